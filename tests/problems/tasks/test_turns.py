"""Joint values in the nearest turns: of joints without ends by default, of others where a place says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tpbso_casadi as tp
from problems.tasks import Joints, Place, Position, ShortTurns
from tpbso_casadi.replanning import Replanner
from tpbso_casadi.scenario import parse_scenario

TURN = 2.0 * np.pi
FREE = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0))
BOUNDED = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0), joint_limits=((-TURN, TURN), (-3.0, 3.0)))


def reached(robot: tp.Robot, start: Place, *goals: Place) -> tuple[list[tuple[float, ...]], list[str]]:
    turns = ShortTurns(robot, start)
    return [goal.values for goal in turns.reached(goals) if isinstance(goal, Joints)], turns.notes


def test_joints_without_ends_go_the_short_way() -> None:
    assert FREE.endless == (True, True) and BOUNDED.endless == (False, False)
    (values,), (note,) = reached(FREE, Joints((3.0, 0.5)), Joints((-3.0, 0.5)))
    assert values == (-3.0 + TURN, 0.5)
    assert note == "goal: joint 1 at 3.283 rad, the short way; turns = 'exact' keeps the stated values"
    assert reached(FREE, Joints((3.0, 0.5)), Joints((-3.0, 0.5), turns="exact")) == ([(-3.0, 0.5)], [])
    assert reached(FREE, Position((0.5, 0.5)), Joints((9.0, 0.5))) == ([(9.0, 0.5)], [])


def test_joints_with_ends_are_where_they_are_stated_unless_it_says_nearest() -> None:
    start, goal = Joints((3.0, 0.5)), (-3.0, 0.5)
    (values,), (note,) = reached(BOUNDED, start, Joints(goal))
    assert values == goal
    assert note == "goal: the same posture is nearer with joint 1 at 3.283 rad; turns = 'nearest' takes it"
    goals = (Joints(goal, turns="nearest"), Joints((-0.1, 2.0), turns="nearest"))
    found, notes = reached(BOUNDED, start, *goals)
    assert found == [(-3.0 + TURN, 0.5), (-0.1, 2.0)]
    assert [note[:8] for note in notes] == ["goal[0]:"]


@given(st.floats(-6.0, 6.0), st.floats(-6.2, 6.2))
def test_no_turn_within_the_range_is_nearer(before: float, stated: float) -> None:
    (values,), _ = reached(BOUNDED, Joints((before, 0.0)), Joints((stated, 0.0), turns="nearest"))
    others = [stated + turn * TURN for turn in (-2, -1, 0, 1, 2) if abs(stated + turn * TURN) <= TURN]
    assert abs(values[0] - before) <= min(abs(other - before) for other in others) + 1e-12
    assert abs(values[0]) <= TURN


def test_vias_are_taken_from_the_posture_before() -> None:
    turns = ShortTurns(FREE, Joints((3.0, 0.0)))
    vias = turns.passed([Joints((-2.5, 0.0), 0.1), Position((0.5, 0.5)), Joints((-1.0, 0.0))])
    (goal,) = turns.reached([Joints((0.0, 0.0))])
    assert [via.values for via in vias if isinstance(via, Joints)] == [(-2.5 + TURN, 0.0), (-1.0 + TURN, 0.0)]
    assert vias[0].within == 0.1 and isinstance(goal, Joints) and goal.values == (TURN, 0.0)
    assert [note[:7] for note in turns.notes] == ["via[0]:", "via[2]:", "goal: j"]


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_plan_takes_them_says_so_and_is_audited() -> None:
    arm = 'unit = "deg"\n[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 100\nmax_acceleration = 500\n'
    task = '[task]\nkind = "point-to-point"\nstart = {{ joints = [170, 30] }}\ngoal = {{ joints = [-170, 30]{} }}\n'
    plans = {}
    for turns in ("nearest", "exact"):
        Path(f"{turns}.toml").write_text(arm + task.format("" if turns == "nearest" else ', turns = "exact"'))
        plans[turns] = tp.plan(f"{turns}.toml", solver="direct")
        plans[turns].save(turns, figures=())
        assert tp.audit(turns).certified
    ends = [np.degrees(plan.trajectory.at(plan.trajectory.breakpoints[[-1]])[0, 0]) for plan in plans.values()]
    np.testing.assert_allclose(ends, [190.0, -170.0], atol=1e-9)
    assert plans["nearest"].duration == pytest.approx(0.4, rel=1e-6)  # 2 sqrt(20 / 500)
    assert plans["nearest"].motion.criteria.task.notes and not plans["exact"].motion.criteria.task.notes
    moved = tp.plan(tp.Move(FREE, Joints((3.0, 0.5)), (Joints((-3.0, 0.5)),)), solver="direct")
    assert moved.motion.criteria.task.notes


def test_stages_go_the_short_way_and_a_cycle_ends_in_its_turns(tmp_path: Path) -> None:
    start, there = Joints((3.0, 0.5)), Joints((-3.0, 0.5))
    plan = tp.sequence(FREE, start=start, stages=[there, Joints((-2.8, 0.7)), start], solver="direct")
    ends = [float(plan.trajectory(stage.end)[0]) for stage in plan.stages]
    assert plan.certified
    np.testing.assert_allclose(ends, [-3.0 + TURN, -2.8 + TURN, 3.0], atol=1e-9)
    notes = plan.motion.criteria.task.notes
    assert [note[:28] for note in notes] == ["stage 1 (move): goal: joint ", "stage 2 (move): goal: joint "]
    assert tp.read_run(plan.save(tmp_path / "run", figures=())).certified
    exact = tp.sequence(FREE, start=start, stages=[Joints((-3.0, 0.5), turns="exact")], solver="direct")
    assert exact.trajectory(exact.duration)[0] == pytest.approx(-3.0)
    cycle = tp.sequence(
        FREE, start=start, stages=[Joints((0.5, 0.5)), Joints((-2.0, 0.5)), start], cyclic=True, solver="direct"
    )
    assert cycle.trajectory(cycle.duration)[0] == pytest.approx(3.0)
    free = tp.sequence(FREE, start=start, stages=[there, Joints((2.0, 0.5))], order="free", solver="direct")
    assert free.certified and free.trajectory(free.stages[-1].end)[0] == pytest.approx(-3.0)


def test_a_point_is_reached_in_a_near_turn() -> None:
    """From 3.0 rad its two postures lie beyond half a turn, or before it; joints after them keep that turn."""
    point = FREE.skeleton(np.array([[3.4, 0.1]]))[0, -1]
    plan = tp.sequence(
        FREE,
        start=Joints((3.0, 0.5)),
        stages=[tp.Position(tuple(point.tolist())), Joints((-2.9, 0.3))],
        solver="direct",
    )
    assert plan.certified and plan.duration < 1.0
    theta = plan.trajectory.at(plan.times)[:, 0]
    assert theta.min() > 2.5 and theta.max() < 4.0


def test_a_replan_goes_the_short_way() -> None:
    task = {"kind": "point-to-point", "start": {"joints": [3.0, 0.5]}, "goal": {"joints": [3.1, 0.5]}}
    arm = {"link_lengths": [0.5, 0.5], "max_speed": [2.0, 2.0], "max_acceleration": [10.0, 10.0]}
    replanner = Replanner(parse_scenario({"arm": arm, "task": task}), evaluations=20)
    step = replanner.replan(replanner.first().trajectory, [], Joints((-3.0, 0.5)))
    assert step.trajectory.value_at_end()[0] == pytest.approx(-3.0 + TURN)
