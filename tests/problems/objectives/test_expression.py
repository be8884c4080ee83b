"""Objectives of a user's own against integrals by hand, and against those that are built in."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from helpers.massive import massive_motion

from problems import OBJECTIVES, InvalidProblem, PointToPoint, Robot, Trajectory, point_to_point
from problems.motions import SampleFunction, traced
from problems.objectives import ExpressionObjective

ARM = equal_links(2)
SWING = Trajectory.from_pieces(np.array([1.0]), [np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 1.5], [-2.0, -1.0]])])


def cost(rate: Any, terminal: Any = None, robot: Robot = ARM) -> ExpressionObjective:
    parts = [None if part is None else traced(part, robot, "c") for part in (rate, terminal)]
    return ExpressionObjective("own", "1", *parts)


def test_integrals_by_hand() -> None:
    times = SWING.times(10)
    # speeds are 6 (t - t^2) and half of it; the integral of (t - t^2)^2 over [0, 1] is 1 / 30
    assert cost(lambda m: ca.sumsqr(m.speed)).of_motion(SWING, ARM, times) == pytest.approx(36.0 * 1.25 / 30.0)
    assert cost(lambda m: 1.0).of_motion(SWING, ARM, times) == pytest.approx(1.0)
    assert cost(None, lambda m: m.duration**2).of_motion(SWING.time_scaled(3.0), ARM, times) == pytest.approx(9.0)
    both = cost(lambda m: m.time * m.speed[0], lambda m: 2.0 * m.duration)
    assert both.of_motion(SWING, ARM, times) == pytest.approx(0.5 + 2.0)  # of 6 (t^2 - t^3)
    signed = cost(lambda m: -ca.fabs(m.q[0] - 0.3))
    dense = np.linspace(0.0, 1.0, 400_001)
    expected = -np.trapezoid(np.abs(SWING(dense)[:, 0] - 0.3), dense)
    assert signed.of_motion(SWING, ARM, times) == pytest.approx(expected, rel=1e-9)


def test_of_torques_it_is_the_energy() -> None:
    motion = massive_motion()
    robot, trajectory = motion.criteria.robot, motion.trajectory
    own = cost(lambda m: ca.sumsqr(m.torque), robot=robot)
    assert own.needs_masses
    expected = OBJECTIVES["energy"].of_motion(trajectory, robot, motion.times)
    assert own.of_motion(trajectory, robot, motion.times) == pytest.approx(expected, rel=1e-12)


def test_a_search_sees_the_same_objective_as_the_model() -> None:
    task = PointToPoint(equal_links(2), (1.0, 0.0), (0.5, 1.5), elbow="up")
    problem = point_to_point(task, cost(lambda m: ca.sumsqr(m.speed), lambda m: m.duration), "reduced", samples=20)
    candidates = np.random.default_rng(1).uniform(*problem.bounds, (6, problem.bounds[0].size))
    model = ca.Function("objective", [problem.model.x], [problem.model.objective])
    for candidate, found in zip(candidates, problem.cost(candidates), strict=True):
        assert found == pytest.approx(float(model(candidate)), rel=1e-9)


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ((None, None), "nothing is minimised"),
        ((SampleFunction("= q[0]\n= q[1]"), None), "one number is needed"),
        ((None, SampleFunction("= time[0]")), "m.duration alone"),
    ],
)
def test_what_is_no_objective(parts: Any, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        ExpressionObjective("own", "1", *parts)


@pytest.mark.parametrize(
    ("text", "reason"), [("= torque[0]", "masses"), ("= q[7]", r"q\[7\] of 2"), ("= jerk[0]", "state the max_jerk")]
)
def test_what_a_robot_has_not(text: str, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        ExpressionObjective("own", "1", SampleFunction(text)).check(ARM)


def test_its_usual_size_is_never_nothing() -> None:
    assert cost(lambda m: 0.0 * m.q[0]).size(ARM) == 1.0
    assert cost(lambda m: ca.log(m.q[0])).size(ARM) == 1.0
    assert cost(lambda m: 3.0).size(ARM) == 3.0
