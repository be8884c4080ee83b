"""The compiled core as a library: one that came with the package, one made of its sources, or none.

With the package come libraries for several instruction sets; each computes the same numbers. Where there is none, as in
a source tree, a compiler makes one once and it is kept in the cache.
"""

from __future__ import annotations

import ctypes
import logging
import os
import re
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache as once
from hashlib import sha256
from importlib.machinery import PathFinder
from pathlib import Path
from tempfile import NamedTemporaryFile

from problems.base import InvalidProblem, cache
from problems.evaluation import THIS_PROCESSOR, Compiler, NativeUnavailable, usable_compiler

LOG = logging.getLogger(__name__)
FOLDER = Path(__file__).parent / "core"
SOURCES = FOLDER / "cpp"
FILES = ("core.cpp", "cover.cpp", "dynamics.cpp", "expressions.cpp", "program.cpp", "through.cpp")
FLAGS = (
    "-O2",
    "-std=c++17",
    "-ffp-contract=off",  # the same bits with and without fused multiply-adds
    "-fno-math-errno",
    "-Wno-psabi",
    "-shared",
    "-fPIC",
)
VARIANTS = ("_avx512", "_avx2", "_portable")  # the best first; each a module's name
SWITCH = "TPBSO_CASADI_CORE"  # environment variable: "off" for none
POINTER, COUNT, NUMBER, LONG = ctypes.c_void_p, ctypes.c_int, ctypes.c_double, ctypes.c_longlong
LANES = 8  # points that the core looks at together
DISTANCES = ctypes.CFUNCTYPE(None, COUNT, POINTER, POINTER)  # of points at times from a solid
TRAVEL = ctypes.CFUNCTYPE(None, COUNT, POINTER, POINTER)  # of a solid in cells of time
IS_CLEAR = ctypes.CFUNCTYPE(COUNT, POINTER, POINTER)  # whether the way from a posture to another is
SIGNATURES = {
    "core_variant": (COUNT, ()),
    "core_digest": (ctypes.c_char_p, ()),
    "core_made": (ctypes.c_char_p, ()),
    "core_world": (POINTER, (POINTER, POINTER, POINTER, POINTER)),
    "core_forget": (None, (POINTER,)),
    "core_chain": (POINTER, (POINTER, POINTER)),
    "core_forget_chain": (None, (POINTER,)),
    "core_torques": (None, (POINTER, COUNT, POINTER, POINTER, POINTER)),
    "core_torque_slopes": (None, (POINTER, COUNT, POINTER, POINTER)),
    "core_expression": (POINTER, (POINTER, POINTER)),
    "core_forget_expression": (None, (POINTER,)),
    "core_expression_values": (None, (POINTER, COUNT, POINTER, NUMBER, POINTER)),
    "core_expression_slopes": (None, (POINTER, COUNT, POINTER, NUMBER, POINTER)),
    "core_prove_expression": (
        COUNT,
        (POINTER, COUNT, COUNT, *(POINTER,) * 5, NUMBER, COUNT, LONG, NUMBER, COUNT, *(POINTER,) * 3),
    ),
    "core_prove_torques": (
        COUNT,
        (
            *(POINTER,) * 5,
            *(COUNT, COUNT, POINTER, POINTER),
            *(NUMBER, NUMBER, NUMBER, COUNT, LONG, NUMBER),
            *(COUNT, POINTER, POINTER, POINTER),
            *(COUNT, POINTER, POINTER),
        ),
    ),
    "core_rooms": (None, (POINTER, COUNT, COUNT, COUNT, *(POINTER,) * 5)),
    "core_nearest": (COUNT, (POINTER, COUNT, NUMBER, COUNT, *(POINTER,) * 4, COUNT, POINTER, POINTER)),
    "core_closest": (None, (POINTER, COUNT, COUNT, *(POINTER,) * 6)),
    "core_prove": (
        COUNT,
        (POINTER, COUNT, NUMBER, COUNT, LONG, COUNT, COUNT, *(POINTER,) * 3, NUMBER, *(POINTER,) * 3),
    ),
    "core_connect": (
        COUNT,
        (*(POINTER,) * 5, NUMBER, NUMBER, NUMBER, COUNT, COUNT, ctypes.c_ulonglong, *(POINTER,) * 4, COUNT, POINTER),
    ),
    "core_cover": (COUNT, (COUNT, POINTER, NUMBER, *(POINTER,) * 3)),
    "core_not_held": (COUNT, (COUNT, POINTER, COUNT, POINTER, NUMBER, COUNT, POINTER)),
    "core_overlaps": (COUNT, (COUNT, POINTER, COUNT, POINTER, POINTER)),
    "core_connect_asking": (
        COUNT,
        (COUNT, *(POINTER,) * 4, NUMBER, COUNT, COUNT, ctypes.c_ulonglong, IS_CLEAR, COUNT, POINTER),
    ),
    "core_inverse": (
        COUNT,
        (
            POINTER,
            COUNT,
            POINTER,
            COUNT,
            *(POINTER,) * 6,
            COUNT,
            POINTER,
            COUNT,
            NUMBER,
            NUMBER,
            COUNT,
            POINTER,
            POINTER,
        ),
    ),
    "core_reach": (None, (POINTER, COUNT, *(POINTER,) * 3, COUNT, POINTER, POINTER, COUNT, COUNT, POINTER, POINTER)),
    "core_program": (
        COUNT,
        (
            *(COUNT,) * 4,
            *(POINTER,) * 5,
            *(COUNT, *(POINTER,) * 5) * 2,
            *(POINTER,) * 3,
            *(NUMBER,) * 3,
            *(POINTER,) * 2,
        ),
    ),
    "core_through": (
        COUNT,
        (COUNT, COUNT, COUNT, *(POINTER,) * 4, COUNT, NUMBER, COUNT, *(POINTER,) * 5, COUNT, *(POINTER,) * 8),
    ),
}


