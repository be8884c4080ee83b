"""A motion as a path q(u) and the speed w(u) = du/dt along it, both splines over u in [0, 1]."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits

PATH_DEGREE, SPEED_DEGREE = 5, 3
RESTING = 3  # control points at each end that are one posture: q' and q'' are zero there
DELAY_COST = 0.999  # of a second of standing still, where one of moving costs 1
GAUSS = 8  # nodes in each piece of the speed, to integrate 1 / w


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
        """From control points to a derivative by u at parameters (n,): (n, size)."""
        return np.asarray(self._functions(u, derivative))


@dataclass(frozen=True)
class Grid:
    """Parameters u and what control points make of a motion there.

    Attributes:
        u: (n,).
        path: of q, q', q'', q''', each (n, N).
        speed: of w, w', w'', each (n, M).
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
        """Of q(u)."""
        return SplineBasis(PATH_DEGREE, self.path_pieces)

    @cached_property
    def speed(self) -> SplineBasis:
        """Of w(u)."""
        return SplineBasis(SPEED_DEGREE, self.speed_pieces)

    def grid(self, u: FloatArray) -> Grid:
        """At parameters (n,)."""
        path = tuple(self.path.matrix(u, n) for n in range(4))
        return Grid(u, path, tuple(self.speed.matrix(u, n) for n in range(3)))

    def even(self, in_piece: int) -> FloatArray:
        """Equal steps, so many in each piece of the speed."""
        return np.linspace(0.0, 1.0, self.speed_pieces * in_piece + 1)

    @cached_property
    def quadrature(self) -> tuple[FloatArray, FloatArray]:
        """Basis functions of the speed at Gauss's nodes (n, M), and their weights (n,)."""
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
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
        """T in s."""
        basis, weights = self.space.quadrature
        return self.delay + float((weights / (basis @ self.speeds)).sum())

    @property
    def cost(self) -> float:
        """T, where standing still counts a little less than moving does, which trade at will otherwise; s."""
        return self.duration - (1.0 - DELAY_COST) * self.delay

    @property
    def duration_slopes(self) -> FloatArray:
        """Of T, and of the cost, with respect to the speeds, (M,)."""
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

    def stretch(self, grid: Grid, limits: JointLimits) -> float:
        """The factor by which it has to be slowed to keep its limits on a grid; below 1 where time can be saved."""
        bounds = (limits.speed, limits.acceleration, limits.jerk)
        peaks = zip(self.derivatives(grid), bounds, strict=True)
        ratios = [0.0 if bound is None else float((np.abs(d) / np.array(bound)).max()) for d, bound in peaks]
        return max(float(ratio ** (1.0 / order)) for order, ratio in enumerate(ratios, start=1))

    def slowed(self, factor: float) -> PathSpeed:
        """The same, so many times slower."""
        return replace(self, speeds=self.speeds / factor)
