"""Moves among obstacles that move: splines of time, where the duration comes before the clearance.

The first three control points of a spline are position, velocity and acceleration at the start, its last three those
at the goal; up to its fourth derivative it is continuous. Duration and control points are searched together. Without
offsets a motion is the quintic from the state at the start to that at the goal.

The numbers of one problem, the states at both ends and obstacles, make another of the same make without anything
being derived or compiled anew.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import comb, prod
from typing import Any, ClassVar, cast

import casadi as ca
import numpy as np

from problems.assembly import (
    PLACES,
    Criteria,
    Decoded,
    DecodedSteps,
    Encoding,
    FeasibilityFirst,
    Problem,
    Variable,
    objective_named,
    statements_of,
    step_limits,
)
from problems.base import FloatArray, InvalidProblem, Matrix, Reading, as_array, constant, split
from problems.evaluation import EvaluationOptions, PopulationFunction, Program, Step
from problems.families.splines import MovePlanner, move_planner, selected
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, LimitKind, StepLimit, TaperedMargin, limits_of
from problems.motions import QUINTIC_HERMITE, ClampedSpline, SplineInTime, SplineShape, Trajectory
from problems.objectives import MotionBounds, Objective
from problems.programs import NonlinearProgram
from problems.robots import Robot
from problems.tasks import Move, check_at_least
from problems.timing import MotionState, least_duration

DEGREE = 5
FIXED = 3  # control points at each end


@dataclass(frozen=True)
class TimeSpline(SplineInTime):
    """A spline over time with pieces of equal duration.

    Args:
        robot: that moves.
        pieces: of the spline.
        steps: of time from sample to sample.
    """

    robot: Robot
    pieces: int
    steps: int

    @cached_property
    def spline(self) -> ClampedSpline:
        return ClampedSpline(np.linspace(0.0, 1.0, self.pieces + 1), degree=DEGREE)

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Shares of the duration at the samples, (steps + 1,)."""
        return np.linspace(0.0, 1.0, self.steps + 1)

    @property
    def inner(self) -> int:
        """The number of control points that are not fixed by the ends."""
        return self.spline.size - 2 * FIXED

    @cached_property
    def quintic(self) -> FloatArray:
        """The matrix (N, 6) from q, dq/du, d2q/du2 at the start, then at the goal, to control points of one quintic.

        A control point is its polar form at the nodes around: of u^m the mean of all products of m out of five of them.
        """
        knots = self.spline.basis.t
        polar = [
            [
                sum(map(prod, combinations(knots[i + 1 : i + 1 + DEGREE], m))) / comb(DEGREE, m)
                for m in range(DEGREE + 1)
            ]
            for i in range(self.spline.size)
        ]
        return np.asarray(np.array(polar) @ QUINTIC_HERMITE)

    def trajectory(self, parameters: SplineShape) -> Trajectory:
        curve, time = self.spline.curve(as_array(parameters.coefficients)), float(parameters.time)
        powers = time ** np.arange(DEGREE, -1, -1)
        return Trajectory(curve.x * time, curve.c / powers[:, None, None])

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        steps = self.steps * int(np.ceil((at_least - 1) / self.steps))
        return np.linspace(0.0, trajectory.duration, steps + 1)


OFFSET = 1.5  # rad, the largest; what is decided is its square root, so that small ones are found too


