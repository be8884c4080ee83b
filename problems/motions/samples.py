"""A motion at samples: times, derivatives of every joint, positions; a limit and an objective read these."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix
from problems.robots import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class Samples:
    """The motion of a robot at n times; symbolic in a model, numeric when a trajectory is verified.

    One row or many: an evaluated candidate is written with one row at a time, a nonlinear program with all of them.

    Attributes:
        robot: that moves; None where only joint angles are needed.
        derivatives: joint angles and their derivatives with respect to time, each (n, dof); rad, rad/s, rad/s^2, ...;
            None for those that are not needed.
        duration: of the whole motion, scalar, s.
        times: of the rows, (n, 1), s.
        weights: of a quadrature rule over time, (n, 1), s: an integral is the sum of weights times values.
        known_positions: those of the robot's frames where they are known already; computed where None.
        quadrature: the same motion at the points of a better rule for integrals, where there is one.
        before_jumps: the same motion just before accelerations jump, where they may.
    """

    robot: Robot | None
    derivatives: tuple[Matrix | None, ...]
    duration: Matrix
    times: Matrix | None = None
    weights: Matrix | None = None
    known_positions: tuple[Matrix, ...] | None = None
    quadrature: Samples | None = None
    before_jumps: Samples | None = None

    @classmethod
    def symbolic(cls, robot: Robot, orders: int) -> Samples:
        """One sample in which angles, so many orders of derivatives, duration, time and weight are symbols."""
        return cls(
            robot=robot,
            derivatives=tuple(ca.SX.sym(f"derivative_{n}", 1, robot.dof) for n in range(orders)),
            duration=ca.SX.sym("duration"),
            times=ca.SX.sym("time"),
            weights=ca.SX.sym("weight"),
        )

    def derivative(self, order: int) -> Matrix:
        """The joint angles (order 0) or one of their derivatives, (n, dof).

        Raises:
            ValueError: these samples were made without it.
        """
        found = self.derivatives[order]
        if found is None:
            raise ValueError(f"these samples were made without derivative {order} of the joint angles")
        return found

    def derivative_or_zero(self, order: int) -> Matrix:
        """The same, or zeros where these samples were made without it: for torques, which need not depend on angles.

        They do not where there is no gravity, nor those of an arm whose joints only slide.
        """
        found = self.derivatives[order]
        return ca.DM.zeros(self.count, self.moving.dof) if found is None else found

    @property
    def theta(self) -> Matrix:
        """Joint angles, (n, dof), rad."""
        return self.derivative(0)

    @property
    def speed(self) -> Matrix:
        """Joint speeds, (n, dof), rad/s."""
        return self.derivative(1)

    @property
    def acceleration(self) -> Matrix:
        """Joint accelerations, (n, dof), rad/s^2."""
        return self.derivative(2)

    @property
    def moving(self) -> Robot:
        """The robot.

        Raises:
            ValueError: these samples have none.
        """
        if self.robot is None:
            raise ValueError("these samples are of joints alone, without a robot")
        return self.robot

    @cached_property
    def positions(self) -> tuple[Matrix, ...]:
        """Where the robot's frames are, base first and tool last, each (n, dim), m."""
        if self.known_positions is not None:
            return self.known_positions
        return self.moving.positions(self.theta)

    @cached_property
    def torque(self) -> Matrix:
        """What the joints' motors give, (n, dof), N m; only of a robot whose masses are known."""
        return self.moving.inverse_dynamics(*(self.derivative_or_zero(order) for order in range(3)))

    @property
    def tool(self) -> Matrix:
        """Where the tool is, (n, dim), m."""
        return self.positions[-1]

    @property
    def count(self) -> int:
        """The number n of samples."""
        return next((int(matrix.shape[0]) for matrix in self.derivatives if matrix is not None), 1)

    def rows(self, chosen: slice) -> Samples:
        """Some of the samples."""
        return Samples(
            robot=self.robot,
            derivatives=tuple(None if matrix is None else matrix[chosen, :] for matrix in self.derivatives),
            duration=self.duration,
            times=None if self.times is None else self.times[chosen, :],
            weights=None if self.weights is None else self.weights[chosen, :],
            known_positions=None if self.robot is None else tuple(matrix[chosen, :] for matrix in self.positions),
        )

    @property
    def both_sides(self) -> Samples:
        """With the rows before jumps behind the others: for what depends on accelerations; (n + m, dof)."""
        jumps = self.before_jumps
        if jumps is None:
            return self
        rows = (ca.vertcat(self.derivative(n), jumps.derivative(n)) for n in range(len(self.derivatives)))
        return Samples(robot=self.robot, derivatives=tuple(rows), duration=self.duration)

    @cached_property
    def steps(self) -> tuple[Samples, Samples]:
        """The samples before and after each step: all but the last, all but the first."""
        return self.rows(slice(None, -1)), self.rows(slice(1, None))


def increasing_choice(costs: FloatArray) -> list[int]:
    """Indices i_1 <= i_2 <= ... with the smallest sum of ``costs[n, i_n]``, by dynamic programming.

    Args:
        costs: of each thing at each time, (things, times).
    """
    index = np.arange(costs.shape[1])
    best, origins = costs[0], []
    for cost in costs[1:]:
        least = np.minimum.accumulate(best)
        origins.append(np.maximum.accumulate(np.where(best == least, index, 0)))
        best = least + cost
    chosen = [int(np.argmin(best))]
    for origin in reversed(origins):
        chosen.append(int(origin[chosen[-1]]))
    return chosen[::-1]
