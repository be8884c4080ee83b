"""A motion along a spline through knots, with stops at corners, run as fast as speed and acceleration limits allow."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.motions.path_spline import PathSpline
from problems.motions.splines.corner import CornerSpline


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
