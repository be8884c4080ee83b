"""Tasks along paths as tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from math import pi
from typing import Annotated, Any, ClassVar, Literal, NoReturn, Self

import numpy as np

from problems import (
    InvalidProblem,
    Obstacle,
    Path,
    PathFollowing,
    Problem,
    Robot,
    closed_curve,
    path_following,
    pentagram,
)
from problems.assembly import Criteria, joint_following
from problems.base import Count, FloatArray, Range
from problems.families.traced import space_tracing, tracing
from problems.motions import JointPath
from problems.robots import SpatialArm
from problems.tasks import Elbow, JointFollowing, PathTracing, SpaceTracing
from problems.timing import distinct_rows, fitted_path
from tpbso_casadi.scenario.catalogues import find_objective
from tpbso_casadi.scenario.frames import FramedPoints
from tpbso_casadi.scenario.input_files import InputFolder, read_points
from tpbso_casadi.scenario.model import ModelSection, ObjectiveChoice, OwnObjectives, TaskSection
from tpbso_casadi.scenario.recorded_rows import LARGEST_COEFFICIENT, MOST_MOTION_ROWS
from tpbso_casadi.scenario.row_tasks import RowFileTask, joint_table, read_joint_rows
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    MOST_JOINT_POINTS,
    MOST_LINKS,
    MOST_POINT_CHECKS,
    MOST_POINTS,
    Angle,
    NotNegative,
    Number,
    PlanarPoint,
    Positive,
    ScenarioError,
)

Interpolation = Literal["spline", "blend", "fit"]
FIELDS = {
    "waypoints": "joints",
    "path": "joints",
    "positions": "joints",
    "rates": "start_speed",
}  # keys of ours by those of a path
MOST_PIECES = 100_000
MOST_COEFFICIENTS = 50  # of a piece


class GivenPathTask(TaskSection):
    """[task] of a path in joint space: speeds at its ends in rad/s, along it; times in s."""

    is_searched: ClassVar[bool] = False
    has_solver: ClassVar[bool] = False
    motions: ClassVar[tuple[str, ...]] = ("spline",)

    start_speed: Annotated[NotNegative, ANGULAR] = 0.0
    goal_speed: Annotated[NotNegative, ANGULAR] = 0.0
    total_time: tuple[Positive, Positive] | None = None

    def stated(self, robot: Robot) -> dict[str, Any]:
        """The path that the table states for a robot, and what it was made of, as arguments of :class:`JointFollowing`.

        Raises:
            InvalidProblem: it is none.
        """
        raise NotImplementedError

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> NoReturn:
        """Refuse to build a problem: a given path is timed, not searched.

        Raises:
            ScenarioError: always.
        """
        raise ScenarioError(f"task.kind: {self.kind!r} is timed; there is nothing to search for")

    def criteria(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        try:
            stated = self.stated(robot)
            speeds: dict[str, Any] = {"start_speed": self.start_speed, "goal_speed": self.goal_speed}
            task = JointFollowing(robot, obstacles=obstacles, **speeds, total_time=self.total_time, **stated)
        except InvalidProblem as error:
            raise InvalidProblem(FIELDS.get(error.field, error.field), error.reason) from error
        return joint_following(task, model.further_limits)


class JointPathTask(RowFileTask, GivenPathTask):
    """The rows of a file beside the scenario file, or a list: waypoints, or a recording; angles in rad."""

    kind: Literal["joint-path"]
    joints: Annotated[
        str
        | Annotated[
            list[Annotated[list[Number], Count(1, MOST_LINKS)]],
            Count(1, MOST_MOTION_ROWS),
        ],
        ANGULAR,
    ]
    interpolation: Interpolation = "spline"
    tolerance: Annotated[Angle, Range(least=0.0)] | None = None

    def with_files(self, folder: InputFolder) -> Self:
        if not isinstance(self.joints, str):
            return self
        try:
            rows = read_joint_rows(folder, self.joints, self.reading)
        except ScenarioError as error:
            raise ScenarioError(f"task.joints: {error}") from error
        return self.read(joints=rows.positions, joint_names=self.joint_names or rows.joint_names, notes=rows.notes)

    def in_radians(self) -> Self:
        """The table in rad; rows whose unit the task states stay in it."""
        found = super().in_radians()
        return found if self.unit is None else found.replaced(joints=self.joints, start=self.start)

    def stated(self, robot: Robot) -> dict[str, Any]:
        if isinstance(self.joints, str):
            raise ScenarioError(f"task.joints: {self.joints!r} has not been read; only a scenario file can name a file")
        rows = joint_table(self.joints, "joints")
        joined = self.joined(robot, rows)
        first = [] if joined.start is None else [joined.start]
        waypoints = np.array([*first, *joined.of(rows)])
        if self.interpolation == "fit":
            waypoints = distinct_rows(waypoints)
        elif len(waypoints) > MOST_ROWS:
            reason = f"{len(waypoints)} rows, of at most {MOST_ROWS}; more are for interpolation = 'fit'"
            raise InvalidProblem("joints", reason)
        path = PATHS[self.interpolation](waypoints, self.tolerance)
        return {"path": path, "waypoints": waypoints, "tolerance": self.tolerance, "notes": joined.notes}


def _given_spline(rows: FloatArray, tolerance: float | None) -> JointPath:
    if tolerance is not None:
        raise InvalidProblem("tolerance", "a spline runs through its points; say interpolation = 'blend'")
    return JointPath.through(rows)


def _blend(rows: FloatArray, tolerance: float | None) -> JointPath:
    if tolerance is None:
        raise InvalidProblem(
            "tolerance", "missing key: how far a blend may leave the lines, rad; with 0 corners are stops"
        )
    return JointPath.blended(rows, tolerance)


def _fit(rows: FloatArray, tolerance: float | None) -> JointPath:
    if tolerance is None:
        raise InvalidProblem("tolerance", "missing key: how far a smooth path may leave the lines between rows, rad")
    return fitted_path(rows, tolerance)


PATHS: dict[str, Callable[[FloatArray, float | None], JointPath]] = {
    "spline": _given_spline,
    "blend": _blend,
    "fit": _fit,
}
MOST_ROWS = 3_000  # that a path passes all of; its timing takes a minute


class JointPiecesTask(GivenPathTask):
    """Polynomial pieces, as a run stores its motion; rad, whatever the parameter."""

    kind: Literal["joint-path"]
    shape: Literal["pieces"]
    breakpoints: Annotated[list[float], Count(2, MOST_PIECES)]
    coefficients: Annotated[list[list[list[float]]], Count(2, MOST_COEFFICIENTS)]

    def stated(self, robot: Robot) -> dict[str, Any]:
        return {"path": JointPath(*trajectory_pieces(self.breakpoints, self.coefficients))}


def trajectory_pieces(breakpoints: list[float], coefficients: list[list[list[float]]]) -> tuple[FloatArray, FloatArray]:
    """Breakpoints (p + 1,) and coefficients (order, p, k) of stated pieces.

    Raises:
        InvalidProblem: they do not fit each other.
    """
    sizes = {(len(pieces), len(row)) for pieces in coefficients for row in pieces}
    if len(sizes) != 1 or next(iter(sizes))[0] != len(breakpoints) - 1:
        raise InvalidProblem(
            "coefficients", "an array (order, pieces, joints) is needed, one breakpoint more than pieces"
        )
    parameters = np.array(breakpoints)
    if not (np.diff(parameters) > 0.0).all():
        raise InvalidProblem("breakpoints", "increasing parameters are needed")
    powers = np.array(coefficients)
    if not (np.abs(powers) <= LARGEST_COEFFICIENT).all():
        raise InvalidProblem("coefficients", f"a number is not finite, or larger than {LARGEST_COEFFICIENT:g}")
    return parameters, powers


def pieces_table(path: JointPath) -> dict[str, Any]:
    """The [task] table of a path in joint space, exactly; plain data."""
    pieces = {"breakpoints": path.breakpoints.tolist(), "coefficients": path.coefficients.tolist()}
    return {"kind": "joint-path", "shape": "pieces", **pieces}


class PathTask(TaskSection):
    """[task] of following a path of any shape: accuracy in m, that of the tool's orientation in rad, times in s."""

    motions: ClassVar[tuple[str, ...]] = ("spline", "paper")

    kind: Literal["path"]
    accuracy: Positive
    angular_accuracy: Annotated[Positive | None, ANGULAR] = None
    objectives: OwnObjectives = field(default_factory=list)
    objective: ObjectiveChoice = "time"
    elbow: Elbow = "free"
    total_time: tuple[Positive, Positive] | None = None

    def path(self) -> Path:
        """The points to follow."""
        raise NotImplementedError

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        check_path(self.path(), robot, obstacles)
        return BUILDERS[model.motion](self, robot, obstacles, model)


