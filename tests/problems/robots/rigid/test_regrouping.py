"""Regrouped masses take the torques of the masses themselves."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import as_array
from problems.robots import BUILT_IN, RigidChain, Transform, built_in
from problems.robots.dynamics import RigidJoint, regrouped
from problems.robots.inertia import Inertia
from problems.robots.transform import about

UP = (0.0, 0.0, 1.0)
GRAVITY = (1.0, 2.0, -9.81)
STATES = 20


def chain_of(seed: int, turns: tuple[bool, ...]) -> list[RigidJoint]:
    """Bodies of three balls each, on joints with any axes."""
    random = np.random.default_rng(seed)
    joints = []
    for each in turns:
        axis, offset, center = random.normal(size=(3, 3))
        x, y, z = (axis / np.linalg.norm(axis)).tolist()
        spread = random.normal(size=(3, 3))
        second = spread @ spread.T
        matrix = tuple(map(tuple, (np.trace(second) * np.eye(3) - second).tolist()))
        body = Inertia(mass=random.uniform(0.5, 3.0), center=tuple(center.tolist()), matrix=matrix)  # type: ignore[arg-type]
        pose = Transform(about((y, z, x), float(random.uniform(-3.0, 3.0))), tuple(offset.tolist()))
        joints.append(RigidJoint(pose=_numbers(pose), axis=(x, y, z), turns=each, moments=body.moments()))
    return joints


def _numbers(pose: Transform) -> Transform:
    rows = tuple(tuple(float(entry) for entry in row) for row in pose.rotation)
    return Transform(rows, pose.translation)  # type: ignore[arg-type]


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), turns=st.lists(st.booleans(), min_size=1, max_size=5).map(tuple))
def test_the_same_torques(seed: int, turns: tuple[bool, ...]) -> None:
    joints = chain_of(seed, turns)
    state = [ca.DM(part) for part in np.random.default_rng(seed).normal(size=(3, STATES, len(joints)))]
    plain, other = (RigidChain(joints=tuple(each), gravity=GRAVITY) for each in (joints, regrouped(joints)))
    expected = as_array(plain.torques(*state))
    np.testing.assert_allclose(as_array(other.torques(*state)), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("name", BUILT_IN)
def test_what_is_left_of_bodies_that_turn_about_z(name: str) -> None:
    for joint in built_in(name).chain.rigid:
        assert joint.axis == UP
        assert joint.moments.mass == 0.0
        assert joint.moments.first[2] == 0.0
        assert joint.moments.second[2][2] == 0.0


def test_a_rod_on_the_axis_belongs_to_the_body_before() -> None:
    """2 kg on the axis, 0.3 m up and 0.6 m out: they weigh on the first joint alone."""
    still = Inertia(mass=1.0, center=(0.1, 0.0, 0.0)).moments()
    upper = Inertia(mass=2.0, center=(0.0, 0.0, 0.3)).moments()
    out = Transform(translation=(0.6, 0.0, 0.0))
    one, two = regrouped(
        [
            RigidJoint(pose=Transform(), axis=(0.0, 1.0, 0.0), moments=still),
            RigidJoint(pose=out, axis=UP, moments=upper),
        ]
    )
    assert (two.moments.mass, two.moments.first) == (0.0, (0.0, 0.0, 0.0))
    assert np.array(two.moments.second) == pytest.approx(np.zeros((3, 3)))
    assert one.moments.first == pytest.approx(
        (0.1 + 2.0 * 0.6, 0.0, 2.0 * 0.3)
    )  # about y: nothing of it along the axis
    assert one.moments.mass == 0.0  # on a base that stands still
