"""Joint rotation, (9), (20)."""

from __future__ import annotations

from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, total
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import MotionBounds, Objective
from problems.robots.robot import Robot


class JointRotation(Objective):
    """(9), (20): sum over joints and time steps of the absolute angular displacement; rad.

    In a search over its samples; of a finished motion over the times at which any joint turns back, which is exact.
    """

    name: ClassVar[str] = "rotation"
    symbol: ClassVar[str] = "F_q"
    equation: ClassVar[str] = "(9)"
    unit: ClassVar[str] = "rad"
    timed: ClassVar[bool] = False
    sooner_is_better: ClassVar[bool] = True
    norm: ClassVar[float] = 1.0
    program_steps: ClassVar[int | None] = 12  # the sum of increments is exact up to a turn between two samples

    def between(self, before: Samples, after: Samples) -> Matrix:
        """The displacement of each joint."""
        return ca.fabs(after.theta - before.theta)

    def of_motion(self, trajectory: Trajectory, robot: Robot, times: FloatArray) -> float:
        """Exactly: the displacements from one turning point to the next."""
        return float(self.value(trajectory.samples(trajectory.extreme_times(0))))

    def upper_bound(self, bounds: MotionBounds) -> float:
        """How far all joints together can turn."""
        return bounds.rotation

    def slack_count(self, robot: Robot, steps: int) -> int:
        """One for each joint and step."""
        return robot.dof * steps

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The sum of the slacks, each no smaller than its displacement in either direction."""
        return total(slack)

    def slack_values(self, theta: FloatArray) -> FloatArray:
        """Absolute displacements, joint after joint."""
        return np.abs(np.diff(theta, axis=0)).ravel(order="F")

    def slack_rows(self, samples: Samples, slack: Matrix) -> list[tuple[str, str, Matrix]]:
        """Both signs of each displacement."""
        before, after = samples.steps
        increments = after.theta - before.theta
        return [
            (f"rotation {name}", f"slack_ij >= {sign}(theta_i(t_j+1) - theta_i(t_j))", slack - step)
            for name, sign, step in (("forward", "+", increments), ("backward", "-", -increments))
        ]
