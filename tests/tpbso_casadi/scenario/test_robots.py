"""The tables of robots: files beside the scenario, what is overridden, masses, motors, what is carried."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.refused import BALLS, FILES, SHORT

import tpbso_casadi as tp
from problems import PlanarArm
from problems.robots import Payload, Robot, SpatialArm, planar_payload
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.animation import animate
from tpbso_casadi.cli.commands import audit
from tpbso_casadi.scenario import InputFolder

TASK = {"kind": "point-to-point", "start": {"joints": [0.0, 0.0]}, "goal": {"joints": [1.0, 0.5]}}


@pytest.fixture
def folder(tmp_path: Path) -> InputFolder:
    """Of a scenario, with the files that it names."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return InputFolder(tmp_path)


def table(**changes: Any) -> dict[str, Any]:
    stated = {"urdf": "short.urdf", "spheres": "balls.toml", "max_acceleration": 5.0} | changes
    return {key: value for key, value in stated.items() if value is not ...}


def built(folder: InputFolder | None, unit: str = "rad", **changes: Any) -> SpatialArm:
    scenario = parse_scenario({"unit": unit, "robot": table(**changes), "task": TASK}, folder)
    robot = scenario.problem().criteria.robot
    assert isinstance(robot, SpatialArm)
    return robot


def test_files_beside_the_scenario_are_read(folder: InputFolder) -> None:
    robot = built(folder)
    assert robot.joints.names == ("turn", "lift")
    assert robot.max_speed == (1.5, 2.5)
    assert robot.max_acceleration == (5.0, 5.0)
    assert [sphere.name for sphere in robot.spheres] == ["hand", "foot"]
    assert robot.skeleton(np.zeros((1, 2)))[0, -1] == pytest.approx([0.5, 0.0, 0.4])


def test_what_was_read_is_complete_without_files(folder: InputFolder) -> None:
    scenario = parse_scenario({"robot": table(), "task": TASK}, folder)
    again = parse_scenario(scenario.table())
    assert again == scenario
    assert again.problem().criteria.robot == scenario.problem().criteria.robot


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
    sliding = SHORT.replace('name="lift" type="revolute"', 'name="lift" type="prismatic"')
    (folder.path / "short.urdf").write_text(sliding)
    assert built(folder, joint_limits=[[-2.0, 2.0], [-0.6, 0.6]]).joints.units == ("rad", "m")
    with pytest.raises(ScenarioError, match=r"^unit: 'deg' does not apply, joint 'lift' slides: state rad and m$"):
        built(folder, "deg", joint_limits=[[-90.0, 90.0], [-0.3, 0.3]])


def test_self_collision_is_looked_after_unless_the_scenario_says_otherwise(folder: InputFolder) -> None:
    assert built(folder).self_collision
    off = {"robot": table(), "task": TASK, "model": {"self_collision": False}}
    assert not parse_scenario(off, folder).problem().criteria.robot.self_collision


def test_links_may_touch_that_a_file_beside_the_scenario_names(folder: InputFolder) -> None:
    touching = BALLS.replace("radius = 0.05", "radius = 0.3")
    (folder.path / "balls.toml").write_text(touching)
    assert built(folder, joint_limits=[[-2.0, 2.0], [-1.0, 1.0]]).kept_pairs == ((0, 1),)
    pairs = '<disable_collisions link1="foot" link2="hand" reason="Never"/><disable_collisions link1="a" link2="b"/>'
    (folder.path / "short.srdf").write_text(f'<robot name="short">{pairs}</robot>')
    assert built(folder, srdf="short.srdf").kept_pairs == ()


def test_a_robot_without_spheres_touches_nothing(folder: InputFolder) -> None:
    robot = built(folder, spheres=...)
    assert robot.self_collision
    assert robot.bodies.each == ()


