"""The [task] and [model] tables of a scenario file: the kinds of tasks, and the form of the model."""

from __future__ import annotations

import json
import pathlib
from math import pi
from typing import Annotated, Any, Literal, Self

from pydantic import Field, PlainValidator, SerializeAsAny, ValidationError
from pydantic_core import PydanticCustomError

from problems import (
    Limit,
    Path,
    PathFollowing,
    PointToPoint,
    Problem,
    Robot,
    closed_curve,
    path_following,
    pentagram,
    point_to_point,
)
from problems.encodings import FORMULATIONS
from problems.scene.obstacle import Obstacle
from problems.tasks.elbow import Elbow
from problems.tasks.path_following import KnotRedundancy
from tpbso_casadi.plugins import Catalogue, PluginError, subclass_of
from tpbso_casadi.scenario.catalogues import LIMIT_CATALOGUE, OBJECTIVE_CATALOGUE, find_objective
from tpbso_casadi.scenario.points import read_points
from tpbso_casadi.scenario.section import PlanarPoint, Positive, ScenarioError, Section
from tpbso_casadi.scenario.validation import NestedError, choice_of, describe, hint, in_words

ObjectiveName = Annotated[str, choice_of(OBJECTIVE_CATALOGUE.registry, OBJECTIVE_CATALOGUE.find)]
LimitName = Annotated[str, choice_of(LIMIT_CATALOGUE.registry, LIMIT_CATALOGUE.find)]
Formulation = Annotated[str, choice_of(FORMULATIONS)]


class ModelSection(Section):
    """[model]: the form of the model."""

    samples: int = Field(default=50, ge=2, le=10_000)
    formulation: Formulation = "paper"
    redundancy_values: int = Field(default=5, ge=2, le=100)
    knots: int | None = Field(default=None, ge=2)
    knot_redundancy: KnotRedundancy = "free"
    limits: list[LimitName] = Field(default_factory=list)

    @property
    def further_limits(self) -> list[type[Limit]]:
        """Kinds of limits that hold besides those of the robot and of the obstacles."""
        return [LIMIT_CATALOGUE.find(name) for name in self.limits]


class TaskSection(Section):
    """[task]: the interface of every kind of task."""

    kind: str

    def with_files(self, folder: pathlib.Path) -> Self:
        """The same task with the content of the files that it names, which lie in ``folder``.

        Raises:
            ScenarioError: a file cannot be read.
        """
        return self

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        """The problem itself.

        Raises:
            InvalidProblem: the robot cannot do the task.
        """
        raise NotImplementedError


class PointToPointTask(TaskSection):
    """[task] of a point-to-point motion: points in m, times in s."""

    kind: Literal["point-to-point"]
    start: PlanarPoint
    goal: PlanarPoint
    objective: ObjectiveName = "time"
    elbow: Elbow = "free"
    segment_time: tuple[Positive, Positive] = (0.1, 4.0)

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        """The problem itself."""
        task = PointToPoint(robot, self.start, self.goal, self.elbow, obstacles, self.segment_time)
        objective = find_objective(self.objective)
        return point_to_point(task, objective, model.formulation, model.samples, model.further_limits)


class PathTask(TaskSection):
    """[task] of following a path of any shape: accuracy in m, times in s."""

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
        task = PathFollowing(
            robot,
            self.path(),
            self.accuracy,
            elbow=self.elbow,
            obstacles=obstacles,
            knots=model.knots,
            total_time=self.total_time,
            knot_redundancy=model.knot_redundancy,
        )
        return path_following(
            task,
            find_objective(self.objective),
            model.formulation,
            model.samples,
            model.redundancy_values,
            model.further_limits,
        )


class PointsTask(PathTask):
    """The user's own points: a CSV file of x,y lines beside the scenario file, or a list."""

    points: str | list[PlanarPoint]
    closed: bool = False
    count: int | None = Field(default=None, ge=2)

    def with_files(self, folder: pathlib.Path) -> Self:
        """The same with the points of its CSV file, if it names one."""
        if not isinstance(self.points, str):
            return self
        try:
            points = read_points(folder / self.points)
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
    angle: float = pi / 2.0
    count: int = Field(default=50, ge=6)

    def path(self) -> Path:
        """The points."""
        return pentagram(self.center, self.radius, self.angle, self.count)


class ClosedCurveTask(PathTask):
    """A smooth closed curve with waves, m and rad."""

    shape: Literal["closed-curve"]
    center: PlanarPoint = (0.0, 0.0)
    radius: Positive
    angle: float = 0.0
    waves: int = Field(default=6, ge=1)
    depth: float = Field(default=0.0, gt=-1.0, lt=1.0)
    count: int = Field(default=50, ge=4)

    def path(self) -> Path:
        """The points."""
        return closed_curve(self.center, self.radius, self.angle, self.waves, self.depth, self.count)


TASKS: dict[str, type[TaskSection]] = {  # by kind, or by kind/shape
    "point-to-point": PointToPointTask,
    "path": PointsTask,
    "path/pentagram": PentagramTask,
    "path/closed-curve": ClosedCurveTask,
}


TASK_CATALOGUE: Catalogue[type[TaskSection]] = Catalogue(
    kind="task",
    group="tpbso_casadi.tasks",
    registry=TASKS,
    accepts=subclass_of(TaskSection),
    requirement="a subclass of tpbso_casadi.scenario.tasks.TaskSection",
)


def _is_plugin(name: str) -> bool:
    """Whether a kind of task is offered by a plug-in, or is a path to its class."""
    return ":" in name or name in TASK_CATALOGUE.names()


def read_task(table: Any) -> TaskSection:
    """The section of a [task] table, whose kind and shape say which of ``TASKS`` it is."""
    if isinstance(table, TaskSection):
        return table
    named = [table.get(key) for key in ("kind", "shape")] if isinstance(table, dict) else [None]
    name = "/".join(str(part) for part in named if part is not None)
    if name not in TASKS and not _is_plugin(name):
        shapes = (task.partition("/") for task in TASKS)
        options = [f"kind = {kind!r}" + (f" with shape = {shape!r}" if shape else "") for kind, _, shape in shapes]
        raise PydanticCustomError("unknown_task", f"needs {in_words(options)}{hint(name, TASKS)}")
    try:
        section = TASK_CATALOGUE.find(name)
    except PluginError as error:
        raise PydanticCustomError("unknown_task", str(error).replace("{", "{{").replace("}", "}}")) from error
    try:
        return section.model_validate_json(json.dumps(table, default=str), strict=True)
    except ValidationError as error:
        raise NestedError(describe(error, section, table)) from error


AnyTask = Annotated[SerializeAsAny[TaskSection], PlainValidator(read_task)]
