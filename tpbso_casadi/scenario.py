"""The scenario file: what a user states, checked key by key.

Every error is a :class:`ScenarioError` of one line that names the file, the key and the reason.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from problems import Ellipse, InvalidProblem, PlanarArm, PointToPoint, Problem
from solvers import Budget, Solver, find_solver

Positive = Annotated[float, Field(gt=0)]
Pair = tuple[float, float]

DEFAULT_EVALUATIONS = 30_000  # the paper-sized swarm: 50 beetles, 200 iterations, 3 evaluations each


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


class Section(BaseModel):
    """A table of the file: unknown keys and NaN or infinite numbers are errors, types are not guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=False)


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


class TaskSection(Section):
    """[task] of a point-to-point motion: points in m, times in s."""

    kind: Literal["point-to-point"]
    start: Pair
    goal: Pair
    objective: Literal["time", "rotation", "length"] = "time"
    elbow: Literal["up", "down", "free"] = "free"
    segment_time: tuple[Positive, Positive] = (0.1, 4.0)


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
    task: TaskSection
    obstacles: list[ObstacleSection] = Field(default_factory=list)
    model: ModelSection = ModelSection()
    solver: SolverSection = SolverSection()

    def problem(self) -> Problem:
        """The problem itself.

        Raises:
            ScenarioError: the arm cannot do the task.
        """
        sections = {"arm": "arm.", "obstacles": "", "samples": "model.", "formulation": "model."}
        try:
            obstacles = tuple(obstacle.build() for obstacle in self.obstacles)
            arm = self.arm.build()
        except InvalidProblem as error:
            raise ScenarioError(f"arm.{error.field}: {error.reason}") from error
        task = self.task.model_dump(exclude={"kind"})
        try:
            return PointToPoint(arm, **task, **self.model.model_dump(), obstacles=obstacles)
        except InvalidProblem as error:
            raise ScenarioError(f"{sections.get(error.field, 'task.')}{error.field}: {error.reason}") from error


def read_scenario(path: Path) -> Scenario:
    """Read and check a scenario file.

    Raises:
        ScenarioError: unreadable, not TOML, or not a scenario.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not a text file: {error.reason} at byte {error.start}") from error
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from error
    try:
        return parse_scenario(content)
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error


def parse_scenario(content: dict[str, Any]) -> Scenario:
    """Check the content of a scenario.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    try:
        return Scenario.model_validate(content)
    except ValidationError as error:
        raise ScenarioError(_first_line(error)) from error


def _first_line(error: ValidationError) -> str:
    """The most telling of pydantic's errors, as ``key: reason``."""
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"] if part not in ("float", "int", "str", "list[constrained-float]"))
    if first["type"] == "extra_forbidden":
        return f"{key}: unknown key{_hint(str(first['loc'][-1]), _siblings(first['loc']))}"
    if first["type"] == "missing":
        return f"{key}: missing key"
    reason = first["msg"][0].lower() + first["msg"][1:]
    shown = repr(first["input"])
    return f"{key}: {reason}, not {shown if len(shown) <= 60 else shown[:57] + '...'}"


def _siblings(location: tuple[int | str, ...]) -> Iterable[str]:
    """The keys that are known where an unknown one was found."""
    section: Any = Scenario
    tables = {"arm": ArmSection, "task": TaskSection, "model": ModelSection}
    tables |= {"solver": SolverSection, "obstacles": ObstacleSection}
    if len(location) > 1:
        section = tables.get(str(location[0]), Scenario)
    return list(section.model_fields)


def _hint(word: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean {near[0]}?" if near else ""
