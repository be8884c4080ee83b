"""What a planner is asked: a problem, a robot, its spheres and limits; and how its answer is judged."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.kinematics import Kinematics, Spheres, read_kinematics, read_spheres
from benchmarks.motion_bench_maker.limits import limits_of
from benchmarks.motion_bench_maker.motors import Motors, Payload
from benchmarks.motion_bench_maker.problem_file import InvalidFile, MotionProblem
from problems.base import FloatArray
from problems.robots import JointLimits

SAMPLES, LIMIT_SAMPLES = 20_000, 20_000  # times at which a motion is checked
TIPS = ("panda_link8", "tool0")  # where the chains of the problems end

INERTIAL = re.compile(r"<inertial>.*?</inertial>", re.DOTALL)

Motion = Callable[[FloatArray, int], FloatArray]  # joint angles, or derivatives of them, (n, k) at times (n,)


@dataclass(frozen=True)
class Setting:
    """A robot with its limits.

    Attributes:
        urdf: file of the robot.
        spheres_file: file of its spheres.
        acceleration: rad/s^2; None for the data sheet's.
        jerk: rad/s^3; None for the data sheet's.
        tip: link that carries the payload, and whose pose may be the goal; the usual one of the problems' robots if
            there is one.
        payload: what it carries.
        keeps_torques: whether the motors' efforts are limits, where the URDF states them and masses.
    """

    urdf: Path
    spheres_file: Path
    acceleration: tuple[float, ...] | None = None
    jerk: tuple[float, ...] | None = None
    tip: str | None = None
    payload: Payload | None = None
    keeps_torques: bool = True

    @property
    def urdf_text(self) -> str:
        """What the URDF states; without masses where torques are not to be kept."""
        text = self.urdf.read_text()
        return text if self.keeps_torques else INERTIAL.sub("", text)

    @cached_property
    def tool(self) -> str | None:
        """The link that is the tool; None for the last of the URDF.

        Raises:
            InvalidFile: the robot has no such link.
        """
        if self.tip is not None and self.tip not in self.kinematics.bodies:
            raise InvalidFile(f"--tip: {self.tip!r} is no link of {self.urdf}")
        return self.tip or next((link for link in TIPS if link in self.kinematics.bodies), None)

    @cached_property
    def motors(self) -> Motors | None:
        """What they have to give with a payload; None where none is stated.

        Raises:
            InvalidFile: it is unknown what carries it, or how to compute that.
        """
        if self.payload is None:
            return None
        if find_spec("pinocchio") is None:
            raise InvalidFile("--payload: torques are checked with Pinocchio, of the extra [oracles]")
        if self.tool is None:
            raise InvalidFile("--payload: which link carries it has to be said by --tip")
        return Motors(self.urdf, self.kinematics.names, self.tool, self.payload)

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
        stated = [self.urdf_text, self.spheres_file.read_text(), asdict(self.limits)]
        return [*stated, *([] if self.payload is None else [asdict(self.payload)])]

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
        """By how much limits are exceeded at samples.

        Returns:
            Shares of speed, acceleration and jerk; ranges, rad; with a payload a share of torques.
        """
        times = np.linspace(0.0, duration, LIMIT_SAMPLES)
        limits, ranges = self.limits, np.array(self.limits.position)
        bounds = [limits.speed, limits.acceleration, *([] if limits.jerk is None else [limits.jerk])]
        shares = [
            float((np.abs(motion(times, order)) / np.array(bound)).max()) - 1.0
            for order, bound in enumerate(bounds, start=1)
        ]
        angles = motion(times, 0)
        beyond = float(np.maximum(ranges[:, 0] - angles, angles - ranges[:, 1]).max())
        torque = [] if self.motors is None else [self.motors.peak(*(motion(times, order) for order in range(3))) - 1.0]
        return [max(share, 0.0) for share in [*shares, beyond, *torque]]

    def clearance(self, problem: MotionProblem, motion: Motion, duration: float) -> float:
        """The least distance of a motion at samples, m."""
        return self.checker(problem).least_clearance(lambda times: motion(times, 0), duration, SAMPLES)
