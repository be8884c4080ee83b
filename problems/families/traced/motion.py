"""The motion: a spline with rounded corners, timed by a scan.

A path with a corner is passed by stopping there; between two corners the spline is the natural one, with second
derivatives zero at both ends. The parameter is regular at the ends: q'(u) is not zero there, as in a spline of a motion
from rest, so that the path can be run at any speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix
from problems.motions import DEGREE, InterpolatingSpline, PathSpline, without_rounding

NATURAL_ORDER = 2  # of the derivative that is zero at the ends of a stretch


class CornerSpline(InterpolatingSpline):
    """Splines with given knots and corners.

    Args:
        knots: M >= 2 increasing values of u, the first 0, the last 1.
        corners: indices of the inner knots that are corners.
    """

    def __init__(self, knots: FloatArray, corners: Sequence[int] = ()) -> None:
        self.corners = tuple(corners)
        repeated = np.repeat(knots[list(self.corners)], DEGREE - 1)
        super().__init__(knots, knots, repeated.tolist())

    @cached_property
    def conditions(self) -> FloatArray:
        """Natural at the start of each stretch, its knots, natural at its end; (n, n)."""
        rows = []
        for first, last in self.stretches:
            start, end = self.knots[first], np.nextafter(self.knots[last], 0.0)
            at_knots = self.basis(self.knots[first : last + 1])
            bends = self.basis(np.array([start, end]), NATURAL_ORDER)
            block = [at_knots[0], bends[0], *at_knots[1:-1], bends[1], at_knots[-1]]
            rows += block if first == 0 else block[1:]
        return without_rounding(np.array(rows))

    def basis_functions(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """All basis functions, or a derivative of them from the right, at parameters (n,)."""
        return np.asarray(self.basis(u, derivative))

    def known(self, angles: Matrix) -> Matrix:
        """Right-hand side: zero, the angles, zero, for each stretch."""
        zero, angles, rows = ca.DM.zeros(1, angles.shape[1]), self.scaled(angles), []
        for first, last in self.stretches:
            block = [angles[first, :], zero, angles[first + 1 : last, :], zero, angles[last, :]]
            rows += block if first == 0 else block[1:]
        return ca.vertcat(*rows)

    @property
    def stretches(self) -> list[tuple[int, int]]:
        """First and last knot of each stretch between corners."""
        ends = [0, *self.corners, self.knots.size - 1]
        return list(pairwise(ends))


@dataclass(frozen=True)
class TracedSpline(PathSpline):
    """The spline of :class:`CornerSpline`; its nodes are the knots.

    A corner is two grid points in one place: the path arrives at the first, stops, and leaves from the second.

    Args:
        corners: indices of the inner nodes at which the path turns a corner.
    """

    corners: tuple[int, ...] = ()

    @cached_property
    def spline(self) -> CornerSpline:
        """The spline through the knots."""
        return CornerSpline(np.array(self.nodes), self.corners)

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Path parameters of the grid points, (n,); each corner is there twice, from the left and from the right."""
        even = super().parameters_u
        at = [corner * self.steps for corner in self.corners]
        return np.insert(even, at, np.nextafter(even[at], 0.0))

    @cached_property
    def double_steps(self) -> FloatArray:
        """Twice the distances of the grid points, (n - 1,); zero from one side of a corner to the other."""
        return np.insert(super().double_steps, [corner * self.steps for corner in self.corners], 0.0)

    @property
    def stops(self) -> tuple[int, ...]:
        """The first grid point at each corner."""
        return tuple(corner * self.steps + before for before, corner in enumerate(self.corners))

    @cached_property
    def intervals(self) -> NDArray[np.intp]:
        """The node interval to which each grid point belongs, (n,); the last one's to the interval before it."""
        starts = np.searchsorted(np.array(self.nodes), self.parameters_u, side="right") - 1
        return np.clip(starts, 0, len(self.nodes) - 2)
