"""Paths among obstacles that move, polished and proven: waiting for them, ahead of them, and what comes after."""

from __future__ import annotations

import numpy as np
from helpers.core_robots import robot_of
from helpers.polish_objective import GOAL, START, WALL, polish_objective

from problems import Joints, Move, move
from problems.core import CompiledWorld
from problems.motions import Trajectory
from problems.polish import Deviations, PathRefinement, joint_box
from problems.robots import SpatialArm
from problems.scene import Box, ConstantVelocity, MovingObstacle, Obstacle

LIFTED = MovingObstacle(WALL, ConstantVelocity((0.0, 0.0, 0.8)))  # gone after a while
CRATE = Box(center=(0.2, 1.2, 1.1), size=(0.3, 0.1, 0.3))
COMING = MovingObstacle(CRATE, ConstantVelocity((0.0, -0.4, 0.0)))  # at the goal from 2.2 s to 3.8 s


def refinement(arm: SpatialArm, *obstacles: Obstacle, stay: float = 0.0, at_least: float = 0.0) -> PathRefinement:
    world = CompiledWorld.of(arm, obstacles)
    assert world is not None
    motions = Deviations(START, GOAL, arm.limits, at_least=at_least)
    objective, box = polish_objective(motions, arm), joint_box(arm, START, GOAL)
    return PathRefinement(world=world, motions=motions, objective=objective, box=box, stay=stay)


def is_clear(world: CompiledWorld, trajectory: Trajectory, after: float = 0.0) -> bool:
    """At many times, as a motion that stands at its goal for a while."""
    times = np.linspace(0.0, trajectory.duration + after, 2000)
    return bool(world.clear(trajectory.at(np.minimum(times, trajectory.duration)), times=times).all())


def test_a_motion_is_as_slow_as_what_moves_needs_and_proven() -> None:
    found = refinement(robot_of("upright"), LIFTED)
    trajectory = found.best_motion(1)
    assert trajectory is not None and found.world.prove(trajectory).status
    assert is_clear(found.world, trajectory) and not is_clear(found.world, found.motions.direct)
    for order, bound in enumerate(found.motions.limits.by_order, start=1):
        peaks = np.abs(trajectory.at(trajectory.extreme_times(order), order)).max(axis=0)
        assert (peaks <= bound * (1.0 + 1e-9)).all()
    standing = refinement(robot_of("upright"), WALL).best_motion(1)
    assert standing is None or trajectory.duration <= standing.duration * 1.02
    again = refinement(robot_of("upright"), LIFTED).best_motion(1)
    assert again is not None
    np.testing.assert_array_equal(trajectory.coefficients, again.coefficients)


def test_the_goal_is_reached_when_it_stays_clear() -> None:
    arm = robot_of("upright")
    quick = refinement(arm, COMING).best_motion(1)
    assert quick is not None
    found = refinement(arm, COMING, stay=2.0)
    assert not is_clear(found.world, quick, after=2.0)
    trajectory = found.best_motion(1)
    assert trajectory is not None and trajectory.duration > quick.duration
    assert is_clear(found.world, trajectory, after=2.0)


def test_no_motion_is_there_before_it_may_be() -> None:
    found = refinement(robot_of("upright"), LIFTED, at_least=4.0)
    trajectory = found.best_motion(1)
    assert trajectory is not None and 4.0 <= trajectory.duration <= 4.1
    assert is_clear(found.world, trajectory)


def test_the_problem_of_a_move_is_refined_among_what_moves() -> None:
    arm = robot_of("upright")
    task = Move(arm, Joints(tuple(START)), (Joints(tuple(GOAL)),), obstacles=(COMING,), stay=2.0)
    problem = move(task)
    (approach,) = problem.direct.approaches()
    motions = list(problem.direct.along_paths(approach, 1, np.inf, lambda is_known: False))
    assert motions
    world = CompiledWorld.of(arm, (COMING,))
    assert world is not None and all(is_clear(world, motion, after=2.0) for motion in motions)
    assert all(verdict.satisfied for verdict in problem.criteria.verify(motions[-1].time_scaled(1.0 + 1e-12)))
