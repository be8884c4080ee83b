"""Motions between states that move."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.core_robots import robot_of
from helpers.polish_objective import ASIDE, GOAL, START, WALL, polish_objective
from helpers.slow import slow_except

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.core import CompiledWorld, SingleRows, WholeRows
from problems.motions import Trajectory
from problems.polish import Deviations, PathRefinement, joint_box
from problems.robots import JointLimits, Robot, built_in
from problems.scene import Box, Obstacle
from problems.timing import MotionState, fastest_move

LEAVING, ARRIVING = np.array([0.3, 0.1, -0.1, 0.0, 0.2, 0.0, 0.1]), np.array([0.2, -0.1, 0.0, 0.1, 0.0, 0.0, 0.0])
SPEEDING, SLOWING = 3.0 * ARRIVING[::-1], -2.0 * LEAVING
RATES = np.array([[LEAVING, SPEEDING], [ARRIVING, SLOWING]])
LOW = np.array([0.0, 0.0, 0.0, 2.5, 0.0, -1.5, 0.0])  # off these, postures of a Panda


def limits() -> JointLimits:
    found = robot_of("upright").limits
    return found if found.jerk is not None else replace(found, jerk=tuple(20.0 * a for a in found.acceleration))


def motions(rates: FloatArray = RATES) -> Deviations:
    return Deviations(START, GOAL, limits(), rates=rates)


def least(bounds: JointLimits, rates: FloatArray = RATES) -> Trajectory:
    return fastest_move(MotionState(START, *rates[0]), MotionState(GOAL, *rates[1]), bounds)


def some(between: Deviations) -> FloatArray:
    return np.asarray(np.random.default_rng(5).uniform(-0.05, 0.05, (between.free, between.dof)))


@pytest.mark.parametrize(
    "rates",
    [RATES, RATES * [[[1.0], [0.0]], [[1.0], [0.0]]], RATES * [[[0.0], [0.0]], [[1.0], [1.0]]]],
    ids=["both", "velocities", "goal"],
)
def test_every_motion_has_the_rates_of_its_ends_and_keeps_the_limits(rates: FloatArray) -> None:
    between = motions(rates)
    x = some(between)
    duration = between.least_duration(x, between.direct.duration)
    assert duration >= between.bound
    found = between.trajectory(x, duration)
    ends = np.array([0.0, found.duration])
    np.testing.assert_allclose(found.at(ends), [START, GOAL], atol=1e-12)
    np.testing.assert_allclose(found.at(ends, 1), rates[:, 0], atol=1e-12)
    np.testing.assert_allclose(found.at(ends, 2), rates[:, 1], atol=1e-6)
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
    between, longer = motions(), 1e-6
    x, duration = some(between), 1.2 * between.direct.duration
    now, later = (between.padded(x, duration + more) for more in (0.0, longer))
    at = between.limited[0]
    nothing = np.zeros(len(at.joint))
    single = between.with_ends(SingleRows(at.joint, at.first - 3, at.weights, nothing, nothing), duration)
    np.testing.assert_allclose(single.by_time * longer, at.values(later) - at.values(now), atol=1e-9)
    where = between.postures(np.array([0.01, 0.5, 0.98]))
    own = where.weights[:, :, None] * np.arange(1.0, 8.0)
    whole = between.with_ends(WholeRows(where.first - 3, own, np.zeros(3), np.zeros(3), np.ones(3)), duration)
    moved = (where.values(later) - where.values(now)) @ np.arange(1.0, 8.0)
    np.testing.assert_allclose(whole.by_time * longer, moved, atol=1e-9)


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
    rates = np.array([[LEAVING, 0.0 * SPEEDING], [ARRIVING, SLOWING]])
    found = best(Deviations(START, GOAL, slow, rates=rates), replace(robot_of("upright"), self_collision=False))
    assert found.duration == pytest.approx(least(slow, rates).duration, rel=2e-5)


def test_past_a_wall_little_jerk_costs_little_time() -> None:
    slow = replace(limits(), jerk=(100.0,) * 7)
    between = Deviations(START, GOAL, slow, rates=RATES)
    assert best(between, robot_of("upright"), (WALL,)).duration <= 1.5 * between.direct.duration


VIAS = [
    pytest.param(tp.Joints(tuple(ASIDE - LOW)), id="joints", marks=pytest.mark.slow),
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


@pytest.mark.slow
def test_the_last_correction_of_a_via_breaks_no_limit_that_time_could_not_mend() -> None:
    posts = Box(center=(0.55, 0.35, 0.4), size=(0.3, 0.1, 0.8)), Box(center=(0.5, -0.4, 0.3), size=(0.4, 0.1, 0.6))
    plan = tp.plan(
        tp.robot("panda"), start=[-2.63, 0.69, -0.7, -2.72, 0.9, 3.41, -1.64], via=[tp.Position((-0.66, 0.11, 0.94))],
        goal=[-0.59, -0.07, -1.98, -1.01, -1.16, 3.19, -1.26], obstacles=posts,
        start_velocity=[0.37, -0.43, 0.32, -0.29, 0.12, 0.23, 0.01],
        goal_velocity=[0.37, -0.33, -0.14, 0.31, 0.34, -0.36, -0.24],
    )  # fmt: skip
    assert plan.certified and plan.result.evaluations == 0


@pytest.mark.parametrize("keys", [{"total_time": (3.0, 4.0)}, {"start_velocity": LEAVING}])
@pytest.mark.slow
def test_no_search_is_needed(keys: dict[str, tuple[float, ...]]) -> None:
    plan = tp.plan(tp.robot("panda"), start=START - LOW, goal=GOAL - LOW, obstacles=[WALL], **keys)
    assert plan.certified
    assert plan.result.evaluations == 0
    assert "total_time" not in keys or 3.0 <= plan.duration <= 3.0 + 1e-6


def planned(robot: tp.StatedRobot, **keys: Any) -> tp.Plan:
    (start_velocity, start_acceleration), (goal_velocity, goal_acceleration) = RATES
    return tp.plan(
        robot, start=START - LOW, goal=GOAL - LOW, start_velocity=start_velocity, goal_velocity=goal_velocity,
        start_acceleration=start_acceleration, goal_acceleration=goal_acceleration, **keys,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("keys", "longest"),
    slow_except([({}, 1.0 + 1e-9), ({"via": [tp.Joints(tuple(ASIDE - LOW))]}, 1.5), ({"obstacles": [WALL]}, 1.5),
                 ({"obstacles": [WALL], "via": [tp.Joints(tuple(ASIDE - LOW))]}, 1.5)], 2),
)  # fmt: skip
def test_a_move_between_accelerations_needs_no_search(keys: dict[str, Any], longest: float, tmp_path: Path) -> None:
    plan, fastest = planned(tp.robot("panda"), **keys), least(built_in("panda").arm().limits).duration
    assert plan.certified and plan.result.evaluations == 0
    ends = plan.trajectory.breakpoints[[0, -1]]
    np.testing.assert_allclose(plan.trajectory.at(ends, 2), RATES[:, 1], atol=1e-7)
    assert fastest * (1.0 - 1e-9) <= plan.duration <= longest * fastest
    content = json.loads(plan.certificate(tmp_path / "certificate.json").read_text())
    assert not any("acceleration" in each for each in content["stages"][0]["not_covered"])


def test_accelerations_past_a_via_are_refused_where_no_direct_plan_has_them() -> None:
    via = [tp.Joints(tuple(ASIDE - LOW))]
    with pytest.raises(tp.ScenarioError, match=r"start_acceleration: past vias solver 'direct' alone keeps it"):
        planned(tp.robot("panda"), via=via, solver="bso")
    ends = {name: {"joints": [angle, 0.1]} for name, angle in (("start", 0.0), ("goal", 1.0))}
    arm = ends | {"via": [tp.Joints((0.5, 0.1))], "goal_acceleration": (1.0, 0.0)}
    with pytest.raises(tp.ScenarioError, match="goal_acceleration: past a via it needs a limit of jerk"):
        tp.plan(tp.robot([0.5, 0.5], max_speed=1.0, max_acceleration=5.0), **arm)
