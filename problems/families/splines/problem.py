"""Moves by splines whose timing follows from the limits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly import Criteria, LocalTimeScale, SearchedTimeScale, Variable, objective_named
from problems.base import FloatArray, InvalidProblem
from problems.evaluation import EvaluationOptions, PopulationFunction, Program
from problems.families.splines.branches import branch_posture, branched, on_postures
from problems.families.splines.direct import MovePlanner, move_planner
from problems.families.splines.encoding import ControlPoints, nominal, stops
from problems.families.splines.path_problem import MoveSteps, SplineProblem, end_rates
from problems.families.splines.program import MoveNlp, usual_pieces
from problems.limits import (
    MAX_STEP_SHARE,
    SAMPLING_MARGIN,
    Constraint,
    LimitKind,
    StepLimit,
    limits_of,
    stay_constraints,
    stay_matters,
    stay_shares,
)
from problems.motions import PathSpline, TimedPath
from problems.objectives import Objective
from problems.tasks import Move, check_at_least

USUAL_PIECES = {1: 6, 2: 4, 3: 3}  # of the spline in each segment, by the number of segments
LEAST_PIECES = 2
LEAST_STEPS = 5  # of the grid in each piece
FINE = 50  # samples of a segment of the usual motion
DETOUR = 2.0  # lengths of the usual motion that a motion may have
MOST_SAMPLES = 600
MOVING_SHARE = 0.98  # of accelerations: between moving ends nothing can be slowed down for what a grid does not see
LEAST_SHARE = 0.1  # of the longest segment: no segment has less of the path parameter


def move(
    task: Move,
    objective: Objective | str = "time",
    samples: int = 60,
    pieces: int | None = None,
    limits: Sequence[LimitKind] = (),
) -> MoveProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, start, vias, goals, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        samples: steps of the path, at whose ends it is timed and checked; more where there are many pieces, or
            obstacles so small that one could be jumped over.
        pieces: of the spline between two stops; by the number of stops where None.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, too few samples or pieces, a pose without a clear posture, or an acceleration
            at an end of a move that passes nothing, or of a robot without a limit of jerk.
    """
    check_at_least("samples", samples, 2)
    check_at_least("pieces", pieces, LEAST_PIECES)
    problem_class = MoveProblem if _stated_acceleration(task) is None else UnsearchedMoveProblem
    tasks = branched(task)
    segments = len(task.vias) + 1
    each = USUAL_PIECES.get(segments, LEAST_PIECES) if pieces is None else pieces
    steps, least = max(LEAST_STEPS, round(samples / (segments * each))), max(map(least_samples, tasks))
    while steps * segments * each < least:
        steps *= 2  # and not what is just enough: another number is compiled anew
    kept, minimised = limits_of(task.robot, task.obstacles, limits), objective_named(objective, task.robot)
    time_scale = SearchedTimeScale.where_needed(minimised, task)
    local_time_scale = LocalTimeScale.where_needed(task)
    start, goal = (task.is_timed and not velocity.any() for velocity in task.end_velocities)
    share = 1.0 if task.at_rest and not task.is_timed else MOVING_SHARE
    spline = PathSpline(
        task.robot, usual_nodes(tasks[0], each), steps, share, (start, goal), integrated=minimised.is_integral
    )
    several = tasks[0].narrowed(tasks[0].start, tasks[0].vias, tuple(goal for one in tasks for goal in one.goals))
    problem, *branches = (
        problem_class(
            criteria=Criteria(task=stated, objective=minimised, limits=kept, free_timing=True),
            motion=spline,
            encoding=ControlPoints(
                stated,
                spline,
                float(segment_durations(stated).sum()),
                time_scale=time_scale,
                local_time_scale=local_time_scale,
            ),
        )
        for stated in (several, *(tasks if len(tasks) > 1 else ()))
    )
    return replace(problem, branches=_sharing_structure(branches)) if branches else problem


def _stated_acceleration(task: Move) -> str | None:
    """The field of an acceleration at an end, which only motions past vias have that take no search; None for none."""
    field = next((name for name in ("start_acceleration", "goal_acceleration") if any(getattr(task, name))), None)
    if field is not None and task.passes_nothing:
        raise InvalidProblem(field, "a path that is timed has its own there; needs motion = 'time-spline'")
    if field is not None and task.robot.limits.jerk is None:
        raise InvalidProblem(field, "past a via it needs a limit of jerk, without which accelerations jump at will")
    return field


def usual_nodes(task: Move, each: int) -> tuple[float, ...]:
    """Nodes of a spline with so many pieces in each segment, which has as much of it as it usually takes time."""
    durations = segment_durations(task)
    lengths = np.maximum(durations, LEAST_SHARE * durations.max())
    stops, segments = np.append(0.0, np.cumsum(lengths)), durations.size
    nodes = np.interp(np.arange(segments * each + 1) / each, np.arange(segments + 1), stops)
    return tuple((nodes / nodes[-1]).tolist())


def _sharing_structure(problems: Iterable[MoveProblem]) -> tuple[MoveProblem, ...]:
    """The problems, of which those with equal variables share the steps of one program: only their numbers differ."""
    first: dict[tuple[Variable, ...], MoveProblem] = {}
    return tuple(replace(each, same_structure_as=first.setdefault(each.variables, each)) for each in problems)