ADVICE = "; install a C++ compiler (g++, clang++ or pip install ziglang), or name one in CXX"


class NoCore(InvalidProblem):
    """The compiled core is needed, and this machine neither has it nor can make it."""


@dataclass(frozen=True)
class CoreLibrary:
    """The compiled core, or the reason why there is none.

    Attributes:
        library: None where there is none.
        account: how it was compiled, or why it was not: a part of a sentence.
        is_missed: whether there is none though nobody has switched it off.
    """

    library: ctypes.CDLL | None
    account: str
    is_missed: bool = False


@once
def loaded_core() -> CoreLibrary:
    """The compiled core that this process has loaded, or why there is none."""
    if os.environ.get(SWITCH, "").lower() == "off":
        return CoreLibrary(None, f"{SWITCH} is off")
    try:
        library = next(filter(None, map(_loaded, _packaged())), None) or _made()
    except NativeUnavailable as reason:
        return CoreLibrary(None, str(reason), is_missed=True)
    return CoreLibrary(library, f"compiled by {library.core_made().decode()}")


def needed_core(needed: str = "arms in space need") -> ctypes.CDLL:
    """The compiled core of this process.

    Args:
        needed: by what, for a message.

    Raises:
        NoCore: there is none; the message says why, and how to get it.
    """
    library = loaded_core().library
    if library is None:
        raise NoCore("robot", f"{needed} {missing_core()}")
    return library


def missing_core() -> str:
    """The compiled core, why there is none, and how to get it: the end of a sentence."""
    loaded = loaded_core()
    return f"the compiled core: {loaded.account}{ADVICE if loaded.is_missed and os.name == 'posix' else ''}"


def core_account() -> str:
    """The compiler that made the core and for what, or why there is none, in words."""
    loaded = loaded_core()
    return f"none, as {loaded.account}" if loaded.library is None else loaded.account


def _packaged() -> list[Path]:
    """Libraries that came with the package and run on this processor, the best first."""
    specs = [PathFinder.find_spec(name, [str(FOLDER)]) for name in VARIANTS]
    paths = [None if spec is None or spec.origin is None else Path(spec.origin) for spec in specs]
    if paths[-1] is None:
        return []
    portable = _loaded(paths[-1])
    if portable is None or portable.core_digest().decode() != digest():  # the sources have changed since
        return []
    best = int(portable.core_variant())
    return [path for number, path in zip((2, 1, 0), paths, strict=True) if path is not None and number <= best]


def _loaded(path: Path) -> ctypes.CDLL | None:
    try:
        library = ctypes.CDLL(str(path))
        for name, (result, arguments) in SIGNATURES.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    except (OSError, AttributeError) as error:  # of another system, or of another version
        LOG.debug("core: %s: %s", path.name, error)
        return None
    return library


def digest() -> str:
    """A digest of the sources, by which packaged libraries say from which they were made."""
    return sha256(b"".join(path.read_bytes() for path in sorted(SOURCES.iterdir()))).hexdigest()


def source() -> str:
    """The sources of the core in one text."""
    seen: set[str] = set()
    return "\n".join(_inlined(name, seen) for name in FILES)


def _inlined(name: str, seen: set[str]) -> str:
    """A file with those of our files that it includes, each once."""
    if name in seen:
        return ""
    seen.add(name)
    text = (SOURCES / name).read_text(encoding="utf-8").replace("#pragma once\n", "")
    return re.sub(r'#include "(\w+\.hpp)"\n', lambda match: _inlined(match[1], seen), text)


def _made() -> ctypes.CDLL:
    """The library of this source tree for this machine, from the cache or compiled now.

    Raises:
        NativeUnavailable: there is no compiler, or it refuses, or what it makes cannot be loaded.
    """
    compiler, text = usable_compiler(), source()
    key = cache.key_of(text, " ".join(FLAGS), compiler.target)
    known = cache.find(key)
    library = None if known is None else _loaded(known)
    return _compiled(compiler, text, key) if library is None else library


def _compiled(compiler: Compiler, text: str, key: str) -> ctypes.CDLL:
    began = time.perf_counter()
    content = compiler.library(text, (*FLAGS, *THIS_PROCESSOR))
    LOG.info("core: compiled in %.3f s", time.perf_counter() - began)
    with suppress(OSError):
        cache.store(key, content)
    with suppress(OSError), NamedTemporaryFile(prefix=".", dir=cache.scratch()) as file:
        file.write(content)
        file.flush()
        library = _loaded(Path(file.name))
        if library is not None:
            return library
    raise NativeUnavailable("what was compiled cannot be loaded")
