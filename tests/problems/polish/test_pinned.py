"""The fastest motions through a few postures of a known one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import robot_of
from helpers.polish_objective import ASIDE, GOAL, START, WALL, polish_objective

import tpbso_casadi as tp
from problems.core import CompiledWorld
from problems.families.splines import direct
from problems.motions import Trajectory
from problems.polish import Deviations, PathRefinement, fastest_pinned, joint_box
from problems.robots import JointLimits, built_in
from problems.timing import fastest_through, rest_to_rest
from solvers import StopReason
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario

ARM = robot_of("upright")
AHEAD = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])  # of a Panda, its tool in front of it
VIAS = [[0.3, 0.8], [-0.5, 1.2], [0.6, 0.4]]


@pytest.fixture(scope="module")
def around() -> tuple[CompiledWorld, Trajectory]:
    """A wall, and a polished motion around it."""
    world, between = CompiledWorld.of(ARM, (WALL,)), Deviations(START, GOAL, ARM.limits)
    assert world is not None
    objective, box = polish_objective(between, ARM), joint_box(ARM, START, GOAL)
    found = PathRefinement(world=world, motions=between, objective=objective, box=box).best_motion(1)
    assert found is not None
    return world, found.time_scaled(1.3)


def test_a_few_postures_lead_around_a_wall(around: tuple[CompiledWorld, Trajectory]) -> None:
    world, known = around
    ends = np.array([0.0, known.duration])
    free = fastest_through(known.at(ends), ARM.limits)
    assert free is not None and world.prove(free).status is False
    pinned = fastest_pinned(known, ends, ARM.limits, world)
    assert pinned is not None and world.prove(pinned).status
    assert free.duration < pinned.duration < known.duration
    np.testing.assert_allclose(pinned.at(np.array([0.0, pinned.duration])), [START, GOAL], atol=1e-9)


def test_nothing_is_found_that_is_no_faster(around: tuple[CompiledWorld, Trajectory]) -> None:
    world, known = around
    soon = known.time_scaled(0.1)  # breaks limits, so that no motion within them is as fast
    assert fastest_pinned(soon, np.array([0.0, soon.duration]), ARM.limits, world) is None


def test_nothing_is_found_where_the_known_motion_is_not_clear(around: tuple[CompiledWorld, Trajectory]) -> None:
    world, _ = around
    through = rest_to_rest(START, GOAL, ARM.limits).time_scaled(2.0)
    assert fastest_pinned(through, np.array([0.0, through.duration]), ARM.limits, world) is None


def test_a_plan_of_an_arm_in_the_plane_past_postures_is_the_fastest_motion() -> None:
    start, *vias, goal = ({"joints": each} for each in ([0.0, 0.5], *VIAS, [0.2, 0.9]))
    task = {"kind": "point-to-point", "start": start, "via": vias, "goal": goal}
    arm = {"link_lengths": [0.5, 0.4], "max_speed": 1.0, "max_acceleration": 2.0}
    found = plan(parse_scenario({"arm": arm, "task": task, "solver": {"name": "direct"}}))
    limits = JointLimits(speed=(1.0, 1.0), acceleration=(2.0, 2.0))
    least = fastest_through(np.array([[0.0, 0.5], *VIAS, [0.2, 0.9]]), limits)
    assert least is not None and found.motion.feasible and found.search.evaluations == 0
    assert found.search.stop_reason is StopReason.CONVERGED  # no bound: others may be faster
    assert found.motion.trajectory.duration == pytest.approx(least.duration, rel=1e-6)


def test_a_plan_of_an_arm_in_space_past_postures_is_the_fastest_motion() -> None:
    postures = AHEAD + 0.2 * np.array([START, ASIDE, GOAL])
    found = tp.plan(tp.robot("panda"), start=postures[0], goal=postures[2], via=[tp.Joints(tuple(postures[1]))])
    least = fastest_through(postures, built_in("panda").arm().limits)
    assert least is not None and found.certified and found.result.evaluations == 0
    assert found.duration == pytest.approx(least.duration, rel=1e-6)


def test_no_motion_is_planned_past_the_posture_at_which_both_ends_are() -> None:
    robot, there = tp.robot("panda"), tp.Joints(tuple(AHEAD))
    with pytest.raises(tp.ScenarioError, match="goal: the same posture as the start and the vias: there is nothing"):
        tp.plan(robot, start=AHEAD, goal=AHEAD, via=[there, there], solver="direct")


def test_a_plan_there_and_back_again_passes_the_posture_between() -> None:
    away = AHEAD + 0.2 * START
    found = tp.plan(tp.robot("panda"), start=AHEAD, goal=AHEAD, via=[tp.Joints(tuple(away))], solver="direct")
    assert found.certified and found.result.evaluations == 0


def test_a_plan_that_moves_away_and_returns_to_the_only_posture_is_certified() -> None:
    robot, there, velocity = tp.robot("panda"), tp.Joints(tuple(AHEAD)), 0.1 * START
    found = tp.plan(robot, start=AHEAD, goal=AHEAD, via=[there], start_velocity=velocity, solver="direct")
    assert found.certified


def test_where_no_fastest_motion_is_found_a_plan_is_timed_anew_along_its_path(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(direct, "fastest_through", lambda *_: None)
    goal = np.array([0.5, 0.3, -0.4, 0.2, 0.4, -0.3, 0.6])
    via = AHEAD + 0.5 * goal + 0.1 * np.array([0.5, -1.0, 1.0, 0.0, 0.5, 0.0, 1.0])
    vias = [tp.Joints(tuple(each)) for each in (via, via + 1e-5 * goal)]
    found = tp.plan(tp.robot("panda"), start=AHEAD, goal=AHEAD + goal, via=vias, solver="direct")
    assert found.certified and found.duration < 0.8  # s; 2.0 as the programs leave it


def test_a_plan_past_a_posture_between_moving_ends_is_the_fastest_motion() -> None:
    limits = built_in("panda").arm().limits
    postures, velocities = AHEAD + 0.2 * np.array([START, ASIDE, GOAL]), 0.1 * np.stack([START, GOAL])
    plan = tp.plan(
        tp.robot("panda"), start=postures[0], goal=postures[2], via=[tp.Joints(tuple(postures[1]))],
        start_velocity=velocities[0], goal_velocity=velocities[1],
    )  # fmt: skip
    rates = np.stack([velocities, 0.0 * velocities], axis=1)
    least = fastest_through(postures, replace(limits, position=None), rates)
    assert least is not None and plan.certified
    assert plan.duration == pytest.approx(least.duration, rel=1e-6)
