"""The [task] tables of paths to follow: the user's own points, and the built-in shapes."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Discriminator, Field, Tag

from problems import InvalidProblem, Path, PathFollowing, Problem, Robot, closed_curve, path_following, pentagram
from problems.assembly.paths.space_tracing import space_tracing
from problems.assembly.tracing import tracing
from problems.robots.spatial.spatial_arm import SpatialArm
from problems.scene.obstacle import Obstacle
from problems.tasks.elbow import Elbow
from problems.tasks.paths.path_tracing import PathTracing
from problems.tasks.paths.space_tracing import SpaceTracing
from tpbso_casadi.scenario.catalogues import find_objective
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import (
    ANGULAR,
    MOST_JOINT_POINTS,
    MOST_POINT_CHECKS,
    MOST_POINTS,
    Angle,
    PlanarPoint,
    Positive,
    ScenarioError,
)
from tpbso_casadi.scenario.task import ModelSection, ObjectiveChoice, OwnObjectives, TaskSection
from tpbso_casadi.scenario.tasks.path_points import PathPoints, read_points


class PathTask(TaskSection):
    """[task] of following a path of any shape: accuracy in m, that of the tool's orientation in rad, times in s."""

    motions: ClassVar[tuple[str, ...]] = ("spline", "paper")

    kind: Literal["path"]
    accuracy: Positive
    angular_accuracy: Annotated[Positive | None, ANGULAR] = None
    objectives: OwnObjectives = Field(default_factory=list)
    objective: ObjectiveChoice = "time"
    elbow: Elbow = "free"
    total_time: tuple[Positive, Positive] | None = None

    def path(self) -> Path:
        """The points to follow."""
        raise NotImplementedError

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        """The problem itself."""
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


def _spline(table: PathTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
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
    """The same in space."""
    if table.elbow != "free":
        raise InvalidProblem("elbow", "of an arm in space the search chooses among all postures; leave it out")
    return SpaceTracing(robot, table.path(), table.accuracy, table.angular_accuracy, obstacles, table.total_time)


def _refuse_poses(table: PathTask) -> None:
    if table.angular_accuracy is not None:
        raise InvalidProblem("angular_accuracy", "this robot's tool has no orientation to be kept")


BUILDERS: dict[str, Callable[[PathTask, Robot, tuple[Obstacle, ...], ModelSection], Problem[Any]]] = {
    "paper": _paper,
    "spline": _spline,
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


def _kind_of_points(value: Any) -> str:
    return "file" if isinstance(value, str) else "list"


class PointsTask(PathTask):
    """The user's own points or poses: a CSV file beside the scenario file, or a list."""

    points: Annotated[Annotated[str, Tag("file")] | Annotated[PathPoints, Tag("list")], Discriminator(_kind_of_points)]
    closed: bool = False
    count: int | None = Field(default=None, ge=2, le=MOST_POINTS)

    def with_files(self, folder: InputFolder) -> Self:
        """The same with the points of its CSV file, if it names one."""
        if not isinstance(self.points, str):
            return self
        try:
            points = read_points(folder, self.points)
        except ScenarioError as error:
            raise ScenarioError(f"task.points: {error}") from error
        return self.model_copy(update={"points": points})

    def path(self) -> Path:
        """The points as they are, or resampled to ``count``."""
        if isinstance(self.points, str):
            raise ScenarioError(f"task.points: {self.points!r} has not been read; only a scenario file can name a CSV")
        given = Path.through(self.points, self.closed)
        return given if self.count is None else given.resampled(self.count)


class PentagramTask(PathTask):
    """The five-pointed star in one stroke, m and rad."""

    shape: Literal["pentagram"]
    center: PlanarPoint = (0.0, 0.0)
    radius: Positive
    angle: Angle = pi / 2.0
    count: int = Field(default=50, ge=6, le=MOST_POINTS)

    def path(self) -> Path:
        """The points."""
        return pentagram(self.center, self.radius, self.angle, self.count)


class ClosedCurveTask(PathTask):
    """A smooth closed curve with waves, m and rad."""

    shape: Literal["closed-curve"]
    center: PlanarPoint = (0.0, 0.0)
    radius: Positive
    angle: Angle = 0.0
    waves: int = Field(default=6, ge=1, le=100)
    depth: float = Field(default=0.0, gt=-1.0, lt=1.0)
    count: int = Field(default=50, ge=4, le=MOST_POINTS)

    def path(self) -> Path:
        """The points."""
        return closed_curve(self.center, self.radius, self.angle, self.waves, self.depth, self.count)
