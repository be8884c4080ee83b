"""Quantiles with runs that have no plan, and gaps."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.comparisons import final, record, results
from hypothesis import given
from hypothesis import strategies as st

from tpbso_casadi.campaign import HEADER, rows, summarise
from tpbso_casadi.campaign.measures import gap, quantile

INF = np.inf


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=9), st.floats(0.0, 1.0))
def test_finite_quantiles_are_numpys(values: list[float], share: float) -> None:
    assert quantile(np.array(values), share) == pytest.approx(np.quantile(values, share), rel=1e-9, abs=1e-6)


def test_what_has_no_plan_comes_last() -> None:
    columns = np.array([[INF, 1.0], [3.0, INF], [1.0, INF], [2.0, INF]])  # sorted 1, 2, 3, inf and 1, inf, inf, inf
    assert quantile(columns, 0.5).tolist() == [2.5, INF]
    assert quantile(columns, 0.25).tolist() == [1.75, INF]
    assert quantile(columns, 0.75).tolist() == [INF, INF]
    assert quantile(columns, 2.0 / 3.0).tolist() == [3.0, INF]  # exactly the third


def test_gaps_by_hand() -> None:
    assert gap(np.array([2.0, 3.0, INF]), 2.0).tolist() == [0.0, 0.5, INF]
    assert gap(np.array([-3.0]), -4.0).tolist() == [0.25]
    assert gap(np.array([0.5]), 0.0).tolist() == [0.5]  # absolute


def test_the_table_has_quartiles_and_gaps() -> None:
    found = results({("x", "a"): final([1.0, 2.0, 3.0, None]), ("x", "b"): final([4.0, None, None, None])})
    a, b = (dict(zip(HEADER, row, strict=True)) for row in rows(found.summaries))
    assert [a[key] for key in ("median", "lower_quartile", "upper_quartile", "median_gap")] == [2.5, 1.75, None, 1.5]
    assert [b[key] for key in ("median", "lower_quartile", "upper_quartile", "median_gap")] == [None] * 4
    [nothing] = rows(summarise([record("x", "a", 1, [], error="ValueError: no")]))
    assert nothing[-3:] == [None] * 3
