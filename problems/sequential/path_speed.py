"""Path and speed as one vector of numbers: basis, grid, freedom, and time along it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import BSpline, FloatArray, as_array
from problems.robots import JointLimits, Robot
from problems.tasks import Place

PATH_DEGREE, SPEED_DEGREE = 5, 3
RESTING = 3  # control points at each end that are one posture: q' and q'' are zero there
DELAY_COST = 0.999  # of a second of standing still, where one of moving costs 1
GAUSS_POINTS = 8  # nodes in each piece of the speed, to integrate 1 / w


@dataclass(frozen=True)
class SplineBasis:
    """Uniform clamped B-splines over [0, 1].

    Args:
        degree: of the splines.
        pieces: that they consist of.
    """

    degree: int
    pieces: int

    @property
    def size(self) -> int:
        """The number of control points."""
        return self.pieces + self.degree

    @cached_property
    def _functions(self) -> BSpline:
        ends = np.zeros(self.degree)
        knots = np.concatenate([ends, np.linspace(0.0, 1.0, self.pieces + 1), ends + 1.0])
        return BSpline(knots, np.eye(self.size), self.degree)

    def matrix(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """The matrix from control points to a derivative by u at parameters (n,): (n, size)."""
        return np.asarray(self._functions(u, derivative))


@dataclass(frozen=True)
class Grid:
    """Parameters u, and the matrices from control points to path and speed there.

    Attributes:
        u: (n,).
        path: matrices of q, q', q'', q''', each (n, N).
        speed: matrices of w, w', w'', each (n, M).
    """

    u: FloatArray
    path: tuple[FloatArray, ...]
    speed: tuple[FloatArray, ...]


@dataclass(frozen=True)
class MotionSpace:
    """The splines in which a motion is sought.

    Args:
        path_pieces: of q(u).
        speed_pieces: of w(u), a multiple of those.
        parts: of each of the latter, over which 1 / w is integrated: more where a motion may all but stand still.
    """

    path_pieces: int
    speed_pieces: int
    parts: int = 1

    @cached_property
    def path(self) -> SplineBasis:
        """The splines of the path q(u)."""
        return SplineBasis(PATH_DEGREE, self.path_pieces)

    @cached_property
    def speed(self) -> SplineBasis:
        """The splines of the speed w(u)."""
        return SplineBasis(SPEED_DEGREE, self.speed_pieces)

    def grid(self, u: FloatArray) -> Grid:
        """The grid of parameters (n,)."""
        path = tuple(self.path.matrix(u, n) for n in range(4))
        return Grid(u, path, tuple(self.speed.matrix(u, n) for n in range(3)))

    def even(self, in_piece: int) -> FloatArray:
        """Parameters in equal steps, so many in each piece of the speed."""
        return np.linspace(0.0, 1.0, self.speed_pieces * in_piece + 1)

    @cached_property
    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Basis functions of the speed at Gauss's nodes (n, M), and their weights (n,)."""
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        cells = self.speed_pieces * self.parts
        starts = np.arange(cells) / cells
        u = (starts[:, None] + (nodes + 1.0) / (2.0 * cells)).ravel()
        return self.speed.matrix(u), np.tile(weights / (2.0 * cells), cells)


