"""The task of following a given path of the joints."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, check_fields
from problems.limits import Constraint
from problems.motions import JointPath, Trajectory
from problems.robots import Robot
from problems.scene import Obstacle
from problems.tasks.checks import check_obstacles, check_range
from problems.tasks.move import rate_conditions
from problems.tasks.task import Marker, Task, end_markers
from problems.timing import departure, deviation

SAME_PATH = 1e-9  # rad, for angles up to 1 rad, and of larger ones; allows for rounding only
SPEEDS = ("start_speed", "goal_speed")
STANDSTILL = 1e-9  # of the path's largest |q'|: below it the parameter starts from a standstill


@dataclass(frozen=True)
class JointFollowing(Task):
    """The task to run a path in joint space.

    Args:
        robot: that moves.
        path: of its joints.
        obstacles: to keep clear of.
        start_speed: |dq/dt| at the start, along the path, rad/s.
        goal_speed: at the end.
        total_time: bounds of T in s; None where nothing is promised.
        waypoints: (n, k) that the path was made of, rad, in which it begins and ends; None where it is stated itself.
        tolerance: how far any joint may be from straight lines between them, rad; None where it runs through them all.
        notes: on how the statement was read, a line each.

    Raises:
        InvalidProblem: the path is of another number of joints, or an end cannot have its speed.
    """

    robot: Robot
    path: JointPath
    obstacles: tuple[Obstacle, ...] = ()
    start_speed: float = 0.0
    goal_speed: float = 0.0
    total_time: tuple[float, float] | None = None
    waypoints: FloatArray | None = None
    tolerance: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        joints = self.path.coefficients.shape[2]
        if joints != self.robot.dof:
            raise InvalidProblem("joints", f"a path of {joints} joints for a robot of {self.robot.dof}")
        check_obstacles(self.robot, self.obstacles)
        if self.total_time is not None:
            check_range("total_time", self.total_time)
        for field, slope in zip(SPEEDS, self._slopes, strict=True):
            speed = getattr(self, field)
            if not 0.0 <= speed < np.inf:
                raise InvalidProblem(field, f"{speed:g} rad/s is negative or no number")
            if speed > 0.0 and slope <= STANDSTILL * self._largest_slope:
                raise InvalidProblem(field, "the path begins or ends there at a standstill of its own parameter")
        for field, velocity in zip(SPEEDS, np.abs(self.end_velocities), strict=True):
            for joint, (value, most) in enumerate(zip(velocity, self.robot.limits.speed, strict=True), start=1):
                if value > most:
                    raise InvalidProblem(
                        field, f"joint {joint} would have {value:.6g} rad/s, and may have {most:g} rad/s"
                    )

    @cached_property
    def _slopes(self) -> FloatArray:
        """The sizes |dq/du| at both ends, (2,)."""
        return np.asarray(np.linalg.norm(self.path.at(self.path.breakpoints[[0, -1]], 1), axis=1))

    @cached_property
    def _largest_slope(self) -> float:
        """The largest |dq/du| at breakpoints and between them."""
        u = np.concatenate([self.path.breakpoints, (self.path.breakpoints[1:] + self.path.breakpoints[:-1]) / 2.0])
        return float(np.linalg.norm(self.path.at(u, 1), axis=1).max())

    @property
    def rates(self) -> tuple[float, float]:
        """The rates du/dt at both ends."""
        start, goal = (
            0.0 if speed == 0.0 else speed / float(slope)
            for speed, slope in zip((self.start_speed, self.goal_speed), self._slopes, strict=True)
        )
        return start, goal

    @property
    def end_velocities(self) -> FloatArray:
        slopes = self.path.at(self.path.breakpoints[[0, -1]], 1)
        return np.asarray(slopes * np.array(self.rates)[:, None])

    @property
    def given_postures(self) -> FloatArray:
        return self.path.at(self.path.breakpoints)

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """Conditions on the path, for all t; on its waypoints; on the velocities at both ends."""
        followed = self._distance("path", departure(self.path, trajectory), "|theta_i(t) - q_i(u(t))|, to rounding")
        distances = [followed, *self._distances_from_waypoints()]
        return [
            *((distance, trajectory.breakpoints[-1:]) for distance in distances),
            *rate_conditions(self, trajectory, 1),
        ]

    def _distances_from_waypoints(self) -> list[Constraint]:
        """Constraints on the distance of the path from its waypoints; none where it is stated itself."""
        if self.waypoints is None:
            return []
        if self.tolerance is not None:
            formula = "|q_i(u) - l_i(u)| for all u, l the straight lines between the waypoints"
            return [self._distance("lines", deviation(self.path, self.waypoints), formula, self.tolerance)]
        away = self.path.at(np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(self.waypoints, axis=0), axis=1))]))
        passed = float(np.abs(away - self.waypoints).max())
        return [self._distance("waypoints", passed, "|q_i(u_j) - w_ij| at every waypoint j, to rounding")]

    def _distance(self, name: str, largest: float, formula: str, allowed: float = 0.0) -> Constraint:
        """A constraint on a distance of joints, rad, that is no more than what is allowed and rounding."""
        rounding = SAME_PATH * max(1.0, float(np.abs(self.path.at(self.path.breakpoints)).max()))
        bound = ca.DM(allowed + rounding)
        return Constraint(
            name=name,
            unit="rad",
            expression=ca.DM(largest),
            lower=-bound,
            upper=bound,
            symmetric=True,
            columns=("any joint",),
            scale=bound,
            formula=formula,
        )

    def markers(self) -> tuple[Marker, ...]:
        return end_markers(self.robot, self.path.at(self.path.breakpoints[[0, -1]]))
