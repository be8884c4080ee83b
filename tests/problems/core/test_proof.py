"""Room proven for all t, against many samples of all balls, against the slower proofs, and against closed forms."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise, product

import numpy as np
import pytest
from helpers.core_robots import ROBOTS, SCENE, arm, margins, postures, robot_of, slider, through, world_of
from helpers.slow import slow_except
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from problems.core import CompiledWorld, Separation
from problems.motions import Trajectory
from problems.robots import ChainJoint, FixedFrame, SpatialArm, Sphere
from problems.robots.chain import JointKind
from problems.scene import Ball, Ellipsoid, HalfSpace, Obstacle

DENSE = 5_000
ROUNDING = 1e-9  # m, of rooms in another order of sums
HAIR = 1e-9  # m
FAR = {"upright": (2, 3, 6), "sliding": (0, 1, 2, 4), "bars": (1, 3, 4), "fork": (1, 3, 4)}
SIDES = (Separation.FROM_OBSTACLES, Separation.FROM_EACH_OTHER)


def scene_of(name: str) -> tuple[Obstacle, ...]:
    """Obstacles so far away that some motions are clear."""
    return tuple(SCENE[number] for number in FAR[name])


def sampled(name: str, motion: Trajectory, count: int) -> list[np.ndarray]:
    """Rooms from obstacles and among links at many times as the core sees postures, and some of them anew."""
    times = np.linspace(0.0, motion.duration, count)
    theta, robot, obstacles = motion.at(times), robot_of(name), scene_of(name)
    world, few = world_of(robot, obstacles), slice(None, None, count // (10 if robot.cover is None else 3))
    found = [world.clearance_margins(theta, which=which) for which in SIDES]
    for seen, anew in zip(found, margins(robot, obstacles, theta[few]), strict=True):
        np.testing.assert_allclose(seen[few], anew, rtol=0.0, atol=ROUNDING)
    return found


def check(name: str, motion: Trajectory, dense: list[np.ndarray], side: int, gap: float) -> bool | None:
    """The status, which is not false; what was seen is there, if not the least at that time."""
    robot = robot_of(name)
    proof = world_of(robot, scene_of(name)).prove(motion, SIDES[side], gap)
    assert 0.0 <= proof.time <= motion.duration
    at_its_time = float(margins(robot, scene_of(name), motion.at(np.array([proof.time])))[side][0])
    assert proof.smallest >= at_its_time - ROUNDING
    if proof.status is True:
        assert proof.proven <= proof.smallest
        assert proof.proven <= dense[side].min() + ROUNDING
        assert proof.proven >= (1.0 - gap) * proof.smallest - 1e-15
        assert proof.proven >= 0.0
    else:
        assert proof.status is False
        assert proof.proven == -np.inf
        assert proof.smallest < 0.0
    return proof.status


def random_motion(name: str, degree: int, seed: int) -> Trajectory:
    """Every fourth one of a single joint."""
    rng, robot = np.random.default_rng(seed), robot_of(name)
    stops = postures(robot, rng, int(rng.choice([2, 3, 12])))
    if seed % 4 == 3:
        return through(np.where(np.arange(robot.dof) == seed % robot.dof, stops, stops[0]), degree, rng)
    width = rng.choice([0.03, 0.2, 0.6])
    return through(stops[:1] + width * (stops - stops[:1]), degree, rng)


@pytest.mark.parametrize(("degree", "name"), slow_except(product((5, 3, 1), ROBOTS), len(ROBOTS)))
def test_no_proof_is_false(degree: int, name: str) -> None:
    statuses: Counter[bool | None] = Counter()
    for seed in range(12):
        motion = random_motion(name, degree, seed)
        dense = sampled(name, motion, DENSE)
        statuses.update(check(name, motion, dense, side, (1.0, 0.1)[seed % 2]) for side in (0, 1))
    assert statuses[True] and statuses[False]


@pytest.mark.parametrize("name", ROBOTS)
def test_a_proof_of_all_is_that_of_both_sides(name: str) -> None:
    world = world_of(robot_of(name), scene_of(name))
    for seed in range(8):
        motion = random_motion(name, 3, seed)
        together, *each = (world.prove(motion, which) for which in (Separation.ALL, *SIDES))
        assert together.status == (each[0].status and each[1].status)


@pytest.mark.parametrize("name", ROBOTS)
def test_of_standing_still_the_whole_room_is_proven(name: str) -> None:
    robot = robot_of(name)
    world, theta = world_of(robot, scene_of(name)), postures(robot, np.random.default_rng(7), 30)
    least = world.clearance_margins(theta)
    for posture, room in zip(theta, least, strict=True):
        proof = world.prove(Trajectory.standing(posture, 2.0), gap=1e-6)
        assert proof.status is bool(room > 0.0)
        assert proof.smallest == pytest.approx(room, abs=ROUNDING)
        if proof.status:
            assert proof.proven == pytest.approx(room, abs=1e-5)


def test_pieces_of_any_lengths_are_proven_alike() -> None:
    """Many of them, some of them much shorter than others; times do not begin anew at each."""
    name, rng = "upright", np.random.default_rng(8)
    robot, motion = robot_of(name), random_motion(name, 5, 11)
    world = world_of(robot, scene_of(name))
    whole = world.prove(motion, gap=0.05)
    for cuts in (np.sort(rng.uniform(0.0, motion.duration, 40)), motion.duration * np.array([1e-9, 1e-6, 0.5])):
        edges = np.unique(np.concatenate([[0.0], cuts, [motion.duration], motion.breakpoints]))
        pieces = [motion.part(a, b) for a, b in pairwise(edges.tolist())]
        again = Trajectory(edges, np.concatenate([piece.coefficients[:, :1] for piece in pieces], axis=1))
        proof = world.prove(again, gap=0.05)
        assert proof.status is whole.status
        if proof.status:
            assert proof.proven == pytest.approx(whole.proven, rel=0.1)


# The slower proofs


# By a hair


def pendulum(length: float, radius: float, **changes: object) -> SpatialArm:
    """A ball that turns about the y axis, at 0 on the x axis and from there downwards."""
    joint = ChainJoint(name="pivot", link="ball", axis=(0.0, 1.0, 0.0))
    return arm(joint, spheres=(Sphere(1, (length, 0.0, 0.0), radius, "ball"),), **changes)


def parabola(lowest: float, at: float, steepness: float) -> tuple[Trajectory, Fraction]:
    """One joint, down and up again within 1 s; and its exact lowest value, of the coefficients as they are rounded."""
    square, linear, constant = steepness, -2.0 * steepness * at, lowest + steepness * at * at
    exact = Fraction(constant) - Fraction(linear) ** 2 / (4 * Fraction(square))
    return Trajectory(np.array([0.0, 1.0]), np.array([[[square]], [[linear]], [[constant]]])), exact


FLOOR = HalfSpace(center=(0.0, 0.0, 0.0))
instants, steep = st.floats(0.05, 0.95), st.floats(0.01, 30.0)


def judged(world: CompiledWorld, motion: Trajectory, room: float) -> None:
    """Where exact arithmetic says by how much it is clear: never clear where it is not, clear by a hair where it is."""
    proof = world.prove(motion)
    if room < 0.0:
        assert proof.status is not True
    elif room > HAIR / 2.0:
        assert proof.status is True


@settings(max_examples=60)
@given(st.floats(0.01, 0.5), instants, steep, st.sampled_from([-HAIR, -1e-11, 0.0, HAIR]))
def test_a_ball_that_slides_to_the_floor(radius: float, at: float, steepness: float, wanted: float) -> None:
    motion, exact = parabola(radius + wanted, at, steepness)
    judged(world_of(slider(radius), (FLOOR,)), motion, float(exact - Fraction(radius)))


@settings(max_examples=60)
@given(
    st.lists(st.floats(0.0, 3.0), min_size=1, max_size=5).filter(lambda powers: sum(powers) > 0.1),
    st.sampled_from([-HAIR, HAIR]),
)
def test_a_ball_that_is_at_the_floor_when_the_motion_ends(powers: list[float], wanted: float) -> None:
    """All derivatives have one sign: no bound of how far it moves could be lower."""
    lowest = 0.125 + wanted
    column = [*(-power for power in reversed(powers)), lowest + sum(powers)]
    exact = sum(map(Fraction, column)) - Fraction(1, 8)
    motion = Trajectory(np.array([0.0, 1.0]), np.array(column)[:, None, None])
    judged(world_of(slider(0.125), (FLOOR,)), motion, float(exact))


@settings(max_examples=40)
@given(
    st.floats(0.1, 5.0), st.floats(0.1, 5.0), st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.sampled_from([-HAIR, HAIR])
)
def test_a_ball_that_bounces_off_the_floor(down: float, up: float, before: float, after: float, wanted: float) -> None:
    """Its speed jumps where one piece ends and another begins."""
    lowest = 0.125 + wanted
    heights = np.array([[[-down], [up]], [[lowest + down * before], [lowest]]])
    motion = Trajectory(np.array([0.0, before, before + after]), heights)
    judged(world_of(slider(0.125), (FLOOR,)), motion, wanted)


@settings(max_examples=60)
@given(st.floats(0.3, 1.5), st.floats(0.01, 0.2), instants, st.floats(-4.0, 4.0), st.sampled_from([-HAIR, HAIR]))
def test_a_ball_that_swings_through_its_lowest_point_above_the_floor(
    length: float, radius: float, at: float, speed: float, wanted: float
) -> None:
    """It is there for one moment, at which nobody looks."""
    assume(abs(speed) > 0.1)
    floor = HalfSpace(center=(0.0, 0.0, -(length + radius + wanted)))
    motion = Trajectory(np.array([0.0, 1.0]), np.array([[[speed]], [[np.pi / 2.0 - speed * at]]]))
    judged(world_of(pendulum(length, radius), (floor,)), motion, wanted)


@settings(max_examples=40)
@given(st.floats(0.3, 1.0), instants, st.floats(0.3, 6.0), st.sampled_from([-HAIR, HAIR]), st.booleans())
def test_a_ball_that_swings_past_another(
    length: float, at: float, speed: float, wanted: float, of_axes_that_are_equal: bool
) -> None:
    """An ellipsoid whose axes are equal is a ball."""
    size, radius = 0.125, 0.0625
    center = (length + size + radius + wanted, 0.0, 0.0)
    ball = (
        Ellipsoid(center=center, semi_axes=(size,) * 3) if of_axes_that_are_equal else Ball(center=center, radius=size)
    )
    motion = Trajectory(np.array([0.0, 1.0]), np.array([[[speed]], [[-speed * at]]]))
    judged(world_of(pendulum(length, radius), (ball,)), motion, wanted)


@settings(max_examples=40)
@given(instants, steep, st.sampled_from([-HAIR, HAIR]), st.floats(-8.0, 8.0))
def test_two_links_of_which_one_slides_to_the_other_while_both_are_whirled(
    at: float, steepness: float, wanted: float, whirl: float
) -> None:
    """Only the joints between the two count, and how fast the others turn does not."""
    beside = FixedFrame(translation=(0.7, 0.3, 0.2))
    joints = (
        ChainJoint(name="whirl", link="plate", axis=(0.0, 0.6, 0.8)),
        ChainJoint(name="lift", link="ball", kind=JointKind.PRISMATIC, position=(-6.0, 6.0), pose=beside),
    )
    spheres = (Sphere(1, (0.7, 0.3, 0.2), 0.1, "plate"), Sphere(2, (0.0, 0.0, 0.0), 0.15, "ball"))
    robot = arm(*joints, spheres=spheres, kept_pairs=((0, 1),), self_collision=True)
    motion, exact = parabola(0.25 + wanted, at, steepness)
    line = np.zeros((3, 1, 1))
    line[1] = whirl
    both = Trajectory(motion.breakpoints, np.concatenate([line, motion.coefficients], axis=2))
    judged(world_of(robot, ()), both, float(exact) - 0.25)
    assert world_of(robot, ()).prove(both, gap=0.5).smallest == pytest.approx(float(exact) - 0.25, abs=steepness)


@pytest.mark.parametrize("margin", [0.0, 0.01])
def test_a_margin_is_kept_to_a_hair(margin: float) -> None:
    for wanted in (-HAIR, HAIR):
        motion, exact = parabola(0.125 + margin + wanted, 0.37, 2.0)
        world = world_of(replace(slider(0.125), margin=margin), (FLOOR,))
        judged(world, motion, float(exact - Fraction(0.125) - Fraction(margin)))


def test_a_piece_too_short_to_be_halved_leaves_others_as_they_are() -> None:
    """The least piece that there can be beside one of a second."""
    motion, _ = parabola(0.126, 0.4, 2.0)
    last = motion.at(np.array([1.0]))
    edges = np.array([0.0, 1.0, np.nextafter(1.0, 2.0)])
    still = np.zeros((3, 1, 1))
    still[2] = last
    both = Trajectory(edges, np.concatenate([motion.coefficients, still], axis=1))
    assert world_of(slider(0.125), (FLOOR,)).prove(both).status is True


def test_what_passes_between_two_looks_is_seen() -> None:
    """An angle that turns once around within a thousandth of the motion."""
    quick = Trajectory.from_pieces(
        np.array([5.0, 0.005, 5.0]), [np.zeros((1, 1)), np.array([[0.0], [2.0 * np.pi]]), np.full((1, 1), 2.0 * np.pi)]
    )
    floor = HalfSpace(center=(0.0, 0.0, -0.5))
    assert world_of(pendulum(0.45, 0.06), (floor,)).prove(quick).status is False
    assert world_of(pendulum(0.43, 0.06), (floor,)).prove(quick).status is True


def test_where_nothing_has_to_be_kept_everything_is_proven() -> None:
    robot = replace(robot_of("upright"), self_collision=False)
    proof = world_of(robot, ()).prove(
        through(postures(robot, np.random.default_rng(1), 3), 5, np.random.default_rng(2))
    )
    assert proof.status is True
    assert proof.proven == np.inf and proof.smallest == np.inf
    assert proof.where is None


@pytest.mark.parametrize("most", [1, 300])
def test_where_a_proof_may_look_at_no_more_a_cell_of_one_piece_is_named(most: int) -> None:
    world, ended = world_of(robot_of("upright"), scene_of("upright")), 0
    for seed in range(12):
        motion = random_motion("upright", 3, seed)
        found = world.prove(motion, gap=1e-9, most_items=most)
        assert found.status is None or found.cell is None
        if found.cell is not None:
            ended += 1
            start, end = found.cell
            assert 0.0 <= start < end <= motion.duration
            pieces = np.searchsorted(motion.breakpoints, [start + 1e-12, end - 1e-12], side="right")
            assert pieces[0] == pieces[1]
    assert ended


def test_it_says_what_comes_near_what() -> None:
    floor, ball = replace(FLOOR, name="floor"), Ball(center=(0.0, 0.0, 2.0), radius=0.1)
    motion, _ = parabola(0.2, 0.5, 1.0)
    world = world_of(slider(0.125), (ball, floor))
    proof = world.prove(motion)
    assert proof.where is not None
    assert (proof.where.links, proof.where.obstacle) == (("ball",), 1)
    assert world.described(proof.where) == "ball, floor"
