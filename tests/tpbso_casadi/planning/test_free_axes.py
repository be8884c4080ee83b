"""Goals and lines that leave the tool free to turn, planned: measured by kinematics of their own, proven, refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.slow import slow_except
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from benchmarks.lines import tool
from problems import Box
from problems.base import FloatArray
from problems.certify import RefusedError, check
from problems.limits import FreeAxis
from problems.tasks import Following, FreeTurns, StraightLine, Surroundings, ToolPath

UR5E = tp.robot("ur5e")
START = {"joints": [0.0, -1.2, 1.5, -1.9, -1.5, 0.3]}
(POINT,), (ROTATION,) = tool(UR5E.model, np.array([[1.2, -1.0, 1.3, -1.9, -1.2, 2.0]]))
POSE: dict[str, Any] = {"position": POINT.tolist(), "quaternion": Rotation.from_matrix(ROTATION).as_quat().tolist()}


def turn_and_lean(plan: tp.Plan) -> tuple[float, float]:
    """The turn of the tool at the end about its z axis, and the lean of that, rad."""
    positions, rotations = tool(UR5E.model, plan.trajectory.at(np.array([plan.duration])))
    np.testing.assert_allclose(positions[0], POINT, atol=1e-8)
    seen = ROTATION.T @ rotations[0]
    swing, _ = Rotation.align_vectors([seen[:, 2]], [[0.0, 0.0, 1.0]])
    return float((swing.inv() * Rotation.from_matrix(seen)).as_rotvec()[2]), float(swing.magnitude())


def test_goals_are_reached_sooner_the_more_is_free(tmp_path: Path) -> None:
    keys: list[dict[str, Any]] = [{}, {"free": "z", "turn": [-0.5, 0.5]}, {"free": "z", "tilt": 0.2}]
    durations = []
    for number, free in enumerate(keys):
        plan = tp.plan(UR5E, start=START, goal=POSE | free)
        turn, lean = turn_and_lean(plan)
        durations.append(plan.duration)
        assert plan.certified
        assert lean <= free.get("tilt", 0.0) + 1e-8
        assert "turn" not in free or abs(turn) <= 0.5 + 1e-8
        assert bool(plan.taken) == bool(free)
        content = json.loads(plan.certificate(tmp_path / f"{number}.json").read_text())
        assert check(content)
        if free.get("turn") or free.get("tilt"):
            content["stages"][0]["places"][-1]["within"] *= 0.9  # the freedom is made use of to its end
            with pytest.raises(RefusedError, match="goal of 'motion'"):
                check(content)
    assert (np.diff(durations) <= 1e-9).all()
    assert durations[2] < 0.9 * durations[0]
    again = tp.read_run(plan.save(tmp_path / "run", figures=()))
    assert again.certified and again.taken == plan.taken


@pytest.mark.parametrize(
    ("goal", "reason"),
    [
        (POSE | {"free": "w"}, "goal.free: .*'x', 'y'"),
        (POSE | {"free": "z", "turn": [0.2, 0.1]}, "goal.turn: 0.2 is not below 0.1"),
        (POSE | {"free": "z", "turn": [-4.0, 4.0]}, "goal: turn: from -4 to 4 rad is beyond a whole turn"),
        (POSE | {"free": "z", "tilt": 2.0}, "goal: tilt: 2 is not within"),
        (POSE | {"tilt": 0.1}, "goal.tilt: of which axis"),
        (POSE | {"free": "z", "turn": [-0.1, 0.1], "tilt": 0.1}, "goal.tilt: .* leave turn or tilt out"),
        ({"position": POSE["position"], "free": "z"}, "goal: free: without a quaternion"),
        ({"position": [0.5, 0.5], "free": "z"}, "goal.free: in the plane"),
        (tp.Pose(tuple(POINT.tolist()), tuple(POSE["quaternion"]), tilt=0.1), "goal.tilt: of which axis"),
    ],
)
def test_goals_with_no_free_axis_are_refused_in_one_line(goal: Any, reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason) as caught:
        tp.plan(UR5E, start=START, goal=goal)
    assert "\n" not in str(caught.value)


STRETCHED = [-0.7, -1.3, 1.3, -0.5, -0.2, -1.0]  # rad: from there a line ends soon if the tool stays turned as it is
BENT, BY = [1.3, -0.75, 0.36, 0.97, 0.76, 1.45], [0.1, 0.05, -0.1]
TURN = np.sin(0.31)  # what a range of 0.3 rad comes to with the accuracy of 0.01 rad


def measured(plan: tp.Plan) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Leans of the x axis, rad, distances from the line, m, and sines of turns about x, each at 2,000 times."""
    positions, rotations = tool(UR5E.model, plan.trajectory.at(np.linspace(0.0, plan.duration, 2_000)))
    since, way = positions - positions[0], positions[-1] - positions[0]
    away = np.linalg.norm(np.cross(since, way), axis=1) / np.linalg.norm(way)
    chords = np.linalg.norm(rotations[:, :, 0] - rotations[0, :, 0], axis=1)
    return 2.0 * np.arcsin(chords / 2.0), away, rotations[:, :, 1] @ rotations[0, :, 2]


