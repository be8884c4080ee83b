"""Which control points of a path may move, and how: not those at a given posture, along a place's freedom elsewhere."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.robots.robot import Robot
from problems.sequential.path_speed import RESTING
from problems.tasks.place import Place

RANK = 1e-7  # of the largest singular value: smaller ones are zero


@dataclass(frozen=True)
class Freedom:
    """The ends of a motion.

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
        """Of what is missed at each end."""
        theta = ca.SX.sym("theta", 1, self.robot.dof)
        misses = {place: place.miss(self.robot, theta) for place in (self.start, self.goal)}
        return {place: ca.Function("jacobian", [theta], [ca.jacobian(miss, theta)]) for place, miss in misses.items()}

    def _free_at(self, place: Place, theta: FloatArray) -> FloatArray:
        """Directions (k, m) in which a posture stays at its place."""
        _, sizes, directions = np.linalg.svd(as_array(self._jacobians[place](theta)))
        return np.asarray(directions[int((sizes > RANK * sizes.max()).sum()) :].T)

    def placed(self, controls: FloatArray) -> FloatArray:
        """The control points with the ends exactly where they have to be."""
        placed = controls.copy()
        placed[:RESTING] = self.start.projected(self.robot, controls[0])
        placed[-RESTING:] = self.goal.projected(self.robot, controls[-1])
        return placed
