"""Motors that give no torque leave the energy of an arm as it is, however it swings."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from problems import PlanarArm
from problems.robots import BUILT_IN, Payload, Robot, SpatialArm, built_in, planar_payload

SECONDS = 0.4
TOLERANCE = 1e-7  # of the energy that moves to and fro
Heights = Callable[[ca.SX], ca.SX]


def drift(robot: Robot, potential: Heights, theta: np.ndarray, speed: np.ndarray) -> float:
    """By how much kinetic and potential energy change in free motion, as a part of the largest kinetic one."""
    k, chain = robot.dof, robot.massive
    q, v = ca.SX.sym("q", 1, k), ca.SX.sym("v", 1, k)
    still = ca.SX(1, k)
    mass = ca.vertcat(*(chain.inertial(q, still, ca.SX(ca.DM.eye(k)[joint, :])) for joint in range(k)))
    fall = ca.Function("fall", [q, v], [ca.solve(mass, -chain.torques(q, v, still).T)])
    energies = ca.Function("energies", [q, v], [ca.bilin(mass, v.T, v.T) / 2.0, potential(q)])

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        return np.concatenate([state[k:], np.array(fall(state[:k], state[k:])).ravel()])

    motion = solve_ivp(rates, (0.0, SECONDS), np.concatenate([theta, speed]), "DOP853", rtol=1e-10, atol=1e-10)
    assert motion.success
    kinetic, height = np.array([[float(part) for part in energies(row[:k], row[k:])] for row in motion.y.T]).T
    assert np.ptp(kinetic) > 1e-3  # it does move
    return float(np.ptp(kinetic + height) / kinetic.max())


def planar_potential(arm: PlanarArm) -> Heights:
    def energy(q: ca.SX) -> ca.SX:
        ends, masses = arm.positions(q), arm.link_masses or ()
        middles = [(one + two) / 2.0 for one, two in pairwise(ends)]
        places = [*zip(masses, middles, strict=False), (arm.payload.mass if arm.payload else 0.0, ends[-1])]
        return -sum(mass * ca.dot(ca.DM(arm.gravity).T, place) for mass, place in places)

    return energy


def spatial_potential(arm: SpatialArm) -> Heights:
    def energy(q: ca.SX) -> ca.SX:
        frames = arm.chain.frames(q, arm.base_frame)
        bodies = [(joint.inertia, frame) for joint, frame in zip(arm.chain.joints, frames[1:], strict=True)]
        bodies.append((arm.payload, frames[-1] @ arm.tool_frame))
        return -sum(
            body.mass * sum(g * part for g, part in zip(arm.gravity, frame.apply(body.center), strict=True))
            for body, frame in bodies
            if body is not None
        )

    return energy


@settings(max_examples=10, deadline=None)
@given(
    links=st.integers(2, 3),
    masses=st.lists(st.floats(0.5, 5.0), min_size=3, max_size=3),
    payload=st.floats(0.0, 3.0),
    gravity=st.tuples(st.floats(-10.0, 10.0), st.floats(-10.0, -5.0)),
    state=st.lists(st.floats(-3.0, 3.0), min_size=6, max_size=6),
)
def test_a_planar_arm_swings(
    links: int, masses: list[float], payload: float, gravity: tuple[float, float], state: list[float]
) -> None:
    arm = PlanarArm(
        (0.5, 0.4, 0.3)[:links], (1.0,) * links, (1.0,) * links, link_masses=tuple(masses[:links]), gravity=gravity,
        payload=planar_payload(payload),
    )  # fmt: skip
    speed = np.array(state[links : 2 * links]) + 4.0  # not at rest
    assert drift(arm, planar_potential(arm), np.array(state[:links]), speed) < TOLERANCE


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_robot_in_space_falls(name: str) -> None:
    payload = Payload(mass=2.0, center=(0.0, 0.02, 0.1), matrix=((0.01, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02)))
    arm = built_in(name).arm(payload=payload)
    random = np.random.default_rng(1)
    theta, speed = random.uniform(-1.0, 1.0, arm.dof), random.uniform(-1.0, 1.0, arm.dof)
    assert drift(arm, spatial_potential(arm), theta, speed) < TOLERANCE
