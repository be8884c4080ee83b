"""Postures at their times among obstacles that move: against the same obstacles put where they are then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import ROBOTS, SCENE, postures, robot_of, world_of

from problems.base import FloatArray
from problems.core import Schedule, Separation
from problems.robots import SpatialArm
from problems.scene import Ball, Box, ConstantVelocity, MovingObstacle, Obstacle, Solid

RATE = 0.05  # m/s
each_robot = pytest.mark.parametrize("name", ROBOTS)


def moving(rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Every second obstacle of the scene at a velocity of its own, some with a margin that grows."""
    found: list[Obstacle] = list(SCENE)
    for number in range(0, len(SCENE), 2):
        motion = ConstantVelocity(tuple(rng.uniform(-0.4, 0.4, 3).tolist()), tuple(rng.uniform(-0.2, 0.2, 3).tolist()))
        found[number] = MovingObstacle(SCENE[number], motion, RATE if number % 4 else 0.0)
    return tuple(found)


def placed(obstacle: Obstacle, time: float) -> Obstacle:
    if not isinstance(obstacle, MovingObstacle):
        return obstacle
    still = obstacle.still
    assert isinstance(still, Solid)
    return replace(still, center=tuple(obstacle.motion.placed(np.array([still.center]), time)[0].tolist()))


def room_then(robot: SpatialArm, obstacles: tuple[Obstacle, ...], theta: FloatArray, time: float) -> float:
    """The least of all, each obstacle alone where it is then, less what its margin has grown by."""
    margins = [
        world_of(robot, (placed(each, time),)).clearance_margins(theta[None], which=Separation.FROM_OBSTACLES)[0]
        - (each.margin_rate * time if isinstance(each, MovingObstacle) else 0.0)
        for each in obstacles
    ]
    return float(min(margins))


@each_robot
def test_rooms_are_those_of_the_obstacles_where_they_are_then(name: str) -> None:
    robot, rng = robot_of(name), np.random.default_rng(3)
    obstacles, theta, times = moving(rng), postures(robot, rng, 13), rng.uniform(0.0, 3.0, 13)
    world = world_of(robot, obstacles)
    found = world.clearance_margins(theta, which=Separation.FROM_OBSTACLES, times=times)
    expected = [room_then(robot, obstacles, *each) for each in zip(theta, times.tolist(), strict=True)]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)
    at_start = [room_then(robot, obstacles, each, 0.0) for each in theta]
    np.testing.assert_allclose(
        world.clearance_margins(theta, which=Separation.FROM_OBSTACLES), at_start, rtol=0.0, atol=1e-9
    )
    both = world.clearance_margins(theta, times=times)
    assert (world.clear(theta, times=times) == (both >= 0.0)).all()
    assert world.moves and not world.still.moves
    fixed = tuple(each for each in obstacles if not each.moves)
    np.testing.assert_array_equal(world.still.clearance_margins(theta), world_of(robot, fixed).clearance_margins(theta))


@each_robot
def test_what_is_nearest_changes_with_the_time_as_differences_say(name: str) -> None:
    robot, rng, step, compared = robot_of(name), np.random.default_rng(5), 1e-5, 0
    theta, times = postures(robot, rng, 60), rng.uniform(0.0, 2.0, 60)
    ball = Ball(center=(0.3, 0.1, 0.4), radius=0.15)
    world = world_of(robot, (MovingObstacle(ball, ConstantVelocity((0.3, -0.2, 0.1)), RATE),))
    near = world.nearby(theta, 0.6, times)
    np.testing.assert_allclose(near.clearance_margins, world.nearby(theta, 0.6, times).clearance_margins)
    for posture in range(len(theta)):
        of_it = np.flatnonzero((near.samples == posture) & ~near.is_link)
        if not of_it.size:
            continue
        least = of_it[near.clearance_margins[of_it].argmin()]
        here, *beside = (
            world.clearance_margins(
                theta[posture : posture + 1], which=Separation.FROM_OBSTACLES, times=times[posture : posture + 1] + t
            )
            for t in (0.0, step, -step)
        )
        assert near.clearance_margins[least] == pytest.approx(here[0], abs=1e-9)
        if abs(beside[0][0] + beside[1][0] - 2.0 * here[0]) / step < 1e-3:
            assert near.rates[least] == pytest.approx((beside[0][0] - beside[1][0]) / (2.0 * step), abs=2e-3)
            compared += 1
    assert compared > 10 and not near.rates[near.is_link].any()


def test_a_way_leads_past_where_an_obstacle_is_then() -> None:
    """A wall crosses the straight way: whoever is late finds it gone."""
    robot = robot_of("upright")
    start, goal = np.array([-0.8, 0.6, 0.0, 0.9, 0.0, 0.5, 0.0]), np.array([0.8, 0.6, 0.0, 0.9, 0.0, 0.5, 0.0])
    wall = Box(center=(0.65, -0.2, 0.35), size=(0.4, 0.04, 1.2))
    world = world_of(robot, (MovingObstacle(wall, ConstantVelocity((0.0, 0.0, 1.0))),))
    box, straight = np.stack([start - 1.0, goal + 1.0]), np.stack([start, goal])
    bent = world.connect(start, goal, box, 1, schedule=Schedule(start, goal, 0.0, 0.5))
    assert bent is not None and len(bent) > 2
    late = world.connect(start, goal, box, 1, schedule=Schedule(start, goal, 3.0, 4.0))
    assert late is not None
    np.testing.assert_allclose(np.linalg.norm(np.diff(late, axis=0), axis=1).sum(), np.linalg.norm(goal - start))
    shares = np.linspace(0.0, 1.0, 50)[:, None]
    between = straight[0] + shares * (straight[1] - straight[0])
    assert world.clear(between, times=3.0 + shares[:, 0]).all()
    assert not world.clear(between, times=0.5 * shares[:, 0]).all()
