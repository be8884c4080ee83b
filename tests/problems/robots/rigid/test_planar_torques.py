"""Torques of planar arms: Lagrange's equations, derived by CasADi from energies, and figures computed by hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import pi
from typing import Any

import casadi as ca
import numpy as np
import pytest

from problems import PlanarArm
from problems.base import Arguments
from problems.robots import planar_payload

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


CASES = list(
    product((2, 3, 4), ({}, OFFSET, OFFSET | {"link_centers": (0.1, -0.2, 0.3, 0.05)}), ((0.0, -9.81), (4.0, 1.0)))
)


@pytest.mark.parametrize(("links", "changes", "gravity"), CASES)
def test_lagranges_equations(links: int, changes: dict[str, Any], gravity: tuple[float, float]) -> None:
    centers = {"link_centers": changes["link_centers"][:links]} if "link_centers" in changes else {}
    arm = arm_of(links, gravity=gravity, **(changes | centers))
    states = np.random.default_rng(3).normal(size=(100, 3, links)) * [[1.5], [2.0], [10.0]]
    lagrange = by_lagrange(arm)
    expected = [np.array(lagrange(*state)).ravel() for state in states]
    found = np.array(arm.inverse_dynamics(*(ca.DM(states[:, part]) for part in range(3))))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


def torques(arm: PlanarArm, theta: Any, speed: Any = (0.0, 0.0), acceleration: Any = (0.0, 0.0)) -> list[float]:
    values = arm.inverse_dynamics(*(ca.DM([part]) for part in (theta, speed, acceleration)))
    return [float(value) for value in np.array(values).ravel()]


RODS = PlanarArm((1.0, 1.0), (3.0, 3.0), (9.0, 9.0), link_masses=(2.0, 2.0))  # uniform
FLAT = replace(RODS, gravity=(0.0, 0.0))


def test_rods_held_straight_out() -> None:
    """2 kg at 0.5 m and 2 kg at 1.5 m from the shoulder; 3 kg more at the tool."""
    assert torques(RODS, (0.0, 0.0)) == pytest.approx([2 * 9.81 * 0.5 + 2 * 9.81 * 1.5, 2 * 9.81 * 0.5])
    loaded = replace(RODS, payload=planar_payload(3.0))
    assert torques(loaded, (0.0, 0.0)) == pytest.approx([2 * 9.81 * 2.0 + 3 * 9.81 * 2.0, 9.81 + 3 * 9.81])
    assert torques(loaded, (pi / 2.0, 0.0)) == pytest.approx([0.0, 0.0], abs=1e-13)
    assert torques(replace(RODS, base_angle=pi / 2.0), (0.0, 0.0)) == pytest.approx([0.0, 0.0], abs=1e-13)


def test_a_rod_speeds_up() -> None:
    """A uniform rod has m l^2 / 3 about its end: 2 / 3 alone, 4 kg over 2 m as one 16 / 3."""
    assert torques(FLAT, (0.4, 0.0), acceleration=(3.0, 0.0))[0] == pytest.approx(16.0)
    assert torques(FLAT, (0.4, 0.3), acceleration=(0.0, 3.0))[1] == pytest.approx(2.0)


def test_a_turning_shoulder_pulls_at_the_elbow() -> None:
    """At right angles the outer rod's centre, 0.5 m out, is drawn to the shoulder with m w^2 times 1 m."""
    assert torques(FLAT, (0.0, pi / 2.0), speed=(2.0, 0.0)) == pytest.approx([0.0, 2.0 * 4.0 * 0.5 * 1.0])


def test_friction_is_against_the_motion() -> None:
    rough = replace(FLAT, viscous_friction=(0.5, 0.0), coulomb_friction=(0.2, 0.1))
    free = torques(FLAT, (0.0, 0.0), speed=(2.0, -1.0))
    assert np.subtract(torques(rough, (0.0, 0.0), speed=(2.0, -1.0)), free) == pytest.approx([1.0 + 0.2, -0.1])
    assert torques(rough, (0.0, 0.0)) == pytest.approx([0.0, 0.0])
    assert rough.massive.has_friction
    assert not replace(rough, coulomb_friction=(0.0, 0.0)).massive.has_friction


def test_code_for_any_masses() -> None:
    """Compiled with symbols for masses, friction and payload, it serves other numbers; zeros cost nothing."""
    arm = arm_of(3, viscous_friction=(0.1, 0.2, 0.3), coulomb_friction=(0.0, 0.0, 0.0), **OFFSET)
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(arm)
    assert not symbolic_copy.massive.has_friction
    rows = [ca.SX.sym(name, 1, 3) for name in "qva"]
    code = ca.Function("torques", [*rows, arguments.symbols], [symbolic_copy.inverse_dynamics(*rows)])
    other = replace(arm, link_masses=(1.0, 2.0, 3.0), payload=planar_payload(0.5, (0.1, 0.1), 0.1))
    values, state = Arguments(), np.random.default_rng(5).normal(size=(3, 3))
    values.symbolic_copy(other)
    found = np.array(code(*state, values.values)).ravel()
    assert found == pytest.approx(np.array(by_lagrange(other)(*state)).ravel() + state[1] * [0.1, 0.2, 0.3])
