"""The compiled core."""

from __future__ import annotations

import pytest

from problems.core import core
from problems.core.compiled import Core


@pytest.fixture(scope="session")
def compiled() -> Core:
    return core()
