"""The least-time scan along a path: speeds and accelerations of the path that all limits allow.

With b = (du/dt)^2 and c = d2u/dt2, constant from one grid point to the next, b_{i+1} = b_i + 2 (u_{i+1} - u_i) c_i,
and every joint moves with q' sqrt(b) and accelerates with q'' b + q' c. Both ends of an interval have to keep

    -above - tilt b <= c <= above - tilt b,        above = a / |q'|, tilt = q'' / q',

for the far end in terms of the near end's b and c. Backward, the largest b from which the rest of the path can be run
follows from what every two of these bounds of c say about b; forward, the largest c is taken that stays below it. The
same is a linear program in two variables for each grid point; here its vertices are written out, so that the scan is
a few operations for each grid point, without a branch. Torques are linear in b and c too, and limits on them are more
bounds of the same kind, but not the same on both sides, as gravity takes its share.

[1] H. Pham, Q.-C. Pham: A new approach to time-optimal path parameterization based on reachability analysis. IEEE
    Transactions on Robotics 34 (2018); https://arxiv.org/abs/1707.07239
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeAlias

import casadi as ca

from problems.base import Matrix, Operand, largest, smallest, total
from problems.robots import Robot

LEAST_TORQUE_SHARE = 1e-3  # of a limit: as much of it has to be left by gravity for a motion, and counts as left


@dataclass(frozen=True)
class TorqueSlopes:
    """The torques tau = rate c + bend b + static at grid points of a path q(u); each (n, k), N m or N.

    Attributes:
        rate: M(q) q'.
        bend: M(q) q'' + C(q, q') q'.
        static: what gravity and Coulomb friction take.
    """

    rate: Matrix
    bend: Matrix
    static: Matrix

    @classmethod
    def along(cls, robot: Robot, theta: Matrix, first: Matrix, second: Matrix) -> TorqueSlopes:
        """The slopes at q, q' and q'', each (n, k), of a robot whose masses are known."""
        chain = robot.dynamics
        static = chain.gravitational(theta)
        if chain.has_friction:
            static = static + chain.coulomb(first)
        return cls(chain.inertial(theta, 0.0 * first, first), chain.inertial(theta, first, second), static)

    def row(self, i: int) -> TorqueSlopes:
        """The slopes at one grid point."""
        return TorqueSlopes(self.rate[i, :], self.bend[i, :], self.static[i, :])

    def seen_before(self, step: Matrix) -> TorqueSlopes:
        """The slopes in terms of b at the grid point before, from which it follows as b + step c."""
        return TorqueSlopes(self.rate + step * self.bend, self.bend, self.static)

    @property
    def stacked(self) -> Matrix:
        """The slopes of one grid point in one column, (3 k, 1)."""
        return ca.horzcat(self.rate, self.bend, self.static).T

    @classmethod
    def unstacked(cls, column: Matrix) -> TorqueSlopes:
        """The inverse of :attr:`stacked`."""
        return cls(*(part.T for part in ca.vertsplit(column, int(column.shape[0]) // 3)))


def limited(robot: Robot) -> bool:
    """Whether the torques of a robot are limited and known."""
    return robot.limits.torque is not None and robot.rigid_chain is not None


LEAST_RATE = 1e-9  # rad per unit of u: a joint that turns less is limited as if it turned so much
TINY = 1e-12  # in the place of a denominator that says that there is no bound
UNBOUNDED = 1e30

Slopes: TypeAlias = tuple[Matrix, Matrix]  # q' and q'' at a grid point, (1, k)


@dataclass(frozen=True)
class Bounds:
    """Limits in one interval: ``-below - tilt b <= c <= above - tilt b``; each (m, 1).

    Attributes:
        above: above.
        tilt: on both sides.
        below: likewise to ``above``; None where it is the same.
    """

    above: Matrix
    tilt: Matrix
    below: Matrix | None = None

    @classmethod
    def of_interval(cls, here: Slopes, ahead: Slopes, step: Matrix, acceleration: Sequence[Operand]) -> Bounds:
        """The bounds at both ends of an interval.

        Args:
            here: q' and q'' at its beginning.
            ahead: the same at its end.
            step: twice its length, 2 (u_{i+1} - u_i).
            acceleration: limits of the joints, rad/s^2.
        """
        ends = [here, (ahead[0] + step * ahead[1], ahead[1])]
        limits, signed = ca.horzcat(*acceleration), [_away_from_zero(first) for first, _ in ends]
        above = ca.horzcat(*(limits / ca.fabs(first) for first in signed))
        tilt = ca.horzcat(*(second / first for first, (_, second) in zip(signed, ends, strict=True)))
        return cls(above.T, tilt.T)

    def with_torques(self, ends: Sequence[TorqueSlopes], torque: Sequence[Operand]) -> Bounds:
        """The bounds with those of torque limits.

        Args:
            ends: of the interval, in terms of b at its beginning.
            torque: limits of the joints, N m or N.
        """
        limits = ca.horzcat(*torque)
        above, tilt, below = [self.above], [self.tilt], [self.above]
        for end in ends:
            up, down = (ca.fmax(limits + sign * end.static, LEAST_TORQUE_SHARE * limits) for sign in (-1.0, 1.0))
            signed, turned = _away_from_zero(end.rate), end.rate < 0.0
            above.append((ca.if_else(turned, down, up) / ca.fabs(signed)).T)
            below.append((ca.if_else(turned, up, down) / ca.fabs(signed)).T)
            tilt.append((end.bend / signed).T)
        return Bounds(ca.vertcat(*above), ca.vertcat(*tilt), ca.vertcat(*below))

    def steepest(self, b: Matrix) -> Matrix:
        """The largest c at b."""
        return smallest(self.above - self.tilt * b)


def _away_from_zero(values: Matrix) -> Matrix:
    return ca.if_else(values < 0.0, -1.0, 1.0) * ca.fmax(ca.fabs(values), LEAST_RATE)


def before(
    here: Slopes, bounds: Bounds, step: Matrix, most: Matrix, least: Matrix | None, speed: Sequence[Operand]
) -> tuple[Matrix, Matrix | None, Matrix]:
    """The range of b at a grid point from that at the next one.

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
    low = largest(ca.vertcat(0.0, (least - step * bounds.above) / ca.fmax(1.0 - step * bounds.tilt, TINY)))
    return high, ca.fmin(low, high), gap(low, high)


def _largest_before(
    here: Slopes, bounds: Bounds, step: Matrix, most: Matrix, least: Matrix | None, speed: Sequence[Operand]
) -> Matrix:
    above, tilt = bounds.above, bounds.tilt
    below = above if bounds.below is None else bounds.below
    not_below = step * above if least is None else step * above - least
    parts = [
        ((ca.horzcat(*speed) / ca.fmax(ca.fabs(here[0]), LEAST_RATE)) ** 2).T,
        (most + step * below) / ca.fmax(1.0 - step * tilt, TINY),
        ca.if_else(step * tilt > 1.0, not_below / ca.fmax(step * tilt - 1.0, TINY), UNBOUNDED),
        *_where_two_meet(bounds, 2 * here[0].numel()),
    ]
    return smallest(ca.vertcat(*parts))


def _where_two_meet(bounds: Bounds, symmetric: int) -> list[Matrix]:
    """The largest b at which every two bounds leave a c between them, given how many are symmetric."""
    above, tilt, below = bounds.above, bounds.tilt, bounds.below
    pairs = list(combinations(range(above.numel()), 2))
    alike = [pair for pair in pairs if below is None or pair[1] < symmetric]
    found: list[Matrix] = []
    if alike:
        one, two = (list(each) for each in zip(*alike, strict=True))
        found.append((above[one] + above[two]) / ca.fmax(ca.fabs(tilt[one] - tilt[two]), TINY))
    if below is not None:
        one, two = (list(each) for each in zip(*(pair for pair in pairs if pair[1] >= symmetric), strict=True))
        apart = 1.0 / (tilt[one] - tilt[two])  # infinite where they never meet; both bounds are positive
        found.append(ca.fmax((above[one] + below[two]) * apart, -(below[one] + above[two]) * apart))
    return found


def advance(bounds: Bounds, step: Matrix, b: Matrix, most: Matrix) -> tuple[Matrix, Matrix]:
    """The largest c at b that keeps below ``most`` at the next grid point, and b there; 0 where the step is."""
    c = ca.fmin(bounds.steepest(b), (most - b) / ca.fmax(step, TINY))
    return c, ca.fmin(most, ca.fmax(0.0, b + step * c))


def interval_time(step: Matrix, b: Matrix, ahead: Matrix) -> Matrix:
    """The time of an interval, s, given b at both ends; all (n, 1)."""
    return step / ca.fmax(ca.sqrt(b) + ca.sqrt(ahead), TINY)


def gap(least: Matrix, most: Matrix) -> Matrix:
    """The amount by which ``least`` is above ``most``, relative to both; 0 where it is not."""
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
    stops: Collection[int] = (),
    torques: tuple[TorqueSlopes, Sequence[Operand]] | None = None,
    shares: Matrix | None = None,
) -> Scan:
    """The largest speeds along a path that all limits allow, by a backward and a forward scan.

    Args:
        first: q' at the grid points, (n, k), rad.
        second: q'', likewise.
        steps: twice the lengths of the n - 1 intervals.
        ends: b at both ends; None for a goal at rest.
        speed: limits of the joints, rad/s.
        acceleration: the same, rad/s^2.
        stops: grid points at which the motion comes to rest; after each there is another one in the same place.
        torques: of all grid points, and their limits, N m or N; None where they are not limited.
        shares: of the speed limits that are made use of at the grid points, (n, 1); all of them where None.
    """
    slopes = [(first[i, :], second[i, :]) for i in range(first.shape[0])]
    most, least = ca.DM(0.0) if ends[1] is None else ends[1], ends[1]
    gaps: list[Matrix] = []
    found: list[tuple[Bounds, Matrix]] = []
    last = len(slopes) - 1
    for i, step in zip(range(last, -1, -1), [0.0, *steps[::-1]], strict=True):
        here, ahead = slopes[i], slopes[min(i + 1, last)]
        bounds = Bounds.of_interval(here, ahead, ca.DM(step), acceleration)
        if torques is not None:
            far = torques[0].row(min(i + 1, last)).seen_before(ca.DM(step))
            bounds = bounds.with_torques((torques[0].row(i), far), torques[1])
        found.append((bounds, most))
        allowed = speed if shares is None else [limit * shares[i] for limit in speed]
        most, least, between = before(here, bounds, ca.DM(step), most, least, allowed)
        most = ca.DM(0.0) if i in stops else most
        gaps.append(between)
    if least is not None:
        gaps.append(gap(least, ends[0]))
    squared = [ends[0]]
    for (bounds, below), step in zip(found[:0:-1], steps, strict=True):
        squared.append(advance(bounds, ca.DM(step), squared[-1], below)[1])
    return Scan(ca.vertcat(*squared), total(ca.vertcat(*gaps, gap(ends[0], most))))
