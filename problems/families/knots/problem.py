"""The paper's second case: following a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from problems.assembly import CostSteps, Criteria, Problem, SearchedTimeScale, objective_named, peak_loop
from problems.base import FloatArray, Matrix, as_array, largest
from problems.evaluation import Loop, PopulationFunction, Step
from problems.families.knots.encoding import DEFAULT_TIME_BOUNDS, KNOT_ENCODINGS, KnotPostures, KnotsEncoding
from problems.families.knots.motion import KnotSpline, turning_speed
from problems.families.knots.program import PathNlp
from problems.limits import SAMPLING_MARGIN, Accuracy, Constraint, Limit, LimitKind, limits_of
from problems.motions import Samples, SplineShape
from problems.objectives import Objective
from problems.tasks import PathFollowing, ProgressMeasure, check_at_least, check_choice


def posture_steps(encoding: KnotPostures[Any], joints: int, x: ca.SX, p: ca.SX) -> list[Step]:
    """The steps that write ``theta``, joint angles of all rows of the knots, ((lead + M) k, 1), from the candidate.

    Args:
        encoding: the symbolic copy of the encoding.
        joints: the number k of them.
        x: symbol of the candidate, (d, 1).
        p: symbol of all numbers of the statement, (q, 1).
    """
    rows = encoding.knot_rows
    row, posture = ca.SX.sym("row", rows.shape[1]), ca.SX.sym("posture", joints)
    theta = encoding.posture_at(x, row, posture.T).T
    start = Step.of("start", {"x": x, "p": p}, {"posture": ca.SX(encoding.posture_before(x).T)})
    inputs = {"x": x, "p": p, "row": row, "posture": posture}
    return [start, Step.of("knots", inputs, {"posture": theta, "theta": theta}, Loop(rows=rows), stacked=("theta",))]


def path_following(
    task: PathFollowing,
    objective: Objective | str = "time",
    formulation: str = "paper",
    samples: int = 50,
    redundancy_values: int = 5,
    limits: Sequence[LimitKind] = (),
) -> PathFollowingProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, path, accuracy, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        formulation: a key of ``KNOT_ENCODINGS``: ``paper``, the cost (25) over the paper's solution vector x_phi and
            t_T; or ``reduced``, where t_T is a closed form of the shape.
        samples: time steps of the motion at which it is sampled, made to fit the points of the path.
        redundancy_values: how many values of x_phi are decided for each redundant link; 5 in the paper.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, or too few samples or values.
    """
    check_choice("formulation", formulation, KNOT_ENCODINGS)
    check_at_least("samples", samples, 2)
    check_at_least("redundancy_values", redundancy_values, 2)
    motion, bounds = motion_along(task, samples), task.duration_bounds
    time_box = DEFAULT_TIME_BOUNDS if bounds is None else bounds.search_box(SAMPLING_MARGIN)
    minimised, kind = objective_named(objective, task.robot), KNOT_ENCODINGS[formulation]
    time_scale = SearchedTimeScale.where_needed(minimised, task) if kind.scales_time else None
    kept = limits_of(task.robot, task.obstacles, limits)
    problem = PathFollowingProblem(
        criteria=Criteria(task=task, objective=minimised, limits=kept, row_times=motion.row_times),
        motion=motion,
        encoding=kind(task, motion, redundancy_values, time_box, time_scale),
    )
    if bounds is not None or problem.encoding.scales_time:
        return problem
    return replace(problem, encoding=replace(problem.encoding, time_box=usual_time_box(problem)))


def motion_along(task: PathFollowing, samples: int) -> KnotSpline:
    """The spline of a path, sampled at about so many steps of time.

    The steps between two points are an even number, so that the spline's nodes are samples. The acceleration peaks at
    the nodes, two of which lie half-way between points: a grid that misses them lets the paper formulation exceed the
    limit by up to 50 %.
    """
    points = len(task.path.points)
    parameters = np.linspace(0.0, 1.0, points)[list(task.knot_indices)]
    return KnotSpline(task.robot, tuple(parameters.tolist()), points, 2 * max(1, round(samples / (points - 1))))


def usual_time_box(problem: PathFollowingProblem) -> tuple[float, float]:
    """Bounds of t_T, s: twice the time that the motion in the middle of its redundancy takes, if that is more."""
    task = problem.encoding.task
    task = replace(task, elbow="up") if task.elbow == "free" else task
    encoding = KNOT_ENCODINGS["reduced"](task, problem.motion, problem.encoding.redundancy_values)
    middle = replace(problem, encoding=encoding)
    time = middle.decoded(ca.DM([0.5] * len(middle.variables))).parameters.time
    return DEFAULT_TIME_BOUNDS[0], max(DEFAULT_TIME_BOUNDS[1], 2.0 * float(time))


