"""The objectives that are built in: time (8), rotation (9), travel length of the tip (10); ours: energy and work."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array, total
from problems.motions import Samples, Trajectory
from problems.objectives.integrals import Integrand, integral
from problems.objectives.objective import DirectMoves, MotionBounds, Objective, usual_state
from problems.robots import Robot


class ExecutionTime(Objective):
    """The duration (8) T = t_1 + t_2, (19) T = t_T; s."""

    name: ClassVar[str] = "time"
    symbol: ClassVar[str] = "T"
    equation: ClassVar[str] = "(8)"
    unit: ClassVar[str] = "s"
    sooner_is_better: ClassVar[bool] = True
    is_duration: ClassVar[bool] = True
    direct_is_least: ClassVar[bool] = True

    def terminal(self, duration: Matrix) -> Matrix:
        return duration

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        return trajectory.duration

    def upper_bound(self, bounds: MotionBounds) -> float:
        return bounds.duration

    def lower_bound(self, moves: DirectMoves) -> FloatArray:
        return moves.durations

    def integrand(self, samples: Samples) -> Integrand:
        return Integrand()


class JointRotation(Objective):
    """The rotation (9), (20): sum over joints and time steps of the absolute angular displacement; rad.

    In a search over its samples; of a finished motion over the times at which any joint turns back, which is exact.
    """

    name: ClassVar[str] = "rotation"
    direct_is_least: ClassVar[bool] = True
    symbol: ClassVar[str] = "F_q"
    equation: ClassVar[str] = "(9)"
    unit: ClassVar[str] = "rad"
    is_time_dependent: ClassVar[bool] = False
    sooner_is_better: ClassVar[bool] = True
    norm: ClassVar[float] = 1.0
    program_steps: ClassVar[int | None] = 12  # the sum of increments is exact up to a turn between two samples

    def between(self, before: Samples, after: Samples) -> Matrix:
        return ca.fabs(after.theta - before.theta)

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The exact value: the displacements from one turning point to the next."""
        return float(self.value(trajectory.samples(trajectory.extreme_times(0))))

    def upper_bound(self, bounds: MotionBounds) -> float:
        return bounds.rotation

    def lower_bound(self, moves: DirectMoves) -> FloatArray:
        return moves.rotations

    def integrand(self, samples: Samples) -> Integrand:
        return Integrand(lengths=tuple(ca.horzsplit(samples.speed)))

    def slack_count(self, robot: Robot, steps: int) -> int:
        return robot.dof * steps

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        return total(slack)

    def slack_values(self, theta: FloatArray) -> FloatArray:
        return np.abs(np.diff(theta, axis=0)).ravel(order="F")

    def slack_rows(self, samples: Samples, slack: Matrix) -> list[tuple[str, str, Matrix]]:
        before, after = samples.steps
        increments = after.theta - before.theta
        return [
            (f"rotation {name}", f"slack_ij >= {sign}(theta_i(t_j+1) - theta_i(t_j))", slack - step)
            for name, sign, step in (("forward", "+", increments), ("backward", "-", -increments))
        ]


SMOOTHING_LENGTH = (
    1e-3  # of the robot's unit of length: rounds the corner of a tip that stands still; costs 1e-4 of a length
)
LENGTH_FLOOR = 1e-14  # of the reach: what rounding makes of a tip that stands still


