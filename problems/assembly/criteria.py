"""What a finished motion is judged by: a statement, limits and an objective."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from problems.base.matrix import FloatArray
from problems.certify.arrival import AtGoal, at_goal, stay_verdicts
from problems.certify.closest_approach import ClosestApproach, closest_approach
from problems.certify.time_scale import exact_time_scale, safe_time_scale
from problems.certify.verdict import Verdict, verdict
from problems.certify.verification import limit_verdicts
from problems.limits.distances.clearance import Clearance
from problems.limits.limit import Limit
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.objectives import Objective
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle
from problems.tasks.drawing import BoundedCurve, Marker, Milestone, ProgressMeasure
from problems.tasks.task import Task


@dataclass(frozen=True, kw_only=True)
class Criteria:
    """What a motion has to do, to keep, and to minimise.

    Attributes:
        free_timing: whether motions are timed path by path: the number of their pieces is then free, and accelerations
            jump where no limit of the jerk forbids it.
        task: the statement: robot, start and goal or path, obstacles.
        objective: what is minimised.
        limits: what the motion must keep.
    """

    free_timing: ClassVar[bool] = False

    task: Task
    objective: Objective
    limits: tuple[Limit, ...]

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """The obstacles to keep clear of."""
        return self.task.obstacles

    def path_of(self, trajectory: Trajectory) -> JointPath:
        """The path of a motion, of the lowest degree that is known of it; its time is the parameter."""
        return JointPath.of(trajectory)

    def at_free_times(self) -> Criteria:
        """The same for a motion that is timed anew along its path."""
        if self.free_timing:
            return self
        return Criteria(task=self.task.at_free_times(), objective=self.objective, limits=self.limits)

    def given_motion(self) -> Trajectory:
        """The motion, where a path is given and nothing is left to be searched for.

        Raises:
            NotImplementedError: there is something.
        """
        raise NotImplementedError

    @property
    def is_polished(self) -> bool:
        """Whether :meth:`polished` goes on from a motion, so that any timing of its path will do before."""
        return False

    @property
    def ends_may_move(self) -> bool:
        """Whether :meth:`polished` may also change the postures at the ends."""
        return False

    def polished(self, start: Trajectory) -> Iterator[Trajectory]:
        """Faster motions made of one that may break limits, each kept farther from them than the last; none here."""
        return iter(())

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Times in s at which to tabulate a trajectory, its breakpoints among them."""
        return trajectory.times(at_least)

    def exact_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower, or faster, a trajectory has to be run so that its limits just hold for all t."""
        return max(exact_time_scale(self.limits, trajectory), self._duration_time_scale(trajectory))

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """The exact time scale and a little more, so that rounding breaks no limit."""
        return max(safe_time_scale(self.limits, trajectory), self._duration_time_scale(trajectory))

    def _duration_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower a trajectory has to be run so that none of its durations is too short."""
        bounds = self.task.duration_bounds
        return 0.0 if bounds is None else bounds.time_scale(self.task.durations(trajectory))

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        """Judge a finished trajectory against every constraint, far more densely than the search does."""
        verdicts = limit_verdicts(self.limits, trajectory, self.task.end_accelerations)
        verdicts += stay_verdicts(self.limits, trajectory, self.task.stay)
        bounds = self.task.duration_bounds
        if bounds is not None:
            durations = bounds.at(ca.DM(self.task.durations(trajectory)).T)
            verdicts.append(verdict(durations, trajectory.breakpoints[-1:]))
        return [*verdicts, *(verdict(constraint, times) for constraint, times in self.task.conditions(trajectory))]

    def closest_approach(self, trajectory: Trajectory) -> ClosestApproach | None:
        """How near a motion comes to an obstacle, and when; None where none is within reach."""
        near = (closest_approach(limit, trajectory) for limit in self.limits if isinstance(limit, Clearance))
        return min((found for found in near if found is not None), key=lambda found: found.distance, default=None)

    def at_goal(self, trajectory: Trajectory) -> AtGoal | None:
        """How long a robot that stands at the end of a motion stays clear; None where nothing moves, or it goes on."""
        if self.task.end_velocities[1].any():
            return None
        return at_goal(self.limits, self.obstacles, trajectory)

    def objective_value(self, trajectory: Trajectory, times: FloatArray) -> float:
        """The objective of a finished motion, exact where it can be; else over samples at times (n,) in s."""
        return self.objective.of_motion(trajectory, self.robot, times)

    def markers(self) -> tuple[Marker, ...]:
        """Positions that the tool has to reach, for drawing."""
        return self.task.markers()

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        """Times of interest within a motion; none by default."""
        return ()

    def bounded_curves(self, trajectory: Trajectory) -> tuple[BoundedCurve, ...]:
        """Quantities to plot over a motion together with their bounds; none by default."""
        return ()

    def progress_measures(self) -> tuple[ProgressMeasure, ...]:
        """Quantities to record and plot during a search; none by default."""
        return ()
