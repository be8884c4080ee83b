"""What motors have to give along a path: linear in b = (du/dt)^2 and c = d2u/dt2, but for viscous friction."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from problems.base.matrix import Matrix
from problems.robots.robot import Robot

LEAST_ROOM = 1e-3  # of a limit: as much of it has to be left by gravity for a motion, and counts as left


@dataclass(frozen=True)
class TorqueSlopes:
    """tau = rate c + bend b + held at grid points of a path q(u); each (n, k), N m or N.

    Attributes:
        rate: M(q) q'.
        bend: M(q) q'' + C(q, q') q'.
        held: what gravity and Coulomb friction take.
    """

    rate: Matrix
    bend: Matrix
    held: Matrix

    @classmethod
    def along(cls, robot: Robot, theta: Matrix, first: Matrix, second: Matrix) -> TorqueSlopes:
        """Those at q, q' and q'', each (n, k), of a robot whose masses are known."""
        chain = robot.massive
        held = chain.gravitational(theta)
        if chain.has_friction:
            held = held + chain.coulomb(first)
        return cls(chain.inertial(theta, 0.0 * first, first), chain.inertial(theta, first, second), held)

    def row(self, i: int) -> TorqueSlopes:
        """Those at one grid point."""
        return TorqueSlopes(self.rate[i, :], self.bend[i, :], self.held[i, :])

    def seen_before(self, step: Matrix) -> TorqueSlopes:
        """In terms of b at the grid point before, from which it follows as b + step c."""
        return TorqueSlopes(self.rate + step * self.bend, self.bend, self.held)

    @property
    def stacked(self) -> Matrix:
        """All in one column, (3 k, 1), of one grid point."""
        return ca.horzcat(self.rate, self.bend, self.held).T

    @classmethod
    def unstacked(cls, column: Matrix) -> TorqueSlopes:
        """Those of :attr:`stacked`."""
        return cls(*(part.T for part in ca.vertsplit(column, int(column.shape[0]) // 3)))


def limited(robot: Robot) -> bool:
    """Whether the torques of a robot are limited and known."""
    return robot.limits.torque is not None and robot.rigid_chain is not None