@dataclass(frozen=True)
class TimeControlPoints(FeasibilityFirst, Encoding[SplineShape]):
    """The encoding of a move in time: rates at both ends are given, so that every limit is penalised.

    Args:
        motion: that is decoded.
        start: joint angles at t = 0, rad.
        goals: joint angles, of which one is reached, rad.
        rates: velocities and accelerations at the start, then at the goal, rad/s and rad/s^2.
        durations: the shortest and the longest, s.
        step_limits: with obstacles, that none is jumped over from one sample to the next.
    """

    numbers: ClassVar[tuple[str, ...]] = ("start", "goals", "rates", "durations")
    scales_time: ClassVar[bool] = False

    motion: TimeSpline
    start: tuple[float, ...]
    goals: tuple[tuple[float, ...], ...]
    rates: tuple[tuple[float, ...], ...]
    durations: tuple[float, float]
    step_limits: tuple[StepLimit, ...] = ()

    @property
    def variables(self) -> tuple[Variable, ...]:
        which = [Variable("which_goal", 0.0, float(len(self.goals)), "1")] if len(self.goals) > 1 else []
        points, joints = range(FIXED, FIXED + self.motion.inner), range(1, self.motion.robot.dof + 1)
        offsets = [Variable(f"offset_{point}[{joint}]", -1.0, 1.0, "1") for point in points for joint in joints]
        return (*which, Variable("duration", 0.0, 1.0, "1"), *offsets)

    def decode(self, x: Matrix) -> Decoded[SplineShape]:
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
        leaving, speeding, arriving, slowing = (ca.horzcat(*rate) for rate in self.rates)
        once, twice = duration, duration**2
        ends = ca.vertcat(
            ca.horzcat(*self.start), leaving * once, speeding * twice, goal, arriving * once, slowing * twice
        )
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

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box: joints turn no farther than from control point to control point."""
        steps = np.abs(np.diff(self.motion.quintic, axis=0)).sum(axis=0)
        longest = self.durations[1]
        ends = [np.array(values) for values in (self.start, *self.rates[:2], self.goals, *self.rates[2:])]
        sizes = [float(np.abs(values).max()) for values in ends]
        turned = steps @ (sizes * longest ** np.tile(np.arange(3.0), 2)) + 2.0 * OFFSET * (self.motion.inner + 1)
        robot = self.motion.robot
        return MotionBounds(duration=longest, rotation=robot.dof * float(turned), radius=robot.reach()[1])


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
    """The loop for things (things, r) that have other numbers."""
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
        task: the statement: robot, postures as start and goals with velocities and accelerations, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        samples: steps of time at whose ends a motion is checked.
        pieces: of the spline.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, too few samples or pieces, a place that is no posture, or a via.
    """
    check_at_least("samples", samples, 2)
    check_at_least("pieces", pieces, LEAST_PIECES)
    motion = TimeSpline(task.robot, pieces, samples)
    return TimeMoveProblem(
        criteria=Criteria(
            task=task,
            objective=objective_named(objective, task.robot),
            limits=limits_of(task.robot, task.obstacles, limits),
            row_times=motion.row_times,
        ),
        motion=motion,
        encoding=encoding_of(task, motion),
        further_limits=tuple(limits),
    )


