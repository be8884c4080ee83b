"""How far the bodies of a robot can move within cells of time: the bound behind every proof in the workspace.

Around the middle m of a cell of length h, within one piece of the motion, no point of body b moves farther than

    sum over j of levers[b, j] (|u_j(m)| h / 2 + max |du_j/dt| h^2 / 8),

with the angular rates u = turns @ dq/dt. The maximum over the piece comes from Bernstein coefficients, so that it is a
bound and no root has to be found.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.bernstein import bernstein
from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot


@dataclass(frozen=True)
class Travel:
    """A trajectory seen by the bodies that it moves.

    Args:
        robot: whose bodies.
        trajectory: of its joints.
    """

    robot: Robot
    trajectory: Trajectory

    @cached_property
    def turning(self) -> Trajectory:
        """The angles over time whose rates bound how bodies move: for a planar arm the orientations of its links."""
        coefficients = np.einsum("mj,ipj->ipm", self.robot.turns, self.trajectory.coefficients)
        return Trajectory(self.trajectory.breakpoints, coefficients)

    @cached_property
    def sharpest(self) -> FloatArray:
        """Bounds of its second derivatives in each piece, (pieces, m), rad/s^2."""
        curves = bernstein(np.asarray(self.turning.derivative(2).c), np.diff(self.trajectory.breakpoints))
        return np.asarray(np.abs(curves).max(axis=0))

    def of_bodies(self, cells: FloatArray) -> FloatArray:
        """How far any point of each body can move from where it is in the middle of cells, (n, bodies), m.

        Args:
            cells: start and end of each, within one piece, (n, 2), s.
        """
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        last = self.trajectory.breakpoints.size - 2
        pieces = np.clip(np.searchsorted(self.trajectory.breakpoints, middles, side="right") - 1, 0, last)
        speeds = np.abs(self.turning.at(middles, 1))
        return np.asarray((speeds * h / 2.0 + self.sharpest[pieces] * h**2 / 8.0) @ self.robot.levers.T)


def halves(cells: FloatArray) -> FloatArray:
    """Every cell cut in two, (2 n, 2), s."""
    middles = cells.mean(axis=1)
    return np.concatenate([np.column_stack([cells[:, 0], middles]), np.column_stack([middles, cells[:, 1]])])
