"""Cells of robots planned by their names: goals, arms that stay, parts, files, exports, refusals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of, status

import tpbso_casadi as tp
from problems.certify import check_certificate as checker
from tpbso_casadi.cli.commands.audit import main as audit
from tpbso_casadi.cli.commands.solve import main as solve

HOME = [1.2, -1.6, 1.9, -1.87, -1.57, 0.0]
ASIDE = [2.2, -1.3, 1.7, -1.9, -1.57, 0.0]
RIGHT_BASE = {"position": [0.9, 0.0, 0.0], "quaternion": [0.0, 0.0, 1.0, 0.0]}
HALF_TURN = (1.0, 0.0, 0.0, 0.0)
START = {"left": HOME, "right": HOME}


@pytest.fixture(scope="module")
def cell() -> tp.StatedRobot:
    return tp.cell({"left": tp.robot("ur5e"), "right": tp.robot("ur5e", base=RIGHT_BASE)})


def test_both_arms_reach_poses_and_the_file_is_checked(cell: tp.StatedRobot, tmp_path: Path) -> None:
    goal = {"left": tp.Pose((0.35, 0.3, 0.3), HALF_TURN), "right": tp.Pose((0.55, -0.3, 0.3), HALF_TURN)}
    plan = tp.plan(cell, start=START, goal=goal)
    assert plan.certified and plan.trajectory(0.0).shape == (12,)
    arms, end = plan.motion.criteria.robot.at_tips, plan.trajectory(plan.duration)[None]
    for name, place in goal.items():
        np.testing.assert_allclose(arms[name].tool.at(end)[0][0], place.point, atol=1e-8)
    content = checker.read(plan.certificate(tmp_path / "c.json"))
    assert [place["carrier"] for place in content["stages"][0]["places"]] == [5] * 1 + [11] * 1
    checker.check(content)
    run = tp.read_run(plan.save(tmp_path / "run", figures=()))
    assert run.certified and run.duration == plan.duration
    left = plan.part("left")
    assert left.joints[0] == "shoulder_pan_joint"
    np.testing.assert_array_equal(left.trajectory(0.3), plan.trajectory(0.3)[:6])


def test_an_arm_that_is_not_named_comes_back_to_its_start(cell: tp.StatedRobot) -> None:
    plan = tp.plan(cell, start=START, goal={"left": ASIDE})
    np.testing.assert_allclose(plan.trajectory(plan.duration), [*ASIDE, *HOME], atol=1e-9)


def test_an_arm_that_stays_is_no_part_of_the_motion(cell: tp.StatedRobot, tmp_path: Path) -> None:
    plan = tp.plan(cell, start=START, goal={"left": ASIDE, "right": "stay"})
    assert plan.certified and plan.trajectory(0.0).shape == (6,)
    part = plan.part("right")
    assert not part.trajectory.moves and part.trajectory.duration == plan.duration
    np.testing.assert_array_equal(part.trajectory(0.1), HOME)
    assert repr(part).startswith("<arm 'right' of a plan: stands still")
    assert tp.read_run(plan.save(tmp_path / "run", figures=())).part("right").joints == part.joints
    in_the_way = {"left": [0.0, -1.2, 1.2, -1.57, -1.57, 0.0], "right": [0.0, -1.2, 1.2, -1.57, -1.57, 0.0]}
    line = line_of(lambda: tp.plan(cell, start=in_the_way, goal={"left": ASIDE, "right": "stay"}))
    assert "right/forearm_link" in line and "left/forearm_link" in line


def test_an_arm_that_stays_is_clear_of_obstacles(cell: tp.StatedRobot) -> None:
    wall = tp.Box(center=(1.2, 0.0, 0.3), size=(0.2, 2.0, 0.6), name="wall")  # the right arm leans into it
    back = [2.6, -1.6, 1.9, -1.87, -1.57, 0.0]
    start = {"left": HOME, "right": back}
    line = line_of(lambda: tp.plan(cell, start=start, goal={"left": ASIDE, "right": "stay"}, obstacles=[wall]))
    assert line.startswith("robots.right.stays_at: ") and "wall" in line and "clearance" in line
    links = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
    allowed = [(f"right/{link}_link", "wall") for link in links]
    goal = {"left": ASIDE, "right": "stay"}
    assert tp.plan(cell, start=start, goal=goal, obstacles=[wall], may_touch=allowed).certified


def test_messages_by_arm_with_what_a_late_start_costs(cell: tp.StatedRobot, tmp_path: Path) -> None:
    plan = tp.plan(cell, start=START, goal={"left": ASIDE, "right": ASIDE})
    plan.save(tmp_path / "run", export=["ros-json"], figures=())
    whole, left, right = (
        json.loads((tmp_path / "run" / f"joint_trajectory{part}.json").read_text()) for part in ("", "_left", "_right")
    )
    assert left["joint_names"] == right["joint_names"] == [name[5:] for name in whole["joint_names"][:6]]
    for row, one, other in zip(whole["points"], left["points"], right["points"], strict=True):
        assert row["positions"] == one["positions"] + other["positions"]
        assert row["time_from_start"] == one["time_from_start"] == other["time_from_start"]
    (line,) = [line for line in plan.program("ros-yaml").assumptions if "late" in line]
    fastest = np.abs(plan.trajectory(plan.trajectory.times(500), 1)).max()
    assert f"1 ms late is up to {1e-3 * fastest:.2g} rad" in line


SCENARIO = """
[robots.left]
model = "ur5e"
[robots.right]
model = "ur5e"
base = { position = [0.9, 0.0, 0.0], quaternion = [0.0, 0.0, 1.0, 0.0] }
[task]
kind = "point-to-point"
goal = { left = { position = [0.35, 0.3, 0.3] }, right = "stay" }
[task.start]
left = { joints = [1.2, -1.6, 1.9, -1.87, -1.57, 0.0] }
right = { joints = [1.2, -1.6, 1.9, -1.87, -1.57, 0.0] }
[[carried]]
arm = "left"
shape = "box"
size = [0.05, 0.05, 0.1]
center = [0.0, 0.0, 0.06]
mass = 0.5
"""


def test_a_scenario_file_of_a_cell(in_an_empty_folder: None, capsys: pytest.CaptureFixture[str]) -> None:
    Path("cell.toml").write_text(SCENARIO)
    assert status(solve, "cell.toml", "--out", "run", "--no-plots") == 0
    assert "left/wrist_3_link" in capsys.readouterr().out
    plan = tp.read_run("run")
    robot = plan.motion.criteria.robot
    assert robot.carried == ("carried",)
    assert plan.scenario.robots is not None and plan.scenario.robots.robots["right"].stays_at == HOME
    assert status(audit, "run") == 0


@pytest.mark.parametrize(
    ("before", "after", "line"),
    [
        ("[robots.right]", '[robots."right/hand"]', "robots.right/hand: a name without '/' is needed"),
        ('model = "ur5e"\nbase', 'model = "ur6"\nbase', "robots.right.model: 'ur6' is not built in"),
        (
            'model = "ur5e"\nbase',
            'model = "ur5e"\ntips = { a = "b" }\nbase',
            "robots.right.tips: a robot of a cell has one tool",
        ),
        ('model = "ur5e"\nbase', 'urdf = "none.urdf"\nbase', "robots.right.urdf: none.urdf: "),
        ('model = "ur5e"\nbase', 'model = "ur5e"\nmax_speed = [1.0]\nbase', "robots.right.max_speed: 1 values"),
        ("[robots.left]", '[robot]\nmodel = "panda"\n[robots.left]', "robots: the robot is stated twice, as [robot]"),
        ('arm = "left"', 'arm = "middle"', "carried.0.arm: no arm is called 'middle'; there are left, right"),
        ('right = "stay" }', 'middle = "stay" }', "task.goal: no arm is called 'middle'; there are left, right"),
        ('right = "stay" }', 'right = "home" }', "task.goal.right: no posture 'home'"),
        ("left = { joints = [1.2,", "left = { joints = [9.9,", "task.start: "),
        (
            "right = { joints = [1.2, -1.6, 1.9, -1.87, -1.57, 0.0] }",
            "",
            "task.start: right is to stay: state its joints",
        ),
    ],
)
def test_a_wrong_cell_gets_one_line(in_an_empty_folder: None, before: str, after: str, line: str) -> None:
    assert before in SCENARIO
    Path("cell.toml").write_text(SCENARIO.replace(before, after))
    assert line in line_of(lambda: tp.read_scenario("cell.toml").problem())


@pytest.mark.parametrize(
    ("goal", "line"),
    [
        ({"left": HOME[:5]}, "goal.left: 5 joints for an arm of 6"),
        ({"left": "home"}, "goal.left: no posture 'home'"),
        ({"left": {"joints": HOME, "within": 0.1}}, "goal.left: within and cost are of all arms together"),
        ({"left": 3.0}, "goal.left: 3.0 is no place"),
        ([{"left": ASIDE, "right": "stay"}, {"left": HOME}], "goal: all goals have to let the same arms stay"),
    ],
)
def test_a_goal_by_arm_that_is_none(cell: tp.StatedRobot, goal: Any, line: str) -> None:
    assert line_of(lambda: tp.plan(cell, start=START, goal=goal)).startswith(line)


def test_a_stage_to_too_few_joints_gets_one_line(cell: tp.StatedRobot) -> None:
    stages = [tp.MoveTo({"left": ASIDE}), tp.MoveTo({"left": HOME[:5]})]
    assert line_of(lambda: tp.sequence(cell, start=START, stages=stages)).startswith(
        "stages[1] goal.left: 5 joints for an arm of 6"
    )


def test_what_is_no_cell(cell: tp.StatedRobot) -> None:
    with pytest.raises(TypeError, match="robots: a dict of robots by their names is needed"):
        tp.cell([tp.robot("ur5e")])  # type: ignore[arg-type]
    assert "robots.left: a robot in space is needed" in line_of(
        lambda: tp.cell({"left": tp.robot([0.5, 0.5], max_speed=1.0, max_acceleration=1.0)})
    )
    plan = tp.plan(cell, start=START, goal={"left": ASIDE, "right": "stay"})
    with pytest.raises(ValueError, match="arm: none is called 'middle'; there are left, right"):
        plan.part("middle")
    with pytest.raises(ValueError, match="one arm alone, which has no name"):
        tp.plan("time-2", evaluations=20, polish=False).part("left")
