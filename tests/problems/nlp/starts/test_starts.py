"""Starts of programs: deterministic, different, evenly spread."""

from __future__ import annotations

from itertools import islice
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import following, moving
from hypothesis import given
from hypothesis import strategies as st

from problems import Ellipse, PlanarArm, Problem, closed_curve
from problems.families.knots.starts import evenly_spread

ARM = PlanarArm((0.6, 0.6, 0.5, 0.3), (4.0, 2.0, 4.0, 4.0), (20.0, 20.0, 40.0, 20.0))
CURVE = closed_curve((0.1, 0.0), 1.0, 0.0, 3, 0.1, 12)
CASES: dict[str, Problem[Any]] = {
    "time": moving(ARM, (1.0, 0.0), (0.5, 1.5), "time", "free"),
    "length": moving(ARM, (1.0, 0.0), (0.5, 1.5), "length", "up", obstacles=(Ellipse((0.8, 0.8), (0.15, 0.25)),)),
    "path": following(ARM, CURVE, 0.05, "time", "free"),
    "path, obstacle": following(ARM, CURVE, 0.05, "rotation", "up", obstacles=(Ellipse((0.4, 0.0), (0.1, 0.1)),)),
}


def first_starts(problem: Problem[Any], seed: int, count: int = 7) -> np.ndarray:
    return np.array(list(islice(problem.nlp().starts(np.random.default_rng(seed)), count)))


@pytest.mark.parametrize("case", CASES)
def test_a_seed_says_which(case: str) -> None:
    first, again, other = (first_starts(CASES[case], seed) for seed in (1, 1, 2))
    assert (first == again).all()
    assert not np.array_equal(first, other)
    assert np.isfinite(first).all()


@given(first=st.floats(0.0, 0.999), count=st.integers(2, 40))
def test_points_of_the_interval_leave_no_gap(first: float, count: int) -> None:
    points = np.sort([float(p[0]) for p in islice(evenly_spread(np.array([first])), count)])
    gaps = np.diff(np.append(points, points[0] + 1.0))
    assert gaps.max() < 2.0 / count  # three distances occur, the largest at most the golden ratio squared over n


def test_points_of_the_square_fall_into_every_cell() -> None:
    points = np.array(list(islice(evenly_spread(np.array([0.2, 0.7])), 64)))
    cells = {tuple(cell) for cell in (4.0 * points).astype(int).tolist()}
    assert len(cells) == 16


def test_starts_of_few_values_meet_the_rows_that_tie_the_knots_to_them() -> None:
    problem = following(ARM, CURVE, 0.05, "rotation", "up", knot_redundancy="values")
    program = problem.nlp()
    rows = next(c for c in program.rows if c.name == "redundancy")
    miss = ca.Function("miss", [program.x], [rows.expression])
    _, *constants = first_starts(problem, 0, 4)  # the first is the cheapest over the grid
    for x in constants:
        assert np.asarray(miss(x)) == pytest.approx(0.0, abs=1e-9)