@dataclass(frozen=True)
class PathSpeed:
    """A path and the speed along it.

    Args:
        space: of both.
        controls: of q(u), (N, k), rad.
        speeds: of w(u), (M,), 1/s, positive.
        delay: for which it stands still at its start, s.
    """

    space: MotionSpace
    controls: FloatArray
    speeds: FloatArray
    delay: float = 0.0

    @cached_property
    def duration(self) -> float:
        """The duration T in s."""
        basis, weights = self.space.quadrature
        return self.delay + float((weights / (basis @ self.speeds)).sum())

    @property
    def cost(self) -> float:
        """The duration, of which standing still counts a little less than moving, s: else they were equally good."""
        return self.duration - (1.0 - DELAY_COST) * self.delay

    @property
    def duration_slopes(self) -> FloatArray:
        """Slopes of the duration, and of the cost, by the speeds, (M,)."""
        basis, weights = self.space.quadrature
        return np.asarray(-(weights / (basis @ self.speeds) ** 2) @ basis)

    def theta(self, grid: Grid) -> FloatArray:
        """Joint angles, (n, k)."""
        return np.asarray(grid.path[0] @ self.controls)

    def derivatives(self, grid: Grid) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Velocities, accelerations and jerks in time, (n, k) each."""
        q1, q2, q3 = (matrix @ self.controls for matrix in grid.path[1:])
        w, w1, w2 = ((matrix @ self.speeds)[:, None] for matrix in grid.speed)
        return q1 * w, q2 * w**2 + q1 * w * w1, q3 * w**3 + 3.0 * q2 * w**2 * w1 + q1 * w * (w1**2 + w * w2)

    def state(self, grid: Grid) -> FloatArray:
        """Angles, velocities and accelerations, (n, 3 k)."""
        return np.concatenate([self.theta(grid), *self.derivatives(grid)[:2]], axis=1)

    def time_scale(self, grid: Grid, limits: JointLimits) -> float:
        """The time scale at which it keeps its limits on a grid; below 1 where time can be saved."""
        limited = zip(self.derivatives(grid), limits.by_order, strict=False)
        return limits.time_scale(float((np.abs(derivative) / bound).max()) for derivative, bound in limited)

    def time_scaled(self, factor: float) -> PathSpeed:
        """The motion, so many times slower."""
        return replace(self, speeds=self.speeds / factor)


RANK_TOLERANCE = 1e-7  # of the largest singular value: smaller ones are zero


@dataclass(frozen=True)
class Freedom:
    """The freedom of a motion at its ends.

    Args:
        robot: that moves.
        start: where the path begins.
        goal: where it ends.
    """

    robot: Robot
    start: Place
    goal: Place

    def moves(self, controls: FloatArray) -> FloatArray:
        """All small changes of control points (N, k) that keep the ends, as columns of a matrix (N k, free)."""
        count, k = controls.shape
        inner = np.eye(count * k)[:, RESTING * k : (count - RESTING) * k]
        first = np.tile(self._free_at(self.start, controls[0]), (RESTING, 1))
        last = np.tile(self._free_at(self.goal, controls[-1]), (RESTING, 1))
        ends = np.zeros((count * k, first.shape[1] + last.shape[1]))
        ends[: RESTING * k, : first.shape[1]] = first
        ends[-RESTING * k :, first.shape[1] :] = last
        return np.concatenate([inner, ends], axis=1)

    @cached_property
    def _jacobians(self) -> dict[Place, ca.Function]:
        """Jacobians of the miss of the place at each end."""
        theta = ca.SX.sym("theta", 1, self.robot.dof)
        misses = {place: place.miss(self.robot, theta) for place in (self.start, self.goal)}
        return {place: ca.Function("jacobian", [theta], [ca.jacobian(miss, theta)]) for place, miss in misses.items()}

    def _free_at(self, place: Place, theta: FloatArray) -> FloatArray:
        """Directions (k, m) in which a posture stays at its place."""
        _, sizes, directions = np.linalg.svd(as_array(self._jacobians[place](theta)))
        return np.asarray(directions[int((sizes > RANK_TOLERANCE * sizes.max()).sum()) :].T)

    def placed(self, controls: FloatArray) -> FloatArray:
        """The control points with the ends exactly where they have to be."""
        placed = controls.copy()
        placed[:RESTING] = self.start.projected(self.robot, controls[0])
        placed[-RESTING:] = self.goal.projected(self.robot, controls[-1])
        return placed


@dataclass(frozen=True)
class Clock:
    """Times t(u), the integral of du / w(u) from 0 on, by Gauss's rule between one parameter and the next.

    Args:
        space: of motions.
        u: parameters, (n,), the first 0, none smaller than the one before.
        waits: how many of them are passed before the motion begins, in equal steps.
    """

    space: MotionSpace
    u: FloatArray
    waits: int = 0

    @cached_property
    def _nodes(self) -> tuple[FloatArray, FloatArray]:
        """Basis functions of the speed at the nodes, ((n - 1) GAUSS_POINTS, M), and weights, (n - 1, GAUSS_POINTS)."""
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
        lengths = np.diff(self.u)[:, None]
        at = self.u[:-1, None] + lengths * (nodes + 1.0) / 2.0
        return self.space.speed.matrix(at.ravel()), weights * lengths / 2.0

    def steps(self, speeds: FloatArray) -> FloatArray:
        """How long a motion with such speeds, (M,), takes from each parameter to the next, (n - 1,), s."""
        basis, weights = self._nodes
        return np.asarray((weights / (basis @ speeds).reshape(weights.shape)).sum(axis=1))

    @property
    def _delays(self) -> FloatArray:
        """Shares of the delay that have passed, (n,)."""
        return np.minimum(np.arange(self.u.size) / max(self.waits, 1), 1.0)

    def times(self, motion: PathSpeed) -> FloatArray:
        """Times at which a motion passes the parameters, (n,), s."""
        return np.asarray(np.append(0.0, np.cumsum(self.steps(motion.speeds))) + self._delays * motion.delay)

    def slopes(self, motion: PathSpeed) -> FloatArray:
        """Slopes of these times by the speeds, s^2, and by the delay: (n, M + 1)."""
        basis, weights = self._nodes
        falls = -weights.ravel()[:, None] / (basis @ motion.speeds)[:, None] ** 2 * basis
        steps = falls.reshape(*weights.shape, -1).sum(axis=1)
        by_speeds = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
        return np.concatenate([by_speeds, self._delays[:, None]], axis=1)


@dataclass(frozen=True)
class TimeShift:
    """A trust region of times.

    Attributes:
        passing: slopes of times at some samples with respect to speeds and delay, (p, M + 1).
        most: by how much each, and the delay, may change, s.
    """

    passing: FloatArray
    most: float

    def rows(self, free: int) -> tuple[FloatArray, FloatArray]:
        """Rows of a program with so many variables before the speeds, (2 p, free + M + 1), and their bounds."""
        slopes = np.pad(self.passing, ((0, 0), (free, 0))) / self.most
        return np.concatenate([slopes, -slopes]), np.ones(2 * len(slopes))
