"""Figures of tests are small pictures."""

from __future__ import annotations

from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def few_dots() -> Iterator[None]:
    """Most of the time of a figure is that of its dots."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("tpbso_casadi.figures.style.DPI", 40)
        yield
