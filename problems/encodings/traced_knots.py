"""The common part of tracing in the plane and in space: a spline through postures at knots, timed."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix
from problems.encodings.encoding import Decoded
from problems.encodings.knot_postures import KnotPostures, largest_values
from problems.encodings.timing.path_timing import GRID_ALLOWANCE, PathTiming
from problems.motions.path_spline import Rates, TimedPath
from problems.motions.traced_spline import TracedSpline

AT_REST: Rates = ca.DM(0.0), None


class TracedKnots(PathTiming, KnotPostures[TimedPath]):
    """A path through knots, from rest to rest; the motion's nodes are the knots. A subclass is a frozen dataclass."""

    motion: TracedSpline

    def decode(self, x: Matrix) -> Decoded[TimedPath]:
        """The least time along the spline through the knots."""
        return Decoded(parameters=self.motion.timed(*self.path(x), self.pace_at_samples(x)))

    def path(self, x: Matrix) -> tuple[Matrix, Rates]:
        """Control points (N, dof), rad; both ends at rest."""
        return self.motion.spline.coefficients(self.postures(x)), AT_REST


def longest_timing(motion: TracedSpline, most: float = np.pi) -> float:
    """No shorter than the least time along any path whose joints turn by at most ``most`` from knot to knot, s.

    That of accelerating in each stretch by a constant d2u/dt2 = c up to its middle and slowing down from there, with a
    c so small that du/dt <= sqrt(c) keeps every limit on any such path.
    """
    spline, joints, grid = motion.spline, motion.robot.limits, motion.parameters_u
    first, second = (largest_values(spline.operator(grid, order), most).max() for order in (1, 2))
    c = min(min(joints.acceleration) / (first + second), (min(joints.speed) / first) ** 2)
    return GRID_ALLOWANCE * 2.0 * float(np.sqrt((len(motion.corners) + 1) / c))
