"""Paths that were found, polished and proven."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from helpers.core_robots import robot_of
from helpers.polish_objective import GOAL, START, WALL, polish_objective

from problems.core import CompiledWorld
from problems.limits import TorqueLimit, limits_of
from problems.polish import (
    Deviations,
    PathRefinement,
    RefinementSettings,
    deviations_from_rest,
    joint_box,
)
from problems.polish.torques import JointTorques
from problems.robots import SpatialArm
from problems.scene import Box
from tpbso_casadi.facade.robots import robot


def refinement(arm: SpatialArm, *obstacles: Box) -> PathRefinement:
    world, motions = CompiledWorld.of(arm, obstacles), Deviations(START, GOAL, arm.limits)
    assert world is not None
    objective, box = polish_objective(motions, arm), joint_box(arm, START, GOAL)
    return PathRefinement(world=world, motions=motions, objective=objective, box=box)


def test_a_way_around_a_wall_is_proven_and_found_again() -> None:
    found = refinement(robot_of("upright"), WALL)
    trajectory = found.best_motion(1)
    assert trajectory is not None and found.world.prove(trajectory).status
    assert trajectory.duration > found.motions.bound
    limits = found.motions.limits
    for order, bound in enumerate(limits.by_order, start=1):
        peaks = np.abs(trajectory.at(trajectory.extreme_times(order), order)).max(axis=0)
        assert (peaks <= bound * (1.0 + 1e-9)).all()
    again = refinement(robot_of("upright"), WALL).best_motion(1)
    assert again is not None
    np.testing.assert_array_equal(trajectory.coefficients, again.coefficients)


def test_without_obstacles_it_is_at_the_bound() -> None:
    found = refinement(robot_of("upright"))
    trajectory = found.best_motion(1)
    assert trajectory is not None and trajectory.duration <= RefinementSettings.near_bound * found.motions.bound


def test_what_is_slower_than_a_known_motion_is_not_returned() -> None:
    found = refinement(robot_of("upright"), WALL)
    assert found.best_motion(1, to_beat=found.motions.bound) is None


def test_joints_are_kept_in_their_ranges() -> None:
    arm = replace(robot_of("upright"), position_limits=((-2.8, 2.8), (-0.1, 0.6), *(((-2.8, 2.8),) * 5)))
    trajectory = refinement(arm, WALL).best_motion(1)
    if trajectory is None:  # it may be no way at all, which is not broken either
        return
    theta = trajectory.at(trajectory.extreme_times(0))
    assert theta[:, 1].max() <= 0.6 + 1e-9 and theta[:, 1].min() >= -0.1 - 1e-9


def test_motors_that_are_too_weak_for_the_bound_are_given_time() -> None:
    strong = robot("panda").model
    assert isinstance(strong, SpatialArm)
    arm = replace(strong, max_torque=(6.0, 60.0, 30.0, 40.0, 5.0, 5.0, 3.0), self_collision=True)
    start, goal = np.array([-0.9, -0.3, 0.0, -2.0, 0.0, 1.7, 0.8]), np.array([0.9, -0.3, 0.0, -2.0, 0.0, 1.7, 0.8])
    limit = next(limit for limit in limits_of(arm, ()) if isinstance(limit, TorqueLimit))
    torques, world = JointTorques.of(limit), CompiledWorld.of(arm, ())
    assert world is not None
    motions = deviations_from_rest(start, goal, arm.limits, torques)
    assert motions.direct.duration > motions.bound
    objective, box = polish_objective(motions, arm), joint_box(arm, start, goal)
    found = PathRefinement(world=world, motions=motions, objective=objective, box=box, torques=torques)
    trajectory = found.best_motion(1)
    assert trajectory is not None and trajectory.duration > motions.bound
    times = trajectory.times(500)
    state = np.concatenate([trajectory.at(times, order) for order in range(3)], axis=1)
    assert np.abs(torques.shares(state)).max() <= 1.02
