"""Named constraints by hand: penalties of the paper, graded penalties, rows of a program, verdicts."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from problems.certify import verdict
from problems.limits import Constraint, PenaltyKind


def limit(values: list[list[float]], penalty: PenaltyKind = PenaltyKind.COUNT, **more: Any) -> Constraint:
    two = ca.DM([[2.0, 4.0]])
    options: dict[str, Any] = {"name": "limit", "equation": "(1)", "unit": "m", "columns": ("a", "b"), "scale": two}
    return Constraint(expression=ca.DM(values), lower=-two, upper=two, penalty=penalty, **(options | more))


def single(values: list[float], **more: Any) -> Constraint:
    return Constraint(**({"name": "c", "unit": "1", "expression": ca.DM(values), "columns": ("x",)} | more))


def test_excess_counts_and_magnitudes() -> None:
    broken = [[1.0, -5.0], [3.0, 4.0]]
    assert np.asarray(limit(broken).excess()).tolist() == [[0.0, 1.0], [1.0, 0.0]]
    assert np.asarray(limit(broken).broken()).tolist() == [[0.0, 1.0], [1.0, 0.0]]
    assert float(limit(broken).paper_penalty()) == 2.0
    assert float(limit(broken, PenaltyKind.MAGNITUDE).paper_penalty()) == 8.0
    assert float(limit(broken).graded_penalty()) == pytest.approx(1.0 / 2.0 + 1.0 / 4.0)
    assert limit(broken).smallest_violation() == 1.0
    assert limit(broken, PenaltyKind.MAGNITUDE).smallest_violation() == 2.0


def test_a_limit_that_is_met_exactly_holds() -> None:
    satisfied = limit([[2.0, -4.0]], PenaltyKind.MAGNITUDE)
    assert float(satisfied.paper_penalty()) == 0.0
    assert float(satisfied.graded_penalty()) == 0.0


@pytest.mark.parametrize(("lower", "upper", "broken"), [(None, 1.0, [0, 1]), (0.5, None, [1, 0]), (0.5, 1.0, [1, 1])])
def test_one_sided_bounds(lower: float | None, upper: float | None, broken: list[float]) -> None:
    low, high = (None if bound is None else ca.DM(bound) for bound in (lower, upper))
    constraint = single([0.0, 2.0], lower=low, upper=high)
    assert [bound.tolist() for bound in constraint.bounds] == [
        [-np.inf if lower is None else lower],
        [np.inf if upper is None else upper],
    ]
    assert constraint.scales.tolist() == [1.0]
    assert float(constraint.paper_penalty()) == sum(broken)
    assert float(constraint.graded_penalty()) == (0.0 if lower is None else 0.5) + (0.0 if upper is None else 1.0)
    assert np.asarray(constraint.broken()).ravel().tolist() == broken


def test_rows_of_a_program_are_scaled_column_after_column() -> None:
    rows = limit([[1.0, -5.0], [3.0, 4.0]])
    assert np.asarray(rows.row_values()).ravel().tolist() == [0.5, 1.5, -1.25, 1.0]
    low, high = rows.row_bounds()
    assert low.tolist() == [-1.0] * 4
    assert high.tolist() == [1.0] * 4


def test_transformed_rows_break_exactly_when_the_limit_does() -> None:
    values = np.linspace(0.0, 3.0, 31)
    two = ca.DM(2.0)
    rows = single(values, lower=None, upper=two, scale=two, transform=lambda v: v**3)
    lower, upper = rows.row_bounds()
    row_entries = np.asarray(rows.row_values()).ravel()
    assert (lower == -np.inf).all()
    assert ((row_entries > upper) == (values > 2.0)).all()


def test_verdict_names_the_worst_entry() -> None:
    broken = verdict(limit([[1.0, -5.0], [1.9, 4.0]]), np.array([0.5, 1.5]))
    assert (broken.worst, broken.bound, broken.satisfied, broken.excess) == (-5.0, -4.0, False, 1.0)
    assert broken.where == "b, t = 0.5 s"
    inside = verdict(limit([[1.0, -3.0], [1.9, 3.0]], for_all_t=False), np.array([0.5, 1.5]))
    assert (inside.worst, inside.bound, inside.satisfied, inside.excess, inside.where) == (1.9, 2.0, True, 0.0, "a")
