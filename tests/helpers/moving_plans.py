"""Motions among obstacles that move, for tests of what is drawn: nothing is searched for; limits may be broken."""

from __future__ import annotations

from functools import cache

import numpy as np
from helpers.space import small_arm
from helpers.space_plans import SPHERES

from problems import Ball, Box, Ellipse, PlanarArm, Robot
from problems.families.splines import move
from problems.scene import Obstacle, Tabulated
from problems.scene.moving import ConstantVelocity, MovingObstacle
from problems.tasks import Joints, Move
from tpbso_casadi.planning import PlannedMotion, motion_of

ROWS = np.array([[0.1, 0.0, 0.0], [0.3, 0.2, 0.4], [0.0, 0.4, 1.2]])
CAR = Tabulated.through([0.0, 0.2, 0.5], ROWS[:, :2], ROWS[:, 2:])
IN_PLANE = (
    Ellipse(center=(-0.8, -0.8), semi_axes=(0.2, 0.1)),
    MovingObstacle(Ellipse(center=(2.2, 1.2), semi_axes=(0.2, 0.1), angle=0.3), ConstantVelocity((-2.0, 0.5)), 0.05),
    MovingObstacle(Ellipse(center=(-1.0, 1.0), semi_axes=(0.3, 0.1)), CAR),
)
IN_SPACE = (
    Box(center=(0.6, 0.1, 0.3), size=(0.1, 0.2, 0.6)),
    MovingObstacle(Ball(center=(1.0, 0.9, 0.9), radius=0.15), ConstantVelocity((-0.8, -0.3, 0.0))),
)


@cache
def plane_plan(*obstacles: Obstacle) -> PlannedMotion:
    """An arm of two links with a width turns by a quarter."""
    arm = PlanarArm(
        link_lengths=(1.0, 0.8), max_speed=(4.0, 4.0), max_acceleration=(20.0, 20.0), link_radius=(0.05, 0.05)
    )
    return _plan(arm, (0.0, 0.3), (1.5, 0.5), obstacles or IN_PLANE)


@cache
def moving_space_plan() -> PlannedMotion:
    """A small arm turns while a ball crosses its way."""
    robot = small_arm(4, max_jerk=(100.0,) * 4, spheres=SPHERES, kept_pairs=((0, 3),), self_collision=True)
    return _plan(robot, (0.0, 0.3, 0.2, 0.8), (1.2, 0.9, -0.4, 1.1), IN_SPACE)


def _plan(
    robot: Robot, start: tuple[float, ...], goal: tuple[float, ...], obstacles: tuple[Obstacle, ...]
) -> PlannedMotion:
    task = Move(robot, Joints(start), (Joints(goal),), obstacles=obstacles)
    problem = move(task, "time", samples=20, pieces=3)
    motion = motion_of(problem, np.zeros(len(problem.variables)))
    return PlannedMotion(scenario=None, motion=motion)  # type: ignore[arg-type]
