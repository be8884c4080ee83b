"""The core in NumPy beside the compiled one: the same rooms, gradients, proofs, ways and solutions of programs."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
import pytest
from helpers.core_robots import EXAMPLES, ROBOTS, SCENE, postures, robot_of, through
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import LinearProgram, Separation, SingleRows, WholeRows
from problems.core.description import described, drift_rounding
from problems.core.interface import Core, CoreWorld, MovingSolids, PathSearch, ProofRequest, Schedule
from problems.core.reference import ReferenceCore
from problems.core.world import LEAST_CELLS, MOST_ITEMS, known_robot
from problems.motions import Trajectory
from problems.robots import SpatialArm
from problems.scene import Obstacle

ROUNDING = 1e-12  # m
BY_DIFFERENCES = 1e-8  # m/rad, of gradients
ALL = (Separation.FROM_OBSTACLES, Separation.FROM_EACH_OTHER, Separation.ALL)
FEW = {"upright": (2, 3, 6), "sliding": (0, 1, 2, 4), "bars": (1, 3, 4)}  # obstacles, so that some motions are clear

each_robot = pytest.mark.parametrize("name", ROBOTS)
seeds = st.integers(0, 100_000)


@dataclass(frozen=True)
class Both:
    """A robot among obstacles in both cores."""

    compiled: CoreWorld
    numpy: CoreWorld

    @classmethod
    def of(cls, compiled: Core, robot: SpatialArm, obstacles: tuple[Obstacle, ...]) -> Both:
        told = described(robot, known_robot(robot), obstacles)
        return cls(compiled.world(*told), ReferenceCore().world(*told))

    def margins(
        self, theta: FloatArray, most: float, which: Separation, first_hit: bool, moving: MovingSolids | None = None
    ) -> tuple[FloatArray, FloatArray]:
        found = np.full(len(theta), most), np.full(len(theta), most)
        self.compiled.lower_to_clearance_margins(theta, found[0], which, first_hit, moving)
        self.numpy.lower_to_clearance_margins(theta, found[1], which, first_hit, moving)
        return found


def scene_of(name: str) -> tuple[Obstacle, ...]:
    return tuple(SCENE[number] for number in FEW[name])


@each_robot
@settings(max_examples=6)
@given(seed=seeds, most=st.sampled_from([np.inf, 0.1, 0.0, -0.05]), count=st.sampled_from([0, 1, 9]))
def test_rooms_are_the_same(compiled: Core, name: str, seed: int, most: float, count: int) -> None:
    robot = robot_of(name)
    theta, both = postures(robot, np.random.default_rng(seed), count), Both.of(compiled, robot, SCENE)
    for which in ALL:
        check_alike(*both.margins(theta, most, which, False))
        one, other = both.margins(theta, most, which, True)
        assert ((one >= most) == (other >= most)).all()


@pytest.mark.parametrize("shape", EXAMPLES)
def test_rooms_from_every_shape_are_the_same(compiled: Core, shape: str) -> None:
    robot = robot_of("sliding")
    theta, both = postures(robot, np.random.default_rng(3), 300), Both.of(compiled, robot, (EXAMPLES[shape],))
    one, other = both.margins(theta, np.inf, Separation.FROM_OBSTACLES, False)
    np.testing.assert_allclose(other, one, rtol=0.0, atol=ROUNDING)


def test_more_postures_than_are_looked_at_together(compiled: Core) -> None:
    robot = robot_of("upright")
    theta, both = postures(robot, np.random.default_rng(4), 1_100), Both.of(compiled, robot, SCENE)
    one, other = both.margins(theta, np.inf, Separation.ALL, False)
    np.testing.assert_allclose(other, one, rtol=0.0, atol=ROUNDING)
    near, same = (
        both.compiled.nearest(theta, 0.02, Separation.ALL),
        both.numpy.nearest(theta, 0.02, Separation.ALL),
    )
    np.testing.assert_array_equal(near.samples, same.samples)


@each_robot
@settings(max_examples=6)
@example(seed=726, below=0.15, which=Separation.FROM_OBSTACLES)
@given(seed=seeds, below=st.sampled_from([0.15, 0.05, 0.0]), which=st.sampled_from(ALL))
def test_what_comes_near_is_the_same_in_the_same_order(
    compiled: Core, name: str, seed: int, below: float, which: Separation
) -> None:
    robot = robot_of(name)
    theta, both = postures(robot, np.random.default_rng(seed), 21), Both.of(compiled, robot, SCENE)
    one, other = both.compiled.nearest(theta, below, which), both.numpy.nearest(theta, below, which)
    np.testing.assert_array_equal(other.samples, one.samples)
    np.testing.assert_array_equal(other.is_link, one.is_link)
    same = check_alike(one.clearance_margins, other.clearance_margins)
    np.testing.assert_allclose(other.gradients[same], one.gradients[same], rtol=0.0, atol=BY_DIFFERENCES)


def check_alike(one: FloatArray, other: FloatArray) -> NDArray[np.bool_]:
    """Where margins (n,) of both cores are equal: in contact with an ellipsoid one may find less depth."""
    same = np.abs(one - other) <= ROUNDING
    assert (same | ((one < 0.0) & (other < 0.0))).all()
    np.testing.assert_allclose(other, one, rtol=0.2, atol=ROUNDING)
    return np.asarray(same)


def drifting(rng: np.random.Generator, count: int) -> FloatArray:
    drifts = rng.uniform(-0.2, 0.2, (count, 7))
    drifts[:, 6] = rng.choice([0.0, 0.05], count)
    return drifts


@each_robot
@settings(max_examples=6)
@example(seed=3114)
@given(seed=seeds)
def test_among_what_moves_rooms_rates_and_gradients_are_the_same(compiled: Core, name: str, seed: int) -> None:
    robot, rng = robot_of(name), np.random.default_rng(seed)
    theta, both = postures(robot, rng, 15), Both.of(compiled, robot, SCENE)
    moving = MovingSolids(drifting(rng, len(SCENE)), rng.uniform(0.0, 3.0, 15))
    check_alike(*both.margins(theta, np.inf, Separation.ALL, False, moving))
    near, other = (world.nearest(theta, 0.1, Separation.ALL, moving) for world in (both.compiled, both.numpy))
    np.testing.assert_array_equal(other.samples, near.samples)
    same = check_alike(near.clearance_margins, other.clearance_margins)
    np.testing.assert_allclose(other.rates[same], near.rates[same], rtol=0.0, atol=BY_DIFFERENCES)
    np.testing.assert_allclose(other.gradients[same], near.gradients[same], rtol=0.0, atol=BY_DIFFERENCES)


def motion_of(name: str, rng: np.random.Generator) -> Trajectory:
    robot = robot_of(name)
    stops = postures(robot, rng, int(rng.choice([2, 3, 12])))
    return through(stops[:1] + rng.choice([0.03, 0.2, 0.6]) * (stops - stops[:1]), int(rng.choice([1, 3, 5])), rng)


def asked_of(
    motion: Trajectory, which: Separation, gap: float, drifts: FloatArray | None = None, rounding: float = 0.0
) -> ProofRequest:
    breaks, coefficients = (np.ascontiguousarray(part) for part in (motion.breakpoints, motion.coefficients))
    return ProofRequest(breaks, coefficients, which, gap, LEAST_CELLS, MOST_ITEMS, drifts, rounding)


@each_robot
def test_proofs_have_the_same_status_and_bounds(compiled: Core, name: str) -> None:
    both, statuses = Both.of(compiled, robot_of(name), scene_of(name)), Counter[int]()
    for seed in range(15):
        motion = motion_of(name, np.random.default_rng(seed))
        for which in ALL:
            asked = asked_of(motion, which, (1.0, 0.1)[seed % 2])
            one, other = both.compiled.prove(asked), both.numpy.prove(asked)
            assert other.status == one.status, (seed, which)
            if one.status == 1:  # cells are looked at in another order
                assert other.smallest == pytest.approx(one.smallest, rel=0.1 * (1.0 - asked.gap) + ROUNDING)
            statuses[one.status] += 1
    assert statuses[0] and statuses[1]


@each_robot
def test_proofs_among_what_moves_have_the_same_status(compiled: Core, name: str) -> None:
    robot, obstacles, statuses = robot_of(name), scene_of(name), Counter[int]()
    both = Both.of(compiled, robot, obstacles)
    for seed in range(40, 52):
        rng = np.random.default_rng(seed)
        motion, drifts = motion_of(name, rng), drifting(rng, len(obstacles))
        asked = asked_of(motion, Separation.ALL, 1.0, drifts, drift_rounding(robot, drifts, motion.duration))
        one, other = both.compiled.prove(asked), both.numpy.prove(asked)
        assert other.status == one.status, seed
        statuses[one.status] += 1
    assert statuses[0] and statuses[1]


def test_where_there_is_nothing_all_is_proven(compiled: Core) -> None:
    robot = replace(robot_of("upright"), self_collision=False)
    both, motion = Both.of(compiled, robot, ()), motion_of("upright", np.random.default_rng(5))
    one, other = (world.prove(asked_of(motion, Separation.ALL, 1.0)) for world in (both.compiled, both.numpy))
    assert one == other and other.status == 1 and other.proven == np.inf
    assert (
        both.numpy.connect(np.zeros(7), np.ones(7), PathSearch(np.zeros((2, 7)), 0.05, 0.0, 9.0, 5, 5, 1))[-1] == 1.0
    ).all()
    assert not len(both.numpy.nearest(np.zeros((3, 7)), np.inf, Separation.ALL).clearance_margins)


def test_a_proof_ends_where_it_may_look_at_no_more(compiled: Core) -> None:
    name = "upright"
    both = Both.of(compiled, robot_of(name), scene_of(name))
    asked = asked_of(Trajectory.standing(np.zeros(7), 1.0), Separation.ALL, 0.1)._replace(most_items=1)
    assert {both.compiled.prove(asked).status, both.numpy.prove(asked).status} <= {-1, 0}


@pytest.mark.parametrize("most", [1, 300])
def test_where_a_proof_ends_a_cell_of_one_piece_is_named(compiled: Core, most: int) -> None:
    both = Both.of(compiled, robot_of("upright"), scene_of("upright"))
    ended = 0
    for seed in range(12):
        motion = motion_of("upright", np.random.default_rng(seed))
        asked = asked_of(motion, Separation.ALL, 1e-9)._replace(most_items=most)
        for world in (both.compiled, both.numpy):
            found = world.prove(asked)
            assert found.status == -1 or (found.start, found.end) == (0.0, 0.0)
            if found.status == -1:
                ended += 1
                assert 0.0 <= found.start < found.end <= motion.duration
                pieces = np.searchsorted(motion.breakpoints, [found.start + 1e-12, found.end - 1e-12], side="right")
                assert pieces[0] == pieces[1]
    assert ended


@pytest.mark.parametrize("seed", range(6))
@each_robot
def test_ways_are_the_same_to_the_last_bit(compiled: Core, name: str, seed: int) -> None:
    robot, rng = robot_of(name), np.random.default_rng(seed)
    both, ranges = Both.of(compiled, robot, scene_of(name)), np.array(robot.position_limits).T
    theta = postures(robot, rng, 60)
    margins, _ = both.margins(theta, np.inf, Separation.ALL, False)
    start, goal = theta[np.argsort(margins)[-2:]]
    schedule = Schedule(start, goal, 0.5, 2.5) if seed % 2 else None
    search = PathSearch(
        ranges, 0.05, 0.0, 1.0, 60, 30, seed, drifting(rng, len(FEW[name])) if seed > 2 else None, schedule
    )
    np.testing.assert_array_equal(
        both.numpy.connect(start, goal, search), both.compiled.connect(start, goal, search), strict=True
    )


shapes = st.tuples(st.integers(1, 4), st.integers(1, 20), st.sampled_from([2, 4, 5]), st.integers(0, 40), seeds)


@settings(max_examples=40)
@given(shapes)
def test_programs_cost_as_little_as_with_highs(shape: tuple[int, int, int, int, int]) -> None:
    """Rows that hold at zero; some unknowns are constants, some rows have no price."""
    k, n, reach, m, seed = shape
    rng = np.random.default_rng(seed)
    first, every = rng.integers(-reach, n, 3 * m), rng.integers(-reach, n, m)
    single = SingleRows(
        rng.integers(0, k, 3 * m), first, rng.normal(size=(3 * m, reach)), -rng.random(3 * m), rng.random(3 * m)
    )
    price = np.where(rng.random(m) < 0.3, np.inf, 10.0 ** rng.uniform(-1.0, 1.0, m))
    whole = WholeRows(every, rng.normal(size=(m, reach, k)), rng.normal(size=m), rng.random(m), price)
    whole.bound[np.isfinite(price)] -= 0.3
    box = np.where(rng.random((n, k)) < 0.1, 0.0, 1.0)
    program = LinearProgram(single, whole, -box, box, (-0.2, 0.4), rng.normal(size=(n, k)) / (n * k))
    found, other = ReferenceCore().solve_program(program), program.by_highs()
    assert (found is None) == (other is None)
    if found is not None and other is not None:
        assert cost_of(program, *found) == pytest.approx(cost_of(program, *other), abs=2e-6)


def cost_of(program: LinearProgram, x: FloatArray, tau: float) -> float:
    """What is paid of a point that keeps hard rows."""
    assert program.cost is not None
    every, wide = program.whole, program.whole.weights.shape[1]
    padded = np.pad(x, ((wide, wide), (0, 0)))[every.first[:, None] + np.arange(wide) + wide]
    missing = np.maximum((every.weights * padded).sum(axis=(1, 2)) + every.by_time * tau - every.bound, 0.0)
    soft = np.isfinite(every.price)
    assert (missing[~soft] <= 1e-7).all()
    return tau + float((program.cost * x).sum() + (every.price[soft] * missing[soft]).sum())
