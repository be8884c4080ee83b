"""What a motion of a task is judged by: its limits and its objective."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem, Parametric
from problems.certify import (
    AtGoal,
    ClosestApproach,
    FixedContact,
    Verdict,
    at_goal,
    closest_approach,
    closest_cover,
    fixed_contacts,
    limit_verdicts,
    safe_time_scale,
    stay_verdicts,
    verdict,
    verdicts_with_first_times,
)
from problems.limits import LIMITS, Clearance, CoverClearance, Limit, LimitKind, complete_limits, limits_of
from problems.motions import JointPath, Trajectory
from problems.objectives import OBJECTIVES, Objective
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle
from problems.tasks import JointFollowing, Milestone, RecordedMotion, Task
from problems.timing import retime


@dataclass(frozen=True, eq=False)
class MotionStage:
    """A stage of a finished motion.

    Attributes:
        label: what it is called.
        kind: of stage.
        start: when it begins, s.
        end: when it ends; the same where nothing moves and nothing waits.
        criteria: by which its motion is judged; None where the arm stands.
        signal: what is told at its beginning, name and value; None where nothing is.
    """

    label: str
    kind: str
    start: float
    end: float
    criteria: Criteria | None = None
    signal: tuple[str, bool | float | str] | None = None

    @property
    def name(self) -> str:
        """The label where there is little room: number and kind, such as ``3 line``."""
        return f"{self.label.partition(' ')[2].partition(' (')[0]} {self.kind}"

    @property
    def signal_in_words(self) -> str:
        """The signal, such as ``gripper = close``; empty where nothing is told."""
        return "" if self.signal is None else f"{self.signal[0]} = {self.signal[1]}"

    def motion(self, trajectory: Trajectory) -> Trajectory:
        """The stage's part of the whole motion, from t = 0."""
        return trajectory.part(self.start, min(self.end, trajectory.duration))

    def verify(self, trajectory: Trajectory) -> tuple[Verdict, ...]:
        """The verdicts on its part of the whole motion; none where the arm stands, as it does where it came from."""
        return () if self.criteria is None else tuple(self.criteria.verify(self.motion(trajectory)))


