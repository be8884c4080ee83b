"""Least time along a path on a grid, in closed form: how fast a path can be run under speed and acceleration limits.

With b = (du/dt)^2 and c = d2u/dt2, constant from one grid point to the next, b_{i+1} = b_i + 2 (u_{i+1} - u_i) c_i,
and every joint moves with q' sqrt(b) and accelerates with q'' b + q' c. Both ends of an interval have to keep

    -room - tilt b <= c <= room - tilt b,        room = a / |q'|, tilt = q'' / q',

for the far end in terms of the near end's b and c. Backward, the largest b from which the rest of the path can be run
follows from what every two of these bounds of c say about b; forward, the largest c is taken that stays below it. The
same is a linear program in two variables for each grid point; here its vertices are written out, so that the scan is
a few operations for each grid point, without a branch.

[1] H. Pham, Q.-C. Pham: A new approach to time-optimal path parameterization based on reachability analysis. IEEE
    Transactions on Robotics 34 (2018); https://arxiv.org/abs/1707.07239
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeAlias

import casadi as ca

from problems.base.matrix import Matrix, Operand, largest, smallest, total

LEAST_RATE = 1e-9  # rad per unit of u: a joint that turns less is limited as if it turned so much
TINY = 1e-12  # in the place of a denominator that says that there is no bound
UNBOUNDED = 1e30

Slopes: TypeAlias = tuple[Matrix, Matrix]  # q' and q'' at a grid point, (1, k)


@dataclass(frozen=True)
class Bounds:
    """What acceleration limits say in one interval: ``-room - tilt b <= c <= room - tilt b``; both (m, 1)."""

    room: Matrix
    tilt: Matrix

    @classmethod
    def of_interval(cls, here: Slopes, ahead: Slopes, step: Matrix, acceleration: Sequence[Operand]) -> Bounds:
        """Of both ends of an interval.

        Args:
            here: q' and q'' at its beginning.
            ahead: the same at its end.
            step: twice its length, 2 (u_{i+1} - u_i).
            acceleration: limits of the joints, rad/s^2.
        """
        ends = [here, (ahead[0] + step * ahead[1], ahead[1])]
        limits, signed = ca.horzcat(*acceleration), [_away_from_zero(first) for first, _ in ends]
        room = ca.horzcat(*(limits / ca.fabs(first) for first in signed))
        tilt = ca.horzcat(*(second / first for first, (_, second) in zip(signed, ends, strict=True)))
        return cls(room.T, tilt.T)

    def steepest(self, b: Matrix) -> Matrix:
        """The largest c at b."""
        return smallest(self.room - self.tilt * b)


def _away_from_zero(values: Matrix) -> Matrix:
    return ca.if_else(values < 0.0, -1.0, 1.0) * ca.fmax(ca.fabs(values), LEAST_RATE)


def before(
    here: Slopes, bounds: Bounds, step: Matrix, most: Matrix, least: Matrix | None, speed: Sequence[Operand]
) -> tuple[Matrix, Matrix | None, Matrix]:
    """From what b may be at a grid point to what it may be at the one before.

    Args:
        here: q' and q'' at the one before.
        bounds: of c in between.
        step: twice the distance; 0 where ``here`` is the last grid point, with itself behind it.
        most: the largest b, from which the rest of the path can be run.
        least: the smallest; None where the path ends at rest, so that it is 0 everywhere.
        speed: limits of the joints, rad/s.

    Returns:
        The same two at the one before, and by how much the smallest was larger than the largest.
    """
    high = ca.fmax(0.0, _largest_before(here, bounds, step, most, least, speed))
    if least is None:
        return high, None, ca.DM(0.0)
    low = largest(ca.vertcat(0.0, (least - step * bounds.room) / ca.fmax(1.0 - step * bounds.tilt, TINY)))
    return high, ca.fmin(low, high), gap(low, high)


def _largest_before(
    here: Slopes, bounds: Bounds, step: Matrix, most: Matrix, least: Matrix | None, speed: Sequence[Operand]
) -> Matrix:
    room, tilt = bounds.room, bounds.tilt
    pairs = combinations(range(room.numel()), 2)
    not_below = step * room if least is None else step * room - least
    parts = [
        ((ca.horzcat(*speed) / ca.fmax(ca.fabs(here[0]), LEAST_RATE)) ** 2).T,
        (most + step * room) / ca.fmax(1.0 - step * tilt, TINY),
        ca.if_else(step * tilt > 1.0, not_below / ca.fmax(step * tilt - 1.0, TINY), UNBOUNDED),
        *((room[i] + room[j]) / ca.fmax(ca.fabs(tilt[i] - tilt[j]), TINY) for i, j in pairs),
    ]
    return smallest(ca.vertcat(*parts))


def advance(bounds: Bounds, step: Matrix, b: Matrix, most: Matrix) -> tuple[Matrix, Matrix]:
    """The largest c at b that keeps below ``most`` at the next grid point, and b there; the step is not 0."""
    c = ca.fmin(bounds.steepest(b), (most - b) / step)
    return c, ca.fmin(most, ca.fmax(0.0, b + step * c))


def interval_time(step: Matrix, b: Matrix, ahead: Matrix) -> Matrix:
    """How long an interval takes, s, given b at both ends; all (n, 1)."""
    return step / ca.fmax(ca.sqrt(b) + ca.sqrt(ahead), TINY)


def gap(least: Matrix, most: Matrix) -> Matrix:
    """By how much ``least`` is above ``most``, relative to both; 0 where it is not."""
    return ca.fmax(0.0, least - most) / ca.fmax(least + most, TINY)


@dataclass(frozen=True)
class Scan:
    """The result of a scan.

    Attributes:
        squared: b at every grid point, (n, 1).
        gap: 0 where the velocities at the ends can be attained, else by how much not.
    """

    squared: Matrix
    gap: Matrix


def scan(
    first: Matrix,
    second: Matrix,
    steps: Sequence[float],
    ends: tuple[Matrix, Matrix | None],
    speed: Sequence[Operand],
    acceleration: Sequence[Operand],
) -> Scan:
    """All of it at once.

    Args:
        first: q' at the grid points, (n, k), rad.
        second: q'', likewise.
        steps: twice the lengths of the n - 1 intervals.
        ends: b at both ends; None for a goal at rest.
        speed: limits of the joints, rad/s.
        acceleration: the same, rad/s^2.
    """
    slopes = [(first[i, :], second[i, :]) for i in range(first.shape[0])]
    most, least = ca.DM(0.0) if ends[1] is None else ends[1], ends[1]
    gaps: list[Matrix] = []
    found: list[tuple[Bounds, Matrix]] = []
    for here, ahead, step in zip(slopes[::-1], [slopes[-1], *slopes[:0:-1]], [0.0, *steps[::-1]], strict=True):
        bounds = Bounds.of_interval(here, ahead, ca.DM(step), acceleration)
        found.append((bounds, most))
        most, least, between = before(here, bounds, ca.DM(step), most, least, speed)
        gaps.append(between)
    if least is not None:
        gaps.append(gap(least, ends[0]))
    squared = [ends[0]]
    for (bounds, below), step in zip(found[:0:-1], steps, strict=True):
        squared.append(advance(bounds, ca.DM(step), squared[-1], below)[1])
    return Scan(ca.vertcat(*squared), total(ca.vertcat(*gaps, gap(ends[0], most))))
