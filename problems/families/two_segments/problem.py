"""The paper's first case, point to point, as a problem; its solution vector (12), and the reduced one.

In the paper's order: theta_m, dtheta_m, phi_s, phi_f, [elbows,] t1, t2. The reduced vector is feasible by construction:
time scaling keeps the speed and acceleration limits, normalised redundancy keeps within reach, and theta_m is counted
from the middle of theta_s and theta_f.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
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
)
from problems.base import FloatArray, Matrix, split
from problems.families.two_segments.motion import TIME_SHARES, Quantities, TwoSegments
from problems.families.two_segments.program import PointToPointNlp
from problems.limits import Limit, LimitKind, limits_of, longest_time_scale, minimum_time_scale, reach_limit, scaling
from problems.motions import Trajectory
from problems.objectives import MotionBounds, Objective
from problems.tasks import Milestone, PointToPoint, check_at_least, check_choice, elbow_signs

MAX_DETOUR = pi  # reduced: how far theta_m may lie from the middle of theta_s and theta_f, rad
MAX_SHAPE_SPEED = 8.0  # reduced: bound of dtheta_m in rad per duration of the motion


@dataclass(frozen=True)
class SegmentsEncoding(Encoding[Quantities]):
    """The common part of both formulations: postures at the ends by inverse kinematics.

    Args:
        task: whose start, goal and elbow.
        motion: that is decoded.
        time_scale: the last variable, where time is scaled and the duration is one.
    """

    time_variables: ClassVar[int]

    task: PointToPoint
    motion: TwoSegments
    time_scale: SearchedTimeScale | None = None

    def decode(self, x: Matrix) -> Decoded[Quantities]:
        """The quantities of the motion, and k_s, k_f of (13)."""
        task, form = self.task, self.task.robot.closed_form
        k, extra, branches = task.robot.dof, form.redundancy, 2 if task.elbow == "free" else 0
        sizes = [k, k, extra, extra, branches, self.time_variables]
        theta_m, dtheta_m, phi_s, phi_f, branch, times = split(x[: sum(sizes)], sizes)
        elbow = elbow_signs(task.elbow, branch, ends=2)
        start, goal = ca.vertcat(*task.start), ca.vertcat(*task.goal)
        theta_s, k_s = form.inverse(start, self.redundancy(start, phi_s), elbow[0])
        theta_f, k_f = form.inverse(goal, self.redundancy(goal, phi_f), elbow[1])
        theta_s = form.wrap(theta_s)
        theta_f = form.wrap_near(theta_f, theta_s)
        quantities = self.quantities(theta_s, theta_m.T, dtheta_m.T, theta_f, times)
        return Decoded(parameters=quantities, reach=reach_limit(ca.horzcat(k_s, k_f)))

    @abstractmethod
    def redundancy(self, point: Matrix, values: Matrix) -> Matrix:
        """The robot's redundant values at a point (dim, 1), from those of the search vector."""

    @abstractmethod
    def quantities(
        self, theta_s: Matrix, theta_m: Matrix, dtheta_m: Matrix, theta_f: Matrix, times: Matrix
    ) -> Quantities:
        """The quantities of decoded ends and the rest of the search vector."""

    def _variables(self, middle: Sequence[Variable], extra: Variable, times: Sequence[Variable]) -> list[Variable]:
        """The decision variables in the paper's order."""
        links = range(3, 3 + self.task.robot.closed_form.redundancy)
        listed = list(middle)
        listed += [
            Variable(f"{extra.name}_{end}[{j}]", extra.lower, extra.upper, extra.unit) for end in "sf" for j in links
        ]
        if self.task.elbow == "free":
            listed += [Variable(f"elbow_{end}", -1.0, 1.0, "1") for end in "sf"]
        return [*listed, *times, *self.time_scale_variables]

    def magnitudes(self) -> tuple[FloatArray, FloatArray]:
        """Upper bounds of speeds and accelerations over the search box, from the Bernstein form of (3) and (5).

        Crude, but proven; both (k,), rad/s and rad/s^2.
        """
        largest = {v.name: max(abs(v.lower), abs(v.upper)) for v in self.variables}
        speed = np.array([largest[f"dtheta_m[{i}]"] for i in range(1, self.task.robot.dof + 1)])
        ranges = self.task.robot.limits.position
        angles = np.pi if ranges is None else np.abs(ranges).max()
        step = np.full(self.task.robot.dof, 2.0 * (angles + 2.0 * pi))  # |theta_m - theta_s|, |theta_f - theta_m|
        t1, t2 = self.time_boxes
        middle = 6.0 * speed / t1[0] + 12.0 * step / t1[0] ** 2
        fastest = 5.0 * step / min(t1[0], t2[0]) + 2.0 * speed + middle * t2[1] / 4.0
        sharpest = 20.0 * step / min(t1[0], t2[0]) ** 2 + 12.0 * speed / t2[0] + 2.0 * middle
        return fastest, sharpest

    @property
    @abstractmethod
    def time_boxes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Bounds of t1 and t2 before any time scaling, s."""

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        t1, t2 = self.time_boxes
        duration, (fastest, sharpest) = t1[1] + t2[1], self.magnitudes()
        rotation = duration * fastest
        return MotionBounds(
            duration=self._longest(duration, limits, fastest, sharpest),
            rotation=float(rotation.sum()),
            radius=self.task.robot.reach()[1],
        )

    def _longest(self, duration: float, limits: Sequence[Limit], fastest: FloatArray, sharpest: FloatArray) -> float:
        return duration


@dataclass(frozen=True)
class PaperSegments(PaperCost, SegmentsEncoding):
    """The paper's solution vector with its cost (15)."""

    time_variables: ClassVar[int] = 2

    @property
    def variables(self) -> tuple[Variable, ...]:
        """theta_m, dtheta_m, phi_s, phi_f, [elbows,] t1, t2."""
        robot = self.task.robot
        joints = range(1, robot.dof + 1)
        ranges, speeds = robot.limits.position or ((-pi, pi),) * robot.dof, robot.limits.speed
        middle = [Variable(f"theta_m[{i}]", *ranges[i - 1], "rad") for i in joints]
        middle += [Variable(f"dtheta_m[{i}]", -speeds[i - 1], speeds[i - 1], "rad/s") for i in joints]
        times = [Variable(name, *self.task.time_box, "s") for name in ("t1", "t2")]
        return tuple(self._variables(middle, Variable("phi", -pi, pi, "rad"), times))

    def redundancy(self, point: Matrix, values: Matrix) -> Matrix:
        return values

    def quantities(
        self, theta_s: Matrix, theta_m: Matrix, dtheta_m: Matrix, theta_f: Matrix, times: Matrix
    ) -> Quantities:
        return Quantities(theta_s, theta_m, dtheta_m, theta_f, times[0], times[1])

    @property
    def time_boxes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The box of t1 and t2."""
        return self.task.time_box, self.task.time_box

    def largest_magnitudes(self) -> dict[str, FloatArray]:
        fastest, sharpest = self.magnitudes()
        return {"speed": fastest, "acceleration": sharpest}


@dataclass(frozen=True)
class ReducedSegments(FeasibilityFirst, SegmentsEncoding):
    """Feasible by construction, except for obstacles and joint ranges: the decoded motion is a shape of duration 1."""

    time_variables: ClassVar[int] = 1

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Detour from the middle, dtheta_m per duration, x_phi_s, x_phi_f, [elbows,] t1/T, [time_scale]."""
        joints = range(1, self.task.robot.dof + 1)
        middle = [Variable(f"detour[{i}]", -MAX_DETOUR, MAX_DETOUR, "rad") for i in joints]
        middle += [Variable(f"dtheta_m[{i}]", -MAX_SHAPE_SPEED, MAX_SHAPE_SPEED, "rad/T") for i in joints]
        return tuple(self._variables(middle, Variable("x_phi", 0.0, 1.0, "1"), [Variable("t1/T", *TIME_SHARES, "1")]))

    def redundancy(self, point: Matrix, values: Matrix) -> Matrix:
        """Redundancy angles from normalised values, by (7) generalised to any link."""
        return self.task.robot.closed_form.restore_redundancy(point, values)

    def quantities(
        self, theta_s: Matrix, theta_m: Matrix, dtheta_m: Matrix, theta_f: Matrix, times: Matrix
    ) -> Quantities:
        """The quantities of a shape of duration 1."""
        middle = (theta_s + theta_f) / 2.0 + theta_m
        return Quantities(theta_s, middle, dtheta_m, theta_f, times[0], 1.0 - times[0])

    def timed(self, shape: Quantities, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> Quantities:
        """The shape of duration 1, run so that it just keeps its limits, and t1, t2 their minimum, or more slowly."""
        shortest = self.task.least_segment_time / ca.fmin(shape.t1, shape.t2)
        scale = ca.fmax(shortest, minimum_time_scale(limits, peaks)) if limits else shortest
        if self.time_scale is not None:
            scale = scale * self.time_scale.factor(x, scale * ca.fmax(shape.t1, shape.t2))
        return shape.time_scaled(scale)

    @property
    def time_boxes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The bounds of t1 and t2 for a shape of duration 1."""
        return TIME_SHARES, TIME_SHARES

    def _longest(self, duration: float, limits: Sequence[Limit], fastest: FloatArray, sharpest: FloatArray) -> float:
        peaks = {1: ca.DM(fastest).T, 2: ca.DM(sharpest).T}
        least = max(longest_time_scale(scaling(limits), peaks), self.task.time_box[0] / TIME_SHARES[0])
        return self.longest_with_time_scale(least)


SEGMENT_ENCODINGS: dict[str, type[SegmentsEncoding]] = {kind.name: kind for kind in (PaperSegments, ReducedSegments)}
FORMULATIONS: tuple[str, ...] = tuple(SEGMENT_ENCODINGS)


def point_to_point(
    task: PointToPoint,
    objective: Objective | str = "time",
    formulation: str = "paper",
    samples: int = 50,
    limits: Sequence[LimitKind] = (),
) -> PointToPointProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, start, goal, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        formulation: a key of ``SEGMENT_ENCODINGS``: ``paper``, the cost (15) over the paper's solution vector; or
            ``reduced``, feasible by construction.
        samples: time steps a segment at which objective and constraints are sampled.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, or too few samples.
    """
    check_choice("formulation", formulation, SEGMENT_ENCODINGS)
    check_at_least("samples", samples, 2, " time steps a segment")
    motion, minimised = TwoSegments(task.robot, samples), objective_named(objective, task.robot)
    kind = SEGMENT_ENCODINGS[formulation]
    kept = limits_of(task.robot, task.obstacles, limits)
    return PointToPointProblem(
        criteria=TwoSegmentsCriteria(task=task, objective=minimised, limits=kept, row_times=motion.row_times),
        motion=motion,
        encoding=kind(task, motion, SearchedTimeScale.where_needed(minimised, task) if kind.scales_time else None),
    )


class TwoSegmentsCriteria(Criteria):
    """The criteria of motions whose segments meet in a control point."""

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        return (Milestone(label="control point", time=float(trajectory.breakpoints[1])),)


@dataclass(frozen=True, kw_only=True)
class PointToPointProblem(Problem[Quantities]):
    """Move the tool from rest at one point to rest at another."""

    motion: TwoSegments
    encoding: SegmentsEncoding

    def steps(self) -> DecodedSteps[Quantities]:
        return DecodedSteps(self)

    def nlp(self) -> PointToPointNlp:
        objective, limits = self.criteria.objective, self.criteria.limits
        return PointToPointNlp(self.encoding.task, self.motion, objective, limits, self.parameters_of)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """theta_s, theta_m, dtheta_m, theta_f, t1, t2 of one candidate (d,)."""
        return self.parameters_of(x).arrays()
