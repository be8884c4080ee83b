"""A spline as a path that a scan times: motions whose shape is searched and whose timing follows.

What is free is the path q(u), u in [0, 1], a cubic spline that need not be at rest anywhere: du/dt is what begins and
ends at zero, or at given values. The least time along it is that of :mod:`problems.motions.path_scan`.

A given path of the joints is one of lines with rounded corners, or a spline through waypoints.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import factorial, sqrt
from typing import Self, TypeAlias

import casadi as ca
import numpy as np

from problems.base import (
    BSpline,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    PiecewisePolynomial,
    as_array,
    split,
    taylor_coefficients,
    total,
)
from problems.motions.path_scan import TINY, TorqueSlopes, interval_time, limited, scan
from problems.motions.samples import Samples
from problems.motions.splines import DEGREE, ClampedSpline
from problems.motions.trajectory import Motion, SampleGrid, Trajectory
from problems.robots import Robot

SPLINE_DEGREE, BLEND_DEGREE = 5, 4
SPLINE_NEEDS = 3  # waypoints; two are a line
SAME_WAYPOINT = 1e-9  # of the whole length
BLEND_REACH = 6.0 / 32.0  # how far the middle of a blend is from its corner, for a unit of half length and of turn


@dataclass(frozen=True)
class JointPath:
    """Joint angles as a function of a path parameter u.

    Args:
        breakpoints: p + 1 increasing values of u.
        coefficients: (order, p, k), rad; highest power first, each piece in its own u from 0, as SciPy's PPoly.
    """

    breakpoints: FloatArray
    coefficients: FloatArray

    @classmethod
    def of(cls, trajectory: Trajectory) -> Self:
        """The path of a motion, with the time as its parameter."""
        return cls(trajectory.breakpoints, trajectory.coefficients)

    @classmethod
    def through(cls, waypoints: FloatArray, parameters: FloatArray | None = None) -> Self:
        """The spline of degree 5 through waypoints: four continuous derivatives.

        Its third and fourth derivatives are zero at both ends, which bends it least.

        Args:
            waypoints: (n, k), rad.
            parameters: at which they are passed, (n,), from 0 on; the lengths of their chords by default.

        Raises:
            InvalidProblem: fewer than two, or two in a row that are the same, or a number that is none.
        """
        u = np.concatenate([[0.0], np.cumsum(_chords(waypoints))]) if parameters is None else parameters
        if u.size < SPLINE_NEEDS:
            return cls(u, np.stack([np.diff(waypoints, axis=0) / np.diff(u)[:, None], waypoints[:-1]]))
        ends, none = np.full((2, SPLINE_DEGREE + 1), u[[0, -1], None]), np.zeros((2, waypoints.shape[1]))
        spline = BSpline.through(
            np.concatenate([ends[0], u[1:-1], ends[1]]),
            np.concatenate([ends[0, :2], u, ends[1, :2]]),
            np.concatenate([waypoints[:1], none, waypoints[1:-1], none, waypoints[-1:]]),
            SPLINE_DEGREE,
            orders=[0, 3, 4, *[0] * (u.size - 2), 3, 4, 0],
        )
        return cls(u, taylor_coefficients(spline, u[:-1], SPLINE_DEGREE))

    @classmethod
    def blended(cls, waypoints: FloatArray, tolerance: float) -> Self:
        """Straight lines between waypoints, their corners rounded by polynomials: two continuous derivatives.

        A blend is as wide as the tolerance allows, half of a line between two corners at most. It leaves its corner
        out; the first and the last waypoint are reached.

        Args:
            waypoints: (n, k), rad.
            tolerance: how far any joint may be from the lines, rad; with 0 the corners stay.

        Raises:
            InvalidProblem: as :meth:`through`, or a negative tolerance.
        """
        if not 0.0 <= tolerance < np.inf:
            raise InvalidProblem("tolerance", f"{tolerance:g} is not a number from 0 on, in rad")
        lengths = _chords(waypoints)
        ways = np.diff(waypoints, axis=0) / lengths[:, None]
        turn = np.abs(np.diff(ways, axis=0)).max(axis=1, initial=0.0)
        room = np.where(np.isin(np.arange(lengths.size), [0, lengths.size - 1]), 1.0, 0.5) * lengths
        with np.errstate(divide="ignore", invalid="ignore"):
            widest = np.where(turn > 0.0, tolerance / (BLEND_REACH * turn), 0.0)
        widest[widest <= SAME_WAYPOINT * lengths.sum()] = 0.0  # such a corner stays
        half = np.concatenate([[0.0], np.minimum(widest, np.minimum(room[:-1], room[1:])), [0.0]])
        pieces = []
        for i, length in enumerate(lengths):
            straight = length - half[i] - half[i + 1]
            if straight > SAME_WAYPOINT * length:
                pieces.append((straight, _line(waypoints[i] + half[i] * ways[i], ways[i])))
            if half[i + 1] > 0.0:
                pieces.append((2.0 * half[i + 1], _blend(waypoints[i + 1], ways[i], ways[i + 1], half[i + 1])))
        u = np.cumsum([0.0, *(extent for extent, _ in pieces)])
        return cls(u, np.stack([coefficients for _, coefficients in pieces], axis=1))

    def first_joints(self, count: int) -> JointPath:
        """The path of the first so many joints."""
        return JointPath(self.breakpoints, self.coefficients[..., :count])

    def moved_by(self, offsets: FloatArray) -> JointPath:
        """The path with each joint off by a constant, (k,), rad or m."""
        return JointPath(self.breakpoints, np.concatenate([self.coefficients[:-1], self.coefficients[-1:] + offsets]))

    def restarted(self, starts: FloatArray) -> FloatArray:
        """Coefficients (order, n, k) of the pieces that hold parameters (n,), each in its own u from there on."""
        return taylor_coefficients(self.at, starts, len(self.coefficients) - 1)

    @cached_property
    def curve(self) -> PiecewisePolynomial:
        """The piecewise polynomial of the angles."""
        return PiecewisePolynomial(self.coefficients, self.breakpoints)

    def at(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """Angles or a derivative of them, (n, k), at parameters (n,)."""
        return np.asarray(self.curve(u, derivative))


def _chords(waypoints: FloatArray) -> FloatArray:
    """Lengths of the lines between waypoints (n, k), (n - 1,), rad."""
    if waypoints.ndim != 2 or len(waypoints) < 2 or not waypoints.shape[1]:
        raise InvalidProblem("waypoints", "a path needs two waypoints at least")
    wrong = np.flatnonzero(~np.isfinite(waypoints).all(axis=1))
    if wrong.size:
        raise InvalidProblem("waypoints", f"number {wrong[0] + 1} has a joint angle that is no number")
    lengths = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    same = np.flatnonzero(lengths <= SAME_WAYPOINT * lengths.sum())
    if same.size:
        raise InvalidProblem("waypoints", f"numbers {same[0] + 1} and {same[0] + 2} are the same")
    return np.asarray(lengths)


def _line(start: FloatArray, way: FloatArray) -> FloatArray:
    """Coefficients (BLEND_DEGREE + 1, k) of a line."""
    return np.concatenate([np.zeros((BLEND_DEGREE - 1, start.size)), [way, start]])


def _blend(corner: FloatArray, before: FloatArray, after: FloatArray, half: float) -> FloatArray:
    """Coefficients (BLEND_DEGREE + 1, k) of a blend between two lines, of their slopes, without curvature.

    With w from 0 to 1: corner - half (1 - 2 w) before + half (2 w^3 - w^4) (after - before).
    """
    lowest_first = [corner - half * before, 2.0 * half * before, 0.0 * corner]
    lowest_first += [2.0 * half * (after - before), -half * (after - before)]
    return np.asarray((np.array(lowest_first) / (2.0 * half) ** np.arange(BLEND_DEGREE + 1)[:, None])[::-1])


SUPPORT = DEGREE + 1  # control points that shape a sample
ALONG = {0: (0,), 1: (1,), 2: (1, 2), 3: (2, 3)}  # which derivatives by u make one by t
Rates: TypeAlias = tuple[Matrix, Matrix | None]  # b = (du/dt)^2 at start and goal; None for a goal at rest


@dataclass(frozen=True)
class TimedPath:
    """A path with the timing along it.

    Attributes:
        control_points: of the spline, (N, k), rad.
        squared: b = (du/dt)^2 at the grid points, (n, 1), 1/s^2; d2u/dt2 is constant from one to the next.
        duration: scalar, s.
        gap: 0 where the velocities at the ends can be attained on this path, else by how much not.
    """

    control_points: Matrix
    squared: Matrix
    duration: Matrix
    gap: Matrix

    def time_scaled(self, factor: Operand, shortest: Operand) -> TimedPath:
        """The path run ``factor`` times slower, for no less than ``shortest`` seconds."""
        duration = ca.fmax(self.duration * factor, shortest)
        return replace(self, squared=self.squared * (self.duration / duration) ** 2, duration=duration)


@dataclass(frozen=True)
class PathSpline(Motion[TimedPath]):
    """Least time along a spline, sampled at grid points of the path.

    Args:
        robot: that moves; its speed and acceleration limits are kept, and its torque limits but for viscous friction.
        nodes: of the spline, increasing from 0 to 1.
        steps: of the grid between two nodes.
        share: of the acceleration limits that the timing makes use of.
        graded: whether steps are shorter near the start, and near the goal, for what counts by time: from rest the
            first of equal steps along the path takes long.
        integrated: whether samples bring Gauss's points of the interval after them, for integrals over time. Where
            accelerations jump a rule over the samples alone misses one side, and a search finds what hides there.
    """

    robot: Robot
    nodes: tuple[float, ...]
    steps: int
    share: float = 1.0
    graded: tuple[bool, bool] = (False, False)
    integrated: bool = False

    @cached_property
    def spline(self) -> ClampedSpline:
        """The spline over the nodes."""
        return ClampedSpline(np.array(self.nodes))

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Path parameters of the grid points, (n,)."""
        starts, lengths = np.array(self.nodes[:-1]), np.diff(self.nodes)
        even = np.append((starts[:, None] + lengths[:, None] * np.arange(self.steps) / self.steps).ravel(), 1.0)
        shares = np.square(np.arange(1, self.steps) / self.steps)  # passed at equal times by what accelerates steadily
        if self.graded[0]:
            even[1 : self.steps] = lengths[0] * shares
        if self.graded[1]:
            even[-self.steps : -1] = 1.0 - lengths[-1] * shares[::-1]
        return even

    @property
    def acceleration(self) -> tuple[Operand, ...]:
        """The accelerations that the timing uses, rad/s^2."""
        return tuple(self.share * limit for limit in self.robot.limits.acceleration)

    @cached_property
    def double_steps(self) -> FloatArray:
        """Twice the distances of the grid points, (n - 1,)."""
        lengths = 2.0 * np.diff(self.nodes)
        even = np.repeat(lengths / self.steps, self.steps)
        shares = (2.0 * np.arange(self.steps) + 1.0) / self.steps**2
        if self.graded[0]:
            even[: self.steps] = lengths[0] * shares
        if self.graded[1]:
            even[-self.steps :] = lengths[-1] * shares[::-1]
        return even

    @property
    def stops(self) -> tuple[int, ...]:
        """Grid points at which the motion comes to rest on its way; none by default."""
        return ()

    def timed(self, control_points: Matrix, rates: Rates, shares: Matrix | None = None) -> TimedPath:
        """The least time along a path.

        Args:
            control_points: (N, k), rad.
            rates: at both ends.
            shares: of the speed limits at the grid points, (n, 1); all of them where None.
        """
        theta, first, second = (
            ca.mtimes(self.spline.sampling_matrix(self.parameters_u, n), control_points) for n in range(3)
        )
        torques = None
        if limited(self.robot):
            torques = TorqueSlopes.along(self.robot, theta, first, second), self.robot.limits.torque or ()
        limits, steps = (self.robot.limits.speed, self.acceleration), self.double_steps.tolist()
        found = scan(first, second, steps, rates, *limits, self.stops, torques, shares)
        duration = total(interval_time(ca.DM(self.double_steps), found.squared[:-1], found.squared[1:]))
        return TimedPath(control_points, found.squared, duration, found.gap)

    def slopes(self, parameters: TimedPath) -> Matrix:
        """d2u/dt2 in the interval after each grid point, for the last one before it; (n, 1), 1/s^2."""
        squared = parameters.squared
        inner = (squared[1:] - squared[:-1]) / ca.DM(np.maximum(self.double_steps, TINY))
        return ca.vertcat(inner, inner[-1])

    def samples(self, parameters: TimedPath) -> Samples:
        k, squared = self.robot.dof, parameters.squared
        along = {
            n: ca.mtimes(self.spline.sampling_matrix(self.parameters_u, n), parameters.control_points)
            for n in self.orders
        }
        b, c = (ca.repmat(column, 1, k) for column in (squared, self.slopes(parameters)))
        taken = interval_time(ca.DM(self.double_steps), squared[:-1], squared[1:])
        times = ca.cumsum(ca.vertcat(0.0, taken))
        samples = Samples(
            robot=self.robot,
            derivatives=tuple(in_time(order, along, b, c) for order in self.orders),
            duration=parameters.duration,
            times=times,
            weights=(ca.vertcat(0.0, taken) + ca.vertcat(taken, 0.0)) / 2.0,
        )
        if not self.integrated:
            return samples
        passed = [along[n][:-1, :] for n in self.orders], b[:-1, :], b[1:, :], c[:-1, :], ca.repmat(taken, 1, k)
        points = [within(share, *passed) for share in GAUSS_SHARES]
        quadrature = Samples(
            robot=self.robot,
            derivatives=tuple(ca.vertcat(*(point[n] for point in points)) for n in self.orders),
            duration=parameters.duration,
            times=ca.vertcat(*(times[:-1] + share * taken for share in GAUSS_SHARES)),
            weights=ca.repmat(taken / len(points), len(points), 1),
        )
        return replace(samples, quadrature=quadrature)

    @cached_property
    def grid(self) -> SampleGrid:
        """The number of the sample alone, as blocks hold finished samples."""
        count = self.parameters_u.size
        return SampleGrid(rows=np.empty((count, 0)), pieces=np.arange(count))

    @cached_property
    def path_grid(self) -> SampleGrid:
        """Rows: the basis functions of each order that are not zero at a grid point; pieces are control points."""
        bases, pieces = zip(*(self.spline.local_basis(self.parameters_u, n) for n in self.orders), strict=True)
        return SampleGrid(rows=np.column_stack(bases), pieces=pieces[0])

    def along(self, window: Matrix, row: Matrix, orders: Iterable[int]) -> dict[int, Matrix]:
        """q(u) and its derivatives (1, k) at one grid point, by order, from the four control points there.

        Args:
            window: the control points one after the other, (4 k, 1).
            row: of :attr:`path_grid`.
            orders: of the derivatives.
        """
        k = self.robot.dof
        found: dict[int, Matrix] = {}
        for n in orders:
            parts = [row[SUPPORT * n + i] * window[i * k : (i + 1) * k].T for i in range(SUPPORT)]
            found[n] = ((parts[0] + parts[1]) + parts[2]) + parts[3]
        return found

    def blocks(self, parameters: TimedPath, orders: tuple[int, ...]) -> Matrix:
        """The samples one after the other: some derivatives, time, weight; likewise Gauss's points after each."""
        samples = self.samples(parameters)
        quadrature = samples.quadrature
        rows = [_row(samples, orders)]
        if quadrature is not None:
            none, found = ca.DM.zeros(1, rows[0].shape[1]), _row(quadrature, orders)
            rows += [ca.vertcat(part, none) for part in ca.vertsplit(found, samples.count - 1)]
        return ca.vec(ca.horzcat(*rows).T)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """The sizes of a sample with Gauss's points after it, which is both a piece and the window."""
        size = self.instants * (len(orders) * self.robot.dof + 2)
        return size, size

    @property
    def instants(self) -> int:
        """The number of samples of a piece: its own, and Gauss's points where integrals are taken."""
        return 1 + len(GAUSS_SHARES) * self.integrated

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        first, *points = split(window, [window.shape[0] // self.instants] * self.instants)
        sample = self._instants([first], durations, orders)
        return replace(sample, quadrature=self._instants(points, durations, orders)) if points else sample

    def _instants(self, windows: Sequence[Matrix], durations: Matrix, orders: tuple[int, ...]) -> Samples:
        k = self.robot.dof
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for place, order in enumerate(orders):
            derivatives[order] = ca.vertcat(*(window[place * k : (place + 1) * k].T for window in windows))
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=durations[0],
            times=ca.vertcat(*(window[-2] for window in windows)),
            weights=ca.vertcat(*(window[-1] for window in windows)),
        )

    def durations(self, parameters: TimedPath) -> Matrix:
        return parameters.duration

    @property
    def duration_count(self) -> int:
        return 1

    def as_matrices(self, parameters: TimedPath) -> list[Matrix]:
        return [parameters.control_points, parameters.squared, parameters.duration, parameters.gap]

    def from_matrices(self, matrices: Sequence[Matrix]) -> TimedPath:
        return TimedPath(*matrices)

    def path(self, control_points: FloatArray) -> JointPath:
        """The path of control points (N, k), with u as its parameter."""
        curve = self.spline.curve(control_points)
        return JointPath(np.asarray(curve.x), np.asarray(curve.c))

    def trajectory(self, parameters: TimedPath) -> Trajectory:
        """The motion of the scan: exact polynomials of degree 6 in time, d2u/dt2 constant in each interval.

        Its accelerations jump at the grid points, and keep their limits there alone.
        """
        squared, slopes = (as_array(part).ravel() for part in (parameters.squared, self.slopes(parameters)))
        control_points = as_array(parameters.control_points)
        starts = self.parameters_u[:-1]
        along = [np.asarray(self.spline.sampling_matrix(starts, n)) @ control_points for n in self.orders]
        durations = self.double_steps / (np.sqrt(squared[:-1]) + np.sqrt(squared[1:]))
        pieces = []
        for i, duration in enumerate(durations):
            advance = np.polynomial.Polynomial([0.0, np.sqrt(squared[i]) * duration, slopes[i] * duration**2 / 2.0])
            powers = [(advance**n).coef for n in range(SUPPORT)]
            piece = np.zeros((2 * DEGREE + 1, self.robot.dof))
            for n, power in enumerate(powers):
                piece[: power.size] += power[:, None] * along[n][i] / factorial(n)
            pieces.append(piece)
        return Trajectory.from_pieces(durations, pieces)


def _row(samples: Samples, orders: tuple[int, ...]) -> Matrix:
    """Some derivatives, time and weight of samples (n, ...), beside each other."""
    assert samples.times is not None and samples.weights is not None
    return ca.horzcat(*(samples.derivative(order) for order in orders), samples.times, samples.weights)


GAUSS_SHARES = (0.5 - sqrt(1.0 / 12.0), 0.5 + sqrt(1.0 / 12.0))  # of an interval's time; they weigh the same


def within(
    share: float, along: Sequence[Matrix], b: Matrix, ahead: Matrix, c: Matrix, taken: Matrix
) -> tuple[Matrix, ...]:
    """Joint angles and their derivatives with respect to time at a share of the time of an interval, (n, k) each.

    Args:
        share: from 0 to 1.
        along: q(u) and its three derivatives at the beginning of the interval, in which it is a cubic.
        b: (du/dt)^2 at the beginning; of the shape of the derivatives, or scalar, as the following.
        ahead: the same at the end.
        c: d2u/dt2.
        taken: how long the interval takes, s.
    """
    start = ca.sqrt(b)
    rate = start + share * (ca.sqrt(ahead) - start)
    ahead_by = share * taken * (start + rate) / 2.0
    q, first, second, third = along
    second_there = second + ahead_by * third
    first_there = first + ahead_by * (second + second_there) / 2.0
    q_there = q + ahead_by * (first + ahead_by * (second / 2.0 + ahead_by * third / 6.0))
    there = {0: q_there, 1: first_there, 2: second_there, 3: third}
    return tuple(in_time(order, there, rate * rate, c) for order in there)


def in_time(order: int, along: Mapping[int, Matrix], b: Matrix, c: Matrix) -> Matrix:
    """A derivative with respect to time, from those with respect to u, b = (du/dt)^2 and a constant c = d2u/dt2.

    Args:
        order: at most 3.
        along: the derivatives by u, those of ``ALONG[order]`` at least.
        b: of the shape of the derivatives, or scalar.
        c: likewise.
    """
    rate = ca.sqrt(b)
    factors: dict[int, tuple[Operand, ...]] = {0: (1.0,), 1: (rate,), 2: (c, b), 3: (3.0 * c * rate, rate * b)}
    parts = [factor * along[n] for n, factor in zip(ALONG[order], factors[order], strict=True)]
    return sum(parts[1:], parts[0])
