"""What a planner is asked: a problem, a robot, its spheres and limits; and how its answer is judged."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

import numpy as np

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.kinematics import Kinematics, Spheres, read_kinematics, read_spheres
from benchmarks.motion_bench_maker.limits import limits_of
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits

SAMPLES, LIMIT_SAMPLES = 20_000, 20_000  # times at which a motion is checked

Motion = Callable[[FloatArray, int], FloatArray]  # joint angles, or derivatives of them, (n, k) at times (n,)


@dataclass(frozen=True)
class Setting:
    """A robot with its limits.

    Attributes:
        urdf: file of the robot.
        spheres_file: file of its spheres.
        acceleration: rad/s^2; None for the data sheet's.
        jerk: rad/s^3; None for the data sheet's.
    """

    urdf: Path
    spheres_file: Path
    acceleration: tuple[float, ...] | None = None
    jerk: tuple[float, ...] | None = None

    @cached_property
    def kinematics(self) -> Kinematics:
        """Of the robot."""
        return read_kinematics(self.urdf)

    @cached_property
    def spheres(self) -> Spheres:
        """Of the robot."""
        return read_spheres(self.spheres_file, self.kinematics)

    @cached_property
    def limits(self) -> JointLimits:
        """Of the joints."""
        return limits_of(self.kinematics, self.acceleration, self.jerk)

    @cached_property
    def _content(self) -> list[object]:
        return [self.urdf.read_text(), self.spheres_file.read_text(), asdict(self.limits)]

    def digest(self, problem: MotionProblem) -> str:
        """Of the files, the limits and a problem."""
        content = [*self._content, asdict(problem)]
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]

    def checker(self, problem: MotionProblem) -> Checker:
        """Of collisions in a problem."""
        return Checker.of(self.kinematics, self.spheres, problem)

    def bound(self, problem: MotionProblem) -> float:
        """Least time in s between the ends of a problem where nothing is in the way: Ruckig's."""
        from ruckig import InputParameter, Result, Ruckig  # noqa: PLC0415 (an extra)
        from ruckig import Trajectory as RuckigTrajectory  # noqa: PLC0415

        given = InputParameter(len(self.limits.speed))
        given.current_position, given.target_position = list(problem.start), list(problem.goal)
        given.max_velocity, given.max_acceleration = list(self.limits.speed), list(self.limits.acceleration)
        assert self.limits.jerk is not None
        given.max_jerk = list(self.limits.jerk)
        trajectory = RuckigTrajectory(len(self.limits.speed))
        result = Ruckig(len(self.limits.speed)).calculate(given, trajectory)
        assert result in (Result.Working, Result.Finished)
        return float(trajectory.duration)

    def excess(self, motion: Motion, duration: float) -> list[float]:
        """By how much of their limits speed, acceleration, jerk, rad or share, and ranges are exceeded at samples."""
        times = np.linspace(0.0, duration, LIMIT_SAMPLES)
        limits, ranges = self.limits, np.array(self.limits.position)
        bounds = [limits.speed, limits.acceleration, *([] if limits.jerk is None else [limits.jerk])]
        shares = [
            float((np.abs(motion(times, order)) / np.array(bound)).max()) - 1.0
            for order, bound in enumerate(bounds, start=1)
        ]
        angles = motion(times, 0)
        beyond = float(np.maximum(ranges[:, 0] - angles, angles - ranges[:, 1]).max())
        return [max(share, 0.0) for share in shares] + [max(beyond, 0.0)]

    def clearance(self, problem: MotionProblem, motion: Motion, duration: float) -> float:
        """The least distance of a motion at samples, m."""
        return self.checker(problem).least_clearance(lambda times: motion(times, 0), duration, SAMPLES)
