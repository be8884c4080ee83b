"""Objectives by hand, row by row, against their bounds and their smooth forms."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin, equal_links, moving
from helpers.slow import slow_except

from problems import OBJECTIVES, InvalidProblem, PlanarArm, PointToPoint, Robot, Trajectory, point_to_point
from problems.base import Matrix, as_array
from problems.motions import SampleFunction, Samples, traced
from problems.objectives import ExpressionObjective, MotionBounds, Objective, WeightedSum
from problems.objectives.catalogue import (
    SMOOTHING,
    SMOOTHING_LENGTH,
    Energy,
    ExecutionTime,
    JointRotation,
    TipTravel,
    Work,
)
from problems.objectives.objective import UNKNOWN_UPPER_BOUND
from solvers import SearchBox

ARM = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0), link_masses=(1.0, 2.0))


class Effort(Objective):
    """An integral, as an objective of a new kind would be: of the squared speeds."""

    name = "effort"
    symbol = "E"
    unit = "rad^2/s"

    def at(self, samples: Samples) -> Matrix:
        return samples.weights * ca.sum2(samples.speed**2)


EVERY: dict[str, Objective] = {**OBJECTIVES, "effort": Effort()}
ROUNDED = {"length": SMOOTHING_LENGTH, "work": SMOOTHING}  # corners, by so much of a value of the usual size
each_objective = pytest.mark.parametrize("objective", EVERY.values(), ids=EVERY)


def bent(theta: Sequence[Sequence[float]]) -> Samples:
    """Postures of the arm of two links, half a second apart."""
    angles = ca.DM(theta)
    rows = angles.shape[0]
    weights = ca.DM(np.full(rows, 0.5))
    speed = ca.DM(np.arange(2.0 * rows).reshape(rows, 2))
    acceleration = ca.DM(np.linspace(-3.0, 5.0, 2 * rows).reshape(rows, 2))
    duration = ca.DM(0.5 * (rows - 1))
    return Samples(robot=ARM, derivatives=(angles, speed, acceleration), duration=duration, weights=weights)


def test_values_by_hand() -> None:
    samples = bent([[0.0, 0.0], [np.pi / 2, 0.0], [np.pi / 2, np.pi / 2], [np.pi / 2, 0.0]])
    kinematic = {name: objective for name, objective in EVERY.items() if not objective.needs_masses}
    values = {name: float(objective.value(samples)) for name, objective in kinematic.items()}
    root = np.sqrt(2.0)
    assert values == {
        "time": 1.5,
        "rotation": pytest.approx(1.5 * np.pi),
        "length": pytest.approx(2.0 * root + root + root),
        "effort": 0.5 * (0 + 1 + 4 + 9 + 16 + 25 + 36 + 49),
    }


def test_they_are_found_by_name() -> None:
    kinds = {"time": ExecutionTime, "rotation": JointRotation, "length": TipTravel, "energy": Energy, "work": Work}
    assert {name: type(objective) for name, objective in OBJECTIVES.items()} == kinds
    assert [o.unit for o in OBJECTIVES.values()] == ["s", "rad", "m", "N^2 m^2 s", "J"]
    assert [o.symbol for o in OBJECTIVES.values()] == ["T", "F_q", "F_d", "E", "W"]
    assert all(objective.name == name for name, objective in OBJECTIVES.items())


@each_objective
def test_rows_one_by_one_add_up(objective: Objective) -> None:
    samples = bent(np.random.default_rng(0).normal(size=(12, 2)).tolist())
    rows = [samples.rows(slice(i, i + 1)) for i in range(12)]
    parts = [objective.at(row) for row in rows]
    parts += [objective.between(before, after) for before, after in pairwise(rows)]
    summed = float(objective.terminal(samples.duration)) + sum(float(ca.sum2(p)) for p in parts if p is not None)
    assert summed == pytest.approx(float(objective.value(samples)), rel=1e-12)


@each_objective
def test_nothing_moves_nothing_counts(objective: Objective) -> None:
    still = bent([[0.3, 0.4]] * 5)
    moved = objective.between(*still.steps)
    assert moved is None or (as_array(moved) == 0.0).all()


@pytest.mark.parametrize("objective", OBJECTIVES.values(), ids=OBJECTIVES)
def test_smooth_forms_are_near(objective: Objective) -> None:
    samples = bent(np.random.default_rng(1).normal(size=(20, 2)).tolist())
    value, steps = float(objective.value(samples)), samples.count - 1
    size = objective.slack_count(ARM, steps)
    least = ca.reshape(ca.DM(objective.slack_values(as_array(samples.theta))), -1, 2) if size else ca.DM(0, 2)
    smooth = float(ca.DM(ca.evalf(objective.smooth(samples, least))))
    if objective.name in ROUNDED:  # downwards
        assert value - steps * ROUNDED[objective.name] * objective.size(ARM) <= smooth <= value
    else:
        assert smooth == pytest.approx(value, rel=1e-12)
    rows = objective.slack_rows(samples, least)
    assert len(rows) == (2 if size else 0)
    assert all(float(ca.mmin(row)) >= 0.0 for _, _, row in rows)
    if size:
        assert objective.slack_values(as_array(samples.theta)).shape == (size,)
        assert float(objective.smooth(samples, least + 0.1)) > value
        assert any(float(ca.mmin(row)) < 0.0 for _, _, row in objective.slack_rows(samples, least - 0.1))


def test_upper_bounds_by_hand() -> None:
    bounds = MotionBounds(duration=3.0, rotation=5.0, radius=2.0)
    found = [objective.upper_bound(bounds) for objective in EVERY.values()]
    assert found == [3.0, 5.0, 10.0, *[UNKNOWN_UPPER_BOUND] * 3]


QUICK = {("time-2", "paper", "free"), ("obstacle-3", "reduced", "up"), ("pentagram-rotation", "paper", "up"),
         ("closed-curve-time", "reduced", "free"), ("rotation-3", "paper", "up")}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "formulation", "elbow"), slow_except(product(BUILTIN, ("paper", "reduced"), ("up", "free")), QUICK)
)
def test_no_candidate_exceeds_the_upper_bound(name: str, formulation: str, elbow: str) -> None:
    check_bound(builtin(name, formulation, elbow))


@pytest.mark.parametrize(
    ("objective", "formulation"), [("time", "paper"), ("rotation", "reduced"), ("length", "paper")]
)
def test_joint_limits_and_long_times_keep_the_upper_bound(objective: str, formulation: str) -> None:
    arm = equal_links(3, joint_limits=((-4.0, 5.0), (-2.0, 2.5), (-1.0, 6.0)))
    check_bound(moving(arm, (1.0, 0.0), (0.5, 1.5), objective, "free", formulation, segment_time=(0.3, 9.0)))


def check_bound(problem: Any) -> None:
    model = problem.model
    objective = ca.Function("objective", [model.x], [model.objective])
    box = SearchBox(*problem.bounds)
    points = box.sample(np.random.default_rng(0), 40)
    corners = np.where(np.random.default_rng(1).random((40, box.dimension)) < 0.5, box.lower, box.upper)
    values = [float(objective(x)) for x in (*points, *corners)]
    assert np.isfinite(values).all()
    assert 0.0 < max(values) <= problem.objective_upper_bound * (1.0 + 1e-12)


# A user's own, against integrals by hand and against those that are built in

PLAIN = equal_links(2)
SWING = Trajectory.from_pieces(np.array([1.0]), [np.array([[0.0, 0.0], [0.0, 0.0], [3.0, 1.5], [-2.0, -1.0]])])


def cost(rate: Any, terminal: Any = None, robot: Robot = PLAIN) -> ExpressionObjective:
    parts = [None if part is None else traced(part, robot, "c") for part in (rate, terminal)]
    return ExpressionObjective("own", "1", *parts)


def test_integrals_by_hand() -> None:
    times = SWING.times(10)
    # speeds are 6 (t - t^2) and half of it; the integral of (t - t^2)^2 over [0, 1] is 1 / 30
    assert cost(lambda m: ca.sumsqr(m.speed)).of_motion(SWING, PLAIN, times) == pytest.approx(36.0 * 1.25 / 30.0)
    assert cost(lambda m: 1.0).of_motion(SWING, PLAIN, times) == pytest.approx(1.0)
    assert cost(None, lambda m: m.duration**2).of_motion(SWING.time_scaled(3.0), PLAIN, times) == pytest.approx(9.0)
    both = cost(lambda m: m.time * m.speed[0], lambda m: 2.0 * m.duration)
    assert both.of_motion(SWING, PLAIN, times) == pytest.approx(0.5 + 2.0)  # of 6 (t^2 - t^3)
    signed = cost(lambda m: -ca.fabs(m.q[0] - 0.3))
    dense = np.linspace(0.0, 1.0, 400_001)
    expected = -np.trapezoid(np.abs(SWING(dense)[:, 0] - 0.3), dense)
    assert signed.of_motion(SWING, PLAIN, times) == pytest.approx(expected, rel=1e-9)


def test_of_torques_it_is_the_energy() -> None:
    own, motion = cost(lambda m: ca.sumsqr(m.torque), robot=HEAVY), some_motion()
    assert own.needs_masses
    expected = OBJECTIVES["energy"].of_motion(motion, HEAVY, motion.times(3))
    assert own.of_motion(motion, HEAVY, motion.times(3)) == pytest.approx(expected, rel=1e-12)


def test_a_search_sees_the_same_objective_as_the_model() -> None:
    task = PointToPoint(equal_links(2), (1.0, 0.0), (0.5, 1.5), elbow="up")
    problem = point_to_point(task, cost(lambda m: ca.sumsqr(m.speed), lambda m: m.duration), "reduced", samples=20)
    candidates = np.random.default_rng(1).uniform(*problem.bounds, (6, problem.bounds[0].size))
    model = ca.Function("objective", [problem.model.x], [problem.model.objective])
    for candidate, found in zip(candidates, problem.cost(candidates), strict=True):
        assert found == pytest.approx(float(model(candidate)), rel=1e-9)


def test_what_is_no_objective_and_what_a_robot_has_not() -> None:
    two, late = SampleFunction("= q[0]\n= q[1]"), SampleFunction("= time[0]")
    parts: list[tuple[Any, Any, str]] = [
        (None, None, "nothing is minimised"),
        (two, None, "one number is needed"),
        (None, late, "m.duration alone"),
    ]
    for rate, terminal, reason in parts:
        with pytest.raises(InvalidProblem, match=reason):
            ExpressionObjective("own", "1", rate, terminal)
    for text, reason in (("= torque[0]", "masses"), ("= q[7]", r"q\[7\] of 2"), ("= jerk[0]", "state the max_jerk")):
        with pytest.raises(InvalidProblem, match=reason):
            ExpressionObjective("own", "1", SampleFunction(text)).check(PLAIN)


def test_its_usual_size_is_never_nothing() -> None:
    assert cost(lambda m: 0.0 * m.q[0]).size(PLAIN) == 1.0
    assert cost(lambda m: ca.log(m.q[0])).size(PLAIN) == 1.0
    assert cost(lambda m: 3.0).size(PLAIN) == 3.0


# Weighted sums: each part against the objective alone, slacks of several, what is refused

HEAVY = equal_links(3, link_masses=(1.0, 2.0, 3.0))
PAIRS = [("time", "rotation"), ("length", "energy"), ("rotation", "work")]
each_pair = pytest.mark.parametrize(
    "pair", [tuple(OBJECTIVES[name] for name in names) for names in PAIRS], ids=["-".join(names) for names in PAIRS]
)


def some_motion() -> Trajectory:
    return Trajectory.from_pieces(np.array([0.7, 0.9]), list(np.random.default_rng(3).normal(size=(2, 5, 3))))


@each_pair
def test_everything_adds_up(pair: tuple[Objective, Objective]) -> None:
    both, motion = WeightedSum((2.0, 0.5), pair), some_motion()
    samples = motion.samples(motion.times(30), HEAVY)
    bounds = MotionBounds(duration=3.0, rotation=5.0, radius=2.0)

    def summed(values: list[float]) -> float:
        return 2.0 * values[0] + 0.5 * values[1]

    assert float(both.value(samples)) == pytest.approx(summed([float(o.value(samples)) for o in pair]), rel=1e-12)
    values = [o.of_motion(motion, HEAVY, motion.times(3)) for o in pair]
    assert both.of_motion(motion, HEAVY, motion.times(3)) == pytest.approx(summed(values), rel=1e-14)
    assert both.upper_bound(bounds) == summed([o.upper_bound(bounds) for o in pair])
    assert both.size(HEAVY) == pytest.approx(summed([o.size(HEAVY) for o in pair]), rel=1e-14)
    assert both.sooner_is_better == (pair[0].sooner_is_better and pair[1].sooner_is_better)
    assert both.is_time_dependent == (pair[0].is_time_dependent or pair[1].is_time_dependent)
    assert both.unit == "1"


def test_two_objectives_with_slacks_of_their_own() -> None:
    """The rotation twice over, under another name: each has its own slacks, one below the other for each joint."""

    class Turning(type(OBJECTIVES["rotation"])):  # type: ignore[misc]
        name = "turning"

    both, motion = WeightedSum((1.0, 3.0), (OBJECTIVES["rotation"], Turning())), some_motion()
    samples = motion.samples(motion.times(12), HEAVY)
    slack = ca.reshape(ca.DM(both.slack_values(as_array(samples.theta))), -1, 3)
    assert slack.shape == (2 * (samples.count - 1), 3)
    rotation = float(OBJECTIVES["rotation"].value(samples))
    assert float(both.smooth(samples, slack)) == pytest.approx(4.0 * rotation)
    assert all(float(ca.mmin(row)) >= 0.0 for _, _, row in both.slack_rows(samples, slack))


def test_its_name_shows_weights() -> None:
    time, energy = OBJECTIVES["time"], OBJECTIVES["energy"]
    assert WeightedSum((1.0, 0.02), (time, energy)).name == "time + 0.02 energy"
    assert WeightedSum((1.5, 1.0), (time, energy)).symbol == "1.5 T + E"
    assert WeightedSum((1.0, 0.02), (time, energy)).terms == ((1.0, time), (0.02, energy))
    assert time.terms == ((1.0, time),)


IMPOSSIBLE: list[tuple[tuple[float, ...], tuple[str, ...], str]] = [
    ((), (), "objective: a weighted sum needs at least one objective"),
    ((1.0,), ("time", "energy"), "objective: 2 weights are needed, not 1"),
    ((1.0, 2.0), ("time", "time"), "objective: the same objective twice: time, time"),
    ((1.0, 0.0), ("time", "energy"), "objective.energy: 0.0 is not a positive number"),
    ((np.inf, 1.0), ("time", "energy"), "objective.time: inf is not a positive number"),
    ((1.0, np.nan), ("time", "energy"), "objective.energy: nan is not a positive number"),
]


def test_impossible_sums_are_refused() -> None:
    for weights, names, reason in IMPOSSIBLE:
        with pytest.raises(InvalidProblem) as error:
            WeightedSum(weights, tuple(OBJECTIVES[name] for name in names))
        assert str(error.value) == reason


def test_a_part_that_needs_masses_needs_them_in_a_sum() -> None:
    both = WeightedSum((1.0, 1.0), (OBJECTIVES["time"], OBJECTIVES["work"]))
    with pytest.raises(InvalidProblem, match=r"^objective: 'work' needs masses"):
        moving(equal_links(3), (1.0, 0.0), (0.5, 1.5), both)


@pytest.mark.parametrize("formulation", ["paper", "reduced"])
def test_a_search_prices_it(formulation: str) -> None:
    """And other weights are other numbers of the same steps."""
    time, energy = OBJECTIVES["time"], OBJECTIVES["energy"]
    sums = [WeightedSum(weights, (time, energy)) for weights in ((1.0, 0.02), (3.0, 0.5))]
    problems = [moving(HEAVY, (1.0, 0.0), (0.5, 1.5), each, "up", formulation, samples=8) for each in sums]
    first, second = (problem.program for problem in problems)
    assert first.parameters.shape == second.parameters.shape
    assert (first.parameters != second.parameters).sum() >= 2
    points = SearchBox(*problems[0].bounds).sample(np.random.default_rng(0), 8)
    for problem in problems:
        model = ca.Function("value", [problem.model.x], [problem.model.objective])
        costs = problem.cost(points)
        feasible = costs <= problem.objective_upper_bound
        assert formulation == "paper" or feasible.any()
        expected = [float(model(x)) for x in points[feasible]]
        assert costs[feasible] == pytest.approx(expected, rel=1e-9)
