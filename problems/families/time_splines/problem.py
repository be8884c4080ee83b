"""Moves among obstacles that move.

The numbers of one problem, the state at the start, goals and obstacles, make another of the same make without anything
being derived or compiled anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from problems.assembly import (
    PLACES,
    CostSteps,
    CostWeights,
    Decoded,
    Problem,
    objective_named,
    statements_of,
    step_limits,
)
from problems.base import FloatArray, InvalidProblem, Matrix, Reading, as_array
from problems.evaluation import EvaluationOptions, PopulationFunction, Program, Step
from problems.families.time_splines.encoding import TimeControlPoints
from problems.families.time_splines.motion import TimeSpline
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, LimitKind, TaperedMargin, limits_of
from problems.motions import SplineShape, Trajectory
from problems.nlp import NonlinearProgram
from problems.objectives import Objective
from problems.tasks import Move, check_at_least
from problems.timing import MotionState, least_duration


def with_numbers_of(program: Program, problem: Problem[Any], parameters: FloatArray) -> Program:
    """The program of a problem, given that of one of the same make and the numbers of its statements (q,)."""
    penalised = problem.encoding.penalised(problem.searched_limits)
    repeated = iter([numbers for limit in penalised for numbers in limit.repeated_numbers()])
    steps = tuple(_with_rows(step, next(repeated)) if _is_repeated(step) else step for step in program.steps)
    return replace(program, steps=steps, parameters=parameters)


def _is_repeated(step: Step) -> bool:
    """Whether it runs for each of several things at each sample."""
    return step.loop is not None and step.loop.window == PLACES


def _with_rows(step: Step, numbers: FloatArray) -> Step:
    """The same for things (things, r) that have other numbers."""
    assert step.loop is not None
    samples = len(step.loop.rows) // len(numbers)
    return replace(step, loop=replace(step.loop, rows=np.tile(numbers, (samples, 1))))


LEAST_PIECES = 2
LONGER, WAIT = 3.0, 2.0  # the longest duration: so many times the shortest, and s to wait for something to pass
LEAST_DURATION = 0.2  # s, of a motion that has hardly anywhere to go
FITTED = 5  # samples of a given motion for each control point of the one that is fitted to it
NO_PROGRAM = "motion 'time-spline' has no nonlinear program; choose a metaheuristic"


def time_move(
    task: Move,
    objective: Objective | str = "time",
    samples: int = 48,
    pieces: int = 5,
    limits: Sequence[LimitKind] = (),
) -> TimeMoveProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, a posture with its velocity and acceleration, postures as goals, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        samples: steps of time at whose ends a motion is checked.
        pieces: of the spline.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, too few samples or pieces, a place that is no posture, a via, or a goal that is
            not to be reached at rest.
    """
    check_at_least("samples", samples, 2)
    check_at_least("pieces", pieces, LEAST_PIECES)
    motion = TimeSpline(task.robot, pieces, samples)
    return TimeMoveProblem(
        task=task,
        motion=motion,
        encoding=encoding_of(task, motion),
        objective=objective_named(objective, task.robot),
        limits=limits_of(task.robot, task.obstacles, limits),
        further_limits=tuple(limits),
    )


def encoding_of(task: Move, motion: TimeSpline) -> TimeControlPoints:
    """The encoding of a task.

    Raises:
        InvalidProblem: it asks for what these motions do not do.
    """
    if task.vias:
        raise InvalidProblem("via", "motion 'time-spline' passes none")
    if any(task.goal_velocity):
        raise InvalidProblem("goal_velocity", "motion 'time-spline' ends at rest")
    velocity, acceleration = task.end_velocities[0], task.end_accelerations[0]
    start, goals = _posture(task, "start", 0), [_posture(task, "goal", number) for number in range(len(task.goals))]
    return TimeControlPoints(
        motion=motion,
        start=tuple(start.tolist()),
        velocity=tuple(velocity.tolist()),
        acceleration=tuple(acceleration.tolist()),
        goals=tuple(tuple(goal.tolist()) for goal in goals),
        durations=_durations(task, start, velocity, acceleration, goals),
        step_limits=step_limits(task),
    )


def _posture(task: Move, field: str, number: int) -> FloatArray:
    """The posture (dof,) at the start, or at a goal, rad.

    Raises:
        InvalidProblem: the place leaves one to be chosen.
    """
    place = task.start if field == "start" else task.goals[number]
    if place.chosen_by_inverse_kinematics or place.choices(task.robot):
        raise InvalidProblem(field, "motion 'time-spline' needs joint angles there")
    return as_array(place.posture(task.robot, ca.DM(0, 1), 1.0, None)[0]).ravel()


def _durations(
    task: Move, start: FloatArray, velocity: FloatArray, acceleration: FloatArray, goals: Sequence[FloatArray]
) -> tuple[float, float]:
    """The shortest and the longest duration that are searched, s: what limits and the task leave."""
    robot, bounds = task.robot, task.duration_bounds
    state = MotionState(start, velocity, acceleration)
    least = [least_duration(state, goal, robot.limits) for goal in goals]
    shortest, longest = max(min(least), LEAST_DURATION), LONGER * max(*least, LEAST_DURATION) + WAIT
    if bounds is None:
        return shortest, longest
    lower, upper = bounds.search_box(SAMPLING_MARGIN)
    shortest = min(max(shortest, lower), upper)
    return shortest, max(min(longest, upper), shortest)