def _paper(table: PathTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
    """The paper's statement: the points are passed at equal intervals of time."""
    _refuse_poses(table)
    task = PathFollowing(
        robot,
        table.path(),
        table.accuracy,
        elbow=table.elbow,
        obstacles=obstacles,
        knots=model.knots,
        total_time=table.total_time,
        knot_redundancy=model.knot_redundancy,
    )
    return path_following(
        task,
        find_objective(table.objective, table.own_objectives),
        model.formulation,
        model.samples,
        model.redundancy_values,
        model.further_limits,
    )


def _traced_in_plane(
    table: PathTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection
) -> Problem[Any]:
    """Ours: the tool stays near the whole path and passes its points when it suits."""
    if model.pieces is not None:
        raise InvalidProblem("pieces", "the points of a path decide about its pieces")
    settings = (
        find_objective(table.objective, table.own_objectives),
        model.samples,
        model.redundancy_values,
        model.further_limits,
    )
    if isinstance(robot, SpatialArm):
        return space_tracing(_in_space(table, robot, obstacles), *settings)
    _refuse_poses(table)
    return tracing(
        PathTracing(robot, table.path(), table.accuracy, table.elbow, obstacles, table.total_time), *settings
    )


def _in_space(table: PathTask, robot: SpatialArm, obstacles: tuple[Obstacle, ...]) -> SpaceTracing:
    """The task of tracing a path in space."""
    if table.elbow != "free":
        raise InvalidProblem("elbow", "of an arm in space the search chooses among all postures; leave it out")
    return SpaceTracing(robot, table.path(), table.accuracy, table.angular_accuracy, obstacles, table.total_time)


def _refuse_poses(table: PathTask) -> None:
    if table.angular_accuracy is not None:
        raise InvalidProblem("angular_accuracy", "this robot's tool has no orientation to be kept")


BUILDERS: dict[str, Callable[[PathTask, Robot, tuple[Obstacle, ...], ModelSection], Problem[Any]]] = {
    "paper": _paper,
    "spline": _traced_in_plane,
}


def check_path(path: Path, robot: Robot, obstacles: tuple[Obstacle, ...]) -> None:
    """The model of so many points can be built in less than a minute.

    Raises:
        InvalidProblem: naming the most that is planned.
    """
    count, most = len(path.points), min(MOST_POINTS, MOST_JOINT_POINTS // robot.dof)
    if obstacles:
        most = min(most, MOST_POINT_CHECKS // len(obstacles))
    if count > most:
        reason = f"a path of {count} points is too long; at most {most} with this robot and these obstacles"
        raise InvalidProblem("count", reason)


class PointsTask(FramedPoints, PathTask):
    """The user's own points or poses: a CSV file beside the scenario file, or a list; maybe in a frame."""

    closed: bool = False
    count: Annotated[int, Range(2, MOST_POINTS)] | None = None

    def with_files(self, folder: InputFolder) -> Self:
        if not isinstance(self.points, str):
            return self
        try:
            points = read_points(folder, self.points)
        except ScenarioError as error:
            raise ScenarioError(f"task.points: {error}") from error
        return self.replaced(points=points)

    def path(self) -> Path:
        """The points as they are, or resampled to ``count``."""
        self.check_in_world()
        if isinstance(self.points, str):
            raise ScenarioError(f"task.points: {self.points!r} has not been read; only a scenario file can name a CSV")
        given = Path.through(self.points, self.closed)
        return given if self.count is None else given.resampled(self.count)


def points_table(path: Path) -> dict[str, Any]:
    """The keys of a [task] table that state points, with the tool's orientation where the path gives it.

    Raises:
        ScenarioError: its corners are others than those that its points have.
    """
    rows: FloatArray = np.hstack([path.array, np.array(path.quaternions)]) if path.quaternions else path.array
    if Path.through(rows).corners != path.corners:
        raise ScenarioError("path: its corners have to be where it turns by 45 degrees or more; say Path.through(...)")
    return {"points": rows}


class PentagramTask(PathTask):
    """The five-pointed star in one stroke, m and rad."""

    shape: Literal["pentagram"]
    center: PlanarPoint = (0.0, 0.0)
    radius: Positive
    angle: Angle = pi / 2.0
    count: Annotated[int, Range(6, MOST_POINTS)] = 50

    def path(self) -> Path:
        return pentagram(self.center, self.radius, self.angle, self.count)


class ClosedCurveTask(PathTask):
    """A smooth closed curve with waves, m and rad."""

    shape: Literal["closed-curve"]
    center: PlanarPoint = (0.0, 0.0)
    radius: Positive
    angle: Angle = 0.0
    waves: Annotated[int, Range(1, 100)] = 6
    depth: Annotated[float, Range(above=-1.0, below=1.0)] = 0.0
    count: Annotated[int, Range(4, MOST_POINTS)] = 50

    def path(self) -> Path:
        return closed_curve(self.center, self.radius, self.angle, self.waves, self.depth, self.count)