def encoding_of(task: Move, motion: TimeSpline) -> TimeControlPoints:
    """The encoding of a task.

    Raises:
        InvalidProblem: it asks for what these motions do not do.
    """
    if task.vias:
        raise InvalidProblem("via", "motion 'time-spline' passes none")
    if any(goal.cost for goal in task.goals):
        raise InvalidProblem("goal", "motion 'time-spline' compares no costs; leave cost out")
    start, goals = _posture(task, "start", 0), [_posture(task, "goal", number) for number in range(len(task.goals))]
    return TimeControlPoints(
        motion=motion,
        start=tuple(start.tolist()),
        goals=tuple(tuple(goal.tolist()) for goal in goals),
        rates=tuple(tuple(rate.tolist()) for rate in task.end_rates.reshape(-1, task.robot.dof)),
        durations=_durations(task, start, goals),
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


def _durations(task: Move, start: FloatArray, goals: Sequence[FloatArray]) -> tuple[float, float]:
    """The shortest and the longest duration that are searched, s: what limits and the task leave."""
    robot, bounds = task.robot, task.duration_bounds
    leaving, arriving = task.end_rates
    state = MotionState(start, *leaving)
    least = [least_duration(state, MotionState(goal, *arriving), robot.limits) for goal in goals]
    shortest, longest = max(min(least), LEAST_DURATION), LONGER * max(*least, LEAST_DURATION) + WAIT
    if bounds is None:
        return shortest, longest
    lower, upper = bounds.search_box(SAMPLING_MARGIN)
    shortest = min(max(shortest, lower), upper)
    return shortest, max(min(longest, upper), shortest)


@dataclass(frozen=True, kw_only=True)
class TimeMoveProblem(Problem[SplineShape]):
    """Move from one state to another.

    Attributes:
        further_limits: kinds of limits that hold besides those of the robot and of the obstacles.
        first: the problem of the same make whose program was derived; itself where None.
    """

    has_program: ClassVar[bool] = False

    motion: TimeSpline
    encoding: TimeControlPoints
    further_limits: tuple[LimitKind, ...] = ()
    first: TimeMoveProblem | None = None

    @cached_property
    def direct(self) -> MovePlanner:
        criteria = self.criteria
        task = cast(Move, criteria.task)  # as :func:`time_move` made it
        return move_planner(task, criteria.objective, criteria.limits, keeps_branch=True)

    @cached_property
    def searched_limits(self) -> tuple[Limit, ...]:
        """The limits with a margin for what is between samples, except at the ends, which are given."""
        return tuple(TaperedMargin(limit) for limit in self.criteria.limits)

    def same_structure_with(self, task: Move) -> TimeMoveProblem:
        """The problem of another task: from another state, to other postures, among other obstacles.

        Where it is of the same make, which takes milliseconds to tell, it shares all that was derived and compiled.

        Raises:
            InvalidProblem: as :func:`time_move`.
        """
        same_robot = task.robot is self.motion.robot
        motion = self.motion if same_robot else replace(self.motion, robot=task.robot)
        limits = limits_of(task.robot, task.obstacles, self.further_limits)
        encoding, criteria = encoding_of(task, motion), replace(self.criteria, task=task, limits=limits)
        other = replace(self, criteria=criteria, motion=motion, encoding=encoding, first=None)
        if same_robot and other._reading.structure_key == self._reading.structure_key:
            object.__setattr__(other, "first", self.first or self)  # frozen from now on
        return other

    @cached_property
    def _reading(self) -> Reading:
        """The numbers of its program, and what problems have in common whose programs differ in these alone."""
        return Reading(statements_of(self))

    def _duration_constraints(self, parameters: SplineShape) -> list[Constraint]:
        """None: the search box keeps them."""
        return []

    def steps(self) -> DecodedSteps[SplineShape]:
        return DecodedSteps(self)

    def cost_program(self) -> Program:
        if self.first is None:
            return super().cost_program()
        return with_numbers_of(self.first.program, self, self._reading.values)

    def _new_evaluator(self, options: EvaluationOptions) -> PopulationFunction:
        """The evaluator of the first problem of its make with other numbers, where there is one."""
        if self.first is None:
            return super()._new_evaluator(options)
        return self.first.evaluator(options).same_structure_with(self.program)

    def nlp(self) -> NonlinearProgram:
        """Refuse: there is no nonlinear program.

        Raises:
            InvalidProblem: always.
        """
        raise InvalidProblem("solver", NO_PROGRAM)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The goal that one candidate (d,) chooses, rad, and its duration, s."""
        shape = self.parameters_of(x)
        return {"theta_goal": as_array(shape.coefficients)[-1], "T": as_array(shape.time).ravel()}

    def parameters_of(self, x: FloatArray) -> SplineShape:
        return self.encoding.decode(ca.DM(x)).parameters

    def quintics(self, count: int) -> FloatArray:
        """Search vectors (count goals, d) of motions in free space to each goal: of durations that grow."""
        goals, d = len(self.encoding.goals), len(self.variables)
        found = np.zeros((count, goals, d))
        which = d - 1 - self.motion.robot.dof * self.motion.inner
        found[:, :, which] = np.linspace(0.0, 1.0, count)[:, None]
        found[:, :, :which] = np.arange(goals)[:, None] + 0.5
        return found.reshape(-1, d)

    def nearest_candidate(self, trajectory: Trajectory) -> FloatArray:
        u = np.linspace(0.0, 1.0, FITTED * self.motion.spline.size)
        theta = trajectory.at(u * trajectory.duration)
        goals = np.array(self.encoding.goals)
        goal = int(np.argmin(np.abs(goals - theta[-1]).max(axis=1)))
        return self.encoding.vector_of(u, theta, trajectory.duration, goal)
