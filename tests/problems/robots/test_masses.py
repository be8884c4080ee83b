"""What is stated of masses, motors, friction and payloads is checked; each message names key and reason."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from helpers.urdf import ARM

from problems import InvalidProblem, PlanarArm
from problems.robots import BUILT_IN, Payload, RobotDescription, built_in, planar_payload, read_urdf
from problems.robots.inertia import inertia_fault, planar_payload_of

NAN = float("nan")


def planar(**changes: Any) -> PlanarArm:
    return PlanarArm((1.0, 1.0), (3.0, 3.0), (9.0, 9.0), **({"link_masses": (2.0, 1.0)} | changes))


WRONG: list[tuple[dict[str, Any], str]] = [
    ({"link_masses": (2.0,)}, "link_masses: 1 values for 2 links"),
    ({"link_masses": (2.0, 0.0)}, "link_masses: 0 is not within 1e-09 and 1e+09 kg"),
    ({"max_torque": (5.0, 0.0)}, "max_torque: 0 is not within 1e-09 and 1e+12 N m"),
    ({"link_centers": (0.5,)}, "link_centers: 1 values for 2 links"),
    ({"link_inertias": (0.1, -0.1)}, "link_inertias: -0.1 is not within 0 and 1e+12 kg m^2"),
    ({"viscous_friction": (0.1, -0.1)}, "viscous_friction: -0.1 is not within 0 and 1e+12 N m s"),
    ({"coulomb_friction": (0.1, -0.1)}, "coulomb_friction: -0.1 is not within 0 and 1e+12 N m"),
    ({"gravity": (0.0, -1e7)}, "gravity: -1e+07 is not within -1e+06 and 1e+06 m/s^2"),
    *(
        ({key: (1.0, 1.0), "link_masses": None}, f"{key}: link_masses are needed with it: without them no torque is")
        for key in ("max_torque", "link_centers", "link_inertias", "viscous_friction", "coulomb_friction")
    ),
    ({"payload": planar_payload(1.0), "link_masses": None}, "payload: link_masses are needed with it"),
]


def test_rods_are_uniform_unless_stated() -> None:
    stated = planar(link_centers=(0.5, 0.5), link_inertias=(2.0 / 12.0, 1.0 / 12.0))
    theta, speed, acceleration = (np.array([[0.3, -0.7]]) * factor for factor in (1.0, 2.0, 3.0))
    implied = planar().dynamics.torques(theta, speed, acceleration)
    assert np.array(stated.dynamics.torques(theta, speed, acceleration)) == pytest.approx(np.array(implied))


def test_an_arm_without_masses_knows_no_torque() -> None:
    arm = planar(link_masses=None)
    assert arm.rigid_chain is None
    with pytest.raises(InvalidProblem, match="robot: no masses are known, so that torques are not"):
        arm.dynamics.torques(*np.zeros((3, 1, 2)))


def test_settings_of_a_file() -> None:
    table = {"link_lengths": [1.0, 1.0], "max_speed": 3.0, "max_acceleration": 9.0, "link_masses": 2.0}
    motors = {"max_torque": 50.0, "viscous_friction": 0.1, "coulomb_friction": [0.0, 0.2], "gravity": [1.0, 2.0]}
    arm = PlanarArm.from_settings(table | motors | {"payload": {"mass": 3.0, "center": [0.1, 0.2], "inertia": 0.05}})
    assert (arm.link_masses, arm.max_torque, arm.gravity) == ((2.0, 2.0), (50.0, 50.0), (1.0, 2.0))
    assert arm.payload == planar_payload(3.0, (0.1, 0.2), 0.05)
    assert arm.limits.torque == (50.0, 50.0)
    with pytest.raises(InvalidProblem, match=r"^gravity: two numbers are needed"):
        PlanarArm.from_settings(table | {"gravity": 9.81})
    with pytest.raises(InvalidProblem, match=r"^link_masses: numbers are needed, not 'two'"):
        PlanarArm.from_settings(table | {"link_masses": "two"})


# Payloads


def box(*rows: Any) -> Any:
    return tuple(tuple(row) for row in rows)


WRONG_PAYLOADS: list[tuple[dict[str, Any], str]] = [
    ({"mass": -1.0}, "payload.mass: -1 is not within 0 and 1e+09 kg"),
    ({"center": (0.0, 1e9, 0.0)}, "payload.center: 1e+09 is not within"),
    ({"matrix": box((1e13, 0, 0), (0, 1, 0), (0, 0, 1))}, "payload.inertia: 1e+13 is not within -1e+12 and 1e+12 kg"),
    ({"matrix": box((1, 0.1, 0), (0, 1, 0), (0, 0, 1))}, "payload.inertia: the matrix is not symmetric"),
    ({"matrix": box((1, 2, 0), (2, 1, 0), (0, 0, 2))}, "payload.inertia: principal moments -1, 2 and 3 kg m^2: one is"),
    (
        {"matrix": box((1, 0, 0), (0, 1, 0), (0, 0, 2.5))},
        "payload.inertia: principal moments 1, 1 and 2.5 kg m^2: the largest is above the sum of the others",
    ),
]


WRONG_TABLES: list[tuple[Any, str]] = [
    (3.0, "payload: a table with a mass is needed; its keys are mass, center, inertia"),
    ({"mass": 1.0, "weight": 9.81}, "payload: a table with a mass is needed"),
    ({"mass": 1.0, "center": [0.0, 0.0, 0.1]}, "payload.center: two numbers are needed, along the last link"),
    ({"mass": 1.0, "center": [0.0, "far"]}, "payload.center: a number is needed, not 'far'"),
    ({"mass": 1.0, "inertia": [1.0]}, "payload.inertia: a number is needed, not [1.0]"),
    ({"mass": 1.0, "inertia": -1.0}, "payload.inertia: -1 is not within 0 and 1e+12 kg m^2"),
]


def test_inertias_that_a_body_can_have() -> None:
    """A thin rod and a flat disc are on the edge, rounded figures a little beyond it."""
    assert inertia_fault(box((1, 0, 0), (0, 1, 0), (0, 0, 0))) is None
    assert inertia_fault(box((1, 0, 0), (0, 1, 0), (0, 0, 2))) is None
    assert inertia_fault(box((1, 0, 0), (0, 1, 0), (0, 0, 2.000001))) is None


# Robots in space


def crane(text: str = ARM) -> RobotDescription:
    return read_urdf(text, tip_link="tool0")


HEAVY = ARM.replace('name="jib">', 'name="jib"><inertial><mass value="1.5"/></inertial>')


WRONG_IN_SPACE: list[tuple[dict[str, Any], str]] = [
    ({"max_torque": 1e13}, "max_torque: 1e+13 is not within"),
    ({"viscous_friction": -1.0}, "viscous_friction: -1 is not within 0 and 1e+12 N m s"),
    ({"coulomb_friction": [1.0, -2.0]}, "coulomb_friction: -2 is not within 0 and 1e+12 N m"),
    ({"gravity": (0.0, 0.0, NAN)}, "gravity: nan is not within"),
]
REFUSED: list[tuple[Callable[[Any], object], Any, str]] = [
    *((lambda changes: planar(**changes), *each) for each in WRONG),
    *((lambda changes: Payload(**({"mass": 1.0} | changes)), *each) for each in WRONG_PAYLOADS),
    *((planar_payload_of, *each) for each in WRONG_TABLES),
    *((lambda given: crane(HEAVY).arm(max_acceleration=1.0, **given), *each) for each in WRONG_IN_SPACE),
]


@pytest.mark.parametrize(("make", "given", "message"), REFUSED, ids=[message[:45] for *_, message in REFUSED])
def test_what_is_wrong_is_named(make: Callable[[Any], object], given: Any, message: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        make(given)
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(
    ("key", "value"),
    [("max_torque", 5.0), ("viscous_friction", 1.0), ("coulomb_friction", 1.0), ("payload", Payload(mass=1.0))],
)
def test_what_has_no_effect_without_masses_is_refused(key: str, value: Any) -> None:
    text = ARM.replace('<mass value="0.5"/>', "")  # of what the jib carries
    with pytest.raises(InvalidProblem, match=f"^{key}: torques are not known: no masses are stated for jib$"):
        crane(text).arm(max_acceleration=1.0, **{key: value})
    assert crane(text).arm(max_acceleration=1.0).rigid_chain is None


def test_torques_are_limited_where_efforts_and_masses_are_known() -> None:
    assert crane(HEAVY).arm(max_acceleration=1.0).max_torque == (40.0, 300.0)
    unstated = HEAVY.replace('effort="40"', 'effort="0"')  # as exporters write what they do not know
    assert crane(unstated).arm(max_acceleration=1.0).max_torque is None
    assert crane(unstated).arm(max_acceleration=1.0, max_torque=[7.0, 9.0]).max_torque == (7.0, 9.0)


def test_friction_of_the_urdf_may_be_overridden() -> None:
    assert [(joint.damping, joint.friction) for joint in crane(HEAVY).chain.joints] == [(0.7, 0.2), (0.0, 0.0)]
    other = crane(HEAVY).arm(max_acceleration=1.0, viscous_friction=[0.0, 2.0])
    assert [(joint.damping, joint.friction) for joint in other.chain.joints] == [(0.0, 0.2), (2.0, 0.0)]
    assert not crane(HEAVY).arm(max_acceleration=1.0, coulomb_friction=0.0).dynamics.has_friction


def test_units_of_torques() -> None:
    assert crane(HEAVY).arm(max_acceleration=1.0).joints.torque_units == ("N m", "N")


def test_an_inertia_that_no_body_has_is_noted() -> None:
    notes = crane(ARM.replace('izz="0.3"', 'izz="0.9"')).notes
    assert "link 'mast': no body has its inertia, principal moments 0.1, 0.2 and 0.9 kg m^2: the largest is" in notes[0]
    assert not any("no body" in note for note in crane().notes)


def test_torques_of_what_no_body_is_are_not_known() -> None:
    inertia_fault = crane(HEAVY.replace('izz="0.3"', 'izz="0.9"'))
    assert inertia_fault.arm(max_acceleration=1.0).max_torque is None
    for stated in ({"max_torque": [7.0, 9.0]}, {"payload": Payload(mass=1.0)}, {"coulomb_friction": 0.0}):
        with pytest.raises(InvalidProblem, match="torques are not known: link 'mast': no body has its inertia"):
            inertia_fault.arm(max_acceleration=1.0, **stated)


@pytest.mark.parametrize(("old", "new", "said"), [
    ('mass value="', 'mass value="1e12" unused="', "a mass of 1e+12 kg; from 0 to 1e+09 kg can be computed with"),
    ('mass value="', 'mass value="-1" unused="', "a mass of -1 kg"),
    ('izz="0.3"', 'izz="1e13"', "izz of <inertia> is 1e+13, out of range"),
])  # fmt: skip
def test_masses_are_those_of_something(old: str, new: str, said: str) -> None:
    with pytest.raises(InvalidProblem) as refused:
        crane(HEAVY.replace(old, new))
    assert said in refused.value.reason, refused.value.reason


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_inertias_are_those_of_bodies(name: str) -> None:
    for joint in built_in(name).chain.joints:
        assert joint.inertia is not None
        assert joint.inertia.mass > 0.0
        assert inertia_fault(joint.inertia.matrix) is None
