"""Which implementation of the core answers: the compiled one where it is there, else the one in NumPy."""

from __future__ import annotations

import logging
import multiprocessing
import os
from contextlib import suppress
from functools import cache as once

from problems.base import cache
from problems.core.compiled import CompiledCore
from problems.core.interface import Core
from problems.core.library import loaded_core
from problems.core.reference import ReferenceCore

LOG = logging.getLogger(__name__)
SLOWER = "plans in space and retiming take 2 to 15 times as long"  # python -m benchmarks.without_compiler
ADVICE = "; install a C++ compiler (g++ or clang++), or name one in CXX" if os.name == "posix" else ""


@once
def core() -> Core:
    """The core of this process; that a compiled one is missing is logged once, before the first answer."""
    if loaded_core().is_missed and _first_of_all_workers():
        LOG.warning("core in NumPy, as %s: %s%s", loaded_core().account, SLOWER, ADVICE)
    return implementation()


@once
def implementation() -> Core:
    """The core of this process, without a warning where it is not compiled."""
    library = loaded_core().library
    return ReferenceCore() if library is None else CompiledCore(library)


def core_account() -> str:
    """The core in use, and how it was compiled or why it was not, in words."""
    loaded = loaded_core()
    return f"{implementation().name}, as {loaded.account}" if loaded.library is None else loaded.account


def _first_of_all_workers() -> bool:
    """Whether this process may log: of processes started by others one a minute."""
    if multiprocessing.parent_process() is None:
        return True
    with suppress(OSError):
        return cache.claim(cache.key_of("a compiled core is missed"))
    return False
