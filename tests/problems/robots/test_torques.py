"""Torques of rigid links: by hand, against Lagrange's equations, by energy that is kept, and of regrouped masses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from problems import PlanarArm, Robot
from problems.base import Arguments
from problems.robots import BUILT_IN, Payload, SpatialArm, built_in, planar_payload

LENGTHS, MASSES = (0.5, 0.4, 0.3, 0.2), (3.0, 2.0, 1.5, 0.8)
OFFSET: dict[str, Any] = {
    "base_angle": 0.7,
    "base_point": (0.3, -0.2),
    "tool_offset": (0.05, -0.08),
    "payload": planar_payload(1.2, (0.03, 0.04), 0.02),
}


def arm_of(links: int, **changes: Any) -> PlanarArm:
    known = {"link_masses": MASSES[:links], "link_inertias": (0.1, 0.05, 0.03, 0.01)[:links]}
    limits = {"max_speed": (3.0,) * links, "max_acceleration": (20.0,) * links}
    return PlanarArm(LENGTHS[:links], **(limits | known | changes))


def lagrangian(arm: PlanarArm, q: ca.SX, v: ca.SX) -> ca.SX:
    """Kinetic less potential energy, written with the absolute orientations of the links alone."""
    masses, inertias = arm.link_masses or (), arm.link_inertias or ()
    centers = arm.link_centers or tuple(length / 2.0 for length in arm.link_lengths)
    joint, psi, bodies = ca.SX(ca.DM(arm.base_point)), ca.SX(arm.base_angle), []
    for link, length in enumerate(arm.link_lengths):
        psi = psi + q[link]
        along, left = ca.vertcat(ca.cos(psi), ca.sin(psi)), ca.vertcat(-ca.sin(psi), ca.cos(psi))
        bodies.append((masses[link], inertias[link], joint + centers[link] * along, psi))
        joint = joint + length * along
    if arm.payload is not None:
        x, y = (offset + part for offset, part in zip(arm.tool_offset, arm.payload.center, strict=False))
        bodies.append((arm.payload.mass, arm.payload.matrix[2][2], joint + x * along + y * left, psi))
    energy = ca.SX(0.0)
    for mass, inertia, place, angle in bodies:
        speed, rate = ca.jtimes(place, q, v), ca.jtimes(angle, q, v)
        energy += mass * ca.sumsqr(speed) / 2.0 + inertia * rate**2 / 2.0 + mass * ca.dot(ca.DM(arm.gravity), place)
    return energy


def by_lagrange(arm: PlanarArm) -> ca.Function:
    """d/dt dL/dv - dL/dq with symbols for posture, speed and acceleration."""
    q, v, a = (ca.SX.sym(name, arm.dof) for name in "qva")
    function = lagrangian(arm, q, v)
    momentum = ca.gradient(function, v)
    torques = ca.jtimes(momentum, q, v) + ca.jtimes(momentum, v, a) - ca.gradient(function, q)
    return ca.Function("lagrange", [q, v, a], [torques])


CASES: list[tuple[int, dict[str, Any], tuple[float, float]]] = [
    (2, {}, (0.0, -9.81)),
    (3, OFFSET, (4.0, 1.0)),
    (4, OFFSET | {"link_centers": (0.1, -0.2, 0.3, 0.05)}, (0.0, -9.81)),
]


@pytest.mark.parametrize(("links", "changes", "gravity"), CASES)
def test_lagranges_equations(links: int, changes: dict[str, Any], gravity: tuple[float, float]) -> None:
    centers = {"link_centers": changes["link_centers"][:links]} if "link_centers" in changes else {}
    arm = arm_of(links, gravity=gravity, **(changes | centers))
    states = np.random.default_rng(3).normal(size=(100, 3, links)) * [[1.5], [2.0], [10.0]]
    lagrange = by_lagrange(arm)
    expected = [np.array(lagrange(*state)).ravel() for state in states]
    found = np.array(arm.dynamics.torques(*(ca.DM(states[:, part]) for part in range(3))))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def torques(arm: PlanarArm, theta: Any, speed: Any = (0.0, 0.0), acceleration: Any = (0.0, 0.0)) -> list[float]:
    values = arm.dynamics.torques(*(ca.DM([part]) for part in (theta, speed, acceleration)))
    return [float(value) for value in np.array(values).ravel()]


RODS = PlanarArm((1.0, 1.0), (3.0, 3.0), (9.0, 9.0), link_masses=(2.0, 2.0))  # uniform
FLAT = replace(RODS, gravity=(0.0, 0.0))


def test_friction_is_against_the_motion() -> None:
    rough = replace(FLAT, viscous_friction=(0.5, 0.0), coulomb_friction=(0.2, 0.1))
    free = torques(FLAT, (0.0, 0.0), speed=(2.0, -1.0))
    assert np.subtract(torques(rough, (0.0, 0.0), speed=(2.0, -1.0)), free) == pytest.approx([1.0 + 0.2, -0.1])
    assert torques(rough, (0.0, 0.0)) == pytest.approx([0.0, 0.0])
    assert rough.dynamics.has_friction
    assert not replace(rough, coulomb_friction=(0.0, 0.0)).dynamics.has_friction


def test_code_for_any_masses() -> None:
    """Compiled with symbols for masses, friction and payload, it serves other numbers; zeros cost nothing."""
    arm = arm_of(3, viscous_friction=(0.1, 0.2, 0.3), coulomb_friction=(0.0, 0.0, 0.0), **OFFSET)
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(arm)
    assert not symbolic_copy.dynamics.has_friction
    rows = [ca.SX.sym(name, 1, 3) for name in "qva"]
    code = ca.Function("torques", [*rows, arguments.symbols], [symbolic_copy.dynamics.torques(*rows)])
    other = replace(arm, link_masses=(1.0, 2.0, 3.0), payload=planar_payload(0.5, (0.1, 0.1), 0.1))
    values, state = Arguments(), np.random.default_rng(5).normal(size=(3, 3))
    values.symbolic_copy(other)
    found = np.array(code(*state, values.values)).ravel()
    assert found == pytest.approx(np.array(by_lagrange(other)(*state)).ravel() + state[1] * [0.1, 0.2, 0.3])


SECONDS = 0.4
TOLERANCE = 1e-7  # of the energy that moves to and fro
Heights = Callable[[ca.SX], ca.SX]


def drift(robot: Robot, potential: Heights, theta: np.ndarray, speed: np.ndarray) -> float:
    """By how much kinetic and potential energy change in free motion, as a part of the largest kinetic one."""
    k, chain = robot.dof, robot.dynamics
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


def spatial_potential(arm: SpatialArm) -> Heights:
    def energy(q: ca.SX) -> ca.SX:
        frames = arm.chain.frames(q, arm.base_frame)
        bodies = [(joint.inertia, frame) for joint, frame in zip(arm.chain.joints, frames[1:], strict=True)]
        bodies.append((arm.payload, frames[-1] @ arm.tool.frame))
        return -sum(
            body.mass * sum(g * part for g, part in zip(arm.gravity, frame.apply(body.center), strict=True))
            for body, frame in bodies
            if body is not None
        )

    return energy


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_robot_in_space_falls(name: str) -> None:
    payload = Payload(mass=2.0, center=(0.0, 0.02, 0.1), matrix=((0.01, 0.0, 0.0), (0.0, 0.02, 0.0), (0.0, 0.0, 0.02)))
    arm = built_in(name).arm(payload=payload)
    random = np.random.default_rng(1)
    theta, speed = random.uniform(-1.0, 1.0, arm.dof), random.uniform(-1.0, 1.0, arm.dof)
    assert drift(arm, spatial_potential(arm), theta, speed) < TOLERANCE


UP = (0.0, 0.0, 1.0)


@pytest.mark.parametrize("name", BUILT_IN)
def test_what_is_left_of_bodies_that_turn_about_z(name: str) -> None:
    for joint in built_in(name).chain.rigid:
        assert joint.axis == UP
        assert joint.moments.mass == 0.0
        assert joint.moments.first[2] == 0.0
        assert joint.moments.second[2][2] == 0.0
