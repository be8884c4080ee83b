"""Keys about safety and about the arm itself: margin, widths, shapes, pose, tool, jerk; and files in degrees."""

from __future__ import annotations

import copy
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import changed
from helpers.scenes import SWING, toml
from oracles.outlines import skeletons

from problems import PlanarArm
from problems.certify import exact_time_scale
from problems.limits import proximity_limits
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.scenario import read_scenario

EVERYTHING: dict[str, Any] = {
    "arm": {
        "link_lengths": [0.6, 0.5, 0.5],
        "max_speed": 4.0,
        "max_acceleration": 20.0,
        "max_jerk": [400.0, 500.0, 600.0],
        "link_radius": [0.04, 0.03, 0.02],
        "base": [0.1, -0.2, 0.3],
        "tool": [0.1, 0.05],
    },
    "task": {"kind": "point-to-point", "start": [1.2, 0.0], "goal": [0.2, 1.2], "objective": "time", "elbow": "up"},
    "obstacles": [
        {"center": [1.3, 1.2], "semi_axes": [0.2, 0.1], "angle": 0.4},
        {"shape": "ellipse", "center": [-0.9, 0.5], "semi_axes": [0.1, 0.1]},
        {"shape": "box", "center": [-0.5, 1.0], "size": [0.2, 0.1], "angle": 0.2},
        {"shape": "polygon", "points": [[1.6, -0.5], [1.6, 0.6], [1.5, 0.6], [1.5, -0.4], [1.0, -0.4], [1.0, -0.5]]},
    ],
    "model": {"margin": 0.02, "self_collision": True, "formulation": "reduced"},
}


def test_everything_arrives_in_the_problem() -> None:
    scenario = parse_scenario(EVERYTHING)
    assert parse_scenario(scenario.table()) == scenario
    problem = scenario.problem()
    robot = problem.criteria.robot
    assert isinstance(robot, PlanarArm)
    assert (robot.margin, robot.self_collision) == (0.02, True)
    assert (robot.base, robot.base_angle, robot.tool_offset) == ((0.1, -0.2), 0.3, (0.1, 0.05))
    assert (robot.link_radius, robot.limits.jerk) == ((0.04, 0.03, 0.02), (400.0, 500.0, 600.0))
    shapes = [type(obstacle).__name__ for obstacle in problem.criteria.obstacles]
    assert shapes == ["Ellipse", "Ellipse", "Rectangle", "Polygon"]
    names = [limit.name for limit in problem.criteria.limits]
    assert names == ["speed", "acceleration", "jerk", "clearance", "self clearance"]


def test_what_is_verified_is_where_the_arm_is() -> None:
    problem = parse_scenario(EVERYTHING).problem()
    x = np.mean(problem.bounds, axis=0)
    trajectory = problem.trajectory(x)
    trajectory = trajectory.time_scaled(max(1.0, exact_time_scale(problem.criteria.limits, trajectory)))
    verdicts = {verdict.name: verdict for verdict in problem.criteria.verify(trajectory)}
    assert all(verdicts[name].satisfied for name in ("start", "goal", "speed", "acceleration", "jerk"))
    tools = skeletons(problem.criteria.robot, trajectory.at(np.array([0.0, trajectory.duration])))[:, -1]
    assert tools == pytest.approx(np.array([[1.2, 0.0], [0.2, 1.2]]), abs=1e-9)
    times = np.linspace(0.0, trajectory.duration, 20_001)
    assert (np.abs(trajectory.at(times, 3)) <= np.array([400.0, 500.0, 600.0]) * (1.0 + 1e-9)).all()
    kept = proximity_limits(problem.criteria.robot, problem.criteria.obstacles)
    assert {limit.name for limit in kept} <= set(verdicts)


def test_too_many_corners_are_named() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    radii = np.where(np.arange(60) % 2, 0.2, 0.1)
    star = np.column_stack([1.6 + radii * np.cos(angles), 1.5 + radii * np.sin(angles)])
    content = changed(EVERYTHING, "arm.link_lengths", [0.05] * 40)
    content["arm"] |= {"max_jerk": 1.0, "link_radius": 0.001}
    content["obstacles"] = [{"shape": "polygon", "points": star.tolist()}] * 3
    with pytest.raises(ScenarioError, match=r"^obstacles\.\d\.shape: more than 250 corners of obstacles for 40"):
        parse_scenario(content).problem()


