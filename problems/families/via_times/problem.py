"""Times of the intervals between given postures, for a fixed interpolation, as papers search for them.

What a vector of interval times stands for is the motion that the interpolation makes of them. ``reduced``: only their
ratios count, and time is scaled so that the motion just keeps its limits, as Lin, Chang and Luh (1983) do. ``paper``:
the times count as they are, and a motion that breaks a limit is penalised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly import (
    Criteria,
    Decoded,
    DecodedSteps,
    Encoding,
    FeasibilityFirst,
    PaperCost,
    Problem,
    SearchedTimeScale,
    Variable,
    objective_named,
    step_limits,
)
from problems.base import FloatArray, InvalidProblem, Matrix, as_array
from problems.families.via_times.interpolations import INTERPOLATIONS
from problems.families.via_times.motion import NodeStates, StatePieces
from problems.families.via_times.program import IntervalTimesNlp
from problems.limits import Limit, LimitKind, StepLimit, limits_of, minimum_time_scale
from problems.motions import Trajectory
from problems.objectives import MotionBounds, Objective
from problems.tasks import Joints, Milestone, Move, check_at_least, check_choice
from problems.timing import least_durations

SHORTEST, LONGEST = 0.02, 2.0  # of the time that the segment of an interval takes from rest to rest
FEWEST_STEPS = 12  # of time in each interval
SLOWEST = 100.0  # times the longest durations of the box: no shape of it has to be run more slowly


@dataclass(frozen=True)
class IntervalTimes(Encoding[NodeStates]):
    """The common part of both formulations: the interpolation at the interval times of a search vector.

    Args:
        task: whose postures are passed.
        motion: that is decoded.
        postures: of the task, both ends included, rad.
        interpolation: a key of ``INTERPOLATIONS``.
        time_boxes: of the intervals, s.
        time_scale: the last variable, where time is scaled and the duration is one.
        step_limits: with obstacles, that none is jumped over from one sample to the next.
    """

    numbers: ClassVar[tuple[str, ...]] = ("postures", "time_boxes")

    task: Move
    motion: StatePieces
    postures: tuple[tuple[float, ...], ...]
    interpolation: str
    time_boxes: tuple[tuple[float, float], ...]
    time_scale: SearchedTimeScale | None = None
    step_limits: tuple[StepLimit, ...] = ()

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The interval times h_1, h_2, ..., [time_scale]."""
        times = (Variable(f"h_{i}", *box, "s") for i, box in enumerate(self.time_boxes, start=1))
        return (*times, *self.time_scale_variables)

    def decode(self, x: Matrix) -> Decoded[NodeStates]:
        return Decoded(parameters=self.states(x[: self.motion.count]))

    def states(self, times: Matrix) -> NodeStates:
        """The motion of interval times (n, 1), s."""
        postures = ca.vertcat(*(ca.horzcat(*posture) for posture in self.postures))
        return INTERPOLATIONS[self.interpolation].states(postures, ca.vertsplit(times))

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box that keep their limits of speed."""
        robot, longest = self.motion.robot, self.longest_with_time_scale(self._longest())
        return MotionBounds(
            duration=longest, rotation=longest * float(sum(robot.limits.speed)), radius=robot.reach()[1]
        )

    def _longest(self) -> float:
        return sum(box[1] for box in self.time_boxes)


@dataclass(frozen=True)
class PaperTimes(PaperCost, IntervalTimes):
    """Interval times as they are; a broken limit is penalised."""


@dataclass(frozen=True)
class ReducedTimes(FeasibilityFirst, IntervalTimes):
    """Interval times up to a common factor, the least with which all limits hold."""

    def timed(self, shape: NodeStates, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> NodeStates:
        if not limits:
            return shape
        scale = minimum_time_scale(limits, peaks)
        if self.time_scale is not None:
            scale = scale * self.time_scale.factor(x, scale * self.motion.duration(shape.durations))
        return shape.time_scaled(scale)

    def _longest(self) -> float:
        return SLOWEST * super()._longest()


INTERVAL_ENCODINGS: dict[str, type[IntervalTimes]] = {kind.name: kind for kind in (ReducedTimes, PaperTimes)}


def via_times(
    task: Move,
    objective: Objective | str = "time",
    interpolation: str = "cubic",
    formulation: str = "reduced",
    samples: int = 50,
    interval_time: tuple[float, float] | None = None,
    limits: Sequence[LimitKind] = (),
) -> ViaTimesProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, start, vias and goal, all of them joint values; obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        interpolation: a key of ``INTERPOLATIONS``.
        formulation: a key of ``INTERVAL_ENCODINGS``.
        samples: steps of the whole motion at whose ends it is checked; more where there are many intervals.
        interval_time: bounds of each, s; where None they follow from the time from rest to rest.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, too few samples, a place that is no posture, two equal ones in a row, or an
            interpolation that is not defined for so many.
    """
    check_choice("interpolation", interpolation, INTERPOLATIONS)
    check_choice("formulation", formulation, INTERVAL_ENCODINGS)
    check_at_least("samples", samples, 2)
    postures, rule = given_postures(task), INTERPOLATIONS[interpolation]
    if rule.vias not in (None, len(task.vias)):
        raise InvalidProblem("interpolation", f"{rule.name!r} passes {rule.vias} vias, not {len(task.vias)}")
    count = rule.intervals(len(postures))
    motion = StatePieces(task.robot, count, max(FEWEST_STEPS, ceil(samples / count)))
    minimised, kind = objective_named(objective, task.robot), INTERVAL_ENCODINGS[formulation]
    time_scale = SearchedTimeScale.where_needed(minimised, task) if kind.scales_time else None
    boxes = _time_boxes(task, postures, rule.segment_of(len(postures)), interval_time)
    kept = limits_of(task.robot, task.obstacles, limits)
    return ViaTimesProblem(
        criteria=ViaTimesCriteria(task=task, objective=minimised, limits=kept, row_times=motion.row_times),
        motion=motion,
        encoding=kind(
            task,
            motion,
            postures=tuple(map(tuple, postures.tolist())),
            interpolation=interpolation,
            time_boxes=boxes,
            time_scale=time_scale,
            step_limits=step_limits(task),
        ),
    )