def test_a_free_turn_leads_on_where_the_tool_as_it_is_cannot_be_led(tmp_path: Path) -> None:
    line = tp.Line(by=[0.0, -0.2, 0.1])
    with pytest.raises(tp.ScenarioError, match="no posture next to the last"):
        tp.sequence(UR5E, start={"joints": STRETCHED}, stages=[line])
    plan = tp.sequence(UR5E, start={"joints": STRETCHED}, stages=[replace(line, free="x")])
    leans, away, sines = measured(plan)
    assert plan.certified and leans.max() <= 0.01 and away.max() <= 1e-3 and np.abs(sines).max() > 0.1
    assert check(json.loads(plan.certificate(tmp_path / "line.json").read_text()))
    again = tp.read_run(plan.save(tmp_path / "run", figures=()))
    assert again.certified and again.taken == plan.taken and "turned by" in plan.taken[0]


@pytest.mark.parametrize("free", slow_except([{"turn": [-0.3, 0.3]}, {"tilt": 0.2}], 1), ids=str)
def test_lines_keep_within_a_range_and_a_cone(free: dict[str, Any]) -> None:
    plan = tp.sequence(UR5E, start={"joints": BENT}, stages=[tp.Line(by=BY, free="x", **free)])
    leans, away, sines = measured(plan)
    assert plan.certified and away.max() <= 1e-3 and leans.max() <= free.get("tilt", 0.01)
    assert "turn" not in free or 0.05 < np.abs(sines).max() <= TURN


@pytest.mark.slow
def test_a_line_along_the_axes_of_the_tool_approaches_a_grasp() -> None:
    away = POINT - 0.1 * ROTATION[:, 2]
    before = tp.Pose(tuple(away.tolist()), tuple(POSE["quaternion"]), free="z")
    plan = tp.sequence(UR5E, start=START, stages=[tp.MoveTo(before), tp.Line(along=[0.0, 0.0, 0.1], free="z")])
    _, lean = turn_and_lean(plan)
    assert plan.certified and lean <= 0.01


@pytest.mark.slow
def test_paths_and_stages_in_a_row_are_free_too() -> None:
    start = tool(UR5E.model, np.array([BENT]))[0][0]
    points = [(start + corner).tolist() for corner in ([0.0, 0.0, -0.1], [0.1, 0.0, -0.1])]
    stages = [tp.Along(points, accuracy=1e-3, free="x"), tp.Line(by=[0.0, 0.0, 0.05], free="y")]
    plan = tp.sequence(UR5E, start={"joints": BENT}, stages=stages)
    assert plan.certified and len(plan.taken) == 2
    positions, rotations = tool(UR5E.model, plan.trajectory.at(np.linspace(0.0, plan.stages[0].end, 2_000)))
    assert np.linalg.norm(rotations[:, :, 0] - rotations[0, :, 0], axis=1).max() <= 0.01
    np.testing.assert_allclose(positions[-1], points[-1], atol=1e-8)


def test_turns_are_searched_where_even_ones_do_not_serve() -> None:
    """Of the laws near what the dynamic program finds, joints follow one whose axis keeps its direction."""
    robot, start = UR5E.model, np.array(STRETCHED)
    (point,), (rotation,) = tool(robot, start[None])
    line = StraightLine(point, point + np.array([0.0, -0.2, 0.1]))
    path = ToolPath(line, (rotation, rotation), FreeAxis("x"))
    laws = list(FreeTurns(path, robot, Surroundings(robot, ())).searched(start))
    found = Following(laws[0], robot).joints(start, 1e-3, 0.01)
    positions, rotations = tool(robot, found.at(np.linspace(*found.breakpoints[[0, -1]], 200)))
    assert np.linalg.norm(rotations[:, :, 0] - rotation[:, 0], axis=1).max() <= 1e-3
    np.testing.assert_allclose(positions[-1], line.goal, atol=1e-8)
    walled = Box(center=tuple(line.points(np.array([0.5]))[0].tolist()), size=(0.05, 0.05, 0.05))
    turns = FreeTurns(path, robot, Surroundings(robot, (walled,)))
    assert not list(turns.even(start)) and not list(turns.searched(start))


@pytest.mark.parametrize(
    ("stage", "reason"),
    [
        (tp.Line(by=BY, free="x", turn=[0.1, 0.3]), r"stages\[0\].turn: does not hold 0"),
        (tp.Line(by=BY, free="x", turn=[-4.0, 4.0]), r"stages\[0\].turn: from -4 to 4 rad is beyond a whole turn"),
        (tp.Line(by=BY, tilt=0.1), r"stages\[0\].tilt: of which axis"),
        (tp.Line(POSE | {"free": "z"}), r"stages\[0\].goal.free: .*state them beside its goal"),
        (tp.Along([[0.1, 0.2, 0.3]], accuracy=1e-3, free="w"), r"stages\[0\].free: .*'x', 'y'"),
    ],
)
def test_lines_with_no_free_axis_are_refused_in_one_line(stage: Any, reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason) as caught:
        tp.sequence(UR5E, start=START, stages=[stage])
    assert "\n" not in str(caught.value)


def test_in_the_plane_no_axis_is_free() -> None:
    arm = tp.robot([0.5, 0.4, 0.3], max_speed=2.0, max_acceleration=10.0)
    with pytest.raises(tp.ScenarioError, match=r"stages\[0\].along: in the plane"):
        tp.sequence(arm, start={"joints": [0.3, 0.9, -0.4]}, stages=[tp.Line(along=[0.0, 0.0, 0.1])])
    with pytest.raises(tp.ScenarioError, match=r"stages\[0\].free: in the plane no axis"):
        tp.sequence(arm, start={"joints": [0.3, 0.9, -0.4]}, stages=[tp.Line(by=[-0.1, 0.15], free="z")])
