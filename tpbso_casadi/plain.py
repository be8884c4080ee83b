"""Plain data and plain text: JSON of anything stored, its seal, settings of objects, versions, texts in one line.

The seal of a document says what was edited in it; it shows accident and carelessness, not a forger, who can compute it
anew.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import asdict, is_dataclass
from enum import Enum
from functools import cache
from hashlib import sha256
from importlib.metadata import version
from typing import Any

import numpy as np

from problems.library import core_account, loaded_core

LONGEST_LINE = 300  # characters


def plain(value: Any) -> Any:
    """The value as JSON can hold it: a number that is not finite as None, an unknown kind of object as its text."""
    if type(value) is float:  # most of a long document
        return value if math.isfinite(value) else None
    if isinstance(value, Enum):
        value = value.value
    elif isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    elif is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def settings_of(solver: object) -> dict[str, Any]:
    """The hyper-parameters of any solver, by name."""
    settings = plain(solver if is_dataclass(solver) else vars(solver))
    assert isinstance(settings, dict)
    return settings


def as_json(content: Mapping[str, Any], indent: int | None = 2) -> str:
    """Strict JSON with a line break at its end."""
    return json.dumps(plain(content), indent=indent, allow_nan=False) + "\n"


class NotJSON(ValueError):
    """Text that is not a JSON document; the message is one line without its content."""


def parsed_json(text: str) -> dict[str, Any]:
    """The table that a JSON document holds.

    Raises:
        NotJSON: it is not JSON, not a table, or nested too deeply.
    """
    try:
        content = json.loads(text, object_pairs_hook=_without_repetition)
    except json.JSONDecodeError as error:
        raise NotJSON(f"not JSON: {error}") from error
    except RecursionError as error:
        raise NotJSON("not JSON of ours: nested too deeply") from error
    except ValueError as error:  # of a whole number of thousands of digits
        raise NotJSON(f"not JSON of ours: {error}") from error
    if not isinstance(content, dict):
        raise NotJSON("not JSON of ours: a table is needed")
    return content


def _without_repetition(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    content = dict(pairs)
    if len(content) < len(pairs):
        [(twice, _)] = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"{twice[:100]}: is there twice")
    return content


SEAL = "seal"  # under which a document holds its digests
DIGITS = 12  # of a digest, hexadecimal


class BrokenSeal(ValueError):
    """A document that was changed; the message is one line that names the key."""


def sealed(document: dict[str, Any]) -> dict[str, Any]:
    """The document with its digests."""
    return {**document, SEAL: _digests(document)}


def check_seal(document: dict[str, Any]) -> None:
    """Make sure that a document is what was sealed.

    Raises:
        BrokenSeal: it has no digests, or a value is not the one that was sealed.
    """
    stored = document.get(SEAL)
    computed = _digests({key: value for key, value in document.items() if key != SEAL})
    if not isinstance(stored, dict):
        raise BrokenSeal(f"{SEAL}: missing key")
    for path in [*computed, *stored]:
        if path not in computed:
            raise BrokenSeal(f"{path}: missing key")
        if stored.get(path) != computed[path]:
            raise BrokenSeal(f"{path}: was changed after the file was written")


def _digests(document: dict[str, Any]) -> dict[str, str]:
    """Digests of all values that hold no further keys, by their paths."""
    return {path: _digest(path, value) for path, value in _leaves(document, "")}


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    if isinstance(value, dict) and value:
        entries: Any = value.items()
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        entries = enumerate(value)
    else:
        yield path, value
        return
    for key, item in entries:
        yield from _leaves(item, f"{path}.{key}" if path else str(key))


def _digest(path: str, value: Any) -> str:
    return sha256(json.dumps([path, value], sort_keys=True).encode()).hexdigest()[:DIGITS]


def visible(text: str, keep: str = "") -> str:
    """The text with escapes in place of what cannot be printed: control characters, bytes that are not UTF-8.

    Args:
        text: any.
        keep: characters that stay as they are.
    """
    return "".join(c if c.isprintable() or c in keep else c.encode("unicode_escape").decode("ascii") for c in text)


def one_line(text: str, longest_part: int | None = None) -> str:
    """A text in one line of at most ``LONGEST_LINE`` characters.

    White space becomes a space, another control character its escape.

    Args:
        text: any.
        longest_part: characters without a space, of a path or a value: what is longer is shortened in its middle.
    """
    parts = [visible(part) for part in text.split()]
    if longest_part is not None:
        half = longest_part // 2
        parts = [part if len(part) <= longest_part else f"{part[: half - 3]}...{part[-half:]}" for part in parts]
    line = " ".join(parts)
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 3]}..."


CORE = "core"


@cache
def versions() -> dict[str, str]:
    """Versions of packages, by their names, and whether there is a core: everything that decides a result.

    The same dictionary each time, not to be changed.
    """
    packages = {name: version(name) for name in ("tpbso-casadi", "casadi", "numpy", "scipy")}
    return packages | {CORE: "none" if loaded_core().library is None else "compiled"}


def version_text() -> str:
    """The text of ``--version``: the version of the package, and how the core was compiled, in two lines."""
    return f"tpbso-casadi {version('tpbso-casadi')}\n{CORE}: {core_account()}"
