"""Starts along a path: the angles at its knots.

By turns: the cheapest way over a grid of the redundancy, ways with the same normalised redundancy at every knot, and
ways with few random values of it in between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import count, islice

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from problems.base.matrix import FloatArray
from problems.encodings import KnotsEncoding
from problems.nlp.starts.displacement import Displacement, displacement_of
from problems.nlp.starts.postures import Postures
from problems.nlp.starts.redundancy_grid import RedundancyGrid
from problems.objectives import Objective
from problems.robots.robot import Robot

CONSTANT_STARTS = 3  # starts of constant redundancy for each one from the grid
ELBOWS = {"up": (1.0,), "down": (-1.0,), "free": (1.0, -1.0)}


@dataclass(frozen=True)
class PathStarts:
    """Sequences of postures through the knots of a path.

    Args:
        encoding: whose path, knots and values of redundancy.
        objective: what is minimised.
    """

    encoding: KnotsEncoding
    objective: Objective

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.encoding.task.robot

    @property
    def displacement(self) -> Displacement:
        """How the joints' steps count."""
        return displacement_of(self.objective)

    @cached_property
    def postures(self) -> Postures:
        """The postures at the knots."""
        return Postures(self.robot, [tuple(point) for point in self.encoding.knot_points.tolist()])

    @cached_property
    def grid(self) -> RedundancyGrid:
        """The steps between the knots; where the longest counts, measured by what each joint can accelerate."""
        task, weights = self.encoding.task, np.ones(self.robot.dof)
        if self.displacement.longest:
            weights = min(self.robot.limits.acceleration) / np.array(self.robot.limits.acceleration)
        return RedundancyGrid(self.postures, ELBOWS[task.elbow], task.obstacles, weights, self.displacement.exponent)

    def sequence(self, rng: np.random.Generator) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Endless angles at the knots (M, k) in rad, and the x_phi behind them; the best over the grid comes first.

        The x_phi are (redundancy_values, k - 2), in the middle where none are behind them.
        """
        shape = self.encoding.redundancy_values, self.robot.redundancy
        first, constants = None, evenly_spread(rng.random(self.robot.redundancy))
        while True:
            cheapest = self.grid.cheapest(rng.random(self.robot.redundancy), first)
            first = float(rng.random())  # other ways begin at other postures
            if cheapest is not None:
                yield cheapest, np.full(shape, 0.5)
            for values in (*islice(constants, CONSTANT_STARTS), rng.random(shape)):
                x_phi = np.broadcast_to(values, shape)
                yield self.interpolated(x_phi, float(rng.choice(self.grid.elbows))), x_phi

    def interpolated(self, x_phi: FloatArray, elbow: float) -> FloatArray:
        """The way of values of x_phi (n, k - 2) at equal distances along the path, with one elbow; (M, k), rad."""
        knots = self.encoding.motion.spline.knots
        between = CubicSpline(np.linspace(0.0, 1.0, len(x_phi)), x_phi)(knots)
        return self.grid.unwrapped(self.postures.at_shares(np.clip(between, 0.0, 1.0), np.full(len(knots), elbow)))


def evenly_spread(first: FloatArray) -> Iterator[FloatArray]:
    """Endless points (d,) of the unit cube that leave no gap: Kronecker's sequence.

    Its step is Roberts' generalised golden ratio, x^(d + 1) = x + 1.

    Args:
        first: where it begins, (d,).
    """
    ratio = float(brentq(lambda x: x ** (first.size + 1) - x - 1.0, 1.0, 2.0))
    step = ratio ** -np.arange(1.0, first.size + 1.0)
    return ((first + n * step) % 1.0 for n in count())
