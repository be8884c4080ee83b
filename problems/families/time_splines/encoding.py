"""Duration and control points, searched together.

Without offsets a motion is the quintic from the state at the start to rest at the goal. Its control points at both ends
are fixed by what is given there, so that whatever is searched leaves and arrives as it has to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly import Decoded, Encoding, FeasibilityFirst, Variable
from problems.base import FloatArray, Matrix, as_array, constant, split
from problems.families.splines import selected
from problems.families.time_splines.motion import FIXED, TimeSpline
from problems.limits import Limit, StepLimit
from problems.motions import SplineShape
from problems.objectives import MotionBounds

OFFSET = 1.5  # rad, the largest; what is decided is its square root, so that small ones are found too


@dataclass(frozen=True)
class TimeControlPoints(FeasibilityFirst, Encoding[SplineShape]):
    """Nothing is restored by time, whose rates at the start are given: every limit is penalised.

    Args:
        motion: that is decoded.
        start: joint angles at t = 0, rad.
        velocity: rad/s.
        acceleration: rad/s^2.
        goals: joint angles, of which one is reached at rest, rad.
        durations: the shortest and the longest, s.
        step_limits: with obstacles, that none is jumped over from one sample to the next.
    """

    numbers: ClassVar[tuple[str, ...]] = ("start", "velocity", "acceleration", "goals", "durations")
    name: ClassVar[str] = "reduced"
    scales_time: ClassVar[bool] = False

    motion: TimeSpline
    start: tuple[float, ...]
    velocity: tuple[float, ...]
    acceleration: tuple[float, ...]
    goals: tuple[tuple[float, ...], ...]
    durations: tuple[float, float]
    step_limits: tuple[StepLimit, ...]

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Which of several goals, the duration, the offsets of each inner control point."""
        which = [Variable("which_goal", 0.0, float(len(self.goals)), "1")] if len(self.goals) > 1 else []
        points, joints = range(FIXED, FIXED + self.motion.inner), range(1, self.motion.robot.dof + 1)
        offsets = [Variable(f"offset_{point}[{joint}]", -1.0, 1.0, "1") for point in points for joint in joints]
        return (*which, Variable("duration", 0.0, 1.0, "1"), *offsets)

    def decode(self, x: Matrix) -> Decoded[SplineShape]:
        """The spline of a search vector."""
        k = self.motion.robot.dof
        which, slower, offsets = split(x, [len(self.variables) - 1 - k * self.motion.inner, 1, k * self.motion.inner])
        shortest, longest = self.durations
        duration = shortest + (longest - shortest) * slower**2
        goal = selected([ca.horzcat(*goal) for goal in self.goals], which)
        points = self.quintic(duration, goal)
        moved = ca.reshape(OFFSET * offsets * ca.fabs(offsets), k, self.motion.inner).T
        inner = points[FIXED:-FIXED, :] + moved
        return Decoded(parameters=SplineShape(ca.vertcat(points[:FIXED, :], inner, points[-FIXED:, :]), duration))

    def quintic(self, duration: Matrix, goal: Matrix) -> Matrix:
        """Control points (N, k), rad, of the quintic to a goal (1, k) in a time in s."""
        start, velocity, acceleration = (ca.horzcat(*v) for v in (self.start, self.velocity, self.acceleration))
        ends = ca.vertcat(start, velocity * duration, acceleration * duration**2, goal)
        return ca.mtimes(constant(self.motion.quintic), ends)

    def vector_of(self, u: FloatArray, theta: FloatArray, duration: float, goal: int) -> FloatArray:
        """The search vector (d,) of the motion to a goal that is nearest to given joint angles.

        Args:
            u: shares of the duration, (n,).
            theta: joint angles there, (n, k), rad.
            duration: s.
            goal: its number.
        """
        shortest, longest = self.durations
        kept = float(np.clip(duration, shortest, longest))
        basis = self.motion.spline.basis_functions(u)
        away = theta - basis @ as_array(self.quintic(ca.DM(kept), ca.DM(self.goals[goal]).T))
        offsets = np.linalg.lstsq(basis[:, FIXED:-FIXED], away, rcond=None)[0].ravel() / OFFSET
        which = [goal + 0.5] if len(self.goals) > 1 else []
        slower = np.sqrt((kept - shortest) / max(longest - shortest, np.finfo(float).tiny))
        x = np.concatenate([which, [slower], np.sign(offsets) * np.sqrt(np.abs(offsets))])
        return np.asarray(np.clip(x, *self.bounds))

    def penalised(self, limits: Sequence[Limit]) -> list[Limit]:
        """All of them, and the length of steps."""
        return [*super().penalised(limits), *self.step_limits]

    def motion_bounds(self) -> MotionBounds:
        """Bounds of the motions of the search box: joints turn no farther than from control point to control point."""
        steps = np.abs(np.diff(self.motion.quintic, axis=0)).sum(axis=0)
        longest = self.durations[1]
        ends = (self.start, self.velocity, self.acceleration, self.goals)
        sizes = [float(np.abs(values).max()) for values in ends]
        turned = steps @ (sizes * longest ** np.array([0.0, 1.0, 2.0, 0.0])) + 2.0 * OFFSET * (self.motion.inner + 1)
        robot = self.motion.robot
        return MotionBounds(duration=longest, rotation=robot.dof * float(turned), radius=robot.reach()[1])
