"""Following a path: cost (25) against an independent implementation, and what every plan keeps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import PATHS, THREE_METRES, changed, following
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.path import PathOracle

from problems import Ellipse, InvalidProblem, PathFollowingProblem, PlanarArm, closed_curve, pentagram
from problems.certify import exact_time_scale
from problems.evaluation import EvaluationOptions
from solvers import BSO, Box, Budget, minimize

ARM = PlanarArm((1.0, 1.0, 1.0), (40.0,) * 3, (2000.0,) * 3)
STAR = pentagram((0.0, 0.0), 1.0, 0.4, 30)
WAVES = closed_curve((0.2, 0.1), 1.3, 0.0, 4, 0.2, 26)
LONG_ARM = PlanarArm((0.3, 0.9, 0.5, 0.7, 0.6), (40.0, 30.0, 40.0, 50.0, 60.0), (2000.0, 900.0, 2000.0, 2000.0, 3000.0))
STUB = PlanarArm((1.4, 0.5, 0.8), (40.0,) * 3, (2000.0,) * 3, ((-9.0, 9.0), (-2.5, 2.5), (-8.0, 8.0)))

CASES = {
    "star, time": following(ARM, STAR, 0.1, "time", "up"),
    "star, rotation": following(ARM, STAR, 0.1, "rotation", "down"),
    "waves, length, free elbow": following(ARM, WAVES, 0.05, "length", "free"),
    "five unequal links": following(LONG_ARM, WAVES, 0.05, "rotation", "up", redundancy_values=4, knots=9),
    "inner hole, joint limits": following(STUB, WAVES, 0.05, "time", "up", knots=20),
    "obstacle": following(ARM, WAVES, 0.05, "rotation", "up", obstacles=(Ellipse((0.8, 0.0), (0.1, 0.2), 0.3),)),
}


QUICK = {"star, time", "obstacle", "inner hole, joint limits"}  # the others take seconds each and are much like them


@pytest.fixture(
    params=[pytest.param(case, marks=[] if name in QUICK else [pytest.mark.slow]) for name, case in CASES.items()],
    ids=CASES,
)
def problem(request: pytest.FixtureRequest) -> PathFollowingProblem:
    following_problem = request.param
    assert isinstance(following_problem, PathFollowingProblem)
    return following_problem


def candidates(problem: PathFollowingProblem, count: int, seed: int = 0) -> np.ndarray:
    return Box(*problem.bounds).sample(np.random.default_rng(seed), count)


def test_paper_cost_agrees_with_numpy(problem: PathFollowingProblem) -> None:
    points = candidates(problem, 3_000)
    for stated in (problem, changed(problem, accuracy=0.6)):
        expected = PathOracle(stated).cost(points)
        differs = np.abs(stated.cost(points) - expected) > 1e-7 * np.abs(expected)
        # A limit met within rounding may count on one side only; that is rare and changes the cost by one jump.
        assert differs.mean() < 1e-3


def test_reduced_cost_agrees_with_numpy(problem: PathFollowingProblem) -> None:
    reduced = changed(problem, formulation="reduced")
    points = candidates(reduced, 2000)
    expected = PathOracle(reduced).cost(points)
    assert (np.abs(reduced.cost(points) - expected) > 1e-7 * np.abs(expected)).mean() < 1e-3


def test_infeasible_always_costs_more_than_feasible(problem: PathFollowingProblem) -> None:
    for stated in (problem, changed(problem, formulation="reduced")):
        loose = changed(stated, accuracy=0.6)
        points = candidates(loose, 1500)
        cost = loose.cost(points)
        broken = PathOracle(loose).breaks_a_limit(points)
        assert 0 < broken.sum() < broken.size
        assert (cost[broken] > loose.objective_upper_bound).all()
        assert (cost[~broken] <= loose.objective_upper_bound).all()


def test_trajectory_meets_every_knot_and_rests_at_both_ends(problem: PathFollowingProblem) -> None:
    for x in candidates(problem, 20):
        trajectory = problem.trajectory(x)
        times = problem.task.point_times(trajectory)
        tip = np.asarray(problem.robot.tool(trajectory.samples(times).theta))
        knots = list(problem.task.knot_indices)
        assert tip[knots] == pytest.approx(problem.task.path.array[knots], abs=1e-7)
        ends = trajectory.samples(np.array([0.0, trajectory.duration]))
        assert np.asarray(ends.speed) == pytest.approx(0.0, abs=1e-6)
        assert np.asarray(ends.acceleration) == pytest.approx(0.0, abs=1e-3)


def test_corners_are_knots() -> None:
    assert len(STAR.corners) == 4
    assert set(STAR.corners) <= set(following(ARM, STAR, 0.1, knots=2).task.knot_indices)


def test_reduced_time_is_the_least_for_all_t(problem: PathFollowingProblem) -> None:
    reduced = changed(problem, formulation="reduced", total_time=(1e-6, 1.0))
    for x in candidates(reduced, 20):
        assert exact_time_scale(reduced.limits, reduced.trajectory(x)) == pytest.approx(1.0, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5))
def test_redundancy_stays_within_its_bounds_at_the_knots(x_phi: list[float]) -> None:
    problem = CASES["inner hole, joint limits"]
    trajectory = problem.trajectory(np.array([*x_phi, 1.0]))
    curves, knots = problem.bounded_curves(trajectory), list(problem.task.knot_indices)
    assert len(curves) == problem.robot.redundancy
    for curve in curves:
        phi = curve.value(curve.times)
        assert (phi[knots] >= curve.lower[knots] - 1e-6).all()
        assert (phi[knots] <= curve.upper[knots] + 1e-6).all()


def test_accuracy_is_that_of_the_verified_trajectory(problem: PathFollowingProblem) -> None:
    points = candidates(problem, 10)
    for x, accuracy in zip(points, problem.accuracy_of(points), strict=True):
        verdicts = {verdict.name: verdict for verdict in problem.verify(problem.trajectory(x))}
        assert verdicts["accuracy"].worst == pytest.approx(accuracy, abs=1e-7)


def test_search_follows_the_star_between_samples_too() -> None:
    problem = following(ARM, STAR, 0.1, "time", "up", "reduced")
    result = minimize(problem.cost, Box(*problem.bounds), BSO(), Budget(4000), 1)
    verdicts = problem.verify(problem.trajectory(result.x))
    assert [verdict.name for verdict in verdicts if not verdict.satisfied] == []
    assert result.cost == pytest.approx(problem.trajectory(result.x).duration)


def test_slow_arm_gets_a_box_that_holds_its_time() -> None:
    slow = replace(ARM, max_speed=(0.5,) * 3, max_acceleration=(1.0,) * 3)
    problem = following(slow, STAR, 0.1)
    assert problem.encoding.time_box[1] > 20.0
    assert following(ARM, STAR, 0.1).encoding.time_box == (0.1, 10.0)


@pytest.mark.parametrize(
    ("changes", "field", "reason"),
    [
        ({"accuracy": 0.0}, "accuracy", "not positive"),
        ({"accuracy": float("nan")}, "accuracy", "not positive"),
        ({"robot": PlanarArm((1.5, 1.5), (4.0,) * 2, (20.0,) * 2)}, "link_lengths", "at least 3 links"),
        ({"knots": 1}, "knots", "fewer than 2"),
        ({"redundancy_values": 1}, "redundancy_values", "fewer than 2"),
        ({"total_time": (1.0, 0.5)}, "total_time", "does not hold"),
        ({"objective": "beauty"}, "objective", "not one of time, rotation, length"),
        ({"path": pentagram((3.0, 0.0), 1.0, 0.0, 30)}, "points", r"points\[0\].*4 m.*out of reach.*3 m"),
        ({"obstacles": (Ellipse((0.9, 0.4), (0.2, 0.2)),)}, "points", "inside the obstacle"),
    ],
)
def test_what_cannot_be_followed(changes: dict[str, Any], field: str, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason) as caught:
        changed(CASES["star, time"], **changes)
    assert caught.value.field == field


def test_model_names_its_constraints() -> None:
    names = [constraint.name for constraint in CASES["obstacle"].constraints]
    assert names == ["speed", "acceleration", "clearance", "swept clearance", "accuracy"]
    assert all(isinstance(constraint.expression, ca.SX) for constraint in CASES["obstacle"].constraints)


def test_a_jerk_limit_is_kept_exactly_by_the_reduced_form() -> None:
    arm = replace(THREE_METRES, max_jerk=(2e5,) * 3)
    problem = following(arm, PATHS["pentagram"], 0.1, "time", "up", "reduced")
    x = np.full(len(problem.variables), 0.5)
    trajectory = problem.trajectory(x)
    jerk = trajectory.at(np.linspace(0.0, trajectory.duration, 20_001), 3)
    assert np.abs(jerk).max() == pytest.approx(2e5, rel=1e-9)  # the only limit that binds
    assert problem.exact_time_scale(trajectory) == pytest.approx(1.0, rel=1e-9)
    assert {v.name for v in problem.verify(trajectory) if v.satisfied} >= {"speed", "acceleration", "jerk"}
    free = following(THREE_METRES, PATHS["pentagram"], 0.1, "time", "up", "reduced").trajectory(x)
    ratio = np.abs(free.at(np.linspace(0.0, free.duration, 20_001), 3)).max() / 2e5
    assert trajectory.duration == pytest.approx(free.duration * ratio ** (1.0 / 3.0), rel=1e-6)
    values = [problem.evaluator(EvaluationOptions("vm"))(x[None])[0], problem.cost(x[None])[0]]
    assert values == pytest.approx([trajectory.duration] * 2, rel=1e-9)
    starts = problem.nlp().starts(np.random.default_rng(0))
    assert all(np.isfinite(next(starts)).all() for _ in range(3))
