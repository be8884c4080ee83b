"""The keys of a scenario about masses, motors, friction and what is carried."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest

from problems import PlanarArm
from problems.robots import Payload, Robot, SpatialArm, planar_payload
from tpbso_casadi import ScenarioError, parse_scenario

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
    return parsed(table, key, unit, scale).problem().robot


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
    first = [float(robot.massive.gravitational(posture)[0, 0]) for robot in (upright, level)]
    assert first[0] == pytest.approx(0.0, abs=1e-12)
    assert 10.0 < abs(first[1]) < 17.0 * 9.81 * 1.2


@pytest.mark.parametrize(("table", "key"), [(ARM | BODIES, "arm"), (PANDA | MOTORS | {"payload": CARRIED}, "robot")])
def test_what_was_read_is_written_as_it_was(table: dict[str, Any], key: str) -> None:
    scenario = parsed(table, key)
    again = parse_scenario(scenario.model_dump(mode="json"))
    assert again == scenario
    assert again.problem().robot == scenario.problem().robot


@pytest.mark.parametrize(
    ("table", "key", "rates"),
    [
        (ARM | BODIES, "arm", ("max_speed", "max_acceleration")),
        (PANDA | MOTORS | {"payload": CARRIED}, "robot", ()),
    ],
)
def test_torques_and_friction_are_never_in_degrees(table: dict[str, Any], key: str, rates: tuple[str, ...]) -> None:
    degrees = table | {rate: table[rate] * 180.0 / pi for rate in rates}
    one, two = (robot_of(degrees, key, "deg", 180.0 / pi), robot_of(table, key))
    state = np.random.default_rng(1).normal(size=(3, 1, one.dof))
    assert np.array(one.inverse_dynamics(*state)) == pytest.approx(np.array(two.inverse_dynamics(*state)), rel=1e-12)
    assert one.limits.torque == two.limits.torque


WRONG: list[tuple[str, dict[str, Any], str]] = [
    ("arm", {"max_torque": 0.0}, "arm.max_torque: "),
    ("arm", {"max_torque": [1.0]}, "arm.max_torque: 1 values for 2 links"),
    ("arm", {"link_masses": -1.0}, "arm.link_masses: "),
    ("arm", {"link_masses": [1.0, 2.0, 3.0]}, "arm.link_masses: 3 values for 2 links"),
    ("arm", {"link_masses": [1.0, 0.0]}, "arm.link_masses.1: input should be greater than 0, not 0.0"),
    (
        "arm",
        {"link_inertias": [0.1, -0.1]},
        "arm.link_inertias.1: input should be greater than or equal to 0, not -0.1",
    ),
    ("arm", {"viscous_friction": -0.1}, "arm.viscous_friction: "),
    ("arm", {"payload": {"center": [0.0, 0.0]}}, "arm.payload.mass: missing key"),
    ("arm", {"payload": {"mass": -1.0}}, "arm.payload.mass: "),
    ("arm", {"payload": {"mass": 1e10}}, "arm.payload.mass: 1e+10 is not within 0 and 1e+09 kg"),
    ("arm", {"payload": {"mass": 1.0, "center": [0.0, 0.0, 0.1]}}, "arm.payload.center"),
    ("arm", {"payload": {"mass": 1.0, "weight": 2.0}}, "arm.payload.weight: unknown key"),
    ("arm", {"payload": 3.0}, "arm.payload: a table is needed, not 3.0"),
    ("arm", {"gravity": [0.0, 0.0, -9.81]}, "arm.gravity: at most 2 items, not 3"),
    ("arm", {"gravity": [0.0, -1e8]}, "arm.gravity: -1e+08 is not within"),
    ("settings", {"payload": {"mass": "1 kg"}}, "robot.settings.payload.mass: a number is needed, not '1 kg'"),
    ("settings", {"link_masses": [1.0]}, "robot.settings.link_masses: 1 values for 2 links"),
    ("robot", {"max_torque": -5.0}, "robot.max_torque: "),
    ("robot", {"max_torque": [5.0, 5.0]}, "robot.max_torque: 2 values for 7 joints"),
    ("robot", {"viscous_friction": [0.1]}, "robot.viscous_friction: 1 values for 7 joints"),
    ("robot", {"coulomb_friction": -0.1}, "robot.coulomb_friction: "),
    ("robot", {"payload": {"mass": 1.0, "inertia": 0.1}}, "robot.payload.inertia: "),
    (
        "robot",
        {"payload": {"mass": 1.0, "inertia": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 3.0]]}},
        "robot.payload.inertia: principal moments 1, 1 and 3 kg m^2: the largest is above the sum of the others",
    ),
    ("robot", {"payload": {"mass": 100.0}}, "task.start: panda_joint6 needs "),
    ("robot", {"gravity": [0.0, -9.81]}, "robot.gravity"),
    ("robot", {"link_masses": 1.0}, "robot.link_masses: unknown key"),
]


@pytest.mark.parametrize(("kind", "changes", "message"), WRONG, ids=[f"{kind} {m[:40]}" for kind, _, m in WRONG])
def test_what_is_wrong_is_named(kind: str, changes: dict[str, Any], message: str) -> None:
    tables = {"arm": ARM | BODIES, "settings": ARM | BODIES, "robot": PANDA}
    table = tables[kind] | changes
    with pytest.raises(ScenarioError) as error:
        robot_of(
            {"model": "planar", "settings": table} if kind == "settings" else table, "arm" if kind == "arm" else "robot"
        )
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("key", ["max_torque", "link_centers", "link_inertias", "viscous_friction", "coulomb_friction"])
def test_what_needs_masses(key: str) -> None:
    with pytest.raises(ScenarioError, match=rf"^arm.{key}: link_masses are needed with it"):
        robot_of(ARM | {key: 1.0}, "arm")
