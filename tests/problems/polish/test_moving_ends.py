"""Motions between states that move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import robot_of
from helpers.polish_objective import ASIDE, GOAL, START, WALL, polish_objective
from helpers.slow import slow_except

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.core import CompiledWorld, SingleRows, WholeRows
from problems.motions import Trajectory
from problems.polish import Deviations, PathRefinement, Rates, joint_box
from problems.robots import JointLimits, Robot, built_in
from problems.scene import Box, Obstacle
from problems.timing import MotionState, fastest_move

LEAVING, ARRIVING = np.array([0.3, 0.1, -0.1, 0.0, 0.2, 0.0, 0.1]), np.array([0.2, -0.1, 0.0, 0.1, 0.0, 0.0, 0.0])
LOW = np.array([0.0, 0.0, 0.0, 2.5, 0.0, -1.5, 0.0])  # off these, postures of a Panda


def limits() -> JointLimits:
    found = robot_of("upright").limits
    return found if found.jerk is not None else replace(found, jerk=tuple(20.0 * a for a in found.acceleration))


def motions(start: FloatArray = LEAVING, goal: FloatArray = ARRIVING) -> Deviations:
    return Deviations(START, GOAL, limits(), rates=Rates(start, goal))


def some(between: Deviations) -> FloatArray:
    return np.asarray(np.random.default_rng(5).uniform(-0.05, 0.05, (between.free, between.dof)))


def test_the_fastest_motion_arrives_with_a_velocity() -> None:
    state = MotionState(START, LEAVING, np.zeros(7))
    found = fastest_move(state, GOAL, limits(), ARRIVING)
    np.testing.assert_allclose(found.value_at_end(0), GOAL, atol=1e-12)
    np.testing.assert_allclose(found.value_at_end(1), ARRIVING, atol=1e-12)
    np.testing.assert_allclose(found.value_at_end(2), 0.0, atol=1e-8)
    assert found.duration < fastest_move(state, GOAL, limits()).duration


@pytest.mark.parametrize(("start", "goal"), [(LEAVING, 0.0 * ARRIVING), (0.0 * LEAVING, ARRIVING), (LEAVING, ARRIVING)])
def test_every_motion_has_the_velocities_of_its_ends_and_keeps_the_limits(start: FloatArray, goal: FloatArray) -> None:
    between = motions(start, goal)
    x = some(between)
    duration = between.least_duration(x, between.direct.duration)
    assert duration >= between.bound
    found = between.trajectory(x, duration)
    ends = np.array([0.0, found.duration])
    np.testing.assert_allclose(found.at(ends), [START, GOAL], atol=1e-12)
    np.testing.assert_allclose(found.at(ends, 1), [start, goal], atol=1e-12)
    np.testing.assert_allclose(found.at(ends, 2), 0.0, atol=1e-6)
    for order, bound in enumerate(between.limits.by_order, start=1):
        peaks = np.abs(found.at(found.extreme_times(order), order)).max(axis=0)
        assert (peaks <= bound * (1.0 + 1e-8)).all()


def test_the_least_duration_is_the_next_in_which_limits_are_kept_and_a_given_one_where_they_are() -> None:
    between = motions()
    x = some(between)
    duration = between.least_duration(x, between.direct.duration)
    assert between.time_scale(between.padded(x, duration)) <= duration
    assert between.least_duration(x, duration) == duration
    direct = between.direct.duration
    assert between.least_duration(np.zeros_like(x), direct) == direct


def test_rows_know_how_ends_change_with_the_duration() -> None:
    between, longer = motions(), 1e-3
    x = some(between)
    now, later = (between.padded(x, between.direct.duration + more) for more in (0.0, longer))
    at = between.limited[0]
    nothing = np.zeros(len(at.joint))
    single = between.with_ends(SingleRows(at.joint, at.first - 3, at.weights, nothing, nothing))
    np.testing.assert_allclose(single.by_time * longer, at.values(later) - at.values(now), atol=1e-12)
    where = between.postures(np.array([0.01, 0.5, 0.98]))
    own = where.weights[:, :, None] * np.arange(1.0, 8.0)
    whole = between.with_ends(WholeRows(where.first - 3, own, np.zeros(3), np.zeros(3), np.ones(3)))
    moved = (where.values(later) - where.values(now)) @ np.arange(1.0, 8.0)
    np.testing.assert_allclose(whole.by_time * longer, moved, atol=1e-12)


def best(between: Deviations, arm: Robot, obstacles: tuple[Obstacle, ...] = ()) -> Trajectory:
    world = CompiledWorld.of(arm, obstacles)
    assert world is not None
    objective, box = polish_objective(between, arm), joint_box(arm, START, GOAL)
    found = PathRefinement(world=world, motions=between, objective=objective, box=box).best_motion(1)
    assert found is not None and world.prove(found).status and between.keeps_limits(found)
    return found


@pytest.mark.parametrize("jerk", [20.0, 100.0, 5000.0])
def test_in_free_space_a_move_takes_the_least_time_however_little_jerk_there_is(jerk: float) -> None:
    slow = replace(limits(), jerk=(jerk,) * 7)
    between = Deviations(START, GOAL, slow, rates=Rates(LEAVING, ARRIVING))
    found = best(between, replace(robot_of("upright"), self_collision=False))
    least = fastest_move(MotionState(START, LEAVING, np.zeros(7)), GOAL, slow, ARRIVING).duration
    assert found.duration == pytest.approx(least, rel=2e-5)


def test_past_a_wall_little_jerk_costs_little_time() -> None:
    slow = replace(limits(), jerk=(100.0,) * 7)
    between = Deviations(START, GOAL, slow, rates=Rates(LEAVING, ARRIVING))
    assert best(between, robot_of("upright"), (WALL,)).duration <= 1.5 * between.direct.duration


VIAS = [
    pytest.param(tp.Joints(tuple(ASIDE - LOW)), id="joints"),
    pytest.param(tp.Pose((0.45, 0.1, 0.6)), id="position", marks=pytest.mark.slow),
]


@pytest.mark.parametrize("via", VIAS)
def test_a_via_between_moving_ends_needs_no_search(via: tp.Joints | tp.Pose) -> None:
    plan = tp.plan(
        tp.robot("panda"), start=START - LOW, goal=GOAL - LOW, obstacles=[WALL], via=[via], start_velocity=LEAVING,
        goal_velocity=ARRIVING,
    )  # fmt: skip
    assert plan.certified and plan.result.evaluations == 0
    ends = plan.trajectory.breakpoints[[0, -1]]
    np.testing.assert_allclose(plan.trajectory.at(ends, 1), [LEAVING, ARRIVING], atol=1e-8)
    if isinstance(via, tp.Joints):
        away = np.linalg.norm(plan.trajectory.at(plan.trajectory.times(8001)) - (ASIDE - LOW), axis=1)
        assert away.min() < 2e-3


def test_the_last_correction_of_a_via_breaks_no_limit_that_time_could_not_mend() -> None:
    posts = Box(center=(0.55, 0.35, 0.4), size=(0.3, 0.1, 0.8)), Box(center=(0.5, -0.4, 0.3), size=(0.4, 0.1, 0.6))
    plan = tp.plan(
        tp.robot("panda"), start=[-2.63, 0.69, -0.7, -2.72, 0.9, 3.41, -1.64], via=[tp.Position((-0.66, 0.11, 0.94))],
        goal=[-0.59, -0.07, -1.98, -1.01, -1.16, 3.19, -1.26], obstacles=posts,
        start_velocity=[0.37, -0.43, 0.32, -0.29, 0.12, 0.23, 0.01],
        goal_velocity=[0.37, -0.33, -0.14, 0.31, 0.34, -0.36, -0.24],
    )  # fmt: skip
    assert plan.certified and plan.result.evaluations == 0


@pytest.mark.parametrize("keys", slow_except([{"total_time": (3.0, 4.0)}, {"start_velocity": LEAVING}], 1))
def test_no_search_is_needed(keys: dict[str, tuple[float, ...]]) -> None:
    plan = tp.plan(tp.robot("panda"), start=START - LOW, goal=GOAL - LOW, obstacles=[WALL], **keys)
    assert plan.certified
    assert plan.result.evaluations == 0
    assert "total_time" not in keys or 3.0 <= plan.duration <= 3.0 + 1e-6


def test_a_move_from_an_acceleration_takes_the_least_time() -> None:
    velocity, acceleration = 0.5 * LEAVING, -3.0 * LEAVING
    plan = tp.plan(
        tp.robot("panda"), start=START - LOW, goal=GOAL - LOW, start_velocity=velocity, start_acceleration=acceleration,
        motion="time-spline",
    )  # fmt: skip
    assert plan.certified and plan.result.evaluations == 0
    least = fastest_move(MotionState(START, velocity, acceleration), GOAL, built_in("panda").arm().limits).duration
    assert plan.duration == pytest.approx(least, rel=1e-9)
