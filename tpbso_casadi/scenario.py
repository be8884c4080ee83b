"""The scenario file: what a user states, checked key by key.

Every error is a :class:`ScenarioError` of one line that names the file, the key and the reason.
"""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Iterable
from math import isfinite, pi
import pathlib
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError

from problems import (
    Ellipse,
    InvalidProblem,
    Path,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Problem,
    closed_curve,
    pentagram,
)
from solvers import Budget, Solver, find_solver

Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]

DEFAULT_EVALUATIONS = 30_000  # the paper-sized swarm: 50 beetles, 200 iterations, 3 evaluations each


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


class Section(BaseModel):
    """A table of the file: unknown keys and NaN or infinite numbers are errors, types are not guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ArmSection(Section):
    """[arm]: lengths in m, limits in rad/s and rad/s^2, as one number or one a joint; joint ranges in rad."""

    link_lengths: list[Positive] = Field(min_length=2)
    max_speed: Positive | list[Positive]
    max_acceleration: Positive | list[Positive]
    joint_limits: list[Pair] | None = None

    def with_links(self, links: int) -> Self:
        """The same reach and limits with another number of equal links."""
        return self.model_copy(update={"link_lengths": [sum(self.link_lengths) / links] * links})

    def build(self) -> PlanarArm:
        """The arm itself."""
        joints = len(self.link_lengths)
        limits = [
            tuple(value) if isinstance(value, list) else (value,) * joints
            for value in (self.max_speed, self.max_acceleration)
        ]
        ranges = None if self.joint_limits is None else tuple(self.joint_limits)
        return PlanarArm(tuple(self.link_lengths), limits[0], limits[1], ranges)


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
        common = {"samples": model.samples, "formulation": model.formulation, "obstacles": obstacles}
        return PointToPoint(arm, **self.model_dump(exclude={"kind"}), **common)


class PathTask(Section):
    """[task] of following a path, whatever its shape: accuracy in m, times in s."""

    kind: Literal["path"]
    accuracy: Positive
    objective: Literal["time", "rotation", "length"] = "time"
    elbow: Literal["up", "down", "free"] = "free"
    total_time: tuple[Positive, Positive] = (0.1, 10.0)

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


class ObstacleSection(Section):
    """[[obstacles]]: an ellipse, m and rad."""

    center: Pair
    semi_axes: tuple[Positive, Positive]
    angle: float = 0.0

    def build(self) -> Ellipse:
        """The obstacle itself."""
        return Ellipse(self.center, self.semi_axes, self.angle)


class ModelSection(Section):
    """[model]: how the problem is written."""

    samples: int = Field(default=50, ge=2, le=10_000)
    formulation: Literal["paper", "reduced"] = "paper"
    redundancy_values: int = Field(default=5, ge=2, le=100)
    knots: int | None = Field(default=None, ge=2)


class SolverSection(Section):
    """[solver]: which search, how long, from which seed; the command line overrides."""

    name: str = "bso"
    population: int | None = None
    iterations: int | None = Field(default=None, gt=0)
    evaluations: int | None = Field(default=None, gt=0)
    time_limit: Positive | None = None
    seed: int = Field(default=1, ge=0)
    settings: dict[str, float | str] = Field(default_factory=dict)

    def build(self) -> Solver:
        """The solver with its settings.

        Raises:
            ScenarioError: an unknown solver or setting, or one out of its range.
        """
        settings: dict[str, Any] = dict(self.settings)
        if self.population is not None:
            settings["population"] = self.population
        try:
            kind = find_solver(self.name)
        except ValueError as error:
            raise ScenarioError(f"solver.name: {error}") from error
        known = list(getattr(kind, "__dataclass_fields__", {}))
        for key in settings:
            if known and key not in known:
                raise ScenarioError(f"solver.settings.{key}: {self.name} has no such setting{_hint(key, known)}")
        try:
            return kind(**settings)
        except (TypeError, ValueError) as error:
            raise ScenarioError(f"solver.settings: {error}") from error

    def budget(self) -> Budget:
        """How long to search; 30,000 evaluations unless something is said."""
        evaluations = self.evaluations
        if evaluations is None and self.iterations is None and self.time_limit is None:
            evaluations = DEFAULT_EVALUATIONS
        return Budget(evaluations, self.iterations, self.time_limit)


class Scenario(Section):
    """A whole scenario file."""

    arm: ArmSection
    task: AnyTask = Field()
    obstacles: list[ObstacleSection] = Field(default_factory=list)
    model: ModelSection = ModelSection()
    solver: SolverSection = SolverSection()

    def problem(self) -> Problem:
        """The problem itself.

        Raises:
            ScenarioError: the arm cannot do the task.
        """
        sections = {"link_lengths": "arm.", "obstacles": "", "samples": "model.", "knots": "model."}
        try:
            obstacles = tuple(obstacle.build() for obstacle in self.obstacles)
            arm = self.arm.build()
        except InvalidProblem as error:
            raise ScenarioError(f"arm.{error.field}: {error.reason}") from error
        try:
            return self.task.build(arm, obstacles, self.model)
        except InvalidProblem as error:
            raise ScenarioError(f"{sections.get(error.field, 'task.')}{error.field}: {error.reason}") from error


def read_scenario(path: pathlib.Path) -> Scenario:
    """Read and check a scenario file.

    Raises:
        ScenarioError: unreadable, not TOML, or not a scenario.
    """
    text = _text(path)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from error
    try:
        return _with_points(parse_scenario(content), path.parent)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _with_points(scenario: Scenario, folder: pathlib.Path) -> Scenario:
    """The scenario with the points of its CSV file in it, so that it is complete."""
    task = scenario.task
    if not (isinstance(task, PointsTask) and isinstance(task.points, str)):
        return scenario
    points = read_points(folder / task.points)
    return scenario.model_copy(update={"task": task.model_copy(update={"points": points})})


def read_points(path: pathlib.Path) -> list[Pair]:
    """The points of a CSV file: x,y in m, one a line; a first line ``x,y`` and empty lines are skipped.

    Raises:
        ScenarioError: naming the file and the line.
    """
    points: list[Pair] = []
    for number, line in enumerate(_text(path).splitlines(), start=1):
        if not line.strip() or (number == 1 and line.replace(" ", "").lower() == "x,y"):
            continue
        try:
            x, y = (float(cell) for cell in line.split(","))
        except ValueError as error:
            raise ScenarioError(f"task.points: {path} line {number}: {line.strip()!r} is not x,y") from error
        if not (isfinite(x) and isfinite(y)):
            raise ScenarioError(f"task.points: {path} line {number}: {line.strip()!r} is not finite")
        points.append((x, y))
    return points


def _text(path: pathlib.Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not a text file: {error.reason} at byte {error.start}") from error


def parse_scenario(content: dict[str, Any]) -> Scenario:
    """Check the content of a scenario.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    try:
        return Scenario.model_validate_json(json.dumps(content, default=str), strict=True)
    except ValidationError as error:
        raise ScenarioError(_first_line(error)) from error


