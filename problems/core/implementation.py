"""Which implementation of the core answers: the compiled one where it is there, else the one in NumPy."""

from __future__ import annotations

from functools import cache as once

from problems.core.compiled import CompiledCore
from problems.core.interface import Core
from problems.core.library import core_library
from problems.core.reference import ReferenceCore


@once
def core() -> Core:
    """The same for the whole process."""
    library = core_library()
    return ReferenceCore() if library is None else CompiledCore(library)
