"""Torques for all t: by hand, against dense samples of random motions, and how slowly a motion has to be run.

By hand: two uniform rods of 2 kg and 0.5 m, stretched out, turned by the first joint. Together they are a rod of 4 kg
and 1 m: 4/3 kg m^2 about the first joint, and held against gravity by 19.62 N m.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.slow import slow_except

from benchmarks.torque_certificates import check, planar_arm, random_motion, sampled_torques
from problems import CertificateStatus, PlanarArm, Trajectory, Verdict
from problems.certify import TorqueProofSettings, limit_verdicts, verification
from problems.certify.torque import prove_torques, torque_time_scale
from problems.limits import TorqueLimit
from problems.robots import BUILT_IN, Payload, built_in, read_urdf

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


RUBS = {"coulomb_friction": (1.0, 0.0)}
LARGEST: dict[str, tuple[Trajectory, dict[str, Any], float]] = {  # the largest torque, N m
    "constant": (turning([6.0]), {}, 8.0),
    "before a jump": (turning([6.0], [3.0]), {}, 8.0),
    "after a jump": (turning([3.0], [6.0]), {}, 8.0),
    "at the end before a jump": (turning([0.0, 12.0], [0.0]), {}, 8.0),
    "at the start after a jump": (turning([0.0], [6.0, -12.0]), {}, 8.0),
    "Coulomb friction where a joint turns back: -8 + 1, then -8 - 1": (turning([-6.0], speed=1.234567), RUBS, 9.0),
    "Coulomb friction of a joint that only brakes": (turning([-6.0], speed=9.0), RUBS, 7.0),
    "turning back where the torque is small, at 0.1 s": (turning([0.0, 12.0], speed=-0.06), RUBS, 9.0),
    "friction of a joint that stands still may act either way": (turning([0.0]), RUBS, 1.0),
    "viscous friction, at 3 rad/s": (turning([6.0]), {"viscous_friction": (1.0, 0.0)}, 11.0),
}


@pytest.mark.parametrize(("motion", "friction", "largest"), LARGEST.values(), ids=LARGEST)
def test_the_largest_torque_decides(motion: Trajectory, friction: dict[str, Any], largest: float) -> None:
    kept = judged(rods(largest, **friction), motion)
    assert (kept.status, abs(kept.worst)) == (CERTIFIED, pytest.approx(largest, rel=1e-9))
    assert (kept.bound, kept.unit) == (np.copysign(largest, kept.worst), "N m")
    assert judged(rods(largest * (1.0 - TINY), **friction), motion).status is VIOLATED


@pytest.mark.parametrize(("motion", "friction", "largest"), LARGEST.values(), ids=LARGEST)
def test_intervals_decide_without_a_core(
    motion: Trajectory, friction: dict[str, Any], largest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verification, "found_core", lambda: None)
    assert judged(rods(largest * 1.001, **friction), motion).status is CERTIFIED
    assert judged(rods(largest * 0.999, **friction), motion).status is VIOLATED


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


def test_what_motors_cannot_hold_breaks_however_slowly_it_is_run() -> None:
    scale, verdict = slowed(rods(HELD - 1.0, gravity=(0.0, -9.81)), turning([0.1]))
    assert (scale, verdict.status) == (0.0, VIOLATED)
    assert verdict.where == "joint 1, t = 0 s, however slowly"
    assert "slowly" not in judged(rods(HELD + 0.1, gravity=(0.0, -9.81)), turning([6.0])).where


def test_a_motion_that_takes_no_torque_is_certified_and_one_that_is_no_number_undecided() -> None:
    verdict = judged(rods(8.0), turning([0.0]))
    assert (verdict.status, verdict.worst) == (CERTIFIED, 0.0)
    assert judged(rods(8.0), turning([np.nan])).status is UNDECIDED
    for motion in (turning([0.0]), turning([np.nan])):
        assert torque_time_scale(TorqueLimit(rods(8.0)), motion) == 0.0


def test_what_too_few_cells_leave_undecided_is_named() -> None:
    motion = turning([0.0, 0.0, 25.0, -100.0, 100.0])  # largest in the middle
    bound = abs(judged(rods(0.1), motion).worst) * 1.001
    assert judged(rods(bound), motion).status is CERTIFIED
    settings = TorqueProofSettings(initial_cells=1, most_cells=0)
    verdict = prove_torques(TorqueLimit(rods(bound)), motion, settings=settings).verdict
    assert verdict.status is UNDECIDED
    assert verdict.cell is not None
    start, end = verdict.cell
    assert 0.0 <= start < end <= motion.duration
    assert verdict.where.endswith(f"; undecided from t = {start:.6g} s on for {end - start:.2g} s")


def test_nothing_is_certified_of_angles_whose_sines_are_not_known() -> None:
    far = Trajectory.standing(np.array([3e5, 0.0]), 1.0)
    assert judged(rods(50.0, gravity=(0.0, -9.81)), far).status is UNDECIDED
    assert judged(rods(50.0, gravity=(0.0, -9.81)), Trajectory.standing(np.array([9e4, 0.0]), 1.0)).satisfied


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


SCALES: dict[str, tuple[Sequence[float], float, dict[str, Any], float]] = {  # acceleration, limit; time scale
    "the largest of 24": (peak_at(0.1234567, 24.0), 8.0, {}, 2.0),
    "the largest of 6": (peak_at(0.1234567, 6.0), 8.0, {}, 1.0),
    "the largest of 1.5": (peak_at(0.1234567, 1.5), 8.0, {}, 0.5),
    "gravity: 19.62 cos(q) + 8 / s^2, largest at the start": ([6.0], HELD + 2.0, {"gravity": (0.0, -9.81)}, 2.0),
    "viscous friction: 8 / s^2 + 3 / s = 4 at the end": (
        [6.0], 4.0, {"viscous_friction": (1.0, 0.0)}, (3.0 + np.sqrt(9.0 + 4.0 * 8.0 * 4.0)) / 8.0
    ),
}  # fmt: skip


@pytest.mark.parametrize(("powers", "limit", "more", "scale"), SCALES.values(), ids=SCALES)
def test_a_time_scale_is_that_of_the_largest_torque(
    powers: Sequence[float], limit: float, more: dict[str, Any], scale: float
) -> None:
    found, verdict = slowed(rods(limit, **more), turning(powers))
    assert found == pytest.approx(scale, rel=1e-6)
    assert verdict.status is CERTIFIED


MOTIONS = 60
SAMPLES = 1_000
MUCH = 1e-6  # relative: what is slowed by this much more is never in doubt


@cache
def robots() -> list[Any]:
    """Planar arms that gravity leaves something to, and the built-in robots with something in the hand."""
    rng, payload = np.random.default_rng(1), Payload(mass=2.0, center=(0.0, 0.05, 0.1))
    planar = [planar_arm(rng) for _ in range(4)]
    limited = [type(arm)(**{**vars(arm), "max_torque": (200.0,) * arm.dof}) for arm in planar]
    return [*limited, *(built_in(name).arm(max_acceleration=15.0, payload=payload) for name in BUILT_IN)]


@pytest.mark.parametrize("part", slow_except(range(4), 1))
def test_slowed_motions_are_certified_and_faster_ones_are_not(part: int) -> None:
    for seed in range(part, MOTIONS, 4):
        rng = np.random.default_rng(seed)
        robot = robots()[seed % len(robots())]
        limit, motion = TorqueLimit(robot), random_motion(rng, robot.dof)
        scale = torque_time_scale(limit, motion)
        if scale == 0.0:  # what gravity takes alone
            assert (sampled_torques(robot, motion.time_scaled(1e6), SAMPLES) > 0.999 * np.array(limit.bounds)).any()
            continue
        slowed, faster = motion.time_scaled(scale), motion.time_scaled(scale / (1.0 + MUCH))
        assert prove_torques(limit, slowed).status is CERTIFIED
        assert prove_torques(limit, faster).status is VIOLATED
        assert (sampled_torques(robot, slowed, SAMPLES) <= np.array(limit.bounds) * (1.0 + 1e-9)).all()


def test_certificates_are_right_where_torques_are_close_to_their_limits() -> None:
    found = [check(seed, count=SAMPLES) for seed in range(8)]
    assert not any(case.is_false for case in found)
    assert {case.status for case in found} == {CERTIFIED, VIOLATED}
    assert all(case.seen >= case.sampled * (1.0 - 1e-3) for case in found)


@pytest.mark.slow
@pytest.mark.parametrize("excess", [None, 1e-6, 1e-8])
def test_no_certificate_is_false(excess: float | None) -> None:
    found = [check(seed, excess, 20_000) for seed in range(300)]
    assert not any(case.is_false for case in found)
    assert sum(case.status is UNDECIDED for case in found) <= 3
    assert excess is None or all(case.status is VIOLATED for case in found)
