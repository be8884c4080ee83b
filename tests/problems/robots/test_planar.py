"""Forward and inverse kinematics against complex exponentials, for any arm."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import InvalidProblem, PlanarArm
from problems.base import as_array
from problems.robots import wrap_to
from problems.robots.planar_links import angular_range, restore

lengths = st.lists(st.floats(0.1, 2.0), min_size=2, max_size=6)
angle = st.floats(-np.pi, np.pi)


def arm_of(link_lengths: list[float], **more: object) -> PlanarArm:
    k = len(link_lengths)
    return PlanarArm(tuple(link_lengths), (1.0,) * k, (1.0,) * k, **more)


def tip_of(link_lengths: list[float], theta: np.ndarray) -> complex:
    return complex(np.sum(np.array(link_lengths) * np.exp(1j * np.cumsum(theta))))


def as_point(z: complex) -> ca.DM:
    return ca.DM([z.real, z.imag])


@given(lengths, st.data())
def test_forward_kinematics_is_a_sum_of_turned_links(links: list[float], data: st.DataObject) -> None:
    theta = np.array(data.draw(st.lists(angle, min_size=len(links), max_size=len(links))))
    positions = arm_of(links).positions(ca.DM(theta).T)
    assert len(positions) == len(links) + 1
    x, y = np.vstack([as_array(matrix) for matrix in positions]).T
    joints = np.concatenate([[0.0], np.cumsum(np.array(links) * np.exp(1j * np.cumsum(theta)))])
    assert x == pytest.approx(joints.real, abs=1e-12)
    assert y == pytest.approx(joints.imag, abs=1e-12)
    assert (arm_of(links).skeleton(theta[None])[0] == np.column_stack([x, y])).all()
    assert as_array(arm_of(links).tool(ca.DM(theta).T))[0].tolist() == [x[-1], y[-1]]


@given(lengths, st.data())
def test_inverse_kinematics_finds_the_posture_again(links: list[float], data: st.DataObject) -> None:
    theta = np.array(data.draw(st.lists(angle, min_size=len(links), max_size=len(links))))
    arm, elbow = arm_of(links), 1.0 if np.sin(theta[1]) >= 0.0 else -1.0
    theta_found, cosine = arm.inverse(as_point(tip_of(links, theta)), ca.DM(np.cumsum(theta)[2:]), elbow)
    again = np.asarray(theta_found).ravel()
    assert abs(tip_of(links, again) - tip_of(links, theta)) < 1e-6
    assert float(cosine) == pytest.approx(np.cos(theta[1]), abs=1e-6)
    assert np.sign(np.sin(again[1])) * elbow >= 0.0 or abs(np.sin(again[1])) < 1e-12


@settings(max_examples=200)
@given(lengths, angle, st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4), st.floats(0.0, 1.0))
def test_normalised_redundancy_always_reaches(links: list[float], direction: float, x: list[float], far: float) -> None:
    arm = arm_of(links)
    inner, outer = arm.reach()
    target = (inner + far * (outer - inner)) * np.exp(1j * direction)
    phi = arm.restore_redundancy(as_point(target), ca.DM(x[: arm.links - 2]))
    theta, _ = arm.inverse(as_point(target), phi, 1.0)
    assert abs(tip_of(links, np.asarray(theta).ravel()) - target) < 1e-6


def test_normalised_redundancy_covers_both_intervals_around_a_hole() -> None:
    arm, target = arm_of([1.4, 0.5, 0.8]), 1.3
    scan = np.linspace(-np.pi, np.pi, 4001)
    reached = np.abs(target - 0.8 * np.exp(1j * scan))
    allowed = (reached >= 0.9) & (reached <= 1.9)
    _, beta_in, beta_out = (float(v) for v in angular_range(arm.link_lengths, 3, as_point(target)))
    assert beta_in > 0.0
    assert (allowed == ((np.abs(scan) >= beta_in) & (np.abs(scan) <= beta_out))).all()
    values = {x: float(restore(arm.link_lengths, as_point(target), ca.DM([x]))) for x in (0.0, 0.5 - 1e-12, 0.5, 1.0)}
    assert list(values.values()) == pytest.approx([-beta_out, -beta_in, beta_in, beta_out], abs=1e-9)


@pytest.mark.parametrize(
    ("links", "point"),
    [([1.0, 1.0], 2.0), ([1.0, 1.0], 0.0), ([1.0, 1.0, 1.0], 3.0), ([1.0, 1.0, 1.0], 0.0), ([2.0, 0.5, 0.5], 1.0)],
    ids=["time_scaled", "folded", "time_scaled 3", "on the base", "edge of the hole"],
)
def test_edges_of_the_reach_are_no_nan(links: list[float], point: float) -> None:
    arm = arm_of(links)
    for x in np.linspace(0.0, 1.0, 7):
        phi = arm.restore_redundancy(as_point(point), ca.DM([x] * (arm.links - 2)))
        theta, _ = arm.inverse(as_point(point), phi, -1.0)
        assert np.isfinite(np.asarray(theta)).all()
        assert abs(tip_of(links, np.asarray(theta).ravel()) - point) < 1e-6


@given(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0))
def test_nearest_turn(given_angle: float, reference: float) -> None:
    angle = float(wrap_to(ca.DM(given_angle), ca.DM(reference)))
    assert abs(angle - reference) <= np.pi + 1e-9
    assert np.exp(1j * angle) == pytest.approx(np.exp(1j * given_angle), abs=1e-9)


def test_joint_limits_decide_the_turn() -> None:
    free, limited = arm_of([1.0, 1.0]), arm_of([1.0, 1.0], joint_limits=((0.0, 2.0 * np.pi), (-4.0, 1.0)))
    theta = ca.DM([-0.5, 3.0]).T
    assert np.asarray(free.wrap(theta)).ravel() == pytest.approx([-0.5, 3.0])
    assert np.asarray(limited.wrap(theta)).ravel() == pytest.approx([2.0 * np.pi - 0.5, 3.0 - 2.0 * np.pi])
    near = limited.wrap_near(ca.DM([-0.1, 2.9]).T, ca.DM([0.1, 0.5]).T)
    assert np.asarray(near).ravel() == pytest.approx([2.0 * np.pi - 0.1, 2.9 - 2.0 * np.pi])


@given(lengths, st.data())
def test_snapping_puts_the_tip_on_its_point_and_moves_little(links: list[float], data: st.DataObject) -> None:
    theta = np.array(data.draw(st.lists(angle, min_size=len(links), max_size=len(links))))
    if abs(np.sin(theta[1])) < 0.1:
        theta[1] = 0.5
    moved = tip_of(links, theta) + 1e-6
    project_to_point = np.asarray(arm_of(links).project_to_point(ca.DM(theta).T, as_point(moved))).ravel()
    assert abs(tip_of(links, project_to_point) - moved) < 1e-12
    assert np.abs(project_to_point - theta).max() < 1e-3


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"link_lengths": (1.0,)}, "link_lengths"),
        ({"link_lengths": (1.0, 0.0)}, "link_lengths"),
        ({"link_lengths": (1.0, -1.0)}, "link_lengths"),
        ({"link_lengths": (1.0, float("nan"))}, "link_lengths"),
        ({"max_speed": (1.0,)}, "max_speed"),
        ({"max_speed": (1.0, float("inf"))}, "max_speed"),
        ({"max_acceleration": (1.0, 0.0)}, "max_acceleration"),
        ({"joint_limits": ((0.0, 1.0),)}, "joint_limits"),
        ({"joint_limits": ((0.0, 1.0), (1.0, 1.0))}, "joint_limits"),
    ],
)
def test_impossible_arms(changes: dict[str, tuple[float, ...]], field: str) -> None:
    valid = {"link_lengths": (1.0, 1.0), "max_speed": (1.0, 1.0), "max_acceleration": (1.0, 1.0)}
    with pytest.raises(InvalidProblem) as caught:
        PlanarArm(**(valid | changes))
    assert caught.value.field == field
