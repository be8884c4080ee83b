"""The [robot] table of a robot in space: files beside the scenario, what is overridden, what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from problems.robots import SpatialArm
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.scenario import InputFolder

URDF = """<robot name="short">
<link name="foot"/><link name="upper"/><link name="lower"/><link name="hand"/>
<joint name="turn" type="revolute"><parent link="foot"/><child link="upper"/><origin xyz="0 0 0.3"/>
 <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1.5" effort="10"/></joint>
<joint name="lift" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.1"/>
 <axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="2.5" effort="10"/></joint>
<joint name="grip" type="fixed"><parent link="lower"/><child link="hand"/><origin xyz="0.5 0 0"/></joint>
</robot>
"""
SPHERES = """[[spheres]]
link = "hand"
center = [0.0, 0.0, 0.0]
radius = 0.05
[[spheres]]
link = "foot"
center = [0.0, 0.0, 0.1]
radius = 0.1
"""
TASK = {"kind": "point-to-point", "start": {"joints": [0.0, 0.0]}, "goal": {"joints": [1.0, 0.5]}}


@pytest.fixture
def folder(tmp_path: Path) -> InputFolder:
    """Of a scenario, with the files that it names."""
    (tmp_path / "short.urdf").write_text(URDF)
    (tmp_path / "balls.toml").write_text(SPHERES)
    return InputFolder(tmp_path)


def table(**changes: Any) -> dict[str, Any]:
    stated = {"urdf": "short.urdf", "spheres": "balls.toml", "max_acceleration": 5.0} | changes
    return {key: value for key, value in stated.items() if value is not ...}


def built(folder: InputFolder | None, unit: str = "rad", **changes: Any) -> SpatialArm:
    scenario = parse_scenario({"unit": unit, "robot": table(**changes), "task": TASK}, folder)
    robot = scenario.problem().robot
    assert isinstance(robot, SpatialArm)
    return robot


def test_files_beside_the_scenario_are_read(folder: InputFolder) -> None:
    robot = built(folder)
    assert robot.joint_names == ("turn", "lift")
    assert robot.max_speed == (1.5, 2.5)
    assert robot.max_acceleration == (5.0, 5.0)
    assert [sphere.name for sphere in robot.spheres] == ["hand", "foot"]
    assert robot.skeleton(np.zeros((1, 2)))[0, -1] == pytest.approx([0.5, 0.0, 0.4])


def test_what_was_read_is_complete_without_files(folder: InputFolder) -> None:
    scenario = parse_scenario({"robot": table(), "task": TASK}, folder)
    again = parse_scenario(scenario.model_dump(mode="json"))
    assert again == scenario
    assert again.problem().robot == scenario.problem().robot


def test_base_and_tool_are_poses(folder: InputFolder) -> None:
    half = np.sqrt(0.5)
    base = {"position": [1.0, 0.0, 0.0], "quaternion": [0.0, 0.0, half, half]}
    robot = built(folder, base=base, tool={"position": [0.1, 0.0, 0.0]})
    assert robot.skeleton(np.zeros((1, 2)))[0, -1] == pytest.approx([1.0, 0.6, 0.4])


def test_degrees_are_those_of_the_table_not_of_the_urdf(folder: InputFolder) -> None:
    robot = built(folder, "deg", max_speed=[90.0, 45.0], joint_limits=[[-90.0, 90.0], [-45.0, 45.0]])
    assert robot.max_speed == pytest.approx((np.pi / 2.0, np.pi / 4.0))
    assert robot.position_limits is not None
    assert np.array(robot.position_limits) == pytest.approx(np.array([[-1.0, 1.0], [-0.5, 0.5]]) * np.pi / 2.0)
    assert built(folder, "deg", max_acceleration=180.0).max_speed == (1.5, 2.5)


def test_degrees_of_a_joint_that_slides_are_refused(folder: InputFolder) -> None:
    sliding = URDF.replace('name="lift" type="revolute"', 'name="lift" type="prismatic"')
    (folder.path / "short.urdf").write_text(sliding)
    assert built(folder, joint_limits=[[-2.0, 2.0], [-0.6, 0.6]]).joint_units == ("rad", "m")
    with pytest.raises(ScenarioError, match=r"^unit: 'deg' does not apply, joint 'lift' slides: state rad and m$"):
        built(folder, "deg", joint_limits=[[-90.0, 90.0], [-0.3, 0.3]])


def test_a_start_of_three_numbers_is_told_how_to_write_it(folder: InputFolder) -> None:
    with pytest.raises(ScenarioError, match=r"^task.start: a point in space is \{ position = \[x, y, z\] \}, not"):
        parse_scenario({"robot": table(), "task": TASK | {"start": [0.4, 0.0, 0.4]}}, folder)


def test_self_collision_is_looked_after_unless_the_scenario_says_otherwise(folder: InputFolder) -> None:
    assert built(folder).self_collision
    off = {"robot": table(), "task": TASK, "model": {"self_collision": False}}
    assert not parse_scenario(off, folder).problem().robot.self_collision


def test_links_may_touch_that_a_file_beside_the_scenario_names(folder: InputFolder) -> None:
    touching = SPHERES.replace("radius = 0.05", "radius = 0.3")
    (folder.path / "balls.toml").write_text(touching)
    assert built(folder, joint_limits=[[-2.0, 2.0], [-1.0, 1.0]]).kept_pairs == ((0, 1),)
    pairs = '<disable_collisions link1="foot" link2="hand" reason="Never"/><disable_collisions link1="a" link2="b"/>'
    (folder.path / "short.srdf").write_text(f'<robot name="short">{pairs}</robot>')
    assert built(folder, srdf="short.srdf").kept_pairs == ()


def test_a_robot_without_spheres_touches_nothing(folder: InputFolder) -> None:
    robot = built(folder, spheres=...)
    assert robot.self_collision
    assert robot.bodies == ()


CASES: list[tuple[dict[str, Any], str]] = [
    ({"urdf": ...}, "robot.model: one of model and urdf is needed"),
    ({"model": "panda"}, "robot.model: one of model and urdf is needed, not both"),
    ({"urdf": "none.urdf"}, "robot.urdf: "),
    ({"urdf": "balls.toml"}, "robot.urdf: "),
    ({"urdf": 3}, "robot.urdf: a word is needed, not 3"),
    ({"spheres": "short.urdf"}, "robot.spheres: "),
    ({"srdf": "short.urdf"}, "robot.srdf: no <disable_collisions>"),
    ({"srdf": "balls.toml"}, "robot.srdf: no XML: "),
    ({"tip_link": "elbow"}, "robot.tip_link: "),
    ({"base_link": "elbow"}, "robot.base_link: "),
    ({"max_acceleration": ...}, "robot.max_acceleration: missing: none is known for joint 'turn'"),
    ({"max_speed": [1.0]}, "robot.max_speed: 1 values for 2 joints"),
    ({"max_speed": -1.0}, "robot.max_speed: input should be greater than 0, not -1.0"),
    ({"joint_limits": [[0.0, 1.0]]}, "robot.joint_limits: 1 ranges for 2 joints"),
    ({"joint_limits": [[1.0, 0.0], [0.0, 1.0]]}, "robot.joint_limits: "),
    ({"base": {"quaternion": [0.0, 0.0, 0.0, 0.5]}}, "robot.base.quaternion: [0.0, 0.0, 0.0, 0.5] is not of length 1"),
    ({"base": [0.0, 0.0, 0.0]}, "robot.base: a table is needed"),
    ({"tool": {"positon": [0.0, 0.0, 0.0]}}, "robot.tool.positon: unknown key"),
    ({"base": {"position": [1e9, 0.0, 0.0]}}, "robot.base: 1e+09 is not within -1e+08 and 1e+08 m"),
    ({"tool": {"quaternion": [0.0, 0.0, 0.0, 0.5]}}, "robot.tool.quaternion: [0.0, 0.0, 0.0, 0.5] is not of length 1"),
    (
        {"urdf": ..., "model": "pandda", "spheres": ..., "max_acceleration": ...},
        "robot.model: no robot 'pandda'; did you mean panda?",
    ),
    ({"kept_pairs": [["foot", "head"]]}, "robot.kept_pairs: no spheres on link 'head'"),
    ({"kept_pairs": [["foot", "foot"]]}, "robot.kept_pairs: 'foot' and 'foot' are one body, or a joint connects them"),
    ({"disabled_pairs": [["foot", "head"]]}, "robot.disabled_pairs: no spheres on link 'head'"),
    ({"settings": {}}, "robot.settings: unknown key"),
    ({"max_torque": 5.0}, "robot.max_torque: torques are not known: no masses are stated for upper, lower"),
    ({"payload": {"mass": 1.0}}, "robot.payload: torques are not known: no masses are stated for upper, lower"),
    ({"viscous_friction": 0.1}, "robot.viscous_friction: torques are not known: no masses are stated for upper, lower"),
    ({"urdf": "../short.urdf"}, "robot.urdf: "),
]


@pytest.mark.parametrize(("changes", "message"), CASES, ids=[message[:40] for _, message in CASES])
def test_what_is_wrong_is_named(changes: dict[str, Any], message: str, folder: InputFolder) -> None:
    with pytest.raises(ScenarioError) as error:
        built(folder, **changes)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_a_file_that_is_named_has_to_be_read() -> None:
    with pytest.raises(ScenarioError, match=r"robot.urdf: 'short.urdf' has not been read; only a scenario file can"):
        built(None)
