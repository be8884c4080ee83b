"""The core in NumPy beside the compiled one: the same rooms, gradients, proofs, ways and solutions of programs."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import ROBOTS, SCENE, postures, robot_of, through
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


def worlds(compiled: Core, robot: SpatialArm, obstacles: tuple[Obstacle, ...]) -> tuple[CoreWorld, CoreWorld]:
    """A robot among obstacles in both cores."""
    description = described(robot, known_robot(robot), obstacles)
    return compiled.world(*description), ReferenceCore().world(*description)


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
@settings(max_examples=12)
@example(seed=4, most=0.02, which=Separation.ALL, count=1_100, moves=False, errors=False)  # not all at once
@example(seed=726, most=0.15, which=Separation.FROM_OBSTACLES, count=21, moves=False, errors=False)
@example(seed=3114, most=0.1, which=Separation.ALL, count=15, moves=True, errors=False)
@given(
    seed=seeds,
    most=st.sampled_from([np.inf, 0.15, 0.05, 0.0, -0.05]),
    which=st.sampled_from(ALL),
    count=st.sampled_from([0, 1, 9, 21]),
    moves=st.booleans(),
    errors=st.booleans(),
)
def test_rooms_and_what_comes_near_are_the_same(
    compiled: Core, name: str, seed: int, most: float, which: Separation, count: int, moves: bool, errors: bool
) -> None:
    robot, rng = robot_of(name), np.random.default_rng(seed)
    theta, both = postures(robot, rng, count), worlds(compiled, robot, SCENE)
    moving = MovingSolids(drifting(rng, len(SCENE)), rng.uniform(0.0, 3.0, count)) if moves else None
    off = rng.uniform(0.0, 0.04, theta.shape) if errors and count else None
    for first_hit in (False, True):
        rooms = np.full(count, most), np.full(count, most)
        for world, room in zip(both, rooms, strict=True):
            world.lower_to_clearance_margins(theta, room, which, first_hit, moving, off)
        if first_hit:
            assert ((rooms[0] >= most) == (rooms[1] >= most)).all()
        else:
            check_alike(*rooms)
    one, other = (world.nearest(theta, most, which, moving, off) for world in both)
    np.testing.assert_array_equal(other.samples, one.samples)
    np.testing.assert_array_equal(other.is_link, one.is_link)
    same = check_alike(one.clearance_margins, other.clearance_margins)
    np.testing.assert_allclose(other.rates[same], one.rates[same], rtol=0.0, atol=BY_DIFFERENCES)
    np.testing.assert_allclose(other.gradients[same], one.gradients[same], rtol=0.0, atol=BY_DIFFERENCES)


def motion_of(name: str, rng: np.random.Generator) -> Trajectory:
    robot = robot_of(name)
    stops = postures(robot, rng, int(rng.choice([2, 3, 12])))
    return through(stops[:1] + rng.choice([0.03, 0.2, 0.6]) * (stops - stops[:1]), int(rng.choice([1, 3, 5])), rng)


def scene_of(name: str) -> tuple[Obstacle, ...]:
    return tuple(SCENE[number] for number in FEW[name])


def asked_of(motion: Trajectory, which: Separation = Separation.ALL, gap: float = 1.0) -> ProofRequest:
    breaks, coefficients = (np.ascontiguousarray(part) for part in (motion.breakpoints, motion.coefficients))
    return ProofRequest(breaks, coefficients, which, gap, LEAST_CELLS, MOST_ITEMS, None, 0.0)


@pytest.mark.parametrize("around", ["obstacles that stand", "obstacles that move", "errors of joints"])
@each_robot
def test_proofs_have_the_same_status_and_bounds(compiled: Core, name: str, around: str) -> None:
    robot, obstacles, statuses = robot_of(name), scene_of(name), Counter[int]()
    both = worlds(compiled, robot, obstacles)
    for seed in range(15):
        rng = np.random.default_rng(seed)
        motion = motion_of(name, rng)
        asked = asked_of(motion, ALL[seed % 3], (1.0, 0.1)[seed % 2])
        if around == "obstacles that move":
            drifts = drifting(rng, len(obstacles))
            asked = asked._replace(drifts=drifts, rounding=drift_rounding(robot, drifts, motion.duration))
        elif around == "errors of joints":
            asked = asked._replace(tracking=rng.uniform(0.0, 0.004, (3, robot.dof)))
        one, other = (world.prove(asked) for world in both)
        assert other.status == one.status, seed
        if one.status == 1:  # cells are looked at in another order
            assert other.smallest == pytest.approx(one.smallest, rel=0.15 * (1.0 - asked.gap) + ROUNDING)
        statuses[one.status] += 1
    assert statuses[0] and statuses[1]


def test_where_there_is_nothing_all_is_proven(compiled: Core) -> None:
    both = worlds(compiled, replace(robot_of("upright"), self_collision=False), ())
    one, other = (world.prove(asked_of(motion_of("upright", np.random.default_rng(5)))) for world in both)
    assert one == other and other.status == 1 and other.proven == np.inf
    for world in both:
        path = world.connect(np.zeros(7), np.ones(7), PathSearch(np.zeros((2, 7)), 0.05, 0.0, 9.0, 5, 5, 1))
        assert (path[-1] == 1.0).all()
        assert not len(world.nearest(np.zeros((3, 7)), np.inf, Separation.ALL).clearance_margins)


@pytest.mark.parametrize("most", [1, 300])
def test_where_a_proof_ends_a_cell_of_one_piece_is_named(compiled: Core, most: int) -> None:
    both, ended = worlds(compiled, robot_of("upright"), scene_of("upright")), 0
    for seed in range(12):
        motion = motion_of("upright", np.random.default_rng(seed))
        for world in both:
            proof = world.prove(asked_of(motion, gap=1e-9)._replace(most_items=most))
            assert proof.status == -1 or (proof.start, proof.end) == (0.0, 0.0)
            if proof.status == -1:
                ended += 1
                assert 0.0 <= proof.start < proof.end <= motion.duration
                pieces = np.searchsorted(motion.breakpoints, [proof.start + 1e-12, proof.end - 1e-12], side="right")
                assert pieces[0] == pieces[1]
    assert ended


@pytest.mark.parametrize("seed", [0, 1, 4, 5])
@each_robot
def test_ways_are_the_same_to_the_last_bit(compiled: Core, name: str, seed: int) -> None:
    robot, rng = robot_of(name), np.random.default_rng(seed)
    both, theta, rooms = worlds(compiled, robot, scene_of(name)), postures(robot, rng, 60), np.full(60, np.inf)
    both[0].lower_to_clearance_margins(theta, rooms, Separation.ALL, False)
    start, goal = theta[np.argsort(rooms)[-2:]]
    search = PathSearch(
        np.array(robot.position_limits).T, 0.05, 0.0, 1.0, 60, 30, seed,
        drifting(rng, len(FEW[name])) if seed > 2 else None, Schedule(start, goal, 0.5, 2.5) if seed % 2 else None,
    )  # fmt: skip
    one, other = (world.connect(start, goal, search) for world in both)
    np.testing.assert_array_equal(one, other, strict=True)


shapes = st.tuples(st.integers(1, 4), st.integers(1, 20), st.sampled_from([2, 4, 5]), st.integers(0, 40), seeds)


@settings(max_examples=30)
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