class TipTravel(Objective):
    """The distance (10) that the tip travels; m.

    A search adds up the straight lines between the tip's positions at its samples, as the paper does. That is too
    little, by the curvature between two samples; a finished motion has the length of the curve itself.
    """

    name: ClassVar[str] = "length"
    symbol: ClassVar[str] = "F_d"
    equation: ClassVar[str] = "(10)"
    unit: ClassVar[str] = "m"
    is_time_dependent: ClassVar[bool] = False
    sooner_is_better: ClassVar[bool] = True
    norm: ClassVar[float] = 1.0
    program_steps: ClassVar[int | None] = 12

    def between(self, before: Samples, after: Samples) -> Matrix:
        step = after.tool - before.tool
        return ca.sqrt(ca.sum2(step * step))

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The length of the curve, to 1e-9: the integral of the tip's speed."""
        theta, rates = ca.SX.sym("theta", robot.dof), ca.SX.sym("rates", robot.dof)
        velocity = ca.jtimes(robot.tool.position(theta.T).T, theta, rates)
        speed = ca.Function("speed", [theta, rates], [ca.norm_2(velocity)])

        def at(moments: FloatArray) -> FloatArray:
            return as_array(speed(trajectory.at(moments).T, trajectory.at(moments, 1).T)).ravel()

        return integral(at, trajectory.breakpoints, LENGTH_FLOOR * robot.reach()[1])

    def size(self, robot: Robot) -> float:
        return robot.length_unit

    def upper_bound(self, bounds: MotionBounds) -> float:
        """A bound by the farthest that the tip can be from the base times what the joints turn."""
        return bounds.radius * bounds.rotation

    def lower_bound(self, moves: DirectMoves) -> FloatArray:
        return moves.distances

    def integrand(self, samples: Samples) -> Integrand:
        robot = samples.moving
        theta, rates = ca.SX.sym("theta", robot.dof), ca.SX.sym("rates", robot.dof)
        velocity = ca.Function("velocity", [theta, rates], [ca.jtimes(robot.tool.position(theta.T).T, theta, rates)])
        return Integrand(lengths=(velocity(samples.theta.T, samples.speed.T).T,))

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The length with corners rounded off by ``SMOOTHING_LENGTH``."""
        before, after = samples.steps
        step, corner = after.tool - before.tool, SMOOTHING_LENGTH * samples.moving.length_unit
        return ca.sum1(ca.sqrt(ca.sum2(step * step) + corner**2) - corner)


FLOOR = 1e-15  # in the unit of the integral: no motor notices less


class TorqueIntegral(Objective):
    """The integral of a function of each joint's torque and speed, summed over the joints; masses have to be known."""

    is_time_dependent: ClassVar[bool] = True
    sooner_is_better: ClassVar[bool] = False
    needs_masses: ClassVar[bool] = True
    is_integral: ClassVar[bool] = True

    @abstractmethod
    def of_joints(self, torque: Matrix, speed: Matrix) -> Integrand:
        """The integrand, a column for each joint; not negative.

        Args:
            torque: (n, dof), N m or N.
            speed: (n, dof), rad/s or m/s.
        """

    def integrand(self, samples: Samples) -> Integrand:
        return self.of_joints(samples.torque, samples.derivative_or_zero(1))

    def lower_bound(self, moves: DirectMoves) -> FloatArray:
        return np.zeros_like(moves.durations)

    def at(self, samples: Samples) -> Matrix:
        assert samples.weights is not None
        return samples.weights * ca.sum2(self.integrand(samples).values)

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        points = samples.for_integrals
        assert points.weights is not None
        return total(points.weights * ca.sum2(self.smooth_rate(points.torque, points.speed, points.moving)))

    def smooth_rate(self, torque: Matrix, speed: Matrix, robot: Robot) -> Matrix:
        """The integrand without kinks, (n, dof)."""
        return self.of_joints(torque, speed).values

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """The integral, to 1e-9 of it, with kinks, and jumps of Coulomb friction where joints turn back."""
        joints = robot.dof
        theta, speed, acceleration = (ca.SX.sym(name, joints) for name in ("theta", "speed", "acceleration"))
        torque = robot.dynamics.torques(theta.T, speed.T, acceleration.T)
        rate = ca.Function("rate", [theta, speed, acceleration], [ca.sum2(self.of_joints(torque, speed.T).values)])

        def at(moments: FloatArray) -> FloatArray:
            return as_array(rate(*(trajectory.at(moments, order).T for order in range(3)))).ravel()

        return integral(at, trajectory.extreme_times(0), FLOOR)

    def size(self, robot: Robot) -> float:
        """The integral over a second at a tenth of speed and acceleration limits, amid the joint ranges."""
        theta, speed, acceleration = (ca.DM(values).T for values in usual_state(robot))
        torque = robot.dynamics.torques(theta, ca.DM.zeros(1, robot.dof), acceleration)
        return float(ca.sum2(self.of_joints(torque, speed).values))


class Energy(TorqueIntegral):
    """The energy E = integral of sum over joints of tau_i^2 dt; N^2 m^2 s. Ours: the paper has no dynamics.

    Proportional to the heat in the windings of motors of the same make, whose current goes with the torque.
    """

    name: ClassVar[str] = "energy"
    symbol: ClassVar[str] = "E"
    unit: ClassVar[str] = "N^2 m^2 s"

    def of_joints(self, torque: Matrix, speed: Matrix) -> Integrand:
        """The squares tau_i^2 of torques."""
        return Integrand(squares=torque)


SMOOTHING = 1e-2  # of the usual power of a joint: rounds the corner where it changes its sign


class Work(TorqueIntegral):
    """The work W = integral of sum over joints of |tau_i dq_i/dt| dt; J. Ours: the paper has no dynamics.

    Braking counts like driving: nothing is fed back.
    """

    name: ClassVar[str] = "work"
    symbol: ClassVar[str] = "W"
    unit: ClassVar[str] = "J"
    polish_suffices: ClassVar[bool] = False  # slow motions are best, of many kinds: 20.0 J where a search found 11.8 J

    def of_joints(self, torque: Matrix, speed: Matrix) -> Integrand:
        """The absolute powers |tau_i dq_i/dt|."""
        return Integrand(lengths=tuple(ca.horzsplit(torque * speed)))

    def smooth_rate(self, torque: Matrix, speed: Matrix, robot: Robot) -> Matrix:
        power, corner = torque * speed, SMOOTHING * self.size(robot) / robot.dof
        return ca.sqrt(power * power + corner**2) - corner
