"""The motion: splines of time, for what depends on the time.

Its first three control points are position, velocity and acceleration at the start, its last three those at the goal.
Up to its fourth derivative it is continuous.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb, prod

import numpy as np

from problems.base import FloatArray, as_array
from problems.motions import ClampedSpline, SplineInTime, SplineShape, Trajectory
from problems.robots import Robot

DEGREE = 5
FIXED = 3  # control points at each end
QUINTICS = np.array(  # in powers of u, lowest first: with q, dq/du, d2q/du2 at u = 0, or q at u = 1, one, else zero
    [
        [1.0, 0.0, 0.0, -10.0, 15.0, -6.0],
        [0.0, 1.0, 0.0, -6.0, 8.0, -3.0],
        [0.0, 0.0, 0.5, -1.5, 1.5, -0.5],
        [0.0, 0.0, 0.0, 10.0, -15.0, 6.0],
    ]
)


@dataclass(frozen=True)
class TimeSpline(SplineInTime):
    """A spline over time with pieces of equal duration.

    Args:
        robot: that moves.
        pieces: of the spline.
        steps: of time from sample to sample.
    """

    robot: Robot
    pieces: int
    steps: int

    @cached_property
    def spline(self) -> ClampedSpline:
        """The basis."""
        return ClampedSpline(np.linspace(0.0, 1.0, self.pieces + 1), degree=DEGREE)

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Shares of the duration at the samples, (steps + 1,)."""
        return np.linspace(0.0, 1.0, self.steps + 1)

    @property
    def inner(self) -> int:
        """The number of control points that are not fixed by the ends."""
        return self.spline.size - 2 * FIXED

    @cached_property
    def quintic(self) -> FloatArray:
        """The matrix (N, 4) from q, dq/du, d2q/du2 at the start and q at the goal to the control points of one quintic.

        That is the polynomial which leaves from the one and comes to rest at the other. A control point is its polar
        form at the nodes around: of u^m the mean of all products of m out of five of them.
        """
        knots = self.spline.basis.t
        polar = [
            [
                sum(map(prod, combinations(knots[i + 1 : i + 1 + DEGREE], m))) / comb(DEGREE, m)
                for m in range(DEGREE + 1)
            ]
            for i in range(self.spline.size)
        ]
        return np.asarray(np.array(polar) @ QUINTICS.T)

    def trajectory(self, parameters: SplineShape) -> Trajectory:
        """The exact piecewise polynomial."""
        curve, time = self.spline.curve(as_array(parameters.coefficients)), float(parameters.time)
        powers = time ** np.arange(DEGREE, -1, -1)
        return Trajectory(curve.x * time, curve.c / powers[:, None, None])

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Equal steps, the samples among them."""
        steps = self.steps * int(np.ceil((at_least - 1) / self.steps))
        return np.linspace(0.0, trajectory.duration, steps + 1)
