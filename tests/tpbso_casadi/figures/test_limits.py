"""The figure of limits over time: where a limit binds, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from problems import Trajectory
from problems.robots.robot import JointLimits
from tpbso_casadi.figures.limits import shares_of, spans


def test_spans_of_a_mask() -> None:
    assert spans(np.array([True, True, False, True, False, False, True])) == [(0, 1), (3, 3), (6, 6)]
    assert spans(np.array([False, False])) == []


def test_shares_of_a_bang_bang_move() -> None:
    # q = t^2 for 1 s, then 2 t - 1 - ... braking likewise: speed 2 at the middle, acceleration 2 throughout
    coefficients = np.array([[[1.0], [-1.0]], [[0.0], [2.0]], [[0.0], [1.0]]])
    trajectory = Trajectory(np.array([0.0, 1.0, 2.0]), coefficients)
    limits = JointLimits(speed=(4.0,), acceleration=(2.0,))
    times = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    assert shares_of(trajectory, limits, "acceleration", times).ravel() == pytest.approx([1.0] * 5)
    assert shares_of(trajectory, limits, "speed", times).ravel() == pytest.approx([0.0, 0.25, 0.5, 0.25, 0.0])