ARM = {"link_lengths": [0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
BODIES = {
    "link_masses": [2.0, 1.0],
    "max_torque": [50.0, 20.0],
    "link_centers": 0.2,
    "link_inertias": [0.05, 0.04],
    "viscous_friction": 0.1,
    "coulomb_friction": [0.0, 0.2],
    "payload": {"mass": 0.5, "center": [0.1, 0.02], "inertia": 0.01},
    "gravity": [0.0, -1.62],
}
PANDA = {"model": "panda"}
CARRIED = {"mass": 3.0, "center": [0.0, 0.0, 0.05], "inertia": [[0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.01]]}
MOTORS = {"max_torque": 90.0, "viscous_friction": [0.3] * 7, "coulomb_friction": 0.1, "gravity": [0.0, 9.81, 0.0]}
POSTURE = {
    "arm": {"start": {"joints": [-1.5, 0.0]}, "goal": {"joints": [-1.0, 0.2]}},
    "robot": {
        "start": {"joints": [0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0]},
        "goal": {"joints": [0.3, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0]},
    },
}


def parsed(table: dict[str, Any], key: str, unit: str = "rad", scale: float = 1.0) -> Any:
    places = {
        end: {"joints": [angle * scale for angle in place["joints"][: 7 if table.get("model") == "panda" else 2]]}
        for end, place in POSTURE["robot" if table.get("model") == "panda" else "arm"].items()
    }
    return parse_scenario({"unit": unit, key: table, "task": {"kind": "point-to-point"} | places})


def robot_of(table: dict[str, Any], key: str = "robot", unit: str = "rad", scale: float = 1.0) -> Robot:
    return parsed(table, key, unit, scale).problem().criteria.robot


def test_an_arm_with_bodies() -> None:
    robot = robot_of(ARM | BODIES, "arm")
    assert isinstance(robot, PlanarArm)
    assert (robot.link_masses, robot.max_torque, robot.gravity) == ((2.0, 1.0), (50.0, 20.0), (0.0, -1.62))
    assert (robot.link_centers, robot.link_inertias) == ((0.2, 0.2), (0.05, 0.04))
    assert (robot.viscous_friction, robot.coulomb_friction) == ((0.1, 0.1), (0.0, 0.2))
    assert robot.payload == planar_payload(0.5, (0.1, 0.02), 0.01)


def test_settings_of_a_kind_of_robot_say_the_same() -> None:
    table = {"model": "planar", "settings": ARM | BODIES}
    assert replace(robot_of(table), link_radius=(0.0, 0.0)) == robot_of(ARM | BODIES, "arm")


def test_a_robot_in_space_with_a_payload() -> None:
    robot = robot_of(PANDA | MOTORS | {"payload": CARRIED})
    assert isinstance(robot, SpatialArm)
    assert robot.payload == Payload(
        mass=3.0, center=(0.0, 0.0, 0.05), matrix=((0.02, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.01))
    )
    assert (robot.max_torque, robot.gravity) == ((90.0,) * 7, (0.0, 9.81, 0.0))
    assert {(joint.damping, joint.friction) for joint in robot.chain.joints} == {(0.3, 0.1)}
    assert robot_of(PANDA).limits.torque == (87.0,) * 4 + (12.0,) * 3


def test_gravity_is_the_worlds_however_the_base_is_turned() -> None:
    """On its side, the first axis level: gravity turns the first joint, and not by more than all mass at full reach."""
    side = {"quaternion": [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]}
    upright, level = robot_of(PANDA), robot_of(PANDA | {"base": side, "max_torque": 500.0})
    posture = np.array([[pi / 2.0, 1.2, 0.0, -0.5, 0.0, 1.5, 0.0]])
    first = [float(robot.dynamics.gravitational(posture)[0, 0]) for robot in (upright, level)]
    assert first[0] == pytest.approx(0.0, abs=1e-12)
    assert 10.0 < abs(first[1]) < 17.0 * 9.81 * 1.2


@pytest.mark.parametrize(("table", "key"), [(ARM | BODIES, "arm"), (PANDA | MOTORS | {"payload": CARRIED}, "robot")])
def test_what_was_read_is_written_as_it_was(table: dict[str, Any], key: str) -> None:
    scenario = parsed(table, key)
    again = parse_scenario(scenario.table())
    assert again == scenario
    assert again.problem().criteria.robot == scenario.problem().criteria.robot


@pytest.mark.parametrize(
    ("table", "key", "rates"),
    [(ARM | BODIES, "arm", ("max_speed", "max_acceleration")), (PANDA | MOTORS | {"payload": CARRIED}, "robot", ())],
)
def test_torques_and_friction_are_never_in_degrees(table: dict[str, Any], key: str, rates: tuple[str, ...]) -> None:
    degrees = table | {rate: table[rate] * 180.0 / pi for rate in rates}
    one, two = (robot_of(degrees, key, "deg", 180.0 / pi), robot_of(table, key))
    state = np.random.default_rng(1).normal(size=(3, 1, one.dof))
    assert np.array(one.dynamics.torques(*state)) == pytest.approx(np.array(two.dynamics.torques(*state)), rel=1e-12)
    assert one.limits.torque == two.limits.torque


def test_what_is_left_out_is_said_wherever_the_status_is(
    folder: InputFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    full = BALLS + BALLS.replace("hand", "lower").partition('[[spheres]]\nlink = "foot"')[0]
    (folder.path / "full.toml").write_text(full)
    assert built(folder, urdf="mesh.urdf", spheres="full.toml").left_out.links == ()
    robot = table(urdf="mesh.urdf", ignore_geometry=["lower", "hand"])
    scenario = parse_scenario({"robot": robot, "task": TASK, "solver": {"evaluations": 200}}, folder)
    plan, run = tp.plan(scenario), str(folder.path / "run")
    words = "certified without the geometry of lower, hand"
    assert plan.certified and words in repr(plan)
    assert plan.not_judged == (
        "the geometry of lower, hand, which is to be ignored",
        "bodies of upper: no collision geometry is stated",
        "torques: no masses are stated for upper, lower",
    )
    plan.save(run, figures=())
    assert f'"in_words": "{words}"' in (folder.path / "run" / "result.json").read_text()
    assert words in repr(tp.audit(run)) and tp.audit(run).not_judged == list(plan.not_judged)
    assert words.removeprefix("certified ") in plan.plot("path").get_suptitle() + plan.plot("path").axes[0].get_title()
    page = folder.path / "motion.html"
    animate(page, "title", plan.motion)
    assert words.removeprefix("certified ") in page.read_text()
    assert audit.main([run]) == 0
    said = capsys.readouterr().out
    assert words in said and "not judged: torques: no masses are stated for upper, lower" in said
