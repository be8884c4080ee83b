"""Tasks of tracing a path: the paper's, and in least time, in the plane and in space.

The tool passes the path's points at equal intervals of time. At some of the points, the knots, inverse kinematics gives
the joint angles; the other points are passed within the trajectory accuracy (24).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from types import MappingProxyType
from typing import ClassVar, Literal, Self, TypeAlias, get_args

import casadi as ca
import numpy as np

from problems.base import (
    LENGTHS,
    FloatArray,
    InvalidProblem,
    Relaxation,
    as_array,
    check_fields,
    check_within,
    largest,
    shown,
)
from problems.limits import Accuracy, Constraint
from problems.motions import Trajectory, increasing_choice
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle, standing
from problems.tasks.checks import check_at_least, check_choice, check_obstacles, check_point, check_range
from problems.tasks.move import passing_times
from problems.tasks.path import PLANAR, Path, check_count
from problems.tasks.place import Elbow, Position, check_elbow, check_holding_at
from problems.tasks.point_to_point import end_conditions
from problems.tasks.task import BoundedCurve, Marker, MarkerKind, Task

MIN_ACCURACY = 1e-12  # of the reach: less is rounding
KnotRedundancy: TypeAlias = Literal["free", "values"]


@dataclass(frozen=True)
class PathFollowing(Task):
    """The task to lead the tool along a path, from rest to rest.

    Args:
        robot: that moves; it has redundancy to spend.
        path: the points P*.
        accuracy: the largest distance between planned and given point at the same path parameter, m (24).
        elbow: the branch of inverse kinematics, the same all along; ``free`` adds a decision variable.
        obstacles: to keep clear of.
        knots: how many of the points are knots at the least, spread evenly; corners are knots too. Half of the
            points if None.
        total_time: bounds of t_T in the finished motion, s. If None nothing is promised: the paper formulation then
            searches from 0.1 s to 10 s, or to twice the time that the motion in the middle of its redundancy takes if
            that is more, and the others keep the least.
        knot_redundancy: of the nonlinear program alone: ``free`` at every knot, or the search vector's ``values``.
        free_times: whether the points may be passed at any times, in order; at equal intervals if not.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is out of
            its range.
    """

    numbers: ClassVar[tuple[str, ...]] = ("total_time",)
    duration_symbol: ClassVar[str] = "t_T"
    equations: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "speed": "(21), (16)",
            "acceleration": "(22), (17)",
            "rotation forward": "(20)",
            "rotation backward": "(20)",
        }
    )

    robot: Robot
    path: Path
    accuracy: float
    elbow: Elbow = "free"
    obstacles: tuple[Obstacle, ...] = ()
    knots: int | None = None
    total_time: tuple[float, float] | None = None
    knot_redundancy: KnotRedundancy = "free"
    free_times: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        check_choice("knot_redundancy", self.knot_redundancy, get_args(KnotRedundancy))
        if self.robot.dim != PLANAR:
            raise InvalidProblem("motion", 'a path in space is traced, with motion = "spline"')
        links = self.robot.closed_form.redundancy + 2
        if links < 3:
            raise InvalidProblem("link_lengths", f"following a path takes at least 3 links, not {links}")
        check_at_least("knots", self.knots, 2)
        check_path(self.robot, self.path, self.accuracy, self.elbow, self.obstacles, self.total_time)

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        return *super().relaxations, looser_accuracy(self, "accuracy", self.accuracy, "m")

    @cached_property
    def knot_indices(self) -> tuple[int, ...]:
        """Indices of points that are knots: both ends, corners and their neighbours, others evenly in between.

        At rest and at a corner the tip is far from moving evenly, and a knot missing there costs the most accuracy.
        """
        last = len(self.path.points) - 1
        knot_count = self.knots if self.knots is not None else (last + 3) // 2
        even = np.rint(np.linspace(0, last, min(knot_count, last + 1))).astype(int).tolist()
        around = [index + shift for index in (0, *self.path.corners, last) for shift in (-1, 0, 1)]
        return tuple(sorted({*even, *(index for index in around if 0 <= index <= last)}))

    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """Times at which the points of the path are passed, (n,), s."""
        if self.free_times:
            return passing_times(self.robot, trajectory, [Position(point) for point in self.path.points])
        return np.linspace(0.0, 1.0, len(self.path.points)) * trajectory.duration

    def at_free_times(self) -> Self:
        return replace(self, free_times=True)

    def accuracy_constraint(self, trajectory: Trajectory) -> Constraint:
        """The trajectory accuracy (24) at every point of the path, numeric."""
        tool = trajectory.samples(self.point_times(trajectory), self.robot).tool
        return Accuracy(self.accuracy).at(tool, ca.DM(self.path.array))

    def accuracy_of(self, trajectory: Trajectory) -> float:
        """Trajectory accuracy: the largest distance from a given point, m."""
        return float(largest(self.accuracy_constraint(trajectory).expression))

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        ends = end_conditions(self.robot, trajectory, self.path.points[0], self.path.points[-1])
        return [(self.accuracy_constraint(trajectory), self.point_times(trajectory)), *ends]

    def markers(self) -> tuple[Marker, ...]:
        points = self.path.array
        return (Marker(label="given points", points=points, kind=MarkerKind.POINTS, tolerance=self.accuracy),)

    def bounded_curves(self, trajectory: Trajectory) -> tuple[BoundedCurve, ...]:
        """The redundancy angle of each link beyond the second, with its bounds (23) at the given points, to draw."""
        times = self.point_times(trajectory)
        lower, upper = self.robot.closed_form.redundancy_ranges(trajectory.at(times), self.path.array)
        return tuple(
            BoundedCurve(
                name="redundancy",
                label="redundancy angle",
                symbol=rf"\phi_{{{column + 3}}}",
                unit="rad",
                value=partial(self._redundant_value, trajectory, column),
                times=times,
                lower=lower[:, column],
                upper=upper[:, column],
                event="given point",
            )
            for column in range(self.robot.closed_form.redundancy)
        )

    def _redundant_value(self, trajectory: Trajectory, column: int, times: FloatArray) -> FloatArray:
        return self.robot.closed_form.redundant_values(trajectory.at(times))[:, column]


def check_path(
    robot: Robot,
    path: Path,
    accuracy: float,
    elbow: Elbow,
    obstacles: Sequence[Obstacle],
    total_time: tuple[float, float] | None,
) -> None:
    """Check that a robot with branches of an elbow can follow a stated path.

    Raises:
        InvalidProblem: naming the first field that is not.
    """
    check_choice("elbow", elbow, get_args(Elbow))
    check_elbow(robot, elbow)
    check_traced(robot, path, accuracy, obstacles, total_time)
    for index, point in enumerate(path.points):
        check_holding_at(robot, elbow, "points", point, f"points[{index}] = {point}: ")


def check_traced(
    robot: Robot,
    path: Path,
    accuracy: float,
    obstacles: Sequence[Obstacle],
    total_time: tuple[float, float] | None,
) -> None:
    """Check that a robot can trace a stated path.

    Raises:
        InvalidProblem: naming the first field that is not.
    """
    if path.array.shape[1] != robot.dim:
        reason = f"{path.array.shape[1]} coordinates; the robot is in {robot.dim} dimensions"
        raise InvalidProblem("points", f"points[0] has {reason}")
    if not accuracy > 0.0:
        raise InvalidProblem("accuracy", f"{shown(accuracy)} m is not positive")
    least = MIN_ACCURACY * robot.reach()[1]
    check_within("accuracy", (accuracy,), (least, LENGTHS[1]), "m, for an arm of this reach")
    check_count("points", len(path.points))
    if total_time is not None:
        check_range("total_time", total_time)
    check_obstacles(robot, obstacles)
    in_the_way = standing(obstacles) if robot.dim == PLANAR else ()  # a tool in space may touch what it works on
    for index, point in enumerate(path.points):
        check_point(robot, in_the_way, "points", point, name=f"points[{index}] = ")


def looser_accuracy(task: Task, field: str, accuracy: float, unit: str) -> Relaxation:
    """The relaxation of an accuracy along a path, given the field of the task that states it."""

    def looser(by: float) -> dict[str, object]:
        return {field: accuracy + by}

    name = field.replace("_", " ")
    return Relaxation(limit=name, of="tip", statement=task, values=looser, size=accuracy, unit=unit)


TIMES_PER_POINT = 40  # among which the time is chosen at which a point is passed
LEAST_TIMES = 2001


class ToolTracing(Task):
    """The common part of tracing in the plane and in space. A subclass is a frozen dataclass.

    Attributes:
        robot: that moves.
        path: the points P*.
        accuracy: the largest distance from the path, m.
        angular_accuracy: the largest angle to the path's orientation, rad; None where that is free.
    """

    robot: Robot
    path: Path
    accuracy: float
    angular_accuracy: float | None = None

    @abstractmethod
    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """Times at which the points of the path are passed, increasing, (n,), s."""

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        found = [*super().relaxations, looser_accuracy(self, "accuracy", self.accuracy, "m")]
        if self.angular_accuracy is not None:
            found.append(looser_accuracy(self, "angular_accuracy", self.angular_accuracy, "rad"))
        return tuple(found)

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """Conditions on start and goal; that the tool stays near the path has a proof of its own."""
        return end_conditions(self.robot, trajectory, self.path.points[0], self.path.points[-1])

    def markers(self) -> tuple[Marker, ...]:
        label, points, kind = "given points", self.path.array, MarkerKind.POINTS
        return (Marker(label=label, points=points, kind=kind, tolerance=self.accuracy, connects_points=True),)


@dataclass(frozen=True)
class PathTracing(ToolTracing):
    """The task to lead the tool along a path, from rest to rest, as fast as the limits allow.

    The points are passed in their order, each within ``accuracy``, whenever it suits; between two of them the tool
    stays within ``accuracy`` of the straight line that joins them. The path is left at neither end: the first point is
    the start, the last the goal.

    Args:
        robot: that moves.
        path: the points P*.
        accuracy: the largest distance from the path, m.
        elbow: the branch of inverse kinematics, the same all along; ``free`` adds a decision variable.
        obstacles: to keep clear of.
        total_time: bounds of T in s; None where nothing is promised.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is out of
            its range.
    """

    numbers: ClassVar[tuple[str, ...]] = ("accuracy", "total_time")

    robot: Robot
    path: Path
    accuracy: float
    elbow: Elbow = "free"
    obstacles: tuple[Obstacle, ...] = ()
    total_time: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        check_path(self.robot, self.path, self.accuracy, self.elbow, self.obstacles, self.total_time)

    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """Times at which the points of the path are passed, increasing, (n,), s.

        Of all choices in order among many times that with the smallest sum of squared distances.
        """
        return times_at(self.robot, trajectory, self.path.array)


def times_at(robot: Robot, trajectory: Trajectory, points: FloatArray) -> FloatArray:
    """Times at which the tool passes points (n, dim) in order, from the start to the end; (n,), s."""
    times = trajectory.times(max(LEAST_TIMES, TIMES_PER_POINT * len(points)))
    tool = as_array(trajectory.samples(times, robot).tool)
    away = np.array([np.square(tool - point).sum(axis=1) for point in points])
    chosen = times[increasing_choice(away)]
    chosen[[0, -1]] = 0.0, trajectory.duration
    return chosen


LARGEST_ANGULAR_ACCURACY = 1.0  # rad; nobody means more by an accuracy
LEAST_ANGULAR_ACCURACY = 1e-9  # rad; less is rounding
HALVINGS = 45  # of the interval in which a point is passed: to rounding


@dataclass(frozen=True)
class SpaceTracing(ToolTracing):
    """The task to lead a tool in space along a path, from rest to rest, as fast as the limits allow.

    The points are passed in their order, each within ``accuracy``, whenever it suits; between two of them the tool
    stays within ``accuracy`` of the straight line that joins them. Where the path gives orientations, the tool is
    turned as it says at the nearest point of that line, within ``angular_accuracy``. The path is left at neither end.

    Args:
        robot: that moves.
        path: the points P*, with orientations or without.
        accuracy: the largest distance from the path, m.
        angular_accuracy: by how much the tool may be turned otherwise, rad; None where its orientation is free.
        obstacles: to keep clear of.
        total_time: bounds of T in s; None where nothing is promised.

    Raises:
        InvalidProblem: a point is out of reach or inside an obstacle, a field is out of its range, or poses come
            without an angular accuracy, or the other way round.
    """

    numbers: ClassVar[tuple[str, ...]] = ("accuracy", "angular_accuracy", "total_time")

    robot: SpatialArm
    path: Path
    accuracy: float
    angular_accuracy: float | None = None
    obstacles: tuple[Obstacle, ...] = ()
    total_time: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        check_traced(self.robot, self.path, self.accuracy, self.obstacles, self.total_time)
        poses, most = self.path.orientations is not None, self.angular_accuracy
        if poses and most is None:
            raise InvalidProblem("angular_accuracy", "missing: the path gives poses, with the tool's orientation")
        if most is not None and not poses:
            raise InvalidProblem("angular_accuracy", "the path gives no orientations, points of 3 coordinates alone")
        if most is not None and not LEAST_ANGULAR_ACCURACY <= most <= LARGEST_ANGULAR_ACCURACY:
            span = f"{LEAST_ANGULAR_ACCURACY:g} and {LARGEST_ANGULAR_ACCURACY:g} rad"
            raise InvalidProblem("angular_accuracy", f"{shown(most)} is not within {span}")

    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """Times at which the tool is nearest to each point of the path, increasing, (n,), s.

        Chosen among many times as in the plane, and then between the two beside it.
        """
        points = self.path.array
        times = trajectory.times(max(LEAST_TIMES, TIMES_PER_POINT * len(points)))
        tool = self.robot.tool.at(trajectory.at(times))[0]
        away = np.array([np.square(tool - point).sum(axis=1) for point in points])
        chosen = np.array(increasing_choice(away))
        low, high = times[np.maximum(chosen - 1, 0)], times[np.minimum(chosen + 1, times.size - 1)]
        found = np.maximum.accumulate(self._nearest(trajectory, low, high))
        found[[0, -1]] = 0.0, trajectory.duration
        return found

    def _nearest(self, trajectory: Trajectory, low: FloatArray, high: FloatArray) -> FloatArray:
        """Times in intervals (n,) at which the tool is nearest to each point, by golden sections, (n,), s."""
        golden = (np.sqrt(5.0) - 1.0) / 2.0
        for _ in range(HALVINGS):
            inner = high - golden * (high - low), low + golden * (high - low)
            first, second = (
                np.square(self.robot.tool.at(trajectory.at(times))[0] - self.path.array).sum(axis=1) for times in inner
            )
            low, high = np.where(first <= second, low, inner[0]), np.where(first <= second, inner[1], high)
        return (low + high) / 2.0
