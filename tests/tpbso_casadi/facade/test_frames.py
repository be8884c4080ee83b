"""Frames in Python: poses and obstacles that are stated in one, files whose frames are moved, and refusals."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of

import tpbso_casadi as tp

HALF = (0.0, 0.0, 1.0, 0.0)  # half a turn about z
DOWN = (1.0, 0.0, 0.0, 0.0)
HOME = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]
FLOOR = tp.Frame("floor", np.array([0.0, 0.0, -0.25]))
BIN = tp.Frame("bin", (0.5, 0.25, 0.25), HALF, frame="floor")
BOX = tp.Box(center=(0.25, 0.0, 0.125), size=(0.03125, 0.5, 0.25), name="side")
GOAL = tp.Pose((0.125, 0.0, 0.5), DOWN)
CELL = """
[robot]
model = "ur5e"
base = { frame = "floor", position = [0.0, 0.0, 0.25] }
[[frames]]
name = "floor"
position = [0.0, 0.0, -0.25]
[[frames]]
name = "bin"
frame = "floor"
position = [0.5, 0.25, 0.25]
quaternion = [0.0, 0.0, 1.0, 0.0]
[[obstacles]]
frame = "bin"
shape = "box"
center = [0.25, 0.0, 0.125]
size = [0.03125, 0.5, 0.25]
name = "side"
[task]
kind = "point-to-point"
start = { joints = [0.0, -1.5, 1.5, -1.5, -1.5, 0.0] }
goal = { frame = "bin", position = [0.125, 0.0, 0.5], quaternion = [1.0, 0.0, 0.0, 0.0] }
"""


PLANAR = """
[arm]
link_lengths = [0.5, 0.5]
max_speed = 4.0
max_acceleration = 20.0
[task]
kind = "point-to-point"
start = [0.9, 0.0]
goal = [0.0, 0.9]
"""


@pytest.fixture
def cell(in_an_empty_folder: None) -> Path:
    path = Path("cell.toml")
    path.write_text(CELL)
    return path


def in_numbers() -> tp.Plan:
    """The same cell in the world: half a turn about z at (0.5, 0.25, 0)."""
    side = tp.Box(center=(0.25, 0.25, 0.125), size=BOX.size, quaternion=HALF, name="side")
    return tp.plan("ur5e", start=HOME, goal=tp.Pose((0.375, 0.25, 0.5), (0.0, 1.0, 0.0, 0.0)), obstacles=[side])


def test_a_plan_in_frames_is_that_of_its_numbers(cell: Path) -> None:
    arm = tp.robot("ur5e", base={"frame": "floor", "position": [0.0, 0.0, 0.25]})
    plan = tp.plan(arm, start=HOME, goal=BIN.at(GOAL), obstacles=[BIN.at(BOX)], frames=[FLOOR, BIN])
    known = in_numbers()
    assert plan.certified and plan.duration == known.duration == tp.plan(cell).duration
    assert plan.scenario.task == known.scenario.task and not plan.scenario.frames
    assert plan.scenario.obstacles[0].table() == known.scenario.obstacles[0].table()
    again = tp.plan(tp.stated_scenario(cell))  # which is resolved by then
    assert again.scenario.table() == tp.plan(cell).scenario.table() and again.duration == plan.duration
    table = {"frame": "bin", "position": [0.125, 0.0, 0.5], "quaternion": [*DOWN]}
    listed = tp.scenario_of(
        "ur5e", start=HOME, goal=[table], via=[BIN.at(GOAL)], frames=[FLOOR, {"name": "bin"} | MOVED]
    )
    assert listed.task.goal[0].point == listed.task.via[0].point == pytest.approx((0.125, 0.0, 0.5))


MOVED = {"position": [0.0, 0.0, 0.0]}


def test_the_frames_of_a_file_are_moved_by_name(cell: Path) -> None:
    moved = tp.scenario_of(cell, frames=[tp.Frame("bin", (0.5, -0.25, 0.25), HALF, frame="floor")])
    assert moved.task.goal.point == (0.375, -0.25, 0.5)
    assert moved.obstacles[0].build().center == (0.25, -0.25, 0.125)
    lower = tp.scenario_of(cell, frames=[tp.Frame("floor", (0.0, 0.0, -0.5))])
    assert lower.robot.base.position == (0.0, 0.0, -0.25) and lower.task.goal.point == (0.375, 0.25, 0.25)
    goal = {"frame": "rack", "position": [0.125, 0.25, 0.5]}
    rack = tp.Frame("rack", (0.25, 0.0, 0.0))
    beside = tp.scenario_of(tp.stated_scenario(cell), frames=[rack], goal=goal, obstacles=[BIN.at(BOX)])
    assert beside.task.goal.point == (0.375, 0.25, 0.5)
    assert beside.obstacles[0].build().center == (0.25, 0.25, 0.125)
    assert not beside.frames


def test_sequences_and_their_bounds() -> None:
    stages = [tp.MoveTo(BIN.at(GOAL)), tp.Line(by=[0.0, 0.125, -0.125], frame="bin", tool_speed=0.1)]
    arm = tp.robot("ur5e", base={"frame": "floor", "position": [0.0, 0.0, 0.25]})
    keys = {"start": HOME, "stages": stages, "frames": [FLOOR, BIN]}
    plan = tp.sequence(arm, **keys)
    assert plan.certified and plan.scenario.task.stages[1].by == [0.0, -0.125, -0.125]
    bound = tp.bound(arm, **keys).seconds
    assert bound is not None and 0.5 < bound <= plan.duration + 1e-9


def test_obstacles_that_move_are_stated_too() -> None:
    moving = BIN.at(tp.MovingObstacle(BOX, tp.ConstantVelocity((0.25, 0.0, 0.0))))
    keys = {"start": HOME, "goal": HOME, "frames": [FLOOR, BIN]}
    (found,) = tp.scenario_of("ur5e", obstacles=[moving], **keys).obstacles
    assert found.velocity == [-0.25, 0.0, 0.0] and found.name == "side"


def test_motions_are_judged_among_the_frames_of_a_file(cell: Path) -> None:
    """Commands that take the surroundings alone of a file read its frames too."""
    Path("way.csv").write_text("t,q1,q2,q3,q4,q5,q6\n0,0,-1.5,1.5,-1.5,-1.5,0\n1,0.1,-1.5,1.5,-1.5,-1.5,0\n")
    around = tp.certify("way.csv", robot=cell).scenario
    assert around.obstacles[0].build().center == (0.25, 0.25, 0.125) and around.robot.base.position == (0.0, 0.0, 0.0)


def stated(**keys: Any) -> tp.Scenario:
    return tp.scenario_of("ur5e", **{"start": HOME, "goal": HOME} | keys)


REFUSED: list[tuple[Callable[[], object], str]] = [
    (lambda: stated(goal=BIN.at(GOAL)), "goal.frame: no frame is called 'bin'; none"),
    (lambda: stated(frames=FLOOR), "frames: a list is needed, [tp.Frame(...)]"),
    (lambda: stated(frames=[3]), "frames[0]: tp.Frame(...) is needed, not 3"),
    (lambda: stated(frames=[tp.Frame("a", (0, 0))]), "frames[0] position.2: mis"),
    (lambda: stated(frames=[BIN]), "frames[0] frame: no frame is called 'floor'"),
    (lambda: tp.scenario_of("time-3", frames=[FLOOR]), "frames: this scenario is in the world already; give its file"),
    (lambda: BIN.at(HOME), "at: tp.Pose(...), or an obstacle in space, is needed, not [0.0, "),
    (lambda: tp.robot("ur5e", base={"frame": "floor"}).model, "base.frame: 'floor' is a name until the scenario's"),
    (lambda: tp.scenario_of(tp.robot("ur5e", base={"frame": "flor"}), start=HOME, goal=HOME, frames=[FLOOR]),
        "base.frame: no frame is called 'flor'; did you mean floor?"),
    (lambda: tp.robot("ur5e").among([BIN.at(BOX)]), "obstacles[0] frame: no frame is called 'bin'; none is stated"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "line"), REFUSED)
def test_what_is_refused(call: Callable[[], object], line: str) -> None:
    assert line_of(call).startswith(line)


def test_a_scenario_in_the_world_has_no_frames_to_move(cell: Path) -> None:
    """It would not move, and nothing would say so."""
    known = tp.read_scenario(cell)
    assert line_of(lambda: tp.plan(known, frames=[BIN])).startswith("frames: this scenario is in the world already")
    planar = "frames: of robots in space alone"
    Path("plane.toml").write_text(PLANAR)
    assert planar in line_of(lambda: tp.plan("plane.toml", frames=[FLOOR]))


def test_a_robot_whose_base_is_in_a_frame_is_shown() -> None:
    shown = repr(tp.robot("ur5e", base={"frame": "floor", "position": [0.0, 0.0, 0.0]}))
    assert shown == "<robot: base.frame: 'floor' is a name until the scenario's frames are resolved>"
