"""The [task] and [model] tables of a scenario file: what is planned, and how it is written."""

from __future__ import annotations

from math import pi
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from problems import Ellipse, Path, PathFollowing, PlanarArm, PointToPoint, Problem, closed_curve, pentagram
from tpbso_casadi.scenario.section import Pair, Positive, ScenarioError, Section


class ModelSection(Section):
    """[model]: how the problem is written."""

    samples: int = Field(default=50, ge=2, le=10_000)
    formulation: Literal["paper", "reduced"] = "paper"
    redundancy_values: int = Field(default=5, ge=2, le=100)
    knots: int | None = Field(default=None, ge=2)
    knot_redundancy: Literal["free", "values"] = "free"


class PointToPointTask(Section):
    """[task] of a point-to-point motion: points in m, times in s."""

    kind: Literal["point-to-point"]
    start: Pair
    goal: Pair
    objective: Literal["time", "rotation", "length"] = "time"
    elbow: Literal["up", "down", "free"] = "free"
    segment_time: tuple[Positive, Positive] = (0.1, 4.0)

    def build(self, arm: PlanarArm, obstacles: tuple[Ellipse, ...], model: ModelSection) -> Problem:
        """The problem itself."""
        own = self.model_dump(exclude={"kind"})
        return PointToPoint(arm, **own, samples=model.samples, formulation=model.formulation, obstacles=obstacles)


class PathTask(Section):
    """[task] of following a path, whatever its shape: accuracy in m, times in s."""

    kind: Literal["path"]
    accuracy: Positive
    objective: Literal["time", "rotation", "length"] = "time"
    elbow: Literal["up", "down", "free"] = "free"
    total_time: tuple[Positive, Positive] | None = None

    def path(self) -> Path:
        """The points to follow."""
        raise NotImplementedError

    def build(self, arm: PlanarArm, obstacles: tuple[Ellipse, ...], model: ModelSection) -> Problem:
        """The problem itself."""
        common = self.model_dump(include={"accuracy", "objective", "elbow", "total_time"})
        return PathFollowing(arm, self.path(), **common, **model.model_dump(), obstacles=obstacles)


class PointsTask(PathTask):
    """The user's own points: a CSV file of x,y lines beside the scenario file, or a list."""

    points: str | list[Pair]
    closed: bool = False
    count: int | None = Field(default=None, ge=2)

    def path(self) -> Path:
        """The points as they are, or resampled to ``count``."""
        if isinstance(self.points, str):
            raise ScenarioError(f"task.points: {self.points!r} has not been read; only a scenario file can name a CSV")
        given = Path.through(self.points, self.closed)
        return given if self.count is None else given.resampled(self.count)


class PentagramTask(PathTask):
    """The five-pointed star in one stroke, m and rad."""

    shape: Literal["pentagram"]
    center: Pair = (0.0, 0.0)
    radius: Positive
    angle: float = pi / 2.0
    count: int = Field(default=50, ge=6)

    def path(self) -> Path:
        """The points."""
        return pentagram(self.center, self.radius, self.angle, self.count)


class ClosedCurveTask(PathTask):
    """A smooth closed curve with waves, m and rad."""

    shape: Literal["closed-curve"]
    center: Pair = (0.0, 0.0)
    radius: Positive
    angle: float = 0.0
    waves: int = Field(default=6, ge=1)
    depth: float = Field(default=0.0, gt=-1.0, lt=1.0)
    count: int = Field(default=50, ge=4)

    def path(self) -> Path:
        """The points."""
        return closed_curve(self.center, self.radius, self.angle, self.waves, self.depth, self.count)


TASKS: dict[str, type[Section]] = {
    "point-to-point": PointToPointTask,
    "points": PointsTask,
    "pentagram": PentagramTask,
    "closed-curve": ClosedCurveTask,
}


def _which_task(task: Any) -> str | None:
    """The key in ``TASKS`` of a [task] table, or of a task already built."""
    if isinstance(task, Section):
        return next(name for name, kind in TASKS.items() if type(task) is kind)
    if not isinstance(task, dict) or task.get("kind") not in ("point-to-point", "path"):
        return None
    if task["kind"] == "point-to-point":
        return "point-to-point"
    shape = task.get("shape")
    return shape if isinstance(shape, str) and shape in TASKS else ("points" if shape is None else None)


AnyTask = Annotated[
    Annotated[PointToPointTask, Tag("point-to-point")]
    | Annotated[PointsTask, Tag("points")]
    | Annotated[PentagramTask, Tag("pentagram")]
    | Annotated[ClosedCurveTask, Tag("closed-curve")],
    Discriminator(
        _which_task,
        custom_error_type="task_kind",
        custom_error_message="needs kind = 'point-to-point', or kind = 'path' with points, "
        "shape = 'pentagram' or shape = 'closed-curve'",
    ),
]
