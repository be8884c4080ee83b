"""The core, compiled where it can be."""

from __future__ import annotations

import pytest

from problems.core.compiled import CompiledCore
from problems.core.interface import Core
from problems.core.library import core_library


@pytest.fixture(scope="session")
def compiled() -> Core:
    library = core_library()
    if library is None:
        pytest.skip("there is no compiled core, and no compiler that makes one")
    return CompiledCore(library)
