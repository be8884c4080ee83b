"""Ways between postures: that they begin and end where they have to, and what they keep clear of in between."""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np
import pytest
from helpers.core_robots import slider, world_of
from helpers.space import small_arm

from problems.core.world import CONNECT
from problems.robots import SpatialArm, Sphere
from problems.scene import Ball, Box

FINER = 20
SPARE = 0.02
WALL = Box(center=(0.6, 0.0, 0.5), size=(0.5, 0.1, 0.5))
START, GOAL = np.array([-0.7, 1.2, 0.0, 0.6, 0.0, 0.2, 0.0]), np.array([0.7, 1.2, 0.0, 0.6, 0.0, 0.2, 0.0])


def reaching() -> SpatialArm:
    """Over a wall from one side to the other."""
    spheres = (
        *(Sphere(2, (0.0, 0.0, 0.1 * k), 0.06, "upper arm") for k in range(4)),
        *(Sphere(4, (0.0, 0.0, 0.1 * k), 0.05, "forearm") for k in range(4)),
        *(Sphere(7, (0.0, 0.0, 0.05 * k), 0.04, "hand") for k in range(4)),
    )
    pairs = tuple((one, two) for one in range(4) for two in range(8, 12))
    return small_arm(spheres=spheres, kept_pairs=pairs, margin=0.01, self_collision=True)


def ranges(robot: SpatialArm) -> np.ndarray:
    assert robot.position_limits is not None
    return np.array(robot.position_limits).T


def missed(robot: SpatialArm) -> float:
    """How much room there may be less than at the nearest look, m.

    Along an edge no joint is farther than half of what lies between two looks from where it is at one of them, and no
    ball moves by more than that times its distance from the axis, of all joints together. What is cut off an edge by
    a shortcut ends between two looks, and so this holds at bends too.
    """
    return float(robot.bodies.levers.sum(axis=1).max()) * CONNECT.edge_step / 2.0


def finely(path: np.ndarray) -> np.ndarray:
    """Postures along the edges of a way, a twentieth of the step of looks apart, (n, dof)."""
    parts = []
    for one, two in pairwise(path):
        count = max(1, int(np.ceil(FINER * np.abs(two - one).max() / CONNECT.edge_step)))
        parts.append(one + np.linspace(0.0, 1.0, count + 1)[:, None] * (two - one))
    return np.concatenate(parts)


@pytest.mark.parametrize("seed", range(6))
def test_a_way_leads_from_start_to_goal_around_what_is_between(seed: int) -> None:
    robot = reaching()
    world = world_of(robot, (WALL,))
    straight = np.stack([START, GOAL])
    assert not world.clear(finely(straight)).all() and world.clear(straight, SPARE).all()
    path = world.connect(START, GOAL, ranges(robot), seed, SPARE)
    assert path is not None and len(path) > 2
    np.testing.assert_array_equal(path[0], START)
    np.testing.assert_array_equal(path[-1], GOAL)
    low, high = ranges(robot)
    assert (path >= low).all() and (path <= high).all()
    assert world.clear(finely(path), SPARE - missed(robot)).all()
    assert world.clear(path[1:-1], SPARE - missed(robot)).all()


def test_with_as_much_to_spare_as_balls_move_between_two_looks_nothing_is_missed() -> None:
    robot, rng, bent = reaching(), np.random.default_rng(3), 0
    world, spare = world_of(robot, (Ball(center=(0.7, 0.0, 0.5), radius=0.1),)), missed(robot)
    for seed in range(12):
        start, goal = np.stack([START, GOAL]) + rng.uniform(-0.2, 0.2, (2, robot.dof))
        if world.clear(np.stack([start, goal]), spare).all():
            path = world.connect(start, goal, ranges(robot), seed, spare, extensions=2_000)
            assert path is not None
            assert world.clear(finely(path)).all()
            bent += not world.clear(finely(np.stack([start, goal])), spare).all()
    assert bent >= 2


def test_where_nothing_is_in_the_way_it_is_straight() -> None:
    robot = reaching()
    path = world_of(robot, ()).connect(START, START + 0.1, ranges(robot), 0)
    assert path is not None
    way, along = path - START, np.full(7, 1.0 / np.sqrt(7.0))
    np.testing.assert_allclose(way, (way @ along)[:, None] * along, atol=1e-12)


def test_from_a_posture_to_itself_nothing_moves() -> None:
    robot = reaching()
    path = world_of(robot, (WALL,)).connect(START, START, ranges(robot), 0)
    assert path is not None
    np.testing.assert_array_equal(path, np.repeat(START[None], len(path), axis=0))


def test_a_seed_is_a_way() -> None:
    robot = reaching()
    world = world_of(robot, (WALL,))
    one, again, other = (world.connect(START, GOAL, ranges(robot), seed, SPARE) for seed in (1, 1, 2))
    assert one is not None and again is not None and other is not None
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or (one != other).any()


def test_there_is_no_way_through_a_floor() -> None:
    robot = slider(0.1)
    floor = Box(center=(0.0, 0.0, 0.0), size=(1.0, 1.0, 0.1))
    start, goal = np.array([0.5]), np.array([-0.5])
    assert world_of(robot, (floor,)).connect(start, goal, ranges(robot), 0) is None
    assert world_of(robot, ()).connect(start, goal, ranges(robot), 0) is not None


def test_what_is_walled_in_has_no_way_out_and_the_search_ends() -> None:
    """Between two walls the hand is held where it is; the trees stop growing after so many extensions."""
    robot = reaching()
    walls = (WALL, Box(center=(0.6, 0.0, 1.2), size=(3.0, 0.1, 2.0)), Box(center=(0.0, 0.0, 1.6), size=(3.0, 3.0, 0.1)))
    world, began = world_of(robot, walls), time.perf_counter()
    assert world.connect(START, GOAL, ranges(robot), 0, SPARE, extensions=300) is None
    assert time.perf_counter() - began < 5.0