@dataclass(frozen=True, kw_only=True)
class PathFollowingProblem(Problem[SplineShape]):
    """Lead the tool along a path, from rest to rest."""

    motion: KnotSpline
    encoding: KnotsEncoding

    def _peaks(self, shape: SplineShape, limits: Sequence[Limit]) -> list[Matrix]:
        """Over all t in closed form where they have one, then those at the samples."""
        spline, exact = self.motion.spline, self.encoding.exact_limits(limits)
        each = (extreme(shape.coefficients) for extreme in (spline.extreme_speeds, spline.accelerations, spline.jerks))
        extremes = Samples(robot=self.motion.robot, derivatives=(ca.DM(), *each), duration=shape.time)
        peaks = [largest_rows(limit.magnitudes(extremes)) for limit in exact]
        sampled = self.encoding.sampled_limits(limits)
        return [*peaks, *(super()._peaks(shape, sampled) if sampled else [])]

    @property
    def accuracy(self) -> Accuracy:
        """The trajectory accuracy (24), as a limit."""
        return Accuracy(self.encoding.task.accuracy)

    def _point_constraints(self, parameters: SplineShape) -> list[Constraint]:
        """The trajectory accuracy (24) at the points of the path."""
        spline = self.motion.spline
        at_points = ca.mtimes(spline.sampling_matrix(self.motion.point_parameters), parameters.coefficients)
        return [self.accuracy.at(self.motion.robot.tool.position(at_points), ca.DM(self.encoding.task.path.array))]

    def steps(self) -> KnotSteps:
        """Postures at the knots, spline, [peaks, scale,] samples, points of the path, finish."""
        return KnotSteps(self)

    def nlp(self) -> PathNlp:
        objective, limits = self.criteria.objective, self.criteria.limits
        return PathNlp(self.encoding.task, self.motion, self.encoding, objective, limits, self.trajectory)

    @cached_property
    def _knots(self) -> ca.Function:
        x = ca.SX.sym("x", len(self.variables))
        return ca.Function("knots", [x], [self.encoding.at_knots(x)[0]])

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Redundancy angles phi at the knots and t_T of one candidate (d,)."""
        phi = as_array(self._knots(x))
        return self.motion.quantities(phi, float(self.parameters_of(x).time))

    @cached_property
    def _accuracy(self) -> PopulationFunction:
        distances = next(
            constraint for constraint in self.model.constraints if constraint.name == "accuracy"
        ).expression
        return PopulationFunction(ca.Function("accuracy", [self.model.x], [largest(distances)]))

    def accuracy_of(self, candidates: FloatArray) -> FloatArray:
        """Trajectory accuracy of candidates (m, d): the largest distance from a given point, (m,), m."""
        return self._accuracy(candidates)

    def progress_measures(self) -> tuple[ProgressMeasure, ...]:
        """The trajectory accuracy (24), of candidates and of motions."""
        accuracy = ProgressMeasure(
            name="accuracy",
            label="trajectory accuracy",
            title="largest distance from a given point",
            unit="m",
            limit=self.encoding.task.accuracy,
            of_candidates=self.accuracy_of,
            of_trajectory=self.encoding.task.accuracy_of,
        )
        return (accuracy,)


def largest_rows(values: Matrix) -> Matrix:
    """The largest of each column, (1, m)."""
    return ca.horzcat(*(largest(column) for column in ca.horzsplit(values)))


class KnotSteps(CostSteps[SplineShape]):
    """Postures at the knots one after the other, the spline through them; where time is scaled, peaks at the nodes."""

    encoding: KnotsEncoding
    motion: KnotSpline

    def __init__(self, problem: PathFollowingProblem) -> None:
        super().__init__(problem)
        self.accuracy = self.arguments.symbolic_copy(problem.accuracy)

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        k = self.motion.robot.dof
        theta = ca.SX.sym("theta", k * len(self.encoding.knot_points))
        shape = self.encoding.shape(ca.reshape(theta, k, -1).T, self.encoding.parts(self.x)[2])
        inputs = {"x": self.x, "p": self.p, "theta": theta}
        zeros, postures = (
            {**starting_values, "accuracy": 1},
            posture_steps(self.encoding, self.motion.robot.dof, self.x, self.p),
        )
        if not self.encoding.scales_time:
            return [*postures, Step.of("spline", inputs, self.motion_vectors(shape, orders, zeros))]
        nodes, peaks_size = self._nodes()
        outputs: dict[str, Matrix] = {
            "coefficients": ca.vec(shape.coefficients.T),
            "last": ca.SX.zeros(2 * k),
            "peaks": ca.SX.zeros(peaks_size),
        }
        sampled = self.encoding.sampled_limits(self.limits)
        further = [peak_loop(self.motion, sampled, self.p, "sampled_peaks")] if sampled else []
        for loop in further:
            outputs["shape_blocks"] = self.motion.blocks(shape, loop.orders)
            outputs["shape_durations"] = ca.SX(shape.time)
            outputs.update({name: ca.SX.zeros(size) for name, size in loop.starting_values.items()})
        coefficients = ca.SX.sym("coefficients", shape.coefficients.numel())
        sizes = {"peaks": peaks_size, **{name: n for loop in further for name, n in loop.starting_values.items()}}
        found = {name: ca.SX.sym(name, size) for name, size in sizes.items()}
        rows, peaks = ca.reshape(coefficients, k, -1).T, self.peaks_of_each(ca.vertcat(*found.values()))
        timed = self.encoding.timed(SplineShape(rows, ca.SX(1)), self.slowing, peaks, self.x)
        inputs_of_scale = {**self.time_scale_inputs, "coefficients": coefficients, **found}
        scale = Step.of("scale", inputs_of_scale, self.motion_vectors(timed, orders, zeros))
        return [*postures, Step.of("spline", inputs, outputs), nodes, *(loop.step for loop in further), scale]

    @property
    def least_orders(self) -> tuple[int, ...]:
        return (0,)

    def _nodes(self) -> tuple[Step, int]:
        """Peaks of speed, acceleration and jerk over all u, at the nodes and where the speed turns between them."""
        grid, (size, width) = self.motion.node_grid, self.motion.piece_sizes((0,))
        window, row = ca.SX.sym("window", width), ca.SX.sym("row", grid.rows.shape[1])
        last = ca.SX.sym("last", 2 * size)
        basis, k = row.shape[0] // 2, size
        speed, acceleration = (self.motion.combined(window, part, (0,), 0) for part in (row[:basis], row[basis:-1]))
        turning = turning_speed(last[:k].T, last[k:].T, acceleration, row[-1])
        step = 2.0 * row[-1]  # from the node before; none to the first
        jerk = ca.if_else(step > 0.0, (acceleration - last[k:].T) / step, 0.0)
        moments = [
            Samples(robot=self.motion.robot, derivatives=(ca.SX(), fast, acceleration, jerk), duration=ca.SX(1))
            for fast in (speed, turning)
        ]
        exact = self.encoding.exact_limits(self.limits)
        magnitudes = [ca.vertcat(*(limit.magnitudes(m).T for limit in exact)) for m in moments]
        peaks = ca.SX.sym("peaks", magnitudes[0].shape[0])
        outputs = {
            "peaks": ca.fmax(ca.fmax(peaks, magnitudes[0]), magnitudes[1]),
            "last": ca.vertcat(speed.T, acceleration.T),
        }
        loop = Loop(rows=grid.rows, window="coefficients", starts=grid.pieces * size)
        inputs = {"p": self.p, "window": window, "row": row, "last": last, "peaks": peaks}
        return Step.of("nodes", inputs, outputs, loop), int(peaks.shape[0])

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """A loop over the points of the path that adds up how far the tool misses each."""
        grid, (size, width) = self.motion.point_grid, self.motion.piece_sizes(orders)
        points = self.encoding.task.path.array
        window, row = ca.SX.sym("window", width), ca.SX.sym("row", grid.rows.shape[1] + points.shape[1])
        basis, point = row[: grid.rows.shape[1]], row[grid.rows.shape[1] :]
        theta = self.motion.combined(window, basis, orders, 0)
        constraint = self.accuracy.at(self.motion.robot.tool.position(theta), point.T)
        accuracy = ca.SX.sym("accuracy")
        inputs = {"p": self.p, "window": window, "row": row, "accuracy": accuracy}
        outputs = {"accuracy": accuracy + self.encoding.penalty(constraint)}
        loop = Loop(rows=np.column_stack([grid.rows, points]), window="blocks", starts=grid.pieces * size)
        return [Step.of("points", inputs, outputs, loop)]

    @property
    def further_penalties(self) -> tuple[str, ...]:
        return ("accuracy",)
