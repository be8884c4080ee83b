"""Parts of motions, and motions of parts: what is executed is made of what was planned, tick by tick."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from problems import Trajectory

SNAP = 1e-12  # s: a time that near to the end of a motion is its end
STILL = 1e-9  # rad or m: a joint that moves by less in a piece stands still


def part(trajectory: Trajectory, first: float, last: float) -> Trajectory:
    """A motion from one time in s to another, on a clock that starts at 0; after its end it stands still."""
    end = trajectory.duration
    if first >= end - SNAP:
        return Trajectory.standing(trajectory.value_at_end(), last - first)
    if last <= end + SNAP:
        return trajectory.part(first, min(last, end))
    return trajectory.part(first, end).followed_by(Trajectory.standing(trajectory.value_at_end(), last - end))


def joined(parts: Sequence[Trajectory]) -> Trajectory:
    """Motions one after the other."""
    order = max(len(each.coefficients) for each in parts)
    padded = [np.pad(each.coefficients, ((order - len(each.coefficients), 0), (0, 0), (0, 0))) for each in parts]
    lengths = np.concatenate([np.diff(each.breakpoints) for each in parts])
    return Trajectory(np.concatenate([[0.0], np.cumsum(lengths)]), np.concatenate(padded, axis=1))


def jumps_between(before: Trajectory, after: Trajectory, time: float) -> tuple[float, float, float]:
    """The largest jumps of angle, speed and acceleration of a joint if one motion takes over from another.

    Args:
        before: that is executed until then.
        after: that is executed from then on.
        time: of both clocks, s.

    Returns:
        rad, rad/s, rad/s^2.
    """
    last, first = part(before, 0.0, time), part(after, time, time + max(after.duration, 1.0))
    at_start = np.zeros(1)
    jumps = [float(np.abs(last.value_at_end(order) - first.at(at_start, order)[0]).max()) for order in range(3)]
    return jumps[0], jumps[1], jumps[2]


def stands(trajectory: Trajectory) -> NDArray[np.bool_]:
    """Which pieces of a motion move no joint by more than rounding, (p,)."""
    powers = np.diff(trajectory.breakpoints)[:, None] ** np.arange(len(trajectory.coefficients) - 1, 0, -1)
    travels = np.einsum("ipk,pi->pk", np.abs(trajectory.coefficients[:-1]), powers)
    return np.asarray((travels <= STILL).all(axis=1))


def rest_time(trajectory: Trajectory) -> float:
    """The time in s from which on a motion stands still; its duration at the latest."""
    moving = np.flatnonzero(~stands(trajectory))
    return float(trajectory.breakpoints[moving[-1] + 1]) if moving.size else 0.0