def _first_line(error: ValidationError) -> str:
    """The first of pydantic's errors, as ``key: reason``; its names of union members are left out of the key."""
    first = error.errors(include_url=False)[0]
    location, kind = first["loc"], first["type"]
    unknown = str(location[-1]) if kind == "extra_forbidden" else None
    key = ".".join(str(part) for part in location if isinstance(part, int) or part in KEYS or part == unknown)
    if unknown is not None:
        return f"{key}: unknown key{_hint(unknown, _siblings(location))}"
    if kind == "missing":
        return f"{key}: missing key"
    reason = first["msg"][0].lower() + first["msg"][1:]
    if kind == "task_kind":
        return f"{key}: {reason}"
    shown = repr(first["input"])
    return f"{key}: {reason}, not {shown if len(shown) <= 60 else shown[:57] + '...'}"


SECTIONS: dict[str, type[Section]] = {
    "arm": ArmSection,
    "obstacles": ObstacleSection,
    "model": ModelSection,
    "solver": SolverSection,
}
KEYS = {key for section in (Scenario, *SECTIONS.values(), *TASKS.values()) for key in section.model_fields}


def _siblings(location: tuple[int | str, ...]) -> Iterable[str]:
    """The keys that are known where an unknown one was found."""
    if len(location) == 1:
        return list(Scenario.model_fields)
    section = TASKS[str(location[1])] if location[0] == "task" else SECTIONS[str(location[0])]
    return list(section.model_fields)


def _hint(word: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean {near[0]}?" if near else ""
