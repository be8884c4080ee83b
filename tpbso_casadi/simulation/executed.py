"""Parts of motions, and motions of parts: what is executed is made of what was planned, tick by tick."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from problems import Trajectory
from problems.base.matrix import FloatArray

SNAP = 1e-12  # s: a breakpoint that near is meant
STILL = 1e-9  # rad or m: a joint that moves by less in a piece stands still


def standing(theta: FloatArray, seconds: float) -> Trajectory:
    """A robot that stands still in a posture (dof,), rad."""
    return Trajectory(np.array([0.0, seconds]), np.asarray(theta, dtype=np.float64)[None, None])


def part(trajectory: Trajectory, first: float, last: float) -> Trajectory:
    """A motion from one time in s to another, on a clock that starts at 0; after its end it stands still."""
    breaks = trajectory.breakpoints
    inner = breaks[(breaks > first + SNAP) & (breaks < last - SNAP)]
    edges = np.concatenate([[first], inner, [last]])
    order, _, dof = trajectory.coefficients.shape
    shifted = np.zeros((order, edges.size - 1, dof))
    for number, start in enumerate(edges[:-1]):
        if start >= trajectory.duration - SNAP:
            shifted[-1, number] = trajectory.at(np.array([trajectory.duration]))[0]
            continue
        piece = int(np.searchsorted(breaks, start + SNAP, side="right")) - 1
        since = start - breaks[piece] if abs(start - breaks[piece]) > SNAP else 0.0
        shifted[:, number] = _shifted(trajectory.coefficients[:, piece], since)
    return Trajectory(edges - first, shifted)


def _shifted(coefficients: FloatArray, since: float) -> FloatArray:
    """Coefficients (order, dof) of the same polynomials in the time since a later start: repeated Horner steps."""
    shifted = coefficients.copy()
    if since:
        for last in range(len(shifted), 1, -1):
            for power in range(1, last):
                shifted[power] += since * shifted[power - 1]
    return shifted


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
    pieces = part(before, 0.0, time)
    durations = np.diff(pieces.breakpoints)[-1:]
    last = Trajectory(np.append(0.0, durations), pieces.coefficients[:, -1:])
    first = part(after, time, max(after.duration, time + 1.0))
    jumps = [np.abs(_value(last, order, float(durations[0])) - _value(first, order, 0.0)).max() for order in range(3)]
    return float(jumps[0]), float(jumps[1]), float(jumps[2])


def _value(trajectory: Trajectory, order: int, time: float) -> FloatArray:
    """A derivative of the first piece, its end included, (dof,)."""
    piece = PPoly(trajectory.coefficients[:, :1], trajectory.breakpoints[:2])
    return np.asarray(piece(time, nu=order))


def stands(trajectory: Trajectory) -> NDArray[np.bool_]:
    """Which pieces of a motion move no joint by more than rounding, (p,)."""
    powers = np.diff(trajectory.breakpoints)[:, None] ** np.arange(len(trajectory.coefficients) - 1, 0, -1)
    travels = np.einsum("ipk,pi->pk", np.abs(trajectory.coefficients[:-1]), powers)
    return np.asarray((travels <= STILL).all(axis=1))


def rest_time(trajectory: Trajectory) -> float:
    """The time in s from which on a motion stands still; its duration at the latest."""
    moving = np.flatnonzero(~stands(trajectory))
    return float(trajectory.breakpoints[moving[-1] + 1]) if moving.size else 0.0
