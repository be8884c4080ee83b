"""Nothing a test does leaves traces outside its folders, or work behind."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True, scope="session")
def no_compilers_at_work_behind_the_tests() -> None:
    patch = pytest.MonkeyPatch()
    patch.setenv("TPBSO_CASADI_BACKEND", "vm")
