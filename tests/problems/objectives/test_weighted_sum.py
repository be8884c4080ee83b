"""Weighted sums: each part against the objective alone, slacks of several, what is refused."""

from __future__ import annotations

from itertools import combinations

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links, moving

from problems import OBJECTIVES, InvalidProblem, Trajectory
from problems.base import as_array
from problems.objectives import MotionBounds, Objective, WeightedSum
from solvers import Box

ARM = equal_links(3, link_masses=(1.0, 2.0, 3.0))
PAIRS = list(combinations(OBJECTIVES.values(), 2))
each_pair = pytest.mark.parametrize("pair", PAIRS, ids=["-".join(one.name for one in pair) for pair in PAIRS])


def some_motion() -> Trajectory:
    return Trajectory.from_pieces(np.array([0.7, 0.9]), list(np.random.default_rng(3).normal(size=(2, 5, 3))))


@each_pair
def test_everything_adds_up(pair: tuple[Objective, Objective]) -> None:
    both, motion = WeightedSum((2.0, 0.5), pair), some_motion()
    samples = motion.samples(motion.times(30), ARM)
    bounds = MotionBounds(duration=3.0, rotation=5.0, radius=2.0)

    def summed(values: list[float]) -> float:
        return 2.0 * values[0] + 0.5 * values[1]

    assert float(both.value(samples)) == pytest.approx(summed([float(o.value(samples)) for o in pair]), rel=1e-12)
    values = [o.of_motion(motion, ARM, motion.times(3)) for o in pair]
    assert both.of_motion(motion, ARM, motion.times(3)) == pytest.approx(summed(values), rel=1e-14)
    assert both.upper_bound(bounds) == summed([o.upper_bound(bounds) for o in pair])
    assert both.size(ARM) == pytest.approx(summed([o.size(ARM) for o in pair]), rel=1e-14)
    assert both.sooner_is_better == (pair[0].sooner_is_better and pair[1].sooner_is_better)
    assert both.timed == (pair[0].timed or pair[1].timed)
    assert both.unit == "1"


@each_pair
def test_slacks_stay_with_their_objectives(pair: tuple[Objective, Objective]) -> None:
    both, motion = WeightedSum((2.0, 0.5), pair), some_motion()
    samples = motion.samples(motion.times(12), ARM)
    theta, steps = as_array(samples.theta), samples.count - 1

    def slacks(objective: Objective) -> ca.DM:
        values = objective.slack_values(theta)
        assert values.size == objective.slack_count(ARM, steps)
        return ca.reshape(ca.DM(values), -1, 3) if values.size else ca.DM(0, 3)

    alone = [float(ca.evalf(o.smooth(samples, slacks(o)))) for o in pair]
    assert float(ca.evalf(both.smooth(samples, slacks(both)))) == pytest.approx(2.0 * alone[0] + 0.5 * alone[1])
    found, expected = (
        both.slack_rows(samples, slacks(both)),
        [r for o in pair for r in o.slack_rows(samples, slacks(o))],
    )
    assert [row[:2] for row in found] == [row[:2] for row in expected]
    for (_, _, row), (_, _, single) in zip(found, expected, strict=True):
        assert (as_array(row) == as_array(single)).all()


def test_two_objectives_with_slacks_of_their_own() -> None:
    """The rotation twice over, under another name: each has its own slacks, one below the other for each joint."""

    class Turning(type(OBJECTIVES["rotation"])):  # type: ignore[misc]
        name = "turning"

    both, motion = WeightedSum((1.0, 3.0), (OBJECTIVES["rotation"], Turning())), some_motion()
    samples = motion.samples(motion.times(12), ARM)
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


@pytest.mark.parametrize(
    ("weights", "names", "reason"),
    [
        ((), (), "objective: a weighted sum needs at least one objective"),
        ((1.0,), ("time", "energy"), "objective: 2 weights are needed, not 1"),
        ((1.0, 2.0), ("time", "time"), "objective: the same objective twice: time, time"),
        ((1.0, 0.0), ("time", "energy"), "objective.energy: 0.0 is not a positive number"),
        ((np.inf, 1.0), ("time", "energy"), "objective.time: inf is not a positive number"),
        ((1.0, np.nan), ("time", "energy"), "objective.energy: nan is not a positive number"),
    ],
)
def test_impossible_sums_are_refused(weights: tuple[float, ...], names: tuple[str, ...], reason: str) -> None:
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
    problems = [moving(ARM, (1.0, 0.0), (0.5, 1.5), each, "up", formulation, samples=8) for each in sums]
    first, second = (problem.program for problem in problems)
    assert first.parameters.shape == second.parameters.shape
    assert (first.parameters != second.parameters).sum() >= 2
    points = Box(*problems[0].bounds).sample(np.random.default_rng(0), 8)
    for problem in problems:
        model = ca.Function("value", [problem.model.x], [problem.model.objective])
        costs = problem.cost(points)
        feasible = costs <= problem.objective_upper_bound
        assert formulation == "paper" or feasible.any()
        expected = [float(model(x)) for x in points[feasible]]
        assert costs[feasible] == pytest.approx(expected, rel=1e-9)
