"""What is made of a structure is kept under it, in the process and on disk: texts and CasADi functions.

A structure is plain data: numbers, words, arrays and this package's frozen dataclasses of them. Its name is made of
all of that, of the sources of this package, which say what is made of it, and of the versions of CasADi and NumPy; what
holds anything else, as a plug-in's class does, has no name and is made anew.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache as once
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from types import NoneType

import casadi as ca
import numpy as np

from problems.base import cache

PACKAGE = __name__.partition(".")[0]
MOST_FUNCTIONS = 256  # that a process holds
CACHE_SIZE = 16  # entries of a cache of what is made of robots, worlds or limits
PLAIN = (NoneType, bool, int, float, str, bytes, np.number, np.bool_)


class NoStructure(Exception):
    """Raised for what is not plain data of this package."""


def structure_key(*parts: object) -> str | None:
    """The name of what is made of these parts alone; None where one of them is not plain data."""
    words = [sources(), ca.CasadiMeta.version(), np.__version__]
    try:
        _write(parts, words)
    except NoStructure:
        return None
    return cache.key_of(*words)


def _write(value: object, words: list[str]) -> None:
    """Add a value, type and class included, to a key as words with definite boundaries.

    Raises:
        NoStructure: it is not plain data of this package.
    """
    kind = type(value)
    if isinstance(value, PLAIN):
        words.append(f"{kind.__name__} {value!r}")
    elif isinstance(value, tuple | list):
        numbers = all(type(part) is float for part in value)
        words.append(repr(value) if numbers else f"{kind.__name__} of {len(value)}")
        for part in () if numbers else value:
            _write(part, words)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "biufU":
        words += [f"{value.dtype.str} {value.shape}", sha256(np.ascontiguousarray(value).tobytes()).hexdigest()]
    elif isinstance(value, dict):
        _write([*value.items()], words)
    elif _is_of_this_package(kind) and is_dataclass(value):
        words.append(f"{kind.__module__}.{kind.__qualname__}")
        for each in fields(value):
            _write(getattr(value, each.name), words)
    elif _is_of_this_package(kind) and isinstance(value, Enum):
        words.append(f"{kind.__module__}.{kind.__qualname__}.{value.name}")
    elif isinstance(value, type) and _is_of_this_package(value):
        words.append(f"class {value.__module__}.{value.__qualname__}")
    else:
        raise NoStructure(kind.__qualname__)


def _is_of_this_package(kind: type) -> bool:
    return kind.__module__.partition(".")[0] == PACKAGE


@once
def sources() -> str:
    """A digest of the sources of this package, so that changed sources give new names."""
    digest = sha256()
    root = Path(__file__).parent.parent
    for folder, inner, names in os.walk(root):
        inner.sort()
        for name in sorted(names):
            if name.endswith(".py"):
                text = Path(folder, name).read_bytes()
                digest.update(f"{os.path.relpath(folder, root)}/{name} {len(text)}\n".encode() + text)
    return digest.hexdigest()


def cached_text(key: str | None, ending: str, make: Callable[[], str]) -> str:
    """The text of a key from the cache; else made now and stored, where there is a key and a place.

    Args:
        key: its name; None for what has none.
        ending: which kind of file it is.
        make: makes it.
    """
    known = None if key is None else cache.find_text(key, ending)
    if known is not None:
        return known
    text = make()
    if key is not None:
        with suppress(OSError):  # a cache that cannot be written costs the next process its time, nothing else
            cache.store(key, text.encode(), ending)
    return text


def cached_function(make: Callable[[], ca.Function], *structure: object) -> ca.Function:
    """The function that is made of a structure, once in a process, and once at all where it can be stored.

    Args:
        make: makes it of the structure and of nothing else.
        structure: what it is called, and what it is made of.
    """
    key = structure_key(*structure)
    return make() if key is None else _by_key(_Named(key, make))


class _Named:
    """A way to make a function, hashed by the name of what it is made of."""

    def __init__(self, key: str, make: Callable[[], ca.Function]) -> None:
        self.key, self.make = key, make

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Named) and self.key == other.key


@lru_cache(maxsize=MOST_FUNCTIONS)
def _by_key(named: _Named) -> ca.Function:
    return ca.Function.deserialize(cached_text(named.key, "fun", lambda: named.make().serialize()))
