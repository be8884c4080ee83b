"""When vias are passed: exactly at breakpoints, exactly between them, in order."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems import Joints, PlanarArm, Position
from problems.base import as_array
from problems.motions import Trajectory
from problems.tasks.move import passing_times

ARM = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0))


def motion(*pieces: list[list[float]], durations: list[float] | None = None) -> Trajectory:
    """Pieces in powers of their own normalised time, lowest first: lists of rows of two joints."""
    return Trajectory.from_pieces(np.array(durations or [1.0] * len(pieces)), [np.array(piece) for piece in pieces])


LINE = motion([[0.0, 0.0], [1.0, 2.0]], [[1.0, 2.0], [1.0, -2.0]], durations=[0.3, 0.7])  # a corner at (1, 2)
CIRCLE = motion([[0.0, 0.3], [2.0 * np.pi, 0.0]], durations=[2.0])


def test_no_vias_no_times() -> None:
    assert passing_times(ARM, LINE, ()).shape == (0,)


def test_a_via_at_a_breakpoint_is_found_exactly() -> None:
    assert passing_times(ARM, LINE, (Joints((1.0, 2.0)),)) == pytest.approx(np.array([0.3]), abs=1e-12)


@pytest.mark.parametrize("share", [0.123456, 0.5, 0.98765])
def test_a_via_between_grid_times_is_found_exactly(share: float) -> None:
    via = Joints((1.0 + share, 2.0 - 2.0 * share))
    assert passing_times(ARM, LINE, (via,)) == pytest.approx(np.array([0.3 + 0.7 * share]), abs=1e-12)


def test_points_are_found_by_the_tool() -> None:
    point = as_array(ARM.tool(ca.DM([[1.2345, 0.3]]))).ravel()
    assert passing_times(ARM, CIRCLE, (Position(tuple(point.tolist())),)) == pytest.approx([1.2345 / np.pi], abs=1e-9)


def test_a_place_passed_twice_is_passed_in_order() -> None:
    """There and back: 0.5 on the way out, 1 at the turn, 0.5 on the way back."""
    out = motion([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]])
    half, far = Joints((0.5, 0.0)), Joints((1.0, 0.0))
    assert passing_times(ARM, out, (half, far, half)) == pytest.approx(np.array([0.5, 1.0, 1.5]), abs=1e-12)
    assert passing_times(ARM, out, (far, half)) == pytest.approx(np.array([1.0, 1.5]), abs=1e-12)


def test_what_is_missed_is_missed_least() -> None:
    """The foot of the perpendicular on the line through 0 in the direction (1, 2)."""
    via = Joints((0.4, 1.2))
    u = (0.4 * 1.0 + 1.2 * 2.0) / 5.0
    assert passing_times(ARM, LINE, (via,)) == pytest.approx(np.array([0.3 * u]), abs=1e-9)


def test_a_motion_that_stands_still_passes_at_any_time() -> None:
    still = motion([[0.1, 0.2]])
    (time,) = passing_times(ARM, still, (Joints((0.1, 0.2)),))
    assert 0.0 <= time <= 1.0
