"""``tp.retime``: paths of every kind as plans in the least time; ``tp.replan`` of plans, with scenes of every form."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.cli.commands import retime as command

ROWS = np.array([[0.0, 0.5], [0.6, 0.9], [1.0, 0.2], [1.5, 0.4]])
SPEED, ACCELERATION = (2.0, 3.0), (10.0, 8.0)
ARM = tp.PlanarArm((0.5, 0.5), SPEED, ACCELERATION)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    np.savetxt("path.csv", ROWS, delimiter=",", header="q1,q2", comments="")
    return tmp_path


def test_rows_a_file_and_a_path_are_the_same() -> None:
    paths: list[Any] = [ROWS, ROWS.tolist(), tp.JointPath.through(ROWS), "path.csv", Path("path.csv")]
    plans = [tp.retime(path, ARM) for path in paths]
    for plan in plans:
        assert plan.certified
        assert plan.duration == pytest.approx(plans[0].duration, rel=1e-9)
    times = np.linspace(0.0, plans[0].duration, 20_001)  # the limits, independently
    assert (np.abs(plans[0].trajectory.at(times, 1)) <= np.array(SPEED) * (1.0 + 1e-9)).all()
    assert (np.abs(plans[0].trajectory.at(times, 2)) <= np.array(ACCELERATION) * (1.0 + 1e-9)).all()
    for row in ROWS:
        assert np.abs(plans[0].trajectory.at(times) - row).max(axis=1).min() < 1e-3


def test_a_blend_leaves_the_lines_by_its_tolerance_at_most() -> None:
    plan = tp.retime(ROWS, ARM, interpolation="blend", tolerance=0.05)
    theta, away = plan.trajectory.at(np.linspace(0.0, plan.duration, 5001)), []
    for a, b in pairwise(ROWS):
        share = np.clip((theta - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        away.append(np.abs(theta - (a + share[:, None] * (b - a))).max(axis=1))
    assert 0.01 < np.min(away, axis=0).max() <= 0.05 + 1e-9
    stops = tp.retime(ROWS, ARM, interpolation="blend", tolerance=0.0)
    assert stops.certified and plan.duration < stops.duration
    lines = next(verdict for verdict in plan.verdicts if verdict.name == "lines")
    assert 0.0 < lines.worst <= lines.bound == pytest.approx(0.05, rel=1e-6)


def test_a_plan_brings_its_robot_along() -> None:
    plan = tp.plan("time-3", solver="pso", evaluations=200, polish=False, retime=False)
    own = tp.retime(plan)
    assert own.duration < plan.duration
    assert own.motion.criteria.robot == plan.motion.criteria.robot
    plan.save("run", figures=())
    assert tp.retime("run").duration == pytest.approx(own.duration, rel=1e-12)
    faster = tp.robot([2.0 / 3.0] * 3, max_speed=8.0, max_acceleration=80.0)  # rates twice, their changes four times
    assert tp.retime("run", faster).duration == pytest.approx(own.duration / 2.0, rel=1e-6)


def test_a_plan_brings_its_obstacles_along() -> None:
    far = tp.Rectangle((0.9, -0.9), (0.1, 0.1))
    plan = tp.plan("time-2", obstacles=[far], solver="pso", evaluations=100, polish=False, retime=False)
    assert tp.retime(plan).motion.criteria.obstacles == (far,)
    assert tp.retime(plan, obstacles=[]).motion.criteria.obstacles == ()


def test_a_run_of_a_given_path_is_retimed_on_the_path_that_was_given() -> None:
    arm = tp.PlanarArm((0.5, 0.5), SPEED, ACCELERATION, max_jerk=(100.0, 100.0))
    tp.retime(ROWS[:3], arm).save("run", figures=())
    tp.retime("run").save("again", figures=())
    solution = tp.read_run("run").result.solution
    assert tp.read_run("again").result.solution == solution
    moving = tp.retime("run", start_speed=0.2)  # the run is at rest at its ends
    assert np.linalg.norm(moving.trajectory(0.0, 1)) == pytest.approx(0.2, abs=1e-9)
    assert tp.retime(ROWS, arm, goal_speed=0.3).certified  # a limit of jerk, and a curved path


def test_what_is_asked_besides_is_kept() -> None:
    moving = tp.retime(ROWS, ARM, start_speed=0.5, total_time=(0.1, 9.0), margin=0.01)
    assert np.linalg.norm(moving.trajectory(0.0, 1)) == pytest.approx(0.5, rel=1e-9)
    assert moving.motion.criteria.robot.margin == 0.01
    assert any(verdict.name == "total time" for verdict in moving.verdicts)
    wall = tp.retime(ROWS, ARM, obstacles=[tp.Rectangle((0.6, 0.6), (0.2, 0.2))])
    assert not wall.certified
    assert "clearance" in {verdict.name for verdict in wall.verdicts if not verdict.satisfied}


REPLANNED = tp.robot([0.7, 0.6], max_speed=2.0, max_acceleration=8.0)
START, GOAL = tp.Joints((0.0, 0.5)), tp.Joints((1.5, 0.3))


@cache
def planned() -> tp.Plan:
    return tp.plan(REPLANNED, start=START, goal=GOAL, solver="pso", evaluations=100, polish=False)


def test_a_plan_goes_on_where_nothing_has_changed() -> None:
    plan = planned()
    for scene in ([], plan, plan.scenario):
        step = tp.replan(plan, 0.2, scene)
        assert step.certified
        assert step.trajectory.duration == pytest.approx(plan.duration - 0.2, abs=1e-6)
        np.testing.assert_allclose(step.trajectory(0.0), plan.trajectory(0.2), atol=1e-12)
    assert tp.replan(plan.trajectory, 0.2, plan).certified


def test_a_wall_in_the_way_is_not_touched() -> None:
    wall = (tp.Rectangle(center, (0.05, 0.05)) for center in [(0.85, 0.85)])
    step = tp.replan(planned(), 0.1, wall)
    assert step.certified
    assert step.kind in {"new", "stop"}
    joints = REPLANNED.model.skeleton(step.trajectory.at(step.trajectory.times(500)))
    assert np.abs(joints - [0.85, 0.85]).max(axis=2).min() > 0.025  # no joint enters it


def test_a_file_states_the_robot_as_for_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.toml").write_text(
        'unit = "deg"\n[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 100.0\nmax_acceleration = 500.0\n'
        "[[obstacles]]\ncenter = [5.0, 5.0]\nsemi_axes = [0.1, 0.1]\n"
        '[[obstacles]]\nshape = "box"\ncenter = [0.0, 0.0]\nsize = [0.3, 0.2]\nmotion = "cart.csv"\n'
        "[model]\nmargin = 0.02\nretime = false\n"
    )
    Path("cart.csv").write_text("t,x,y\n0,4,4\n1,4,5\n")
    Path("path.csv").write_text("q1,q2\n0,0\n30,20\n10,60\n")
    options = ["path.csv", "--robot", "arm.toml", "--blend", "2", "--start-speed", "5", "--quiet", "--no-plots"]
    assert command.main([*options, "--out", "run"]) == 0
    plan = tp.retime("path.csv", "arm.toml", interpolation="blend", tolerance=2.0, start_speed=5.0)
    assert plan.certified and plan.scenario == tp.read_run("run").scenario and plan.scenario.model.margin == 0.02
    assert [len(obstacle.motion_rows or ()) for obstacle in plan.scenario.obstacles] == [0, 2]
    ends = plan.trajectory.at(np.array([0.0, plan.duration]))
    np.testing.assert_allclose(ends, np.radians([[0.0, 0.0], [10.0, 60.0]]), atol=1e-9)
    Path("task.toml").write_text(Path("arm.toml").read_text() + '[task]\nkind = "joint-path"\njoints = "path.csv"\n')
    stated = tp.plan("task.toml").trajectory
    np.testing.assert_allclose(stated.at(stated.breakpoints[[0, -1]]), ends, atol=1e-9)
    again = tp.retime(plan, tp.robot([0.5, 0.5], max_speed=1.0, max_acceleration=5.0))  # at rest at its ends
    assert again.certified and (again.scenario.task.start_speed, len(again.scenario.obstacles)) == (0.0, 2)
