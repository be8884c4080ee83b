"""The [task] tables of paths to follow: the user's own points, and the built-in shapes."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from problems import InvalidProblem, Path, PathFollowing, Problem, Robot, closed_curve, path_following, pentagram
from problems.assembly.tracing import tracing
from problems.scene.obstacle import Obstacle
from problems.tasks.elbow import Elbow
from problems.tasks.paths.path_tracing import PathTracing
from tpbso_casadi.scenario.catalogues import find_objective
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import (
    LARGEST,
    MOST_GIVEN_POINTS,
    MOST_JOINT_POINTS,
    MOST_POINT_CHECKS,
    MOST_POINTS,
    Angle,
    PlanarPoint,
    Positive,
    ScenarioError,
)
from tpbso_casadi.scenario.task import ModelSection, ObjectiveName, TaskSection


class PathTask(TaskSection):
    """[task] of following a path of any shape: accuracy in m, times in s."""

    motions: ClassVar[tuple[str, ...]] = ("spline", "paper")

    kind: Literal["path"]
    accuracy: Positive
    objective: ObjectiveName = "time"
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
        find_objective(table.objective),
        model.formulation,
        model.samples,
        model.redundancy_values,
        model.further_limits,
    )


def _spline(table: PathTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
    """Ours: the tool stays near the whole path and passes its points when it suits."""
    if model.pieces is not None:
        raise InvalidProblem("pieces", "the points of a path decide about its pieces")
    task = PathTracing(robot, table.path(), table.accuracy, table.elbow, obstacles, table.total_time)
    return tracing(task, find_objective(table.objective), model.samples, model.redundancy_values, model.further_limits)


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


class PointsTask(PathTask):
    """The user's own points: a CSV file of x,y lines beside the scenario file, or a list."""

    points: str | Annotated[list[PlanarPoint], Field(max_length=MOST_GIVEN_POINTS)]
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


def read_points(folder: InputFolder, name: str) -> list[PlanarPoint]:
    """The points of a CSV file: x,y in m, one a line; a first line ``x,y`` and empty lines are skipped.

    Raises:
        ScenarioError: naming the file and the line, not what it says: the file may be none of the user's.
    """
    points: list[PlanarPoint] = []
    for number, line in enumerate(folder.read_text(name).splitlines(), start=1):
        if not line.strip() or (number == 1 and line.replace(" ", "").lower() == "x,y"):
            continue
        place = f"{folder.path / name} line {number}"
        try:
            x, y = (float(cell) for cell in line.split(","))
        except ValueError as error:
            raise ScenarioError(f"{place}: two numbers x,y are needed") from error
        if not (abs(x) <= LARGEST and abs(y) <= LARGEST):
            raise ScenarioError(f"{place}: a number is not finite, or larger than {LARGEST:g}")
        if len(points) == MOST_GIVEN_POINTS:
            raise ScenarioError(f"{place}: more than {MOST_GIVEN_POINTS} points")
        points.append((x, y))
    return points
