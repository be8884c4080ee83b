"""The core, compiled where it can be, and in NumPy."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from problems.core import arm, linear_program, world
from problems.core.compiled import CompiledCore
from problems.core.interface import Core
from problems.core.library import core_library
from problems.core.reference import ReferenceCore


@pytest.fixture(scope="session")
def compiled() -> Core:
    library = core_library()
    if library is None:
        pytest.skip("there is no compiled core, and no compiler that makes one")
    return CompiledCore(library)


def forget() -> None:
    """What was made by another core."""
    for cached in (world._known_world, world._core_world, arm._known):
        cached.cache_clear()


@pytest.fixture(scope="module", params=["compiled", "NumPy"])
def each_core(request: pytest.FixtureRequest) -> Iterator[Core]:
    """Both, one after the other: what is asked of a core is asked of that one."""
    core: Core = ReferenceCore() if request.param == "NumPy" else request.getfixturevalue("compiled")
    with pytest.MonkeyPatch.context() as patch:
        for module in (world, arm, linear_program):
            patch.setattr(module, "core", lambda: core)
        forget()
        yield core
    forget()
