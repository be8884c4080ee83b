"""Formulas for many rows at once: the bits of one row after the other, whatever the number of rows."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems.evaluation.program import RowFunction

WIDTH = 8


def formula() -> ca.Function:
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    return ca.Function(
        "f",
        [x, p],
        [ca.vertcat(ca.sqrt(ca.sumsqr(x)) - p[0], ca.if_else(x[0] > p[1], 2.0, x[2]), 7.0)],
        ["x", "p"],
        ["y"],
    )


@pytest.mark.parametrize("count", [0, 1, 2, WIDTH - 1, WIDTH, WIDTH + 1, 3 * WIDTH + 5])
def test_rows_are_computed_as_one_by_one(count: int) -> None:
    rng, function = np.random.default_rng(count), RowFunction(formula(), WIDTH)
    for _ in range(2):
        columns, numbers = rng.normal(size=(3, count)), rng.normal(size=2)
        expected = [np.array(formula()(column, numbers)).ravel() for column in columns.T]
        assert function(columns, numbers).T.tolist() == [row.tolist() for row in expected]


def test_results_of_an_earlier_call_stay_as_they_are() -> None:
    x = ca.SX.sym("x", 2)
    double = RowFunction(ca.Function("double", [x], [2.0 * x]), WIDTH)
    first = double(np.ones((2, 3)))
    double(np.zeros((2, 3)))
    assert first.tolist() == np.full((2, 3), 2.0).tolist()
