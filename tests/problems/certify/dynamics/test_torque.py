"""Torques for all t, worked out by hand: two uniform rods of 2 kg and 0.5 m, stretched out, turned by the first joint.

Together they are a rod of 4 kg and 1 m: 4/3 kg m^2 about the first joint, and held against gravity by 19.62 N m.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from problems import CertificateStatus, PlanarArm, Trajectory, Verdict
from problems.base import FloatArray
from problems.certify import limit_verdicts
from problems.certify.torque import PROOF_GAP, torque_time_scale
from problems.limits import TorqueLimit
from problems.robots import read_urdf

CERTIFIED, VIOLATED, UNDECIDED = CertificateStatus
INERTIA, HELD = 4.0 / 3.0, 19.62
TINY = 1e-7


def rods(limit: float, **more: Any) -> PlanarArm:
    """The arm, without gravity if nothing else is said."""
    stated: dict[str, Any] = {"gravity": (0.0, 0.0), "link_masses": (2.0, 2.0), **more}
    return PlanarArm((0.5, 0.5), (9.0, 9.0), (99.0, 99.0), max_torque=(limit, 50.0), **stated)


def turning(*pieces: Sequence[float], start: float = 0.0, speed: float = 0.0, length: float = 0.5) -> Trajectory:
    """The first joint's motion from its accelerations, lowest power of each piece's own time first."""
    coefficients = np.zeros((8, len(pieces), 2))
    for number, powers in enumerate(pieces):
        bend = np.polynomial.Polynomial(powers).integ(1, speed).integ(1, start)
        coefficients[7 - np.arange(len(bend.coef)), number, 0] = bend.coef
        start, speed = float(bend(length)), float(bend.deriv()(length))
    return Trajectory(length * np.arange(len(pieces) + 1), coefficients)


def judged(robot: PlanarArm, motion: Trajectory) -> Verdict:
    [verdict] = limit_verdicts([TorqueLimit(robot)], motion)
    return verdict


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_a_constant_torque_exactly_at_its_limit_is_certified(direction: float) -> None:
    verdict = judged(rods(8.0), turning([6.0 * direction]))
    assert (verdict.status, verdict.bound, verdict.unit) == (CERTIFIED, 8.0 * direction, "N m")
    assert verdict.worst == pytest.approx(8.0 * direction, rel=1e-12)
    assert verdict.where.startswith("joint 1, t = ")


def test_a_constant_torque_just_above_its_limit_is_not() -> None:
    assert judged(rods(8.0), turning([6.0 * (1.0 + TINY)])).status is VIOLATED


def peak_at(when: float, height: float = 6.0) -> list[float]:
    """An acceleration that is largest at one time."""
    return [height * (1.0 - 3.0 * when**2), height * 6.0 * when, -3.0 * height]


@pytest.mark.parametrize("when", [0.1234567, 0.31830988, 0.4999, 0.0001])
def test_a_torque_above_its_limit_at_a_single_time_is_found(when: float) -> None:
    verdict = judged(rods(8.0 * (1.0 - TINY)), turning(peak_at(when)))
    assert verdict.status is VIOLATED
    assert verdict.worst == pytest.approx(8.0, rel=1e-9)
    assert verdict.where == f"joint 1, t = {when:.4g} s"
    assert judged(rods(8.0), turning(peak_at(when))).status is CERTIFIED


@pytest.mark.parametrize("pieces", [([3.0], [6.0]), ([6.0], [3.0]), ([0.0, 12.0], [0.0]), ([0.0], [6.0, -12.0])])
def test_both_sides_of_a_jump_count(pieces: tuple[list[float], list[float]]) -> None:
    motion = turning(*pieces)
    assert judged(rods(8.0), motion).status is CERTIFIED
    assert judged(rods(8.0), motion).worst == pytest.approx(8.0, rel=1e-9)
    assert judged(rods(8.0 * (1.0 - TINY)), motion).status is VIOLATED


def test_coulomb_friction_changes_sides_where_a_joint_turns_back() -> None:
    back, friction = turning([-6.0], speed=1.234567), {"coulomb_friction": (1.0, 0.0)}
    assert judged(rods(9.0, **friction), back).status is CERTIFIED  # -8 + 1, then -8 - 1
    assert judged(rods(9.0 * (1.0 - TINY), **friction), back).status is VIOLATED
    forward = turning([-6.0], speed=9.0)
    assert judged(rods(7.0, **friction), forward).status is CERTIFIED
    assert judged(rods(7.0 * (1.0 - TINY), **friction), forward).status is VIOLATED


def test_a_joint_that_only_turns_back_where_its_torque_is_small_needs_no_room_for_friction_elsewhere() -> None:
    motion = turning([0.0, 12.0], speed=-0.06)  # back at 0.1 s
    verdict = judged(rods(9.0, coulomb_friction=(1.0, 0.0)), motion)
    assert (verdict.status, verdict.worst) == (CERTIFIED, pytest.approx(9.0, rel=1e-12))


def test_friction_of_a_joint_that_stands_still_may_act_either_way() -> None:
    still, friction = turning([0.0]), {"coulomb_friction": (1.0, 0.0)}
    assert judged(rods(1.0, **friction), still).status is CERTIFIED
    assert judged(rods(0.99, **friction), still).status is VIOLATED


def test_viscous_friction_counts() -> None:
    motion = turning([6.0])  # to 3 rad/s in 0.5 s
    assert judged(rods(11.0, viscous_friction=(1.0, 0.0)), motion).status is CERTIFIED
    assert judged(rods(11.0 * (1.0 - TINY), viscous_friction=(1.0, 0.0)), motion).status is VIOLATED


def test_what_motors_cannot_hold_breaks_however_slowly_it_is_run() -> None:
    heavy = rods(HELD - 1.0, gravity=(0.0, -9.81))
    verdict = judged(heavy, turning([0.1]))
    assert verdict.status is VIOLATED
    assert verdict.where == "joint 1, t = 0 s, however slowly"
    assert "slowly" not in judged(rods(HELD + 0.1, gravity=(0.0, -9.81)), turning([6.0])).where


def test_a_motion_that_takes_no_torque_is_certified() -> None:
    verdict = judged(rods(8.0), turning([0.0]))
    assert (verdict.status, verdict.worst) == (CERTIFIED, 0.0)


def test_a_motion_that_is_no_number_is_undecided() -> None:
    assert judged(rods(8.0), turning([np.nan])).status is UNDECIDED


LIFT = """<robot name="lift"><link name="floor"/>
<link name="cabin"><inertial><mass value="3"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="rope" type="prismatic"><parent link="floor"/><child link="cabin"/><axis xyz="0 0 1"/>
<limit lower="-5" upper="5" velocity="9" effort="50"/></joint></robot>"""


def test_a_slide_is_lifted_by_a_force() -> None:
    robot = read_urdf(LIFT, tip_link="cabin").arm(max_acceleration=9.0)
    motion = turning([2.0])
    verdict = judged(robot, Trajectory(motion.breakpoints, motion.coefficients[:, :, :1]))
    assert (verdict.status, verdict.unit, verdict.bound) == (CERTIFIED, "N", 50.0)
    assert verdict.worst == pytest.approx(3.0 * (9.81 + 2.0), rel=1e-9)


# Slowing down


def slowed(robot: PlanarArm, motion: Trajectory) -> tuple[float, Verdict]:
    """The time scale, and the verdict on the motion that is run so."""
    scale = torque_time_scale(TorqueLimit(robot), motion)
    return scale, judged(robot, motion.time_scaled(scale) if scale > 0.0 else motion)


@pytest.mark.parametrize(("height", "scale"), [(24.0, 2.0), (6.0, 1.0), (1.5, 0.5)])
def test_a_time_scale_is_that_of_the_largest_torque(height: float, scale: float) -> None:
    found, verdict = slowed(rods(8.0), turning(peak_at(0.1234567, height)))
    assert found == pytest.approx(scale, rel=1e-6)
    assert verdict.status is CERTIFIED


def test_a_time_scale_with_gravity() -> None:
    """Of 19.62 + 8 N m, run s times slower: 19.62 cos(q) + 8 / s^2, largest at the start."""
    found, verdict = slowed(rods(HELD + 2.0, gravity=(0.0, -9.81)), turning([6.0]))
    assert found == pytest.approx(2.0, rel=1e-6)
    assert verdict.status is CERTIFIED


def test_a_time_scale_with_viscous_friction() -> None:
    """8 / s^2 + 3 / s = 4 at the end."""
    found, verdict = slowed(rods(4.0, viscous_friction=(1.0, 0.0)), turning([6.0]))
    assert found == pytest.approx((3.0 + np.sqrt(9.0 + 4.0 * 8.0 * 4.0)) / 8.0, rel=1e-6)
    assert verdict.status is CERTIFIED


def test_no_time_scale_helps_what_cannot_be_held() -> None:
    found, verdict = slowed(rods(HELD - 1.0, gravity=(0.0, -9.81)), turning([6.0]))
    assert (found, verdict.status) == (0.0, VIOLATED)
    assert verdict.where.endswith("however slowly")


@pytest.mark.parametrize("motion", [turning([0.0]), turning([np.nan])])
def test_a_motion_without_torques_or_numbers_needs_no_time(motion: Trajectory) -> None:
    assert torque_time_scale(TorqueLimit(rods(8.0)), motion) == 0.0


def test_the_largest_torque_seen_is_near_what_is_proven() -> None:
    def torque(times: FloatArray) -> FloatArray:
        q, a = motion.at(times)[:, 0], motion.at(times, 2)[:, 0]
        return np.asarray(np.abs(INERTIA * a + HELD * np.cos(q)))

    motion = turning([3.0, 20.0, -90.0, 40.0], start=0.3, length=1.0)
    largest = torque(np.linspace(0.0, 1.0, 100_001)).max()
    verdict = judged(rods(99.0, gravity=(0.0, -9.81)), motion)
    assert largest * (1.0 - PROOF_GAP) <= abs(verdict.worst) <= largest * (1.0 + 1e-9)