@dataclass(frozen=True, kw_only=True)
class TimeMoveProblem(Problem[SplineShape]):
    """Move from a state to rest at a posture.

    Attributes:
        further_limits: kinds of limits that hold besides those of the robot and of the obstacles.
        first: the problem of the same make whose program was derived; itself where None.
    """

    has_program: ClassVar[bool] = False

    task: Move
    motion: TimeSpline
    encoding: TimeControlPoints
    further_limits: tuple[LimitKind, ...] = ()
    first: TimeMoveProblem | None = None

    @cached_property
    def searched_limits(self) -> tuple[Limit, ...]:
        """The limits with a margin for what is between samples, except at the ends, which are given."""
        return tuple(TaperedMargin(limit) for limit in self.limits)

    def same_structure_with(self, task: Move) -> TimeMoveProblem:
        """The problem of another task: from another state, to other postures, among other obstacles.

        Where it is of the same make, which takes milliseconds to tell, it shares all that was derived and compiled.

        Raises:
            InvalidProblem: as :func:`time_move`.
        """
        same_robot = task.robot is self.robot
        motion = self.motion if same_robot else replace(self.motion, robot=task.robot)
        limits = limits_of(task.robot, task.obstacles, self.further_limits)
        encoding = encoding_of(task, motion)
        other = replace(self, task=task, motion=motion, encoding=encoding, limits=limits, first=None)
        if same_robot and other._reading.structure_key == self._reading.structure_key:
            object.__setattr__(other, "first", self.first or self)  # frozen from now on
        return other

    def same_make(self, task: Move) -> bool:
        """Whether the problem of another task shares what was derived and compiled for this one."""
        return self.same_structure_with(task).first is not None

    @cached_property
    def _reading(self) -> Reading:
        """The numbers of its program, and what problems have in common whose programs differ in these alone."""
        return Reading(statements_of(self))

    def decoded(self, x: Matrix) -> Decoded[SplineShape]:
        """The motion of a search vector."""
        return self.encoding.decode(x)

    def point_constraints(self, parameters: SplineShape) -> list[Constraint]:
        """The length of steps, with obstacles."""
        steps = self.motion.samples(parameters).steps
        return [constraint for limit in self.encoding.step_limits for constraint in limit.between(*steps)]

    def duration_constraints(self, parameters: SplineShape) -> list[Constraint]:
        """None: the search box keeps them."""
        return []

    def objective_bound(self) -> float:
        """An upper bound of what the objective counts as: what is above it costs no more."""
        return self.objective.upper_bound(self.encoding.motion_bounds())

    @cached_property
    def weights(self) -> CostWeights:
        """The weights in the cost, which need no motion: feasibility is graded."""
        return self.encoding.weights(self.objective_bound(), ())

    def cost_program(self) -> Program:
        """Decode, sample, finish."""
        if self.first is None:
            return TimeMoveSteps(self).program()
        return with_numbers_of(self.first.program, self, self._reading.values)

    def new_evaluator(self, options: EvaluationOptions) -> PopulationFunction:
        """That of the first problem of its make with other numbers, where there is one."""
        if self.first is None:
            return super().new_evaluator(options)
        return self.first.evaluator(options).same_structure_with(self.program)

    def nlp(self) -> NonlinearProgram:
        """There is none.

        Raises:
            InvalidProblem: always.
        """
        raise InvalidProblem("solver", NO_PROGRAM)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The goal that one candidate (d,) chooses, rad, and its duration, s."""
        shape = self.parameters_of(x)
        return {"theta_goal": as_array(shape.coefficients)[-1], "T": as_array(shape.time).ravel()}

    def parameters_of(self, x: FloatArray) -> SplineShape:
        """Numeric parameters of the motion of one candidate (d,)."""
        return self.encoding.decode(ca.DM(x)).parameters

    def exact_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower, or faster, a trajectory has to be run; 1 from a state that moves, whose rates are given."""
        return super().exact_time_scale(trajectory) if self.task.at_rest else 1.0

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """The same and a little more, so that rounding breaks no limit."""
        return super().safe_time_scale(trajectory) if self.task.at_rest else 1.0

    def quintics(self, count: int) -> FloatArray:
        """Search vectors (count goals, d) of motions in free space to each goal: of durations that grow."""
        goals, d = len(self.encoding.goals), len(self.variables)
        found = np.zeros((count, goals, d))
        which = d - 1 - self.robot.dof * self.motion.inner
        found[:, :, which] = np.linspace(0.0, 1.0, count)[:, None]
        found[:, :, :which] = np.arange(goals)[:, None] + 0.5
        return found.reshape(-1, d)

    def nearest_candidate(self, trajectory: Trajectory) -> FloatArray:
        """That of :meth:`vector_of`."""
        return self.vector_of(trajectory)

    def vector_of(self, trajectory: Trajectory) -> FloatArray:
        """The search vector (d,) whose motion is nearest to a given one: what is left of a plan, say."""
        u = np.linspace(0.0, 1.0, FITTED * self.motion.spline.size)
        theta = trajectory.at(u * trajectory.duration)
        goals = np.array(self.encoding.goals)
        goal = int(np.argmin(np.abs(goals - theta[-1]).max(axis=1)))
        return self.encoding.vector_of(u, theta, trajectory.duration, goal)


class TimeMoveSteps(CostSteps[SplineShape]):
    """Decode a candidate, then as any motion."""

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        """The step from the candidate to the motion's blocks."""
        outputs = self.motion_vectors(self.encoding.decode(self.x).parameters, orders, starting_values)
        return [Step.of("decode", {"x": self.x, "p": self.p}, outputs)]
