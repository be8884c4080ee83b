"""Mechanical work: the integral of the power of all motors, whether they drive or brake."""

from __future__ import annotations

from typing import ClassVar

import casadi as ca

from problems.base.matrix import Matrix
from problems.objectives.torque_integral import TorqueIntegral
from problems.robots.robot import Robot

SMOOTHING = 1e-2  # of the usual power of a joint: rounds the corner where it changes its sign


class Work(TorqueIntegral):
    """W = integral of sum over joints of |tau_i dq_i/dt| dt; J. Ours: the paper has no dynamics.

    Braking counts like driving: nothing is fed back.
    """

    name: ClassVar[str] = "work"
    symbol: ClassVar[str] = "W"
    unit: ClassVar[str] = "J"

    def rate(self, torque: Matrix, speed: Matrix) -> Matrix:
        """|tau_i dq_i/dt|."""
        return ca.fabs(torque * speed)

    def smooth_rate(self, torque: Matrix, speed: Matrix, robot: Robot) -> Matrix:
        """The same with corners rounded off downwards."""
        power, corner = torque * speed, SMOOTHING * self.size(robot) / robot.dof
        return ca.sqrt(power * power + corner**2) - corner