def test_degrees_are_radians_once_the_file_is_read() -> None:
    turned = copy.deepcopy(EVERYTHING) | {"unit": "deg"}
    for key in ("max_speed", "max_acceleration"):
        turned["arm"][key] = degrees(turned["arm"][key])
    turned["arm"]["max_jerk"] = [degrees(value) for value in turned["arm"]["max_jerk"]]
    turned["arm"]["base"][2] = degrees(0.3)
    for obstacle in turned["obstacles"]:
        if "angle" in obstacle:
            obstacle["angle"] = degrees(obstacle["angle"])
    star = {"kind": "path", "shape": "pentagram", "radius": 0.5, "accuracy": 0.1, "angle": 1.0}
    rows = [[0.1, 0.2, 0.3], [0.5, 0.1, 0.0]]
    blend = {"kind": "joint-path", "joints": rows, "interpolation": "blend", "tolerance": 0.05, "start_speed": 0.2}
    angles = {"angle": degrees(1.0)}, {"joints": np.degrees(rows).tolist(), "tolerance": degrees(0.05)}
    both = (EVERYTHING["task"], {}), (star, angles[0]), (blend, angles[1] | {"start_speed": degrees(0.2)})
    for task, in_degrees in both:
        rest = {key: value for key, value in EVERYTHING.items() if key != "solver" or task is not blend}
        stated = {key: turned[key] for key in rest} | {"unit": "deg", "task": task | in_degrees}
        read = [parse_scenario(content).table() for content in (rest | {"task": task}, stated)]
        assert read[0]["unit"] == read[1]["unit"] == "rad"
        assert flat(read[1]) == pytest.approx(flat(read[0]), rel=1e-15, abs=0.0)


def flat(content: Any, key: str = "") -> dict[str, Any]:
    """The numbers of a scenario by their places."""
    if isinstance(content, dict | list | tuple):
        items = content.items() if isinstance(content, dict) else enumerate(content)
        return {name: leaf for k, value in items for name, leaf in flat(value, f"{key}.{k}").items()}
    return {key: content} if isinstance(content, float) else {}


def test_degrees_of_a_robot_by_its_class() -> None:
    settings = {"link_lengths": [1.0, 1.0], "max_speed": [180.0, 180.0], "max_acceleration": 360.0, "base_angle": 90.0}
    content = {"unit": "deg", "robot": {"model": "planar", "settings": settings}, "task": EVERYTHING["task"]}
    robot = parse_scenario(content | {"model": {"margin": 0.1}}).problem().criteria.robot
    assert robot.limits.speed == (np.pi, np.pi)
    assert robot.limits.acceleration == (2.0 * np.pi,) * 2
    assert (robot.base_angle, robot.margin) == (np.pi / 2.0, 0.1)


def test_a_file_in_degrees(tmp_path: Path) -> None:
    path = tmp_path / "move.toml"
    arm = {"link_lengths": [1.0, 1.0], "max_speed": 180, "max_acceleration": 360, "base": [0.0, 0.0, 90]}
    arm |= {"joint_limits": [[-180, 180], [0, 150]]}
    path.write_text(toml(unit="deg", arm=arm, task=SWING | {"start": [1.0, 0.5]}))
    scenario = read_scenario(path)
    assert scenario.unit == "rad"
    assert scenario.arm is not None
    assert scenario.arm.base == [0.0, 0.0, np.pi / 2.0]
    assert scenario.arm.joint_limits == [(-np.pi, np.pi), (0.0, np.radians(150.0))]
    path.write_text(path.read_text().replace("deg", "turns"))
    with pytest.raises(ScenarioError, match=r"move\.toml: unit: input should be 'rad' or 'deg', not 'turns'$"):
        read_scenario(path)


def test_another_scene_of_the_same_make_has_the_same_functions() -> None:
    moved = changed(EVERYTHING, "model.margin", 0.0205)
    moved = changed(moved, "obstacles.2.center", [-0.51, 1.01])
    moved = changed(moved, "obstacles.3.points.0", [1.61, -0.51])
    moved = changed(moved, "arm.base", [0.11, -0.21, 0.2])
    moved = changed(moved, "arm.link_radius", [0.041, 0.031, 0.021])
    programs = [parse_scenario(content).problem().cost_program() for content in (EVERYTHING, moved)]
    texts = [[step.function.serialize() for step in program.steps] for program in programs]
    assert texts[0] == texts[1]
    assert (programs[0].parameters != programs[1].parameters).any()
