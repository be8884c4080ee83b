"""A proof for any limit that is written in joint angles and their derivatives: interval arithmetic over time cells.

In a cell of time every joint angle and derivative lies between its Bernstein coefficients. Interval arithmetic bounds
what the limit makes of them; cells that this does not settle are halved. It works for any expression, and is as sharp
as its intervals: a limit that holds with a margin is soon proven, one that is touched stays undecided.
"""

from __future__ import annotations

from dataclasses import replace
from math import comb

import casadi as ca
import numpy as np

from problems.base.bernstein import bernstein
from problems.base.matrix import FloatArray
from problems.certify.interval import bounds
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, verdict
from problems.limits.constraint import Constraint
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.motions.trajectory import SAMPLED_ORDERS, Trajectory

FIRST_TIMES = 401  # times at which a violation is looked for first
MAX_CELLS = 4000


def prove_by_cells(limit: Limit, trajectory: Trajectory) -> list[Verdict]:
    """Verdicts on a limit: violated where a sample breaks it, certified where interval arithmetic settles all cells.

    The verdict is about every time, so that constraints on steps from one sample to the next are left out.
    """
    times = trajectory.times(FIRST_TIMES)
    sampled = limit.at(trajectory.samples(times, limit.robot_or_none))
    symbolic = [_expression(limit, trajectory, index) for index in range(len(sampled))]
    return [
        _settled(verdict(constraint, times), expression, constraint, trajectory)
        for constraint, expression in zip(sampled, symbolic, strict=True)
    ]


def _expression(limit: Limit, trajectory: Trajectory, index: int) -> ca.Function:
    """One row of a constraint as a function of angles and derivatives, one after the other, and of the time."""
    k = trajectory.coefficients.shape[2]
    symbols, time = ca.SX.sym("derivatives", k * SAMPLED_ORDERS), ca.SX.sym("time")
    derivatives = tuple(part.T for part in ca.vertsplit(symbols, k))
    duration = ca.SX(trajectory.duration)
    now = Samples(robot=limit.robot_or_none, derivatives=derivatives, duration=duration, times=time)
    return ca.Function(
        "row", [ca.vertcat(symbols, time)], [ca.densify(limit.at(now)[index].expression.T)], {"cse": True}
    )


def _settled(outcome: Verdict, expression: ca.Function, constraint: Constraint, trajectory: Trajectory) -> Verdict:
    """A verdict at samples, raised to all t or lowered to undecided."""
    if not outcome.satisfied:
        return outcome
    if constraint.rows != len(trajectory.times(FIRST_TIMES)):  # it is not about one time after the other
        return replace(outcome, status=CertificateStatus.UNDECIDED)
    (low, high), slack = constraint.bounds, TOLERANCE * constraint.scales
    cells = [(piece, 0.0, 1.0) for piece in range(trajectory.breakpoints.size - 1)]
    curves = [_curves(trajectory, order) for order in range(SAMPLED_ORDERS)]
    for count in range(MAX_CELLS):
        if not cells:
            return outcome
        piece, start, end = cells.pop()
        ranges = [_range(curve[:, piece], start, end) for curve in curves]
        ranges.append(_times(trajectory, piece, start, end))
        lower, upper = bounds(expression, *(np.concatenate(side) for side in zip(*ranges, strict=True)))
        if count + len(cells) > MAX_CELLS:
            break
        if (lower < low - slack).any() or (upper > high + slack).any():
            middle = (start + end) / 2.0
            cells += [(piece, start, middle), (piece, middle, end)]
    return replace(outcome, status=CertificateStatus.UNDECIDED)


def _times(trajectory: Trajectory, piece: int, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """The times in s of a part of a piece, both (1,)."""
    first, last = trajectory.breakpoints[piece : piece + 2]
    return np.array([first + start * (last - first)]), np.array([first + end * (last - first)])


def _curves(trajectory: Trajectory, order: int) -> FloatArray:
    """Bernstein coefficients of a derivative, (n + 1, pieces, k)."""
    return bernstein(np.asarray(trajectory.derivative(order).c), np.diff(trajectory.breakpoints))


def _range(curve: FloatArray, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """Bounds over a part of a piece, (k,): Bernstein coefficients (n + 1, k) of that part alone."""
    part = _left(_left(curve[::-1], 1.0 - start)[::-1], (end - start) / (1.0 - start)) if start < 1.0 else curve[-1:]
    return part.min(axis=0), part.max(axis=0)


def _left(curve: FloatArray, share: float) -> FloatArray:
    """Bernstein coefficients of the first ``share`` of an interval (de Casteljau)."""
    n = len(curve) - 1
    matrix = [
        [comb(i, j) * share**j * (1.0 - share) ** (i - j) if j <= i else 0.0 for j in range(n + 1)]
        for i in range(n + 1)
    ]
    return np.asarray(np.array(matrix) @ curve)