def least_samples(task: Move) -> int:
    """How many steps it takes that a motion somewhat longer than the usual one jumps over no obstacle."""
    step = StepLimit.for_robot(task.robot, task.obstacles)
    if step is None:
        return 0
    stops = nominal(task)
    between = np.linspace(0.0, len(stops) - 1.0, FINE * (len(stops) - 1) + 1)
    theta = np.column_stack([np.interp(between, np.arange(len(stops)), column) for column in stops.T])
    travel = np.linalg.norm(np.diff(task.robot.skeleton(theta), axis=0), axis=2).sum(axis=0).max()
    return min(MOST_SAMPLES, ceil(DETOUR * float(travel) / (MAX_STEP_SHARE * step.width)))


def segment_durations(task: Move) -> FloatArray:
    """Roughly how long each segment takes on a straight line between usual postures, (segments,), s."""
    limits = task.robot.limits
    speed, acceleration = np.array(limits.speed), np.array(limits.acceleration)
    distances = np.abs(np.diff(nominal(task), axis=0))
    return np.asarray((distances / speed).max(axis=1)) + float((speed / acceleration).max())


@dataclass(frozen=True, kw_only=True)
class MoveProblem(SplineProblem):
    """Move from a place to another, by way of others.

    Attributes:
        branches: where places leave several postures to inverse kinematics, the problems that keep to one of them each;
            all of one make have the same program, with other numbers.
        same_structure_as: the problem whose program has the same steps; itself where None.
    """

    motion: PathSpline
    encoding: ControlPoints
    branches: tuple[MoveProblem, ...] = ()
    same_structure_as: MoveProblem | None = None

    @property
    def branch(self) -> dict[str, FloatArray]:
        """The postures of the stops that have several, where one has been chosen at each.

        :meth:`on_branch` makes the same problem of them, to the bit.
        """
        if self.branches:
            return {}
        raced = self.same_structure_as is not None
        listed = [stop for stop in stops(self.encoding.task) if stop.may_be_missed or (raced and stop.name == "goal")]
        places = {stop.name: stop.places[0] for stop in listed}
        return {
            name: np.array(place.branch_angles) if place.branch_angles else branch_posture(self.motion.robot, place)
            for name, place in places.items()
        }

    def on_branch(self, branch: Mapping[str, FloatArray]) -> MoveProblem:
        own = (self.branches or (self,))[0]
        if set(branch) != set(own.branch):
            raise InvalidProblem("branches", f"postures at {', '.join(own.branch) or 'no stop'} are needed")
        task = on_postures(self.encoding.task, branch)
        duration = float(segment_durations(task).sum())
        encoding = replace(self.encoding, task=task, usual_duration=duration)
        criteria = replace(self.criteria, task=task)
        found = replace(own, criteria=criteria, encoding=encoding, same_structure_as=None)
        return replace(
            found,
            same_structure_as=next((each for each in self.branches if each.variables == found.variables), None),
        )

    def _point_constraints(self, parameters: TimedPath) -> list[Constraint]:
        """The length of steps, with obstacles; velocities at the ends that can be attained; what stays clear after."""
        found = super()._point_constraints(parameters)
        found += [] if self.encoding.at_rest else [end_rates(parameters.gap)]
        limits, robot, stay = self.criteria.limits, self.motion.robot, self.criteria.task.stay
        if not stay_matters(limits, stay):
            return found
        goal, since = parameters.control_points[-1, :], ca.DM(stay_shares(stay) * stay)
        return [*found, *stay_constraints(limits, robot, goal, parameters.duration, since, SAMPLING_MARGIN)]

    def steps(self) -> MoveSteps:
        """Path, scan backward, scan forward, [slow down,] sample, finish."""
        return MoveSteps(self)

    def cost_program(self) -> Program:
        if self.same_structure_as is None:
            return super().cost_program()
        return self.same_structure_as.program.with_numbers(self.steps().arguments.values)

    def _new_evaluator(self, options: EvaluationOptions) -> PopulationFunction:
        if self.same_structure_as is None:
            return super()._new_evaluator(options)
        return self.same_structure_as.evaluator(options).with_numbers(self.program.parameters)

    def nlp(self) -> MoveNlp:
        """The problem for solvers that follow gradients: cubic pieces in time, not a spline."""
        task, criteria = self.encoding.task, self.criteria
        return MoveNlp(task, criteria.objective, criteria.limits, usual_pieces(task), self.quick_trajectory)

    @cached_property
    def direct(self) -> MovePlanner:
        criteria = self.criteria
        return move_planner(self.encoding.task, criteria.objective, criteria.limits, not self.branches)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The postures at the stops of one candidate (d,), rad, and the path parameter there."""
        at = np.array(self.motion.nodes[:: self.encoding.pieces])
        names = [stop.name for stop in stops(self.encoding.task)]
        theta = {f"theta_{name}": row for name, row in zip(names, self.path(x).at(at), strict=True)}
        return {**theta, "u_stops": at}


@dataclass(frozen=True, kw_only=True)
class UnsearchedMoveProblem(MoveProblem):
    """Move past vias with accelerations at the ends, which paths that are timed do not have: only planned directly."""

    has_program: ClassVar[bool] = False

    def _new_evaluator(self, options: EvaluationOptions) -> PopulationFunction:
        raise self._refusal

    def nlp(self) -> MoveNlp:
        raise self._refusal

    @property
    def _refusal(self) -> InvalidProblem:
        field = _stated_acceleration(self.encoding.task) or ""
        return InvalidProblem(field, "past vias solver 'direct' alone keeps it, which was not asked or found no motion")
