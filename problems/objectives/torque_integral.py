"""Integrals over time of what the motors give: the common part of energy and work."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import casadi as ca

from problems.base.matrix import FloatArray, Matrix, as_array, total
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import Objective
from problems.objectives.quadrature import integral
from problems.robots.robot import Robot

FLOOR = 1e-15  # in the unit of the integral: no motor notices less
USUAL_SHARE = 0.1  # of the acceleration limits, in a motion of the usual size


class TorqueIntegral(Objective):
    """The integral of a function of each joint's torque and speed, summed over the joints; masses have to be known."""

    timed: ClassVar[bool] = True
    sooner_is_better: ClassVar[bool] = False
    needs_masses: ClassVar[bool] = True
    is_integral: ClassVar[bool] = True

    @abstractmethod
    def rate(self, torque: Matrix, speed: Matrix) -> Matrix:
        """What is integrated, of each joint, (n, dof); not negative.

        Args:
            torque: (n, dof), N m or N.
            speed: (n, dof), rad/s or m/s.
        """

    def at(self, samples: Samples) -> Matrix:
        """Each sample's weight times what is integrated."""
        assert samples.weights is not None
        return samples.weights * ca.sum2(self.rate(samples.torque, samples.derivative_or_zero(1)))

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The integral without kinks."""
        points = samples if samples.quadrature is None else samples.quadrature
        assert points.weights is not None
        return total(points.weights * ca.sum2(self.smooth_rate(points.torque, points.speed, points.moving)))

    def smooth_rate(self, torque: Matrix, speed: Matrix, robot: Robot) -> Matrix:
        """What is integrated, without kinks, (n, dof)."""
        return self.rate(torque, speed)

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """To 1e-9 of it: kinks, and jumps of Coulomb friction where joints turn back, included."""
        joints = robot.dof
        theta, speed, acceleration = (ca.SX.sym(name, joints) for name in ("theta", "speed", "acceleration"))
        torque = robot.inverse_dynamics(theta.T, speed.T, acceleration.T)
        rate = ca.Function("rate", [theta, speed, acceleration], [ca.sum2(self.rate(torque, speed.T))])

        def at(moments: FloatArray) -> FloatArray:
            return as_array(rate(*(trajectory.at(moments, order).T for order in range(3)))).ravel()

        return integral(at, trajectory.extreme_times(0), FLOOR)

    def size(self, robot: Robot) -> float:
        """That of a second at a tenth of speed and acceleration limits, in the middle of the joint ranges."""
        limits, ranges = robot.limits, robot.limits.position or ((0.0, 0.0),) * robot.dof
        theta = ca.DM([sum(bounds) / 2.0 for bounds in ranges]).T
        speed, acceleration = (USUAL_SHARE * ca.horzcat(*values) for values in (limits.speed, limits.acceleration))
        torque = robot.inverse_dynamics(theta, ca.DM.zeros(1, robot.dof), acceleration)
        return float(ca.sum2(self.rate(torque, speed)))
