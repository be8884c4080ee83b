"""The two problems of the paper: costs (15) and (25) against independent implementations, and what every plan keeps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.cases import OVAL, PATHS, THREE_METRES, changed, equal_links, following, moving
from helpers.searching import VM, sampled
from helpers.slow import slow_except
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.path import PathOracle
from oracles.planar import PointToPointOracle

from problems import (
    Ellipse,
    InvalidProblem,
    PathFollowingProblem,
    PlanarArm,
    PointToPointProblem,
    closed_curve,
    pentagram,
)
from problems.base import FloatArray
from problems.certify import exact_time_scale
from solvers import BSO, PSO, Budget, SearchBox, minimize

ARM = PlanarArm((1.0, 1.0, 1.0), (40.0,) * 3, (2000.0,) * 3)
STAR = pentagram((0.0, 0.0), 1.0, 0.4, 30)
WAVES = closed_curve((0.2, 0.1), 1.3, 0.0, 4, 0.2, 26)
LONG_ARM = PlanarArm((0.3, 0.9, 0.5, 0.7, 0.6), (40.0, 30.0, 40.0, 50.0, 60.0), (2000.0, 900.0, 2000.0, 2000.0, 3000.0))
STUB = PlanarArm((1.4, 0.5, 0.8), (40.0,) * 3, (2000.0,) * 3, ((-9.0, 9.0), (-2.5, 2.5), (-8.0, 8.0)))
TILTED = Ellipse((-0.4, 0.9), (0.3, 0.1), 0.7)
SLOWER = 1.0 + 1e-9  # the reduced form stands exactly at its limits
START, GOAL = (1.0, 0.0), (0.5, 1.5)
UNEQUAL = PlanarArm((0.3, 0.9, 0.5, 0.4), (4.0, 3.0, 5.0, 6.0), (20.0, 10.0, 30.0, 40.0))
HOLLOW = PlanarArm((1.5, 0.4, 0.3), (4.0,) * 3, (20.0,) * 3)
LIMITED = equal_links(3, joint_limits=((-2.5, 3.0), (-2.0, 2.5), (-1.0, 5.0)))

PATH_CASES = {
    "star, time": following(ARM, STAR, 0.1, "time", "up"),
    "star, rotation": following(ARM, STAR, 0.1, "rotation", "down"),
    "waves, length, free elbow": following(ARM, WAVES, 0.05, "length", "free"),
    "five unequal links": following(LONG_ARM, WAVES, 0.05, "rotation", "up", redundancy_values=4, knots=9),
    "inner hole, joint limits": following(STUB, WAVES, 0.05, "time", "up", knots=20),
    "obstacle": following(
        ARM, WAVES, 0.05, "rotation", "up", samples=26, obstacles=(Ellipse((0.8, 0.0), (0.1, 0.2), 0.3),)
    ),
}
POINT_CASES = {
    "2 links, time": moving(equal_links(2), START, GOAL, "time", "up"),
    "3 links, time": moving(equal_links(3), START, GOAL, "time", "up"),
    "5 links, rotation, free": moving(equal_links(5), START, GOAL, "rotation", "free"),
    "3 links, oval": moving(equal_links(3), START, GOAL, "length", "up", obstacles=(OVAL,)),
    "4 links, two obstacles": moving(equal_links(4), START, GOAL, "length", "down", obstacles=(OVAL, TILTED)),
    "unequal links": moving(UNEQUAL, START, (-0.5, 1.2), "rotation", "free"),
    "inner hole": moving(HOLLOW, (1.2, 0.0), GOAL, "time", "down"),
    "joint limits": moving(LIMITED, START, GOAL, "time", "free"),
}
QUICK = {"obstacle", "inner hole, joint limits", "3 links, oval", "unequal links", "inner hole"}


def cases(of: dict[str, Any]) -> list[Any]:
    return [pytest.param(case, id=name, marks=[pytest.mark.slow] * (name not in QUICK)) for name, case in of.items()]


each_path = pytest.mark.parametrize("problem", cases(PATH_CASES))
each_move = pytest.mark.parametrize("problem", cases(POINT_CASES))


# Between two points


def around_the_best(problem: PointToPointProblem, count: int) -> FloatArray:
    """Half of them all over the box, half around the best of a short search, where the feasible ones are."""
    box, rng = SearchBox(*problem.bounds), np.random.default_rng(3)
    best = minimize(problem.cost, box, PSO(), Budget(3000), 3).x
    near = best + 10.0 ** rng.uniform(-4.0, -0.5, (count // 2, 1)) * rng.normal(size=(count // 2, box.dimension))
    return np.concatenate([box.sample(rng, count // 2), box.clip(near)])


@each_move
def test_agrees_with_numpy_and_keeps_the_order(problem: PointToPointProblem) -> None:
    points, oracle = around_the_best(problem, 1000), PointToPointOracle(problem)
    costs, expected = problem.cost(points), oracle.cost(points)
    # A limit met within rounding may count on one side only; that is rare and changes the cost by one jump.
    agrees = np.abs(costs - expected) <= 1e-8 * np.abs(expected)
    assert agrees.mean() >= 0.999
    kinds = oracle.kinds(points)[agrees]
    feasible, broken, unreachable = (costs[agrees][kinds == kind] for kind in range(3))
    assert feasible.size > 0
    assert broken.size > 0
    assert feasible.max() <= problem.objective_upper_bound < broken.min()
    if problem.criteria.robot.links > 2:
        assert unreachable.size > 0
        assert broken.max() < unreachable.min()


@each_move
def test_reduced_form_evaluates_the_same_motions(problem: PointToPointProblem) -> None:
    """What the reduced form finds feasible costs the same in the paper form, whose vector is rebuilt from it."""
    reduced, paper = changed(problem, formulation="reduced"), problem
    lower, upper = reduced.bounds  # at the very edge of x_phi the arm is time_scaled, and rounding puts it out of reach
    points = np.clip(around_the_best(reduced, 400)[200:], lower + 1e-6, upper - 1e-6)
    cost = reduced.cost(points)
    feasible = cost <= reduced.objective_upper_bound
    assert feasible.any()
    for x, value in zip(points[feasible][:40], cost[feasible][:40], strict=True):
        q = reduced.quantities(x)
        phi = [np.cumsum(q[name])[2:] for name in ("theta_s", "theta_f")]
        free = problem.encoding.task.elbow == "free"
        branch = [np.sin(q[name][1]) for name in ("theta_s", "theta_f")] if free else []
        vector = [q["theta_m"], q["dtheta_m"] / SLOWER, *phi, branch, q["t1"] * SLOWER, q["t2"] * SLOWER]
        assert paper.cost(np.concatenate(vector)[None])[0] == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("objective", ["time", "rotation"])
def test_check_values_of_two_links(objective: str) -> None:
    best = {"time": (0.7015, 0.4908), "rotation": (2.4135, 1.637)}[objective]
    for elbow, value in zip(("up", "free"), best, strict=True):
        problem = moving(equal_links(2), START, GOAL, objective, elbow, "reduced")
        result = minimize(problem.cost, SearchBox(*problem.bounds), PSO(), Budget(15_000), 1)
        assert result.cost == pytest.approx(value, rel=0.02)
        assert result.cost > value * (1.0 - 1e-3)


# Along a path


@each_path
@pytest.mark.parametrize(
    ("formulation", "accuracy"), slow_except([("paper", 0.6), ("reduced", 0.6), ("paper", None)], 2)
)
def test_costs_agree_with_numpy_and_what_breaks_a_limit_costs_more(
    problem: PathFollowingProblem, formulation: str, accuracy: float | None
) -> None:
    stated = changed(problem, formulation=formulation, accuracy=accuracy or problem.criteria.task.accuracy)
    points, oracle = sampled(stated, 1000), PathOracle(stated)
    costs, broken = stated.cost(points), oracle.breaks_a_limit(points)
    # A limit met within rounding may count on one side only; that is rare and changes the cost by one jump.
    assert (np.abs(costs - (expected := oracle.cost(points))) > 1e-7 * np.abs(expected)).mean() <= 1e-3
    assert (costs[broken] > stated.objective_upper_bound).all()
    assert (costs[~broken] <= stated.objective_upper_bound).all()
    assert accuracy is None or 0 < broken.sum() < broken.size


@each_path
def test_trajectory_meets_every_knot_and_rests_at_both_ends(problem: PathFollowingProblem) -> None:
    for x in sampled(problem, 8):
        trajectory = problem.trajectory(x)
        times = problem.criteria.task.point_times(trajectory)
        tip = np.asarray(problem.criteria.robot.tool.position(trajectory.samples(times).theta))
        knots = list(problem.criteria.task.knot_indices)
        assert tip[knots] == pytest.approx(problem.criteria.task.path.array[knots], abs=1e-7)
        ends = trajectory.samples(np.array([0.0, trajectory.duration]))
        assert np.asarray(ends.speed) == pytest.approx(0.0, abs=1e-6)
        assert np.asarray(ends.acceleration) == pytest.approx(0.0, abs=1e-3)


def test_corners_are_knots() -> None:
    assert len(STAR.corners) == 4
    assert set(STAR.corners) <= set(following(ARM, STAR, 0.1, knots=2).criteria.task.knot_indices)


@each_path
def test_reduced_time_is_the_least_for_all_t(problem: PathFollowingProblem) -> None:
    reduced = changed(problem, formulation="reduced", total_time=(1e-6, 1.0))
    for x in sampled(reduced, 8):
        assert exact_time_scale(reduced.criteria.limits, reduced.trajectory(x)) == pytest.approx(1.0, abs=1e-9)


@settings(max_examples=12, deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5))
def test_redundancy_stays_within_its_bounds_at_the_knots(x_phi: list[float]) -> None:
    problem = PATH_CASES["inner hole, joint limits"]
    trajectory = problem.trajectory(np.array([*x_phi, 1.0]))
    curves, knots = problem.criteria.task.bounded_curves(trajectory), list(problem.criteria.task.knot_indices)
    assert len(curves) == problem.criteria.robot.closed_form.redundancy
    for curve in curves:
        phi = curve.value(curve.times)
        assert (phi[knots] >= curve.lower[knots] - 1e-6).all()
        assert (phi[knots] <= curve.upper[knots] + 1e-6).all()


@each_path
def test_accuracy_is_that_of_the_verified_trajectory(problem: PathFollowingProblem) -> None:
    points = sampled(problem, 10)
    for x, accuracy in zip(points, problem.accuracy_of(points), strict=True):
        verdicts = {verdict.name: verdict for verdict in problem.criteria.verify(problem.trajectory(x))}
        assert verdicts["accuracy"].worst == pytest.approx(accuracy, abs=1e-7)


def test_search_follows_the_star_between_samples_too() -> None:
    problem = following(ARM, STAR, 0.1, "time", "up", "reduced")
    result = minimize(problem.cost, SearchBox(*problem.bounds), BSO(), Budget(2000), 1)
    verdicts = problem.criteria.verify(problem.trajectory(result.x))
    assert [verdict.name for verdict in verdicts if not verdict.satisfied] == []
    assert result.cost == pytest.approx(problem.trajectory(result.x).duration)


def test_slow_arm_gets_a_box_that_holds_its_time() -> None:
    slow = replace(ARM, max_speed=(0.5,) * 3, max_acceleration=(1.0,) * 3)
    problem = following(slow, STAR, 0.1)
    assert problem.encoding.time_box[1] > 20.0
    assert following(ARM, STAR, 0.1).encoding.time_box == (0.1, 10.0)


NOT_FOLLOWED: list[tuple[dict[str, Any], str, str]] = [
    ({"accuracy": 0.0}, "accuracy", "not positive"),
    ({"accuracy": float("nan")}, "accuracy", "not positive"),
    ({"robot": PlanarArm((1.5, 1.5), (4.0,) * 2, (20.0,) * 2)}, "link_lengths", "at least 3 links"),
    ({"knots": 1}, "knots", "fewer than 2"),
    ({"redundancy_values": 1}, "redundancy_values", "fewer than 2"),
    ({"total_time": (1.0, 0.5)}, "total_time", "does not hold"),
    ({"objective": "beauty"}, "objective", "not one of time, rotation, length"),
    ({"path": pentagram((3.0, 0.0), 1.0, 0.0, 30)}, "points", r"points\[0\].*4 m.*out of reach.*3 m"),
    ({"obstacles": (Ellipse((0.9, 0.4), (0.2, 0.2)),)}, "points", "inside the obstacle"),
]


def test_what_cannot_be_followed() -> None:
    for changes, field, reason in NOT_FOLLOWED:
        with pytest.raises(InvalidProblem, match=reason) as caught:
            changed(PATH_CASES["star, time"], **changes)
        assert caught.value.field == field


def test_a_jerk_limit_is_kept_exactly_by_the_reduced_form() -> None:
    arm = replace(THREE_METRES, max_jerk=(2e5,) * 3)
    problem = following(arm, PATHS["pentagram"], 0.1, "time", "up", "reduced")
    x = np.full(len(problem.variables), 0.5)
    trajectory = problem.trajectory(x)
    jerk = trajectory.at(np.linspace(0.0, trajectory.duration, 20_001), 3)
    assert np.abs(jerk).max() == pytest.approx(2e5, rel=1e-9)  # the only limit that binds
    assert exact_time_scale(problem.criteria.limits, trajectory) == pytest.approx(1.0, rel=1e-9)
    assert {v.name for v in problem.criteria.verify(trajectory) if v.satisfied} >= {"speed", "acceleration", "jerk"}
    free = following(THREE_METRES, PATHS["pentagram"], 0.1, "time", "up", "reduced").trajectory(x)
    ratio = np.abs(free.at(np.linspace(0.0, free.duration, 20_001), 3)).max() / 2e5
    assert trajectory.duration == pytest.approx(free.duration * ratio ** (1.0 / 3.0), rel=1e-6)
    values = [problem.evaluator(VM)(x[None])[0], problem.cost(x[None])[0]]
    assert values == pytest.approx([trajectory.duration] * 2, rel=1e-9)
    starts = problem.nlp().starts(np.random.default_rng(0))
    assert all(np.isfinite(next(starts)).all() for _ in range(3))
