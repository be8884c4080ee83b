"""Ways of robots of several branches: each branch's own, gone at the same time as far as that is clear."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from helpers.core_robots import world_of

from problems.core.world import CONNECT
from problems.robots import ChainJoint, FixedFrame, SpatialArm, Sphere
from problems.robots.chain import Chain, JointKind, Tip
from problems.scene import Box, Obstacle

pytestmark = pytest.mark.usefixtures("compiled")

RADIUS, MARGIN = 0.1, 0.01


def carts(count: int = 2, *, lift: bool = False) -> SpatialArm:
    """Balls on a floor that two joints each slide along x and y; a lift moves them all, where there is one."""
    joints = [_slide("lift", 0, (0.0, 0.0, 1.0))] if lift else []
    spheres, tips = [], []
    for number in range(count):
        first = len(joints) + 1
        joints += [_slide(f"x{number}", int(lift), (1.0, 0.0, 0.0)), _slide(f"y{number}", first, (0.0, 1.0, 0.0))]
        spheres.append(Sphere(first + 1, (0.0, 0.0, 0.0), RADIUS, f"cart {number}"))
        tips.append(Tip(name=f"cart {number}", link=f"y{number}", frame=FixedFrame(), body=first + 1))
    chain = Chain(name="carts", joints=tuple(joints), tip_body=len(joints), tips=tuple(tips))
    pairs = tuple((one, two) for one in range(count) for two in range(one + 1, count))
    speeds = (1.0,) * len(joints)
    return SpatialArm(
        chain, max_speed=speeds, max_acceleration=speeds, spheres=tuple(spheres), kept_pairs=pairs, margin=MARGIN,
        self_collision=True,
    )  # fmt: skip


def _slide(name: str, parent: int, axis: tuple[float, float, float]) -> ChainJoint:
    return ChainJoint(name=name, link=name, kind=JointKind.PRISMATIC, position=(-1.5, 1.5), axis=axis, parent=parent)


def way(robot: SpatialArm, ends: list[list[float]], seed: int, *obstacles: Obstacle) -> np.ndarray | None:
    """A way between two postures, looked at ten times as closely as it was found."""
    start, goal = np.array(ends)
    world = world_of(robot, obstacles)
    path = world.connect(start, goal, np.array([[-1.5] * robot.dof, [1.5] * robot.dof]), seed)
    if path is not None:
        np.testing.assert_array_equal(path[[0, -1]], [start, goal])
        for one, two in pairwise(path):
            shares = np.linspace(0.0, 1.0, 2 + int(10.0 * np.abs(two - one).max() / CONNECT.edge_step))
            assert (world.clearance_margins(one + shares[:, None] * (two - one)) > -CONNECT.edge_step).all()
    return path


def length(path: np.ndarray) -> float:
    """What the joint that moves most goes, m, in all steps."""
    return float(np.abs(np.diff(path, axis=0)).max(axis=1).sum())


def test_branches_have_their_turns_and_what_carries_them_comes_before() -> None:
    assert carts().chain.orders == ((0, 0, 1, 1), (1, 1, 0, 0))
    assert carts(lift=True).chain.orders == ((0, 1, 1, 2, 2), (0, 2, 2, 1, 1))
    assert carts(3).chain.orders[1] == (2, 2, 0, 0, 1, 1)
    assert carts(1).chain.orders == ()


@pytest.mark.parametrize("seed", range(0, 8, 2))
@pytest.mark.parametrize("lift", [False, True])
def test_ways_that_cross_are_gone_at_the_same_time(seed: int, lift: bool) -> None:
    """One cart goes 1.6 m along x, the other along y; one after the other they would go 3.2 m."""
    robot = carts(lift=lift)
    ends = [[-0.8, 0.0, 0.0, -0.8], [0.8, 0.0, 0.0, 0.8]]
    path = way(robot, [[0.1, *ends[0]], [0.4, *ends[1]]] if lift else ends, seed)
    assert path is not None
    assert 1.6 <= length(path) < (2.6 if lift else 2.3)


def test_each_goes_through_a_gap_of_its_own() -> None:
    """Two walls, each with a gap as wide as a cart and a third: all joints at once hardly find both at a time."""
    robot, walls = carts(), list[Obstacle]()
    for x in (-0.5, 0.5):
        walls += [Box(center=(x, side * 0.9, 0.0), size=(0.1, 1.5, 0.6)) for side in (-1.0, 1.0)]
    ends = [[-1.2, 1.2, 1.2, -1.2], [0.0, 0.5, 0.0, -0.5]]
    found = [way(robot, ends, seed, *walls) for seed in (0, 2, 4)]
    assert all(path is not None for path in found)


def test_three_take_their_turns() -> None:
    robot = carts(3)
    path = way(robot, [[-1.0, 0.0, 0.0, -1.0, 1.0, 1.0], [1.0, 0.0, 0.0, 1.0, -1.0, -1.0]], 0)
    assert path is not None
    assert length(path) < 5.0
    np.testing.assert_array_equal(path, way(robot, [path[0].tolist(), path[-1].tolist()], 0))


@pytest.mark.parametrize("seed", range(4))
def test_two_that_change_places_move_at_once(seed: int) -> None:
    """Neither can arrive while the other stands where that is to be."""
    path = way(carts(), [[-0.5, 0.0, 0.5, 0.0], [0.5, 0.0, -0.5, 0.0]], seed)
    assert path is not None and len(path) > 2


def test_where_a_branch_has_no_way_there_is_none() -> None:
    walls = [Box(center=(x, 0.0, 0.0), size=(0.1, 3.4, 0.6)) for x in (-0.5, 0.5)]
    assert way(carts(), [[-1.2, 0.0, 1.2, 0.0], [0.0, 0.0, 1.2, 0.5]], 0, *walls) is None
