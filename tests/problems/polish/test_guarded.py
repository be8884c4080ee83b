"""The fastest motions past places and obstacles near a draft."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import robot_of
from helpers.polish_objective import ASIDE, GOAL, START, WALL, polish_objective

import tpbso_casadi as tp
from problems.core import CompiledWorld, Guards, SegmentMotion, found_core
from problems.families.splines import direct
from problems.limits import ToolSpeed, TorqueLimit
from problems.motions import Trajectory
from problems.polish import DEFAULT_GUARDED, Deviations, Draft, PathRefinement, fastest_guarded, joint_box
from problems.polish.guarded import GuardedMotion, GuardedPassing, SegmentSamples
from problems.robots import JointLimits, built_in
from problems.timing import Passing, fastest_through, rest_to_rest
from solvers import StopReason
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario

ARM = robot_of("upright")
THROUGH = DEFAULT_GUARDED.through
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


def test_the_fastest_motion_near_a_known_one_is_clear_and_no_slower(around: tuple[CompiledWorld, Trajectory]) -> None:
    world, known = around
    ends = np.array([0.0, known.duration])
    free = fastest_through(known.at(ends), ARM.limits)
    assert free is not None and world.prove(free).status is False
    found = fastest_guarded(Draft.of_motion(known, ends), ARM.limits, world)
    assert found is not None and world.prove(found).status
    assert free.duration < found.duration < 1.002 * known.duration / 1.3
    np.testing.assert_allclose(found.at(np.array([0.0, found.duration])), [START, GOAL], atol=1e-9)


def test_a_path_past_a_wall_leads_to_much_the_same_motion(around: tuple[CompiledWorld, Trajectory]) -> None:
    world, known = around
    path = world.connect(START, GOAL, joint_box(ARM, START, GOAL), 1)
    assert path is not None
    found = fastest_guarded(Draft.along([path], ARM.limits), ARM.limits, world)
    assert found is not None and world.prove(found).status and found.duration < 1.1 * known.duration / 1.3


def test_a_draft_is_given_up_that_cannot_come_clear(around: tuple[CompiledWorld, Trajectory]) -> None:
    world, _ = around
    through = rest_to_rest(START, GOAL, ARM.limits)
    narrow = replace(DEFAULT_GUARDED, radius=2e-3, programs=2)
    draft = Draft.of_motion(through, np.array([0.0, through.duration]))
    assert fastest_guarded(draft, ARM.limits, world, settings=narrow) is None


@pytest.mark.parametrize("with_jerk", [True, False])
def test_guards_are_what_is_exceeded_to_the_first_order(with_jerk: bool) -> None:
    """Against differences: of distances, torques and an expression, by control points and durations."""
    arm, rng = built_in("panda").arm(), np.random.default_rng(3)
    limits = arm.limits if with_jerk else replace(arm.limits, jerk=None)
    world = CompiledWorld.of(arm, (WALL,))
    assert world is not None
    postures = AHEAD + 0.3 * rng.uniform(-1.0, 1.0, (3, 7))
    free = fastest_through(postures, limits)
    assert free is not None
    cells = (free.breakpoints.size - 1) // 2
    draft, passing = Draft.of_motion(free, free.breakpoints[::cells]), Passing.of(postures, limits, None, THROUGH)
    search = GuardedPassing(
        passing.postures, limits, passing.ends, THROUGH, range_share=1.0, draft=draft, world=world,
        own_limits=(TorqueLimit(arm), ToolSpeed(max=0.5).for_robot(arm, ())), most_margin=1e-3,
        guarded=replace(DEFAULT_GUARDED, programs=1),
    )  # fmt: skip
    grid, motion = search._begun()
    search = replace(search, guarded=replace(DEFAULT_GUARDED, reach=2.0, near=9.0, most_guards=10_000))
    before = GuardedMotion(search, motion, SegmentSamples.of(grid, 2))
    change = SegmentMotion(*(1e-6 * rng.normal(size=part.shape) for part in motion))
    after = replace(before, motion=SegmentMotion(*(a + b for a, b in zip(motion, change, strict=True))))
    moved = search.points(grid, after.motion) - search.points(grid, motion)
    for one, other in zip(before._excesses, after._excesses, strict=True):
        guards, order = before._guards(one, 1e3), np.argsort(-one.value, kind="stable")
        touched = moved[guards.segments[:, None], guards.first[:, None] + np.arange(grid.degree + 1)]
        foretold = np.einsum("nak,nak->n", guards.slopes, touched)
        foretold += guards.by_log_duration * (change.durations / motion.durations)[guards.segments]
        assert guards.least.size == order.size > 20
        found = one.value[order] - other.value[order]
        assert np.median(np.abs(found - foretold)) < 1e-3 * np.median(np.abs(found))


def test_a_guard_of_one_joint_is_its_range() -> None:
    """The core's rows of all joints against its rows of one, which no code of theirs is shared with."""
    postures = np.array([[0.0, 0.0], [1.0, 0.5], [0.9, 2.5]])
    limits = JointLimits(speed=(1.0, 1.5), acceleration=(3.0, 4.0), jerk=(20.0, 30.0))
    most, core = 1.01, found_core()
    assert core is not None
    free = Passing.of(postures, limits, None, THROUGH)
    ranged = replace(free, limits=replace(limits, position=((-most, most), (-9.0, 9.0))), range_share=1.0)
    grid, start = free._begun()
    found, is_solved = ranged._solved(grid, start)
    weights, first = grid.at_angles()
    rows, d = first.size, free.degree
    slopes = np.zeros((2 * rows, d + 1, 2))
    slopes[:, :, 0] = -weights.reshape(-1, d + 1)
    segments = np.repeat([0, 1], rows)
    guards = Guards(segments, np.tile(first, 2), slopes, np.zeros(2 * rows), postures[segments, 0] - most)
    guarded, was_solved = core.pass_through(free._stops, grid.limited(THROUGH.speed_shares), guards, start)
    unbound = free._solved(grid, start)[0].durations.sum()
    assert is_solved and was_solved and found.durations.sum() > 1.001 * unbound
    np.testing.assert_allclose(guarded.durations, found.durations, rtol=2e-3)


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
