"""Joint values in the nearest turns: of joints without ends by default, of others where a place says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers.running import line_of
from hypothesis import given
from hypothesis import strategies as st

import tpbso_casadi as tp
from problems.tasks import Joints, Place, Position, ShortTurns
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
        plans[turns] = tp.plan(f"{turns}.toml")
        plans[turns].save(turns, figures=())
        assert tp.audit(turns).certified
    ends = [np.degrees(plan.trajectory.at(plan.trajectory.breakpoints[[-1]])[0, 0]) for plan in plans.values()]
    np.testing.assert_allclose(ends, [190.0, -170.0], atol=1e-9)
    assert plans["nearest"].duration == pytest.approx(0.4, rel=1e-6)  # 2 sqrt(20 / 500)
    assert plans["nearest"].motion.criteria.task.notes and not plans["exact"].motion.criteria.task.notes
    moved = tp.plan(tp.Move(FREE, Joints((3.0, 0.5)), (Joints((-3.0, 0.5)),)))
    assert moved.motion.criteria.task.notes


def test_values_in_a_sequence_are_those_that_are_stated() -> None:
    goal = {"joints": [0.1, 0.1], "turns": "nearest"}
    task = {"kind": "sequence", "start": {"joints": [0.0, 0.0]}, "stages": [{"kind": "move", "goal": goal}]}
    arm = {"link_lengths": [0.5, 0.5], "max_speed": 2.0, "max_acceleration": 10.0}
    line = line_of(lambda: parse_scenario({"arm": arm, "task": task}))
    assert line.endswith("in a sequence joints have the values that are stated; leave turns out"), line
