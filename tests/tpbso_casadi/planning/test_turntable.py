"""Paths in a frame that moves: a workpiece on a turntable, by other kinematics, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.core_robots import placed
from helpers.running import line_of

import tpbso_casadi as tp
from benchmarks.turntable import DOWN, HOME, PLACE, TABLE
from problems.robots import SpatialArm

START = {"table": [0.0], "arm": HOME}
FIRST = tp.MoveTo(tp.Pose((PLACE[0] + 0.12, PLACE[1], PLACE[2] + 0.06), DOWN), arm="arm")


@pytest.fixture
def cell(in_an_empty_folder: None) -> tp.StatedRobot:
    Path("table.urdf").write_text(TABLE)
    base = {"position": [*PLACE[:2].tolist(), 0.0]}
    table = tp.robot("table.urdf", tip_link="disc", max_acceleration=4.0, max_jerk=40.0, base=base)
    return tp.cell({"table": table, "arm": tp.robot("ur5e", max_jerk=60.0)})


def test_the_tool_goes_along_a_line_of_the_table_while_that_turns(cell: tp.StatedRobot, tmp_path: Path) -> None:
    line = tp.Line(goal=[0.0, 0.12, 0.06], arm="arm", frame="table", accuracy=0.002)
    plan = tp.sequence(cell, start=START, stages=[FIRST, line])
    assert plan.certified
    arm, way = plan.motion.criteria.robot, plan.stages[1].trajectory
    assert isinstance(arm, SpatialArm) and way is not None
    turns, places = placed(arm, way(np.linspace(0.0, way.duration, 500)))
    table, tip = (next(one for one in arm.chain.tips if one.name == name) for name in ("table", "arm"))
    tool = places[:, tip.body] + turns[:, tip.body] @ np.array(tip.frame.translation)
    seen = np.einsum("nji,nj->ni", turns[:, table.body], tool - places[:, table.body])
    ends = np.array([[0.12, 0.0, 0.06], [0.0, 0.12, 0.06]])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    off = seen - ends[0] - ((seen - ends[0]) @ along)[:, None] * along
    assert np.linalg.norm(off, axis=1).max() < 0.002 + 1e-9
    np.testing.assert_allclose(seen[[0, -1]], ends, atol=1e-6)
    assert np.ptp(way(np.linspace(0.0, way.duration, 50))[:, 0]) > 0.01  # the table takes part
    assert tp.read_run(plan.save(tmp_path / "run", figures=())).certified


@pytest.mark.parametrize(
    ("keys", "line"),
    [
        ({"frame": "arm"}, "stages[1] frame: the tool itself does not move in its own frame"),
        ({"frame": "disc"}, "stages[1] arm: no arm is called 'disc'; there are table, arm"),
        (
            {"frame": "table", "max_tool_speed": 0.1},
            "stages[1] max_tool_speed: of ways that are stated in the world",
        ),
        ({"frame": "table", "free": "z"}, "stages[1] free: of ways that are stated in the world alone"),
    ],
)
def test_frames_that_are_none(cell: tp.StatedRobot, keys: dict[str, Any], line: str) -> None:
    stage = tp.Line(goal=[0.0, 0.12, 0.06], arm="arm", **keys)
    assert line_of(lambda: tp.sequence(cell, start=START, stages=[FIRST, stage])).startswith(line)


def test_a_frame_is_moved_by_one_first_joint(cell: tp.StatedRobot) -> None:
    base = {"position": [0.9, 0.0, 0.0], "quaternion": [0.0, 0.0, 1.0, 0.0]}
    two = tp.cell({"left": tp.robot("ur5e"), "right": tp.robot("ur5e", base=base)})
    home = [1.2, -1.6, 1.9, -1.87, -1.57, 0.0]
    stage = tp.Line(by=[0.0, 0.0, 0.05], arm="right", frame="left")
    line = line_of(lambda: tp.sequence(two, start={"left": home, "right": home}, stages=[stage]))
    assert "frame: 'left': one joint alone has to move it, of the robot that is stated first" in line
