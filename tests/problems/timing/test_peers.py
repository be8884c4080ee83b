"""The comparison with other planners: what it measures, and that its cases run."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.peers.report import certified, excess
from problems.robots import JointLimits
from problems.timing.free_space import rest_to_rest

LIMITS = JointLimits(speed=(1.0, 1.0), acceleration=(2.0, 2.0), jerk=(8.0, 8.0))


def test_excess_is_what_a_limit_is_broken_by() -> None:
    move = rest_to_rest(np.zeros(2), np.array([3.0, 1.0]), LIMITS)
    assert excess(move.at, move.duration, LIMITS) == 0.0
    assert certified(move, LIMITS)
    faster = move.time_scaled(1.0 / 1.1)
    assert excess(faster.at, faster.duration, LIMITS) == pytest.approx(1.1**3 - 1.0, rel=1e-6)
    assert not certified(faster, LIMITS)


def test_a_move_is_as_fast_as_ruckigs() -> None:
    pytest.importorskip("ruckig")
    from benchmarks.peers.rest_moves import move  # noqa: PLC0415 - an extra

    one = move(3)
    assert one.ratio == pytest.approx(1.0, abs=1e-9)
    assert (one.excess, one.certified) == (0.0, True)


def test_a_path_is_as_fast_as_toppras() -> None:
    pytest.importorskip("toppra")
    from benchmarks.peers.waypoint_paths import METHODS, timings  # noqa: PLC0415 - an extra

    results = dict(zip(METHODS, timings(11), strict=True))
    assert results["ours"].excess == 0.0
    assert results["ours"].certified
    assert results["ours"].duration == pytest.approx(results[METHODS[2]].duration, rel=3e-3)
