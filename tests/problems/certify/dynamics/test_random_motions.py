"""Random motions of many robots: what is certified holds at dense samples, and time scales are the least."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from benchmarks.torque_certificates import check, planar_arm, random_motion, sampled_torques
from problems import CertificateStatus
from problems.certify.torque import prove_torques, torque_time_scale
from problems.limits import TorqueLimit
from problems.robots import BUILT_IN, Payload, built_in

CERTIFIED, VIOLATED, UNDECIDED = CertificateStatus
MOTIONS = 100
SAMPLES = 1_000
MUCH = 1e-6  # relative: what is slowed by this much more is never in doubt


@cache
def robots() -> list[Any]:
    """Planar arms that gravity leaves something to, and the built-in robots with something in the hand."""
    rng, payload = np.random.default_rng(1), Payload(mass=2.0, center=(0.0, 0.05, 0.1))
    planar = [planar_arm(rng) for _ in range(4)]
    limited = [type(arm)(**{**vars(arm), "max_torque": (200.0,) * arm.dof}) for arm in planar]
    return [*limited, *(built_in(name).arm(max_acceleration=15.0, payload=payload) for name in BUILT_IN)]


@pytest.mark.parametrize("part", range(4))
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
