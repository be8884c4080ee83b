"""Helpers on matrices."""

from __future__ import annotations

import casadi as ca
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from problems.base import largest


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=40), st.integers(1, 3))
def test_largest(values: list[float], columns: int) -> None:
    matrix = np.array(values * columns).reshape(-1, columns)
    assert float(largest(ca.DM(matrix))) == matrix.max()
