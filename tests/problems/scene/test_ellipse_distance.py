"""How far a segment is from an ellipse: the bound that limits keep, and the number behind it."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from oracles.outlines import to_segment

from problems import Ellipse
from problems.base import as_array

LEAST_SHARE = {1.0: 0.9999, 5.0 / 3.0: 0.96, 3.0: 0.89, 10.0: 0.78}  # of the distance, by the ratio of the semi-axes


def segments(ellipse: Ellipse, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    start = np.column_stack([np.cos(phase), np.sin(phase)]) * ellipse.semi_axes * rng.uniform(0.8, 2.5, (count, 1))
    turn = np.array([[np.cos(ellipse.angle), np.sin(ellipse.angle)], [-np.sin(ellipse.angle), np.cos(ellipse.angle)]])
    start = ellipse.center + start @ turn
    return start, start + rng.normal(size=(count, 2)) * rng.choice([0.0, 0.3, 2.0], (count, 1))


@pytest.mark.parametrize(
    ("ratio", "share"),
    [
        pytest.param(*each, marks=[pytest.mark.slow] if number else [])
        for number, each in enumerate(LEAST_SHARE.items())
    ],
)
def test_the_bound_is_below_the_distance_by_no_more_than_is_said(ratio: float, share: float) -> None:
    ellipse = Ellipse((0.3, -0.2), (1.0, 1.0 / ratio), 0.6)
    start, end = segments(ellipse, 400, 1)
    clearance, bound = (
        as_array(measure(ca.DM(start), ca.DM(end))).ravel()
        for measure in (ellipse.segment_clearance, ellipse.segment_distance)
    )
    assert ((bound > 0.0) == (clearance > 0.0)).all()
    assert (bound[clearance <= 0.0] == clearance[clearance <= 0.0]).all()
    boundary = ellipse.outline(6000)
    for row in np.flatnonzero(clearance > 0.01):
        distance = to_segment(boundary, start[row], end[row]).min()
        assert clearance[row] - 1e-9 <= bound[row] <= distance
        assert bound[row] >= share * (distance - 1e-5)
        assert ellipse.distance_of(tuple(start[row]), tuple(end[row])) == pytest.approx(distance, abs=2e-5)


def test_a_circle_is_exact_and_what_enters_is_not_positive() -> None:
    disc = Ellipse((0.0, 0.0), (0.5, 0.5))
    for start, end, expected in (
        ((-2.0, 1.0), (2.0, 1.0), 0.5),
        ((1.0, 1.0), (3.0, 1.0), np.sqrt(2.0) - 0.5),
        ((0.0, 2.0), (0.0, 2.0), 1.5),
        ((-1.0, 0.0), (1.0, 0.0), -0.5),
        ((0.0, 0.0), (0.0, 0.0), -0.5),
    ):
        assert float(disc.segment_distance(ca.DM([start]), ca.DM([end]))) == pytest.approx(expected, abs=1e-12)
        assert disc.distance_of(start, end) == pytest.approx(expected, abs=1e-6)


def test_gradients_are_finite_everywhere() -> None:
    ends = ca.SX.sym("ends", 2, 2)
    oval = Ellipse((0.0, 0.0), (0.5, 1.0))
    value = oval.smooth(oval.segment_distance(ends[0, :], ends[1, :]))
    derivatives = ca.Function("d", [ends], [ca.gradient(value, ca.vec(ends)), ca.hessian(value, ca.vec(ends))[0]])
    for corners in ([[0, 0], [0, 0]], [[0, 0], [1, 0]], [[-1, 0], [1, 0]], [[2, 1], [2, 1]], [[0.5, -3], [0.5, 3]]):
        assert all(np.isfinite(as_array(part)).all() for part in derivatives(ca.DM(corners)))
