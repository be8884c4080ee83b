"""What others do about torque limits is done as they would, and its table says what is missing."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems import PlanarArm
from problems.base import as_array
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import retime

pytest.importorskip("toppra")
from benchmarks.peers.torque_limited import Timed, by_ruckig, by_toppra, slowed

FLOATING = PlanarArm(
    link_lengths=(0.5, 0.4),
    max_speed=(4.0, 4.0),
    max_acceleration=(30.0, 30.0),
    max_jerk=(600.0, 600.0),
    max_torque=(5.0, 2.0),
    link_masses=(3.0, 2.0),
    gravity=(0.0, 0.0),
)
ENDS = np.array([[0.0, 0.3], [1.5, -0.4]])


def peak(motion: Timed) -> float:
    times = np.linspace(0.0, motion.duration, 5_000)
    torques = as_array(FLOATING.dynamics.torques(*(ca.DM(motion.at(times, order)) for order in range(3))))
    return float((np.abs(torques) / np.array(FLOATING.limits.torque)).max())


def test_without_gravity_a_move_is_slowed_by_the_root_of_its_peak() -> None:
    pytest.importorskip("ruckig")
    fast = by_ruckig(ENDS, FLOATING.limits)
    slow = slowed(fast, FLOATING)
    assert peak(fast) > 1.5
    assert slow.duration / fast.duration == pytest.approx(np.sqrt(peak(fast)), rel=1e-5)
    assert peak(slow) == pytest.approx(1.0, abs=1e-4)
    assert slow.at(np.array([0.0, slow.duration]), 0) == pytest.approx(ENDS, abs=1e-9)


def test_a_move_that_keeps_its_torques_stays_as_it_is() -> None:
    pytest.importorskip("ruckig")
    strong = PlanarArm(**{**vars(FLOATING), "max_torque": (500.0, 200.0)})
    fast = by_ruckig(ENDS, strong.limits)
    assert slowed(fast, strong).duration == fast.duration


def test_a_line_is_as_fast_as_toppras() -> None:
    path = JointPath.through(ENDS)
    peer = by_toppra(path, FLOATING, 500)
    assert peer is not None
    limits = JointLimits(**{**vars(FLOATING.limits), "jerk": None})
    ours = retime(path, limits, chain=FLOATING.dynamics)
    assert ours.duration == pytest.approx(peer.duration, rel=2e-3)
