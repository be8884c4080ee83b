"""Robots in space against Pinocchio, at 1,000 random states of each: poses, Jacobians, torques of folded masses."""

from __future__ import annotations

from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.urdf import ARM

from problems.robots import BUILT_IN, RobotDescription, built_in, read_urdf, tool_jacobian
from problems.robots.chain import Chain

pin = pytest.importorskip("pinocchio")

STATES = 1_000


class Oracle:
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
    folder = files("problems.robots.spatial.models")
    found = {name: (folder.joinpath(f"{name}.urdf").read_text(), built_in(name)) for name in BUILT_IN}
    tilted = ARM.replace('xyz="0 0 0.5"/><axis xyz="0 0 2"/>', 'rpy="0.3 -0.7 2"/><axis xyz="1 -2 0.5"/>')
    assert tilted != ARM
    return found | {"crane": (tilted, read_urdf(tilted, tip_link="tool0"))}


@pytest.fixture(params=[*BUILT_IN, "crane"])
def case(request: Any) -> tuple[RobotDescription, Oracle, np.ndarray]:
    text, description = robots()[request.param]
    low, high = np.array([joint.position for joint in description.chain.joints]).T
    states = np.random.default_rng(7).uniform(low, high, (STATES, len(low)))
    return description, Oracle(text, description), states


Case = tuple[RobotDescription, Oracle, np.ndarray]


def test_poses(case: Case) -> None:
    description, oracle, states = case
    position, rotation = (np.array(part) for part in description.drawn.tool_pose(ca.DM(states)))
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


def folded(chain: Chain) -> Any:
    """Pinocchio's model of the chain alone, with the masses that were folded into its bodies."""
    model, last = pin.Model(), 0
    for joint in chain.joints:
        kind = pin.JointModelRevoluteUnaligned if joint.turns else pin.JointModelPrismaticUnaligned
        place = pin.SE3(np.array(joint.rotation), np.array(joint.translation))
        last = model.addJoint(last, kind(np.array(joint.axis)), place, joint.name)
        assert joint.inertia is not None
        inertia = pin.Inertia(joint.inertia.mass, np.array(joint.inertia.center), np.array(joint.inertia.matrix))
        model.appendBodyToJoint(last, inertia, pin.SE3.Identity())
    return model


def test_torques_of_folded_masses(case: Case) -> None:
    description, oracle, states = case
    model = folded(description.chain)
    data = model.createData()
    rates = np.random.default_rng(8).normal(size=(2, *states.shape))
    for theta, speed, acceleration in zip(states, *rates, strict=True):
        found = pin.rnea(model, data, theta, speed, acceleration)
        np.testing.assert_allclose(found, oracle.torques(theta, speed, acceleration), atol=2e-12)
