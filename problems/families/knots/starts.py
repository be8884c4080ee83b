"""Structured starts of the program: grids of redundancy angles.

At every knot the links 3..k stand at one of the angles of a grid, which with the elbow makes a posture; a step from
one knot to the next costs sum_i |w_i dtheta_i|^p. The cheapest sequence of postures is exact on the grid, and in the
basin of a good motion: p = 1.5 for little rotation, p = 3, which evens steps out, for little time.

By turns: the cheapest way over a grid of the redundancy, ways with the same normalised redundancy at every knot, and
ways with few random values of it in between.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import count, islice

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray, as_array
from problems.families.knots.encoding import KnotsEncoding
from problems.limits import proximity_limits
from problems.motions import Samples
from problems.objectives import Objective
from problems.programs import Displacement, PointPostures, displacement_of
from problems.robots import Robot
from problems.scene import Obstacle, standing

MAX_POSTURES_PER_KNOT = 100  # for each elbow
TURN = 2.0 * np.pi


@dataclass(frozen=True)
class RedundancyGrid:
    """Postures at M knots and the costs of the steps between them.

    Args:
        postures: of the arm at the knots.
        elbows: +1 up, -1 down, or both.
        obstacles: postures that come too near to one are left out.
        weights: w of the joints, (k,).
        exponent: p.
    """

    postures: PointPostures
    elbows: tuple[float, ...]
    obstacles: tuple[Obstacle, ...]
    weights: FloatArray
    exponent: float

    @cached_property
    def angles(self) -> FloatArray:
        """The grid of phi of links 3..k, (states, k - 2), rad, before it is shifted."""
        links = self.postures.robot.closed_form.redundancy
        steps = int(MAX_POSTURES_PER_KNOT ** (1.0 / links) + 1e-9)
        axis = TURN * np.arange(steps) / steps
        return np.stack(np.meshgrid(*[axis] * links, indexing="ij"), axis=-1).reshape(-1, links)

    def table(self, shift: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """All postures, (M, S, k) in rad, of the grid shifted by (k - 2,) rad; and which are possible, (M, S)."""
        phi = np.tile(self.angles + shift, (len(self.elbows), 1))
        elbow = np.repeat(np.array(self.elbows), len(self.angles))
        knots = range(self.postures.points.shape[0])
        reached_postures = [self.postures.at_angles(i, phi, elbow) for i in knots]
        theta, reached = (np.array(part) for part in zip(*reached_postures, strict=True))
        return theta, reached & self._allowed(theta)

    def _allowed(self, theta: FloatArray) -> NDArray[np.bool_]:
        """Flags of postures (M, S, k) that keep joint limits and clearances, (M, S)."""
        robot, allowed = self.postures.robot, np.ones(theta.shape[:2], dtype=bool)
        if robot.limits.position is not None:
            low, high = np.array(robot.limits.position).T
            allowed &= (self.endless | ((theta >= low) & (theta <= high))).all(axis=2)
        samples = Samples(robot=robot, derivatives=(ca.DM(theta.reshape(-1, robot.dof)),), duration=ca.DM(1.0))
        for limit in proximity_limits(robot, standing(self.obstacles)):
            clear = as_array(limit.clearances(samples)).min(axis=1) > robot.margin
            allowed &= clear.reshape(allowed.shape)
        return allowed

    def difference(self, theta: FloatArray, before: FloatArray) -> FloatArray:
        """Joint displacements from ``before`` to ``theta`` (..., k), rad: the short way round where they can turn."""
        step = theta - before
        return step - TURN * np.round(step / TURN) * self.endless

    @cached_property
    def endless(self) -> NDArray[np.bool_]:
        """Flags of the joints that can turn without end, (k,)."""
        ranges = self.postures.robot.limits.position
        if ranges is None:
            return np.ones(self.postures.robot.dof, dtype=bool)
        return np.asarray(np.diff(np.array(ranges), axis=1).ravel() >= TURN)

    def cheapest(self, shift: FloatArray, first: float | None = None) -> FloatArray | None:
        """The cheapest sequence of postures, unwrapped: (M, k), rad; None when there is none.

        Args:
            shift: of the grid, (k - 2,), rad.
            first: a share in [0, 1) that picks the posture at the first knot; any if None.
        """
        theta, possible = self.table(shift)
        begin, origins = np.flatnonzero(possible[0]), []
        if first is not None and begin.size:
            begin = begin[[int(first * begin.size)]]
        cost = np.full(possible.shape[1], np.inf)
        cost[begin] = 0.0
        for before, after, allowed in zip(theta[:-1], theta[1:], possible[1:], strict=True):
            sums = cost[:, None] + self.step_costs(before, after)
            origins.append(sums.argmin(axis=0))
            cost = np.where(allowed, sums.min(axis=0), np.inf)
        if not np.isfinite(cost.min()):
            return None
        chosen = [int(cost.argmin())]
        for origin in reversed(origins):
            chosen.append(int(origin[chosen[-1]]))
        return self.unwrapped(theta[np.arange(len(theta)), chosen[::-1]])

    def step_costs(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """The cost of the step from each posture (S, k) to each of the next knot (S, k): (S, S)."""
        steps = self.difference(after[None, :, :], before[:, None, :])
        return np.asarray((np.abs(self.weights * steps) ** self.exponent).sum(axis=2))

    def unwrapped(self, theta: FloatArray) -> FloatArray:
        """Postures (M, k) unwrapped, with the steps whose cost was counted; limited joints near their middle."""
        steps = self.difference(theta[1:], theta[:-1])
        joined = np.vstack([theta[:1], theta[0] + np.cumsum(steps, axis=0)])
        ranges = self.postures.robot.limits.position
        if ranges is None:
            return joined
        middle = np.mean(ranges, axis=1)
        return np.asarray(joined + TURN * np.round((middle - joined.mean(axis=0)) / TURN) * self.endless)


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
    def postures(self) -> PointPostures:
        """The postures at the knots."""
        return PointPostures(self.robot, [tuple(point) for point in self.encoding.knot_points.tolist()])

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
        shape = self.encoding.redundancy_values, self.robot.closed_form.redundancy
        first, constants = None, evenly_spread(rng.random(self.robot.closed_form.redundancy))
        while True:
            cheapest = self.grid.cheapest(rng.random(self.robot.closed_form.redundancy), first)
            first = float(rng.random())  # other ways begin at other postures
            if cheapest is not None:
                yield cheapest, np.full(shape, 0.5)
            for values in (*islice(constants, CONSTANT_STARTS), rng.random(shape)):
                x_phi = np.broadcast_to(values, shape)
                yield self.interpolated(x_phi, float(rng.choice(self.grid.elbows))), x_phi

    def interpolated(self, x_phi: FloatArray, elbow: float) -> FloatArray:
        """The way of values of x_phi (n, k - 2) at equal distances along the path, with one elbow; (M, k), rad."""
        knots = self.encoding.motion.spline.knots
        between = scipy.interpolate.CubicSpline(np.linspace(0.0, 1.0, len(x_phi)), x_phi)(knots)
        return self.grid.unwrapped(self.postures.at_shares(np.clip(between, 0.0, 1.0), np.full(len(knots), elbow)))


def evenly_spread(first: FloatArray) -> Iterator[FloatArray]:
    """Endless points (d,) of the unit cube that leave no gap: Kronecker's sequence.

    Its step is Roberts' generalised golden ratio, x^(d + 1) = x + 1.

    Args:
        first: where it begins, (d,).
    """
    ratio = float(scipy.optimize.brentq(lambda x: x ** (first.size + 1) - x - 1.0, 1.0, 2.0))
    step = ratio ** -np.arange(1.0, first.size + 1.0)
    return ((first + n * step) % 1.0 for n in count())
