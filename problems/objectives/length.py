"""Travel length of the tip, (10)."""

from __future__ import annotations

from typing import ClassVar

import casadi as ca

from problems.base.matrix import FloatArray, Matrix, as_array
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import MotionBounds, Objective
from problems.objectives.quadrature import integral
from problems.robots.robot import Robot

SMOOTHING_LENGTH = (
    1e-3  # of the robot's unit of length: rounds the corner of a tip that stands still; costs 1e-4 of a length
)
LENGTH_FLOOR = 1e-14  # of the reach: what rounding makes of a tip that stands still


class TipTravel(Objective):
    """(10): how far the tip travels; m.

    A search adds up the straight lines between the tip's positions at its samples, as the paper does. That is too
    little, by the curvature between two samples; a finished motion has the length of the curve itself.
    """

    name: ClassVar[str] = "length"
    symbol: ClassVar[str] = "F_d"
    equation: ClassVar[str] = "(10)"
    unit: ClassVar[str] = "m"
    timed: ClassVar[bool] = False
    sooner_is_better: ClassVar[bool] = True
    norm: ClassVar[float] = 1.0
    program_steps: ClassVar[int | None] = 12

    def between(self, before: Samples, after: Samples) -> Matrix:
        """The length of each step."""
        step = after.tool - before.tool
        return ca.sqrt(ca.sum2(step * step))

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The length of the curve, to 1e-9: the integral of the tip's speed."""
        theta, rates = ca.SX.sym("theta", robot.dof), ca.SX.sym("rates", robot.dof)
        velocity = ca.jtimes(robot.tool(theta.T).T, theta, rates)
        speed = ca.Function("speed", [theta, rates], [ca.norm_2(velocity)])

        def at(moments: FloatArray) -> FloatArray:
            return as_array(speed(trajectory.at(moments).T, trajectory.at(moments, 1).T)).ravel()

        return integral(at, trajectory.breakpoints, LENGTH_FLOOR * robot.reach()[1])

    def size(self, robot: Robot) -> float:
        """A length of the robot's, m."""
        return robot.length_unit

    def upper_bound(self, bounds: MotionBounds) -> float:
        """The tip moves no farther than the farthest it can be from the base times what the joints turn."""
        return bounds.radius * bounds.rotation

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The same with corners rounded off by ``SMOOTHING_LENGTH``."""
        before, after = samples.steps
        step, corner = after.tool - before.tool, SMOOTHING_LENGTH * samples.moving.length_unit
        return ca.sum1(ca.sqrt(ca.sum2(step * step) + corner**2) - corner)