def given_postures(task: Move) -> FloatArray:
    """The postures of a move, both ends included, (n, dof), rad.

    Raises:
        InvalidProblem: a place is none, there are several goals, or two in a row are the same.
    """
    if len(task.goals) > 1:
        raise InvalidProblem("goal", "kind 'via-times' has one")
    for field, places in (("start", (task.start,)), ("via", task.vias), ("goal", task.goals)):
        if not all(isinstance(place, Joints) and not place.within for place in places):
            raise InvalidProblem(field, "kind 'via-times' needs joint values")
    if not task.at_rest:
        raise InvalidProblem("start_velocity", "kind 'via-times' is from rest to rest")
    postures = task.given_postures
    same = np.flatnonzero((np.diff(postures, axis=0) == 0.0).all(axis=1))
    if same.size:
        field = "via" if same[0] < len(task.vias) else "goal"
        raise InvalidProblem(field, f"posture {same[0] + 2} is the same as the one before it")
    return postures


def _time_boxes(
    task: Move, postures: FloatArray, segment_of: Sequence[int], stated: tuple[float, float] | None
) -> tuple[tuple[float, float], ...]:
    """Bounds of the interval times, s: as stated, or shares of what each segment takes from rest to rest."""
    if stated is not None:
        return (stated,) * len(segment_of)
    stopping = least_durations(np.diff(postures, axis=0), task.robot.limits).max(axis=1)[list(segment_of)]
    return tuple((SHORTEST * time, LONGEST * time) for time in stopping.tolist())


class ViaTimesCriteria(Criteria):
    """The criteria of motions whose intervals meet at given postures."""

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        times = trajectory.breakpoints[1:-1]
        return tuple(Milestone(label=f"knot {number}", time=float(t)) for number, t in enumerate(times, start=2))


@dataclass(frozen=True, kw_only=True)
class ViaTimesProblem(Problem[NodeStates]):
    """Pass given postures by an interpolation whose interval times are decided."""

    motion: StatePieces
    encoding: IntervalTimes

    def steps(self) -> DecodedSteps[NodeStates]:
        return DecodedSteps(self)

    def nlp(self) -> IntervalTimesNlp:
        encoding, criteria = self.encoding, self.criteria
        return IntervalTimesNlp(
            task=encoding.task,
            motion=self.motion,
            objective=criteria.objective,
            limits=criteria.limits,
            time_boxes=encoding.time_boxes,
            states=encoding.states,
            decode=self.parameters_of,
        )

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The interval times of one candidate (d,), s."""
        return {"h": as_array(self.parameters_of(x).durations).ravel()}
