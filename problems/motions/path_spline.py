"""A spline as a path that a scan times: motions whose shape is searched and whose timing follows.

What is free is the path q(u), u in [0, 1], a cubic spline that need not be at rest anywhere: du/dt is what begins and
ends at zero, or at given values. The least time along it is that of :mod:`problems.motions.path_scan`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import factorial
from typing import TypeAlias

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, as_array, total
from problems.motions.joint_path import JointPath
from problems.motions.path_scan import TINY, TorqueSlopes, interval_time, limited, scan
from problems.motions.samples import Samples
from problems.motions.splines import DEGREE, ClampedSpline
from problems.motions.trajectory import Motion, SampleGrid, Trajectory
from problems.robots import Robot

SUPPORT = DEGREE + 1  # control points that shape a sample
ALONG = {0: (0,), 1: (1,), 2: (1, 2), 3: (2, 3)}  # which derivatives by u make one by t
Rates: TypeAlias = tuple[Matrix, Matrix | None]  # b = (du/dt)^2 at start and goal; None for a goal at rest


@dataclass(frozen=True)
class TimedPath:
    """A path with its timing.

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

    def slowed(self, factor: Operand, shortest: Operand) -> TimedPath:
        """The same path run ``factor`` times slower, for no less than ``shortest`` seconds."""
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
    """

    robot: Robot
    nodes: tuple[float, ...]
    steps: int
    share: float = 1.0
    graded: tuple[bool, bool] = (False, False)

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
        """The accelerations that the timing makes use of, rad/s^2."""
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

    def timed(self, control_points: Matrix, rates: Rates, pace: Matrix | None = None) -> TimedPath:
        """The least time along a path.

        Args:
            control_points: (N, k), rad.
            rates: at both ends.
            pace: shares of the speed limits at the grid points, (n, 1); all of them where None.
        """
        theta, first, second = (
            ca.mtimes(self.spline.sampling_matrix(self.parameters_u, n), control_points) for n in range(3)
        )
        torques = None
        if limited(self.robot):
            torques = TorqueSlopes.along(self.robot, theta, first, second), self.robot.limits.torque or ()
        limits, steps = (self.robot.limits.speed, self.acceleration), self.double_steps.tolist()
        found = scan(first, second, steps, rates, *limits, self.stops, torques, pace)
        duration = total(interval_time(ca.DM(self.double_steps), found.squared[:-1], found.squared[1:]))
        return TimedPath(control_points, found.squared, duration, found.gap)

    def slopes(self, parameters: TimedPath) -> Matrix:
        """d2u/dt2 in the interval after each grid point, for the last one before it; (n, 1), 1/s^2."""
        squared = parameters.squared
        inner = (squared[1:] - squared[:-1]) / ca.DM(np.maximum(self.double_steps, TINY))
        return ca.vertcat(inner, inner[-1])

    def samples(self, parameters: TimedPath) -> Samples:
        """The motion at all grid points."""
        k, squared = self.robot.dof, parameters.squared
        along = {
            n: ca.mtimes(self.spline.sampling_matrix(self.parameters_u, n), parameters.control_points)
            for n in self.orders
        }
        b, c = (ca.repmat(column, 1, k) for column in (squared, self.slopes(parameters)))
        times = interval_time(ca.DM(self.double_steps), squared[:-1], squared[1:])
        return Samples(
            robot=self.robot,
            derivatives=tuple(in_time(order, along, b, c) for order in self.orders),
            duration=parameters.duration,
            times=ca.cumsum(ca.vertcat(0.0, times)),
            weights=(ca.vertcat(0.0, times) + ca.vertcat(times, 0.0)) / 2.0,
        )

    @cached_property
    def grid(self) -> SampleGrid:
        """Nothing but the number of the sample: blocks hold finished samples."""
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
        """The samples one after the other: some derivatives, time, weight."""
        samples = self.samples(parameters)
        assert samples.times is not None and samples.weights is not None
        derivatives = [samples.derivative(order) for order in orders]
        return ca.vec(ca.horzcat(*derivatives, samples.times, samples.weights).T)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """A piece is a sample, and so is the window."""
        size = len(orders) * self.robot.dof + 2
        return size, size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        """One sample."""
        k = self.robot.dof
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for place, order in enumerate(orders):
            derivatives[order] = window[place * k : (place + 1) * k].T
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=durations[0],
            times=window[-2],
            weights=window[-1],
        )

    def durations(self, parameters: TimedPath) -> Matrix:
        """The duration T, s."""
        return parameters.duration

    @property
    def duration_count(self) -> int:
        """One: T."""
        return 1

    def as_matrices(self, parameters: TimedPath) -> list[Matrix]:
        """Control points, b, the duration, the gap."""
        return [parameters.control_points, parameters.squared, parameters.duration, parameters.gap]

    def from_matrices(self, matrices: Sequence[Matrix]) -> TimedPath:
        """Control points, b, the duration, the gap."""
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

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Equal steps in each piece of the finished motion, which has pieces of its own."""
        return trajectory.times(at_least)


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