@dataclass(frozen=True, kw_only=True)
class Criteria(Parametric):
    """The task of a motion, the limits that it keeps, and the objective.

    Attributes:
        task: the statement: robot, start and goal or path, obstacles.
        objective: what is minimised.
        limits: what the motion must keep.
        free_timing: whether motions are timed path by path: the number of their pieces is then free, and accelerations
            jump where no limit of the jerk forbids it.
        row_times: times in s, at least so many, at which to tabulate a trajectory, its breakpoints among them.
    """

    task: Task
    objective: Objective
    limits: tuple[Limit, ...]
    free_timing: bool = False
    row_times: Callable[[Trajectory, int], FloatArray] = Trajectory.times

    @property
    def stages(self) -> tuple[MotionStage, ...]:
        """The stages of which a motion is made; none where it is one."""
        return ()

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
        """The criteria of a motion that is timed anew along its path."""
        if self.free_timing:
            return self
        task = self.task.at_free_times()
        return Criteria(task=task, objective=self.objective, limits=self.limits, free_timing=True)

    def with_clock(self, clock: Callable[[FloatArray], FloatArray]) -> Self:
        """The criteria with another clock, (n,) to (n,), s, for what is due at given times; unchanged by default."""
        return self

    def given_motion(self) -> Trajectory:
        """The motion, where a path is given and nothing is left to be searched for.

        Raises:
            NotImplementedError: there is something.
        """
        raise NotImplementedError

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower, or faster, a trajectory has to be run so that its limits hold for all t, despite rounding.

        1 where an end is not at rest: its rates are given.
        """
        if not self.task.at_rest:
            return 1.0
        bounds = self.task.duration_bounds
        of_durations = 0.0 if bounds is None else bounds.time_scale(self.task.durations(trajectory))
        return max(safe_time_scale(self.limits, trajectory), of_durations)

    @cached_property
    def judged_limits(self) -> tuple[Limit, ...]:
        """The limits as verdicts speak of them: of all bodies, also of those that a search need not look at."""
        return complete_limits(self.limits, self.robot, self.obstacles)

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        """Judge a finished trajectory against every constraint, far more densely than the search does."""
        verdicts = self._limit_verdicts(trajectory)
        verdicts += stay_verdicts(self._lasting_limits, trajectory, self.task.stay)
        bounds = self.task.duration_bounds
        if bounds is not None:
            durations = bounds.at(ca.DM(self.task.durations(trajectory)).T)
            verdicts.append(verdict(durations, trajectory.breakpoints[-1:]))
        return [*verdicts, *(verdict(constraint, times) for constraint, times in self.task.conditions(trajectory))]

    def _limit_verdicts(self, trajectory: Trajectory) -> list[Verdict]:
        return limit_verdicts(self.judged_limits, trajectory, self.task.end_accelerations)

    def by_stage(self, trajectory: Trajectory) -> tuple[tuple[Verdict, ...], ...]:
        """The verdicts on each stage of what is made of several; here there is one."""
        return (tuple(self.verify(trajectory)),)

    def overall(self, by_stage: Iterable[tuple[Verdict, ...]]) -> tuple[Verdict, ...]:
        """The verdicts on the whole, given those on its stages."""
        return next(iter(by_stage))

    @property
    def _lasting_limits(self) -> tuple[Limit, ...]:
        """The limits by which a robot that stands is judged: what can reach it, or its covers."""
        return self.judged_limits if self.robot.cover is not None else self.limits

    def closest_approach(self, trajectory: Trajectory, by_stage: Sequence[Sequence[Verdict]]) -> ClosestApproach | None:
        """How near a motion comes to an obstacle, and when, given its verdicts; None where none is within reach."""
        near = [closest_approach(limit, trajectory) for limit in self.judged_limits if isinstance(limit, Clearance)]
        near += [closest_cover(limit, trajectory) for limit in self.judged_limits if isinstance(limit, CoverClearance)]
        return min((found for found in near if found is not None), key=lambda found: found.distance, default=None)

    def at_goal(self, trajectory: Trajectory) -> AtGoal | None:
        """How long a robot that stands at the end of a motion stays clear; None where nothing moves, or it goes on."""
        if self.task.end_rates[1].any():
            return None
        return at_goal(self._lasting_limits, self.obstacles, trajectory)

    def objective_value(self, trajectory: Trajectory, times: FloatArray) -> float:
        """The objective of a finished motion, exact where it can be; else over samples at times (n,) in s."""
        return self.objective.of_motion(trajectory, self.robot, times)

    def at_times(self, times: FloatArray) -> Iterator[tuple[Criteria, NDArray[np.intp]]]:
        """The criteria that hold at times (n,) in s, with the indices of these times: the whole by default."""
        yield self, np.arange(times.size)

    @property
    def assumed(self) -> str:
        """Under what ``certified`` holds, in words to stand behind it; empty where there is nothing to say."""
        return self.robot.assumed

    def fixed_contacts(self, trajectory: Trajectory) -> tuple[FixedContact, ...]:
        """The links that no joint moves and obstacles that are not proven to keep clear of them during a motion."""
        seconds = trajectory.duration + self.task.stay
        return fixed_contacts(self.robot, self.obstacles, seconds) if type(self.robot) is SpatialArm else ()

    def not_judged(self, trajectory: Trajectory) -> tuple[str, ...]:
        """Lines that name what no verdict on a motion speaks of, although it is or may be there."""
        found = [*self.robot.unjudged, *self._contacts_with_several(), *map(str, self.fixed_contacts(trajectory))]
        if self.robot.dim == 3 and self.obstacles and type(self.robot) is not SpatialArm:
            found.append("clearance of what no joint moves from obstacles")
        if self.robot.joint_errors is not None:
            planned = dict.fromkeys(limit.name for limit in self.judged_limits if not limit.within_tracking)
            found.append(f"{', '.join(planned)}, and the path of the tool, of joints that are off the plan")
        return tuple(found)

    def _contacts_with_several(self) -> Iterator[str]:
        """A line for each name of obstacles that may be touched and that several of them have, parts of one too."""
        bodies = Counter(obstacle.unmoved.name for obstacle in self.obstacles)
        for name in dict.fromkeys(obstacle for _, obstacle in self.robot.may_touch):
            if bodies[name] > 1:
                yield f"contact with any of the {bodies[name]} bodies that are called {name}, which may be touched"

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        """Times of interest within a motion; those of the task by default."""
        return self.task.milestones(trajectory)


def joint_following(task: JointFollowing, limits: Sequence[LimitKind] = ()) -> JointFollowingCriteria:
    """The criteria of a path to be run; time is the objective.

    Args:
        task: the statement: robot, path, obstacles.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.
    """
    return JointFollowingCriteria(
        task=task, objective=OBJECTIVES["time"], limits=limits_of(task.robot, task.obstacles, limits)
    )


@dataclass(frozen=True, kw_only=True)
class JointFollowingCriteria(Criteria):
    """Run a given path."""

    task: JointFollowing
    free_timing: bool = True

    def path_of(self, trajectory: Trajectory) -> JointPath:
        return self.task.path

    def given_motion(self) -> Trajectory:
        """The path in the least time; slower where other limits or a total time need it and both ends are at rest.

        Raises:
            InvalidProblem: the path stands still or jumps, or no motion has its velocities at the ends.
        """
        trajectory = retime(self.task.path, self.robot.limits, self.task.rates, chain=self.robot.rigid_chain)
        scale = self.safe_time_scale(trajectory)
        return trajectory if scale <= 1.0 else trajectory.time_scaled(scale)


def recorded_motion(task: RecordedMotion, limits: Sequence[LimitKind] = ()) -> RecordedMotionCriteria:
    """The criteria of a motion that is stated as it is.

    Args:
        task: the statement: robot, motion, obstacles.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: what is left out is no limit.
    """
    every = limits_of(task.robot, task.obstacles, limits)
    known = dict.fromkeys([*(limit.name for limit in every), *LIMITS])
    unknown = next((name for name in task.without if name not in known), None)
    if unknown is not None:
        raise InvalidProblem("without", f"{unknown!r} is no limit; there are {', '.join(known)}")
    kept = tuple(limit for limit in every if limit.name not in task.without)
    return RecordedMotionCriteria(task=task, objective=OBJECTIVES["time"], limits=kept)


@dataclass(frozen=True, kw_only=True)
class RecordedMotionCriteria(Criteria):
    """Run a motion exactly as it is stated."""

    task: RecordedMotion
    free_timing: bool = True

    def given_motion(self) -> Trajectory:
        return self.task.motion

    @cached_property
    def judged_limits(self) -> tuple[Limit, ...]:
        return tuple(limit for limit in super().judged_limits if limit.name not in self.task.without)

    @property
    def assumed(self) -> str:
        left_out = f"without a verdict on {', '.join(self.task.without)}" if self.task.without else ""
        return ", ".join(filter(None, (super().assumed, left_out)))

    def _limit_verdicts(self, trajectory: Trajectory) -> list[Verdict]:
        """The verdicts on limits, with the first time at which a violated one is broken."""
        return verdicts_with_first_times(self.judged_limits, trajectory, self.task.end_accelerations)

    def not_judged(self, trajectory: Trajectory) -> tuple[str, ...]:
        left_out = (f"{name}, as asked" for name in self.task.without)
        return (*super().not_judged(trajectory), *self.task.remarks, *left_out)
