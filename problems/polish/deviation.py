"""Motions that deviate from the direct one: q(u) = S(u) + sum over i of B_i(u) x_i, u = t / T.

S is the fastest direct motion between two postures at rest, run in the time T; the deviation is a cubic B-spline that
vanishes at both ends with its first two derivatives. A derivative of order r is q_r(u) / T^r: that it stays within its
limit L is linear in the control points x, |q_r(u)| <= L T^r. Accelerations are linear in u between the ends of the
pieces of either, and jerks constant, so that rows there suffice; speeds have rows in between as well.

Where an end moves, S is the fastest motion between both states; the control points there are no longer zero but
quadratic in T, as a velocity v and an acceleration a are derivatives T v and T^2 a. S may also be any motion from rest
to rest that is known, made of cubics.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import factorial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from problems.base import BSpline, FloatArray, taylor_coefficients
from problems.core import SingleRows, WholeRows
from problems.motions import Trajectory
from problems.polish.settings import DEFAULT_DEVIATION, DeviationSettings
from problems.polish.spline import DEGREE, PIECES, SAMPLES, DeviationSpline
from problems.robots import JointLimits
from problems.timing import (
    MotionState,
    fastest_move,
    least_durations,
    peak_shares,
    rest_to_rest,
    switch_shares,
)

R = TypeVar("R", SingleRows, WholeRows)
JUST_BEFORE = 1e-8  # of the duration: before a jump of accelerations
TIME_ROUNDING = 1e-9  # of the duration: breakpoints that are one


@dataclass(frozen=True, eq=False)
class JointRows:
    """Values that depend on one joint each: of one derivative, or of angles.

    Attributes:
        order: of the derivative.
        joint: number of the joint, (m,).
        first: number of the first of four control points, those at rest counted, (m,).
        weights: of the control points, (m, 4).
        base: of the direct motion, by u, (m,).
    """

    order: int
    joint: NDArray[np.intp]
    first: NDArray[np.intp]
    weights: FloatArray
    base: FloatArray

    def values(self, padded: FloatArray) -> FloatArray:
        """The values at given control points, all (pieces + 3, k) of them: (m,)."""
        points = padded[self.first[:, None] + np.arange(4), self.joint[:, None]]
        return np.asarray(self.base + np.einsum("ma,ma->m", self.weights, points))


@dataclass(frozen=True, eq=False)
class PostureRows:
    """Postures at some parameters, or derivatives of them.

    Attributes:
        first: number of the first of four control points, (n,).
        weights: of the control points, (n, 4).
        base: of the direct motion, (n, k).
    """

    first: NDArray[np.intp]
    weights: FloatArray
    base: FloatArray

    def values(self, padded: FloatArray) -> FloatArray:
        """The postures at given control points, all (pieces + 3, k) of them: (n, k)."""
        points = padded[self.first[:, None] + np.arange(4)]
        return np.asarray(self.base + np.einsum("na,nak->nk", self.weights, points))


def direct_motion(
    start: FloatArray, goal: FloatArray, limits: JointLimits, rates: FloatArray | None = None
) -> Trajectory:
    """The fastest direct motion between two postures (k,), at rest unless rates are given, as of :class:`Deviations`.

    Between equal postures at rest it is a second of rest.

    Raises:
        InvalidProblem: there is none within the limits.
    """
    if rates is not None and rates.any():
        return fastest_move(MotionState(start, *rates[0]), MotionState(goal, *rates[1]), limits)
    if (start == goal).all():
        return Trajectory(np.array([0.0, 1.0]), np.pad(start[None, None], ((DEGREE, 0), (0, 0), (0, 0))))
    return rest_to_rest(start, goal, limits)


def one_cubic(start: FloatArray, goal: FloatArray, duration: float) -> Trajectory:
    """The cubic from rest at a posture (k,) to rest at another in a time in s."""
    way, none = goal - start, np.zeros_like(start)
    rows = [-2.0 * way / duration**3, 3.0 * way / duration**2, none, start]
    return Trajectory(np.array([0.0, duration]), np.stack(rows)[:, None])


def smoothed(trajectory: Trajectory, pieces: int) -> Trajectory:
    """The uniform cubic spline of so many pieces whose control points are postures of a motion from rest to rest.

    Derivatives of the spline are averages of those of the motion, so that it keeps the limits that the motion keeps. It
    is at rest a little before and after, takes two more of its steps, and is nowhere farther from the motion than that
    goes in one step.
    """
    step = trajectory.duration / pieces
    knots = step * np.arange(-DEGREE, pieces + 3 + DEGREE, dtype=np.float64)
    postures = trajectory.at(np.clip(knots[1:-3], 0.0, trajectory.duration))
    spline, breakpoints = BSpline(knots, postures, DEGREE), knots[DEGREE:-DEGREE]
    return Trajectory(breakpoints, taylor_coefficients(spline, breakpoints[:-1], DEGREE))


class Deviations:
    """All motions between two postures that deviate from the direct one, or from another, by a spline.

    Args:
        start: (k,), rad.
        goal: (k,), rad.
        limits: of the joints.
        gentler: limits of the direct motion that is deviated from; near both ends a deviation has no effect.
        rates: velocities and accelerations at both ends, (2 ends, 2, k), rad/s and rad/s^2; at rest where None.
        at_least: no motion may take less time, s.
        around: a motion from rest to rest that is deviated from in the place of the direct one.
        is_smooth: whether what is deviated from is one cubic, so that accelerations jump at the ends alone.
        pieces: of the spline.
        settings: of the rows.

    Attributes:
        is_smooth: as given.
        direct: the fastest motion between the two, within the gentler limits where there are some; or that one.
        bound: no motion between the two takes less time, s.

    Raises:
        InvalidProblem: there is no direct motion.
    """

    def __init__(
        self,
        start: FloatArray,
        goal: FloatArray,
        limits: JointLimits,
        *,
        gentler: JointLimits | None = None,
        rates: FloatArray | None = None,
        at_least: float = 0.0,
        around: Trajectory | None = None,
        is_smooth: bool = False,
        pieces: int = PIECES,
        settings: DeviationSettings = DEFAULT_DEVIATION,
    ) -> None:
        self.start, self.goal, self.limits, self.settings, self.is_smooth = start, goal, limits, settings, is_smooth
        self.spline = DeviationSpline.of(pieces, 2 if is_smooth else 3)
        self._direct_limits = limits if gentler is None else gentler
        self.moving = rates is not None and bool(rates.any())
        self._is_direct = around is None and not is_smooth
        if around is not None:
            self.direct = smoothed(around, settings.smoothing * pieces)
        else:
            self.direct = direct_motion(start, goal, self._direct_limits, rates)
            self.direct = one_cubic(start, goal, self.direct.duration) if is_smooth else self.direct
        at_rest = float(least_durations(goal - start, limits).max())
        self.bound = max((1.0 - settings.allowance) * self.direct.duration if self.moving else at_rest, at_least)
        self._moved = np.zeros((2, self.spline.count, start.size))
        for order, moved in enumerate(self._moved, start=1):
            if rates is not None and self.moving:
                moved[: self.fixed] = self.spline.end_points(0.0, order, rates[0, order - 1])
                moved[-self.fixed :] = self.spline.end_points(1.0, order, rates[1, order - 1])

    @property
    def dof(self) -> int:
        """The number of joints."""
        return self.start.size

    @property
    def fixed(self) -> int:
        """The number of control points of a joint at either end that are not free."""
        return self.spline.fixed

    @property
    def free(self) -> int:
        """The number of control points of a joint that are free."""
        return self.spline.count - 2 * self.fixed

    def padded(self, x: FloatArray, duration: float | None = None) -> FloatArray:
        """All control points (pieces + 3, k) of a motion of a duration in s with some that are free (free, k).

        Without a duration the motion takes as long as the direct one.
        """
        padded = np.pad(x, ((self.fixed, self.fixed), (0, 0)))
        if not self.moving or duration is None:
            return padded
        once, twice = (duration**order - self.direct.duration**order for order in (1, 2))
        return np.asarray(padded + once * self._moved[0] + twice * self._moved[1])

    def ends_by_time(self, duration: float) -> FloatArray:
        """How the control points at the ends change with a duration in s, (pieces + 3, k), rad/s."""
        return np.asarray(self._moved[0] + 2.0 * duration * self._moved[1])

    def changed(self, x: FloatArray, longer: float, duration: float) -> FloatArray:
        """How all control points change, to first order, with free ones, (free, k), and a longer duration, in s."""
        padded = np.pad(x, ((self.fixed, self.fixed), (0, 0)))
        return padded + longer * self.ends_by_time(duration) if self.moving else padded

    def with_ends(self, rows: R, duration: float) -> R:
        """Rows of free control points with what a change of a duration in s does to those at the ends."""
        if not self.moving:
            return rows
        points = self.ends_by_time(duration)[rows.first[:, None] + self.fixed + np.arange(DEGREE + 1)]
        if isinstance(rows, SingleRows):
            points = np.take_along_axis(points, rows.joint[:, None, None], axis=2)[:, :, 0]
        moved = (rows.weights * points).sum(axis=tuple(range(1, rows.weights.ndim)))
        return replace(rows, by_time=rows.by_time + moved)

    def cost_with_ends(
        self, cost: FloatArray | None, time_cost: float, duration: float
    ) -> tuple[FloatArray | None, float]:
        """Costs of free control points, (free, k), and of a duration in s, by those of all, (pieces + 3, k)."""
        if cost is None:
            return None, time_cost
        return cost[self.fixed : -self.fixed], time_cost + float((cost * self.ends_by_time(duration)).sum())

    def _base(self, u: FloatArray, order: int) -> FloatArray:
        """Derivatives of the direct motion by u, (m, k)."""
        return self.direct.at(u * self.direct.duration, order) * self.direct.duration**order

    @property
    def _changes(self) -> list[FloatArray]:
        """Breakpoints between the cubics of each joint's direct motion, as shares of its duration."""
        jerks, inner = self.direct.coefficients[0], self.direct.breakpoints[1:-1] / self.direct.duration
        changes = np.abs(np.diff(jerks, axis=0)) > TIME_ROUNDING * np.abs(jerks).max()
        return [inner[column] for column in changes.T]

    @cached_property
    def _intervals(self) -> tuple[NDArray[np.intp], FloatArray, FloatArray]:
        """Parts in which a joint's motion is one cubic: number of the joint, beginning and end, each (m,)."""
        switching = self._is_direct and not self.moving
        shares = switch_shares(self.goal - self.start, self._direct_limits) if switching else self._changes
        joints, ends = [], []
        for joint, own in enumerate(shares):
            nodes = np.unique(np.concatenate([self.spline.edges, own]))
            nodes = np.append(nodes[:-1][np.diff(nodes) > TIME_ROUNDING], 1.0)
            joints.append(np.full(nodes.size - 1, joint))
            ends.append(np.column_stack([nodes[:-1], nodes[1:]]))
        both = np.concatenate(ends)
        return np.concatenate(joints), both[:, 0], both[:, 1]

    def _rows(self, u: FloatArray, joint: NDArray[np.intp], order: int, within: FloatArray) -> JointRows:
        """Rows at parameters that lie in, or at the edge of, the parts in which other parameters lie."""
        weights, piece = self.spline.weights(u, order, within)
        base = sum(
            self._base(within, order + more)[np.arange(len(u)), joint] * (u - within) ** more / factorial(more)
            for more in range(DEGREE + 1 - order)
        )
        return JointRows(order, joint, piece, weights, np.asarray(base))

    @cached_property
    def limited(self) -> list[JointRows]:
        """Rows of speeds, accelerations and jerks where their limits are enforced, as far as there are any."""
        joint, begin, end = self._intervals
        middle = (begin + end) / 2.0
        if self.moving:
            count = self.settings.moving_speed_rows
        else:
            count = self.settings.speed_rows if self._is_direct or self.is_smooth else self.settings.known_speed_rows
        inside = begin + (end - begin) * np.arange(1, count)[:, None] / count
        u, who, around = np.append(end, inside), np.tile(joint, count), np.tile(middle, count)
        rows = [self._rows(u, who, 1, around)]
        if self.limits.jerk is None:  # accelerations may jump
            rows.append(self._rows(np.append(begin, end), np.tile(joint, 2), 2, np.tile(middle, 2)))
        else:
            rows.append(self._rows(end, joint, 2, middle))
            rows.append(self._rows(middle, joint, 3, middle))
        return rows

    def angles(self, more: FloatArray) -> JointRows:
        """Angles where they are compared with the joints' ranges: in each part, and at more parameters (n,)."""
        joint, begin, end = self._intervals
        middle, who = (begin + end) / 2.0, np.repeat(np.arange(self.dof), more.size)
        others = np.tile(more, self.dof)
        u, within = np.concatenate([end, middle, others]), np.concatenate([middle, middle, others])
        return self._rows(u, np.concatenate([joint, joint, who]), 0, within)

    def parameters(self, in_piece: int = SAMPLES) -> FloatArray:
        """The parameters of samples, so many in each piece of the even spline, without both ends, (n,)."""
        return self.spline.parameters(in_piece)

    @cached_property
    def switches(self) -> FloatArray:
        """Parameters at which accelerations may be extreme, of any joint, (n,): on both sides of where they jump."""
        inner = np.unique(self._intervals[2][self._intervals[2] < 1.0])
        if self.limits.jerk is not None:
            return inner
        return np.concatenate([[JUST_BEFORE], inner - JUST_BEFORE, inner, [1.0 - JUST_BEFORE]])

    def postures(self, u: FloatArray, order: int = 0) -> PostureRows:
        """Postures at parameters (n,), or a derivative of them by u."""
        weights, piece = self.spline.weights(u, order)
        return PostureRows(piece, weights, self._base(u, order))

    def time_scale(self, padded: FloatArray, share: float = 1.0) -> float:
        """The least duration of the motion with some control points within a share of limits, as far as rows say, s."""
        bounds = [share * bound for bound in self.limits.by_order]
        needed = [
            (np.abs(rows.values(padded)) / bound[rows.joint]).max() ** (1.0 / rows.order)
            for rows, bound in zip(self.limited, bounds, strict=True)
        ]
        return float(max(needed))

    def least_duration(self, x: FloatArray, near: float, at_least: float = 0.0, share: float = 1.0) -> float:
        """The least duration of the motion of free control points (free, k), no less than a given one, s.

        Between moving ends the motion depends on its duration: the result is a given duration in s, or the next longer
        one that is found in which the motion keeps a share of its limits.
        """
        least = max(self.bound, at_least)
        if not self.moving:
            return max(self.time_scale(self.padded(x)), least)
        return self._long_enough(max(near, least), lambda each: self.time_scale(self.padded(x, each), share) <= each)

    def _long_enough(self, duration: float, keeps: Callable[[float], bool], most: float = np.inf) -> float:
        """The first of a duration in s and longer ones in which a motion between moving ends keeps its limits.

        The control points at the ends grow with the duration, and what they need with it, often faster than itself: a
        fixed-point iteration would diverge.

        Args:
            duration: s.
            keeps: whether the motion of a duration in s keeps the limits.
            most: share of the duration by which it may be longer; the longest is returned where none keeps them.
        """
        settings, tried = self.settings, duration
        for share in (0.0, *np.geomspace(settings.least_step, settings.largest_step, settings.duration_steps)):
            if share > most or keeps(tried := duration * (1.0 + share)):
                break
        return tried

    def fitted(self, path: FloatArray, begin: float = 0.0) -> FloatArray:
        """Free control points (free, k) of a motion along a path of straight parts, (m, dof), rad.

        The motion leaves and arrives at rest; its speed in between does not matter. It may wait a share of the time
        before it begins.
        """
        steps = (np.abs(np.diff(path, axis=0)) / np.array(self.limits.speed)).max(axis=1)
        at = np.concatenate([[0.0], np.cumsum(steps)])
        moved = np.concatenate([[True], np.diff(at) > 0.0])
        at, path = at[moved] / (at[-1] or 1.0), path[moved]
        u = self.parameters()
        into = np.maximum(u - begin, 0.0) / (1.0 - begin)
        share = into**3 * (10.0 - 15.0 * into + 6.0 * into**2)
        wanted = np.column_stack([np.interp(share, at, column) for column in path.T])
        return np.asarray(self.fit @ (wanted - self._base(u, 0)))

    def nearest_to(self, trajectory: Trajectory) -> FloatArray:
        """Free control points (free, k) of the motion nearest to another one, whose ends are moved to its own."""
        u, undeviated = self.parameters(), np.zeros((self.free, self.dof))
        there = self.postures(u).values(self.padded(undeviated, trajectory.duration))
        first, last = trajectory.at(trajectory.breakpoints[[0, -1]])
        share = (u**2 * (3.0 - 2.0 * u))[:, None]
        moved = (1.0 - share) * (self.start - first) + share * (self.goal - last)
        return np.asarray(self.fit @ (trajectory.at(u * trajectory.duration) + moved - there))

    @property
    def fit(self) -> FloatArray:
        """The matrix from changes of postures at the usual parameters to those of free control points, (free, n)."""
        return self.spline.fit

    def trajectory(self, x: FloatArray, duration: float, at_least: float = 0.0) -> Trajectory:
        """The motion of free control points (free, k) in a time in s, or in a little more that limits need.

        Where limits let it be faster, it is, but takes no less time than a given one, s. Between moving ends it may
        break limits: no longer duration need mend that.
        """
        if not self.moving:
            motion = self._in_duration(x, duration)
            scale = self.limits.time_scale(peak_shares(motion, self.limits))
            return motion.time_scaled(max(scale, self.bound / duration, at_least / duration))
        keeps = partial(self._keeps_limits_in, x)
        return self._in_duration(x, self._long_enough(duration, keeps, self.settings.largest_correction))

    def _keeps_limits_in(self, x: FloatArray, duration: float) -> bool:
        return self.keeps_limits(self._in_duration(x, duration))

    def keeps_limits(self, trajectory: Trajectory) -> bool:
        """Whether speeds, accelerations and jerks of a motion of cubics are within their limits."""
        return self.limits.time_scale(peak_shares(trajectory, self.limits)) <= 1.0 + TIME_ROUNDING

    def _in_duration(self, x: FloatArray, duration: float) -> Trajectory:
        nodes = np.unique(np.concatenate([self.spline.edges, self.direct.breakpoints / self.direct.duration]))
        nodes = np.append(nodes[:-1][np.diff(nodes) > TIME_ROUNDING], 1.0)
        begin, middle = nodes[:-1], (nodes[:-1] + nodes[1:]) / 2.0
        padded, back = self.padded(x, duration), (begin - middle)[:, None]
        there = []
        for order in range(DEGREE + 1):
            there.append(self.postures(middle, order).values(padded))
        rows = [
            sum(there[order + more] * back**more / factorial(more) for more in range(DEGREE + 1 - order))
            / (factorial(order) * duration**order)
            for order in range(DEGREE, -1, -1)
        ]
        return Trajectory(nodes * duration, np.stack([np.asarray(row) for row in rows]))
