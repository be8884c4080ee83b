"""Robots in space against Pinocchio, at 200 random states of each: poses, Jacobians, torques."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.urdf import ARM
from scipy.spatial.transform import Rotation

from problems.base import Arguments
from problems.robots import (
    BUILT_IN,
    FixedFrame,
    Payload,
    RobotDescription,
    SpatialArm,
    Transform,
    built_in,
    matrix_of,
    read_urdf,
    tool_jacobian,
)

pin = pytest.importorskip("pinocchio")

STATES = 200


class UrdfOracle:
    """Pinocchio's model of a URDF, all joints off the chain at 0."""

    def __init__(self, text: str, description: RobotDescription) -> None:
        self.model = pin.buildModelFromXML(text)
        self.data = self.model.createData()
        self.joints = [self.model.joints[self.model.getJointId(joint.name)] for joint in description.chain.joints]
        self.tip = self.model.getFrameId(description.chain.tip_link)

    def spread(self, values: np.ndarray, rates: bool = False) -> np.ndarray:
        full = np.zeros(self.model.nv) if rates else pin.neutral(self.model)
        full[[joint.idx_v if rates else joint.idx_q for joint in self.joints]] = values
        return full

    def pose(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        pin.framesForwardKinematics(self.model, self.data, self.spread(theta))
        place = self.data.oMf[self.tip]
        return place.translation, place.rotation

    def jacobian(self, theta: np.ndarray) -> np.ndarray:
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        full = pin.computeFrameJacobian(self.model, self.data, self.spread(theta), self.tip, frame)
        return np.array(full[:, [joint.idx_v for joint in self.joints]])

    def torques(self, theta: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        rates = (self.spread(values, rates=True) for values in (speed, acceleration))
        full = pin.rnea(self.model, self.data, self.spread(theta), *rates)
        return np.array(full[[joint.idx_v for joint in self.joints]])


def robots() -> dict[str, tuple[str, RobotDescription]]:
    folder = files("problems.robots") / "models"
    found = {name: (folder.joinpath(f"{name}.urdf").read_text(), built_in(name)) for name in BUILT_IN}
    tilted = ARM.replace('xyz="0 0 0.5"/><axis xyz="0 0 2"/>', 'rpy="0.3 -0.7 2"/><axis xyz="1 -2 0.5"/>')
    assert tilted != ARM
    return found | {"crane": (tilted, read_urdf(tilted, tip_link="tool0"))}


@pytest.fixture(params=[*BUILT_IN, "crane"])
def case(request: Any) -> tuple[RobotDescription, UrdfOracle, np.ndarray]:
    text, description = robots()[request.param]
    low, high = np.array([joint.position for joint in description.chain.joints]).T
    states = np.random.default_rng(7).uniform(low, high, (STATES, len(low)))
    return description, UrdfOracle(text, description), states


Case = tuple[RobotDescription, UrdfOracle, np.ndarray]


def test_poses(case: Case) -> None:
    description, oracle, states = case
    position, rotation = (np.array(part) for part in description.drawn.tool.pose(ca.DM(states)))
    for theta, place, turn in zip(states, position, rotation.reshape(-1, 3, 3), strict=True):
        expected_place, expected_turn = oracle.pose(theta)
        np.testing.assert_allclose(place, expected_place, atol=5e-15)
        np.testing.assert_allclose(turn, expected_turn, atol=5e-15)


def test_jacobians(case: Case) -> None:
    description, oracle, states = case
    theta = ca.SX.sym("theta", 1, states.shape[1])
    jacobian = ca.Function("jacobian", [theta], [tool_jacobian(description.drawn, theta)])
    for state in states:
        np.testing.assert_allclose(np.array(jacobian(state)), oracle.jacobian(state), atol=1e-14)


def test_torques_of_folded_masses(case: Case) -> None:
    description, oracle, states = case
    chain = Oracle(description.arm(**GIVEN))
    rates = np.random.default_rng(8).normal(size=(2, *states.shape))
    for theta, speed, acceleration in zip(states, *rates, strict=True):
        found = pin.rnea(chain.model, chain.data, theta, speed, acceleration)
        np.testing.assert_allclose(found, oracle.torques(theta, speed, acceleration), atol=2e-12)


TOLERANCE = 1e-9  # N m
BOX = ((0.02, 0.004, -0.003), (0.004, 0.03, 0.005), (-0.003, 0.005, 0.025))
PAYLOAD = Payload(mass=3.0, center=(0.02, -0.03, 0.05), matrix=BOX)
OTHER = ((0.2, 0.0, 0.01), (0.0, 0.3, 0.0), (0.01, 0.0, 0.4))
TOOL = Transform(matrix_of(Rotation.from_euler("xyz", (0.3, -0.2, 1.1)).as_quat()), (0.01, 0.02, 0.1))
WALL = Transform(matrix_of(Rotation.from_euler("xyz", (0.0, np.pi / 2.0, 0.0)).as_quat()), (0.0, 1.0, 2.0))
TILTED = Transform(matrix_of(Rotation.from_euler("xyz", (0.4, -0.9, 2.0)).as_quat()))
CRANE = (
    ARM.replace('xyz="0 0 0.5"/><axis xyz="0 0 2"/>', 'rpy="0.3 -0.7 2"/><axis xyz="1 -2 0.5"/>')
    .replace('name="jib">', 'name="jib"><inertial><mass value="1.5"/><origin xyz="0.1 0.2 0"/></inertial>')
    .replace('effort="300"/>', 'effort="300"/><dynamics damping="5" friction="2"/>')
)
GIVEN = {"max_acceleration": 10.0, "max_jerk": 100.0}
SETTINGS: dict[str, dict[str, Any]] = {
    "bare": {},
    "with a payload": {"payload": PAYLOAD},
    "with a payload on a turned tool": {"payload": PAYLOAD, "tool": TOOL},
    "on a wall": {"base": WALL, "payload": PAYLOAD},
    "tilted, gravity too": {"base": TILTED, "gravity": (1.0, -2.0, -3.0)},
    "with friction": {"viscous_friction": 0.7, "coulomb_friction": 0.4},
    "in space": {"gravity": (0.0, 0.0, 0.0)},
}


def arm_of(name: str, settings: dict[str, Any]) -> SpatialArm:
    description = read_urdf(CRANE, tip_link="tool0") if name == "crane" else built_in(name)
    return description.arm(**GIVEN, **settings)


def placed(frame: FixedFrame) -> Any:
    return pin.SE3(np.array(frame.rotation), np.array(frame.translation))


class Oracle:
    """Pinocchio's model of an arm's chain on its base, with the payload as a body of its own on the tool."""

    def __init__(self, arm: SpatialArm) -> None:
        self.model, last = pin.Model(), 0
        self.model.gravity = pin.Motion(np.array(arm.gravity), np.zeros(3))
        place = placed(arm.base_frame)
        for joint in arm.chain.joints:
            kind = pin.JointModelRevoluteUnaligned if joint.turns else pin.JointModelPrismaticUnaligned
            at_zero = placed(joint.pose)
            last = self.model.addJoint(last, kind(np.array(joint.axis)), place * at_zero, joint.name)
            place = pin.SE3.Identity()
            assert joint.inertia is not None
            self.carry(last, joint.inertia, place)
        if arm.payload is not None:
            self.carry(last, arm.payload, placed(arm.chain.tip) * placed(arm.tool_in_tip))
        self.data = self.model.createData()
        self.damping = np.array([joint.damping for joint in arm.chain.joints])
        self.friction = np.array([joint.friction for joint in arm.chain.joints])

    def carry(self, joint: int, body: Any, place: Any) -> None:
        inertia = pin.Inertia(body.mass, np.array(body.center), np.array(body.matrix))
        self.model.appendBodyToJoint(joint, inertia, place)

    def torques(self, theta: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        moving = np.array(pin.rnea(self.model, self.data, theta, speed, acceleration))
        return np.asarray(moving + self.damping * speed + self.friction * np.sign(speed))


def states_of(arm: SpatialArm) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Postures between the limits, speeds up to those of the joints, accelerations up to 20 rad/s^2."""
    assert arm.position_limits is not None
    random = np.random.default_rng(7)
    low, high = np.array(arm.position_limits).T
    shape, speed = (STATES, arm.dof), np.array(arm.max_speed)
    return random.uniform(low, high, shape), random.uniform(-speed, speed, shape), random.uniform(-20.0, 20.0, shape)


@pytest.mark.parametrize("settings", SETTINGS)
@pytest.mark.parametrize("name", [*BUILT_IN, "crane"])
def test_torques(name: str, settings: str) -> None:
    arm = arm_of(name, SETTINGS[settings])
    oracle, states = Oracle(arm), states_of(arm)
    found = np.array(arm.dynamics.torques(*(ca.DM(part) for part in states)))
    expected = [oracle.torques(*state) for state in zip(*states, strict=True)]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=TOLERANCE)


@pytest.mark.parametrize("name", BUILT_IN)
def test_code_for_any_payload(name: str) -> None:
    """Compiled with symbols for a payload's numbers, it serves another payload."""
    arm = arm_of(name, {"payload": PAYLOAD})
    states = states_of(arm)
    rows = [ca.SX.sym(part, 1, arm.dof) for part in ("theta", "speed", "acceleration")]
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(arm)
    code = ca.Function("torques", [*rows, arguments.symbols], [symbolic_copy.dynamics.torques(*rows)])
    heavier = replace(arm, payload=Payload(mass=5.0, center=(0.1, 0.2, 0.3), matrix=OTHER))
    for carrying in (arm, heavier):
        values = Arguments()
        values.symbolic_copy(carrying)
        oracle = Oracle(carrying)
        for state in list(zip(*states, strict=True))[:50]:
            found = np.array(code(*state, values.values)).ravel()
            np.testing.assert_allclose(found, oracle.torques(*state), atol=TOLERANCE)
