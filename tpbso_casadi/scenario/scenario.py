"""The scenario file: what a user states, checked key by key.

Every error is a :class:`ScenarioError` of one line that names the file, the key and the reason.
"""

from __future__ import annotations

import difflib
import json
import pathlib
import tomllib
from collections.abc import Iterable
from math import isfinite
from typing import Any, Self

from pydantic import Field, ValidationError

from problems import Ellipse, InvalidProblem, PlanarArm, Problem
from solvers import IPOPT, Budget, Solver, find_solver
from tpbso_casadi.scenario.section import Pair, Positive, ScenarioError, Section
from tpbso_casadi.scenario.tasks import TASKS, AnyTask, ModelSection, PointsTask

DEFAULT_EVALUATIONS = 30_000  # the paper-sized swarm: 50 beetles, 200 iterations, 3 evaluations each
DEFAULT_STARTS = 20
NEEDED: dict[type, tuple[type | tuple[type, ...], str]] = {  # of a setting, by the type of its default
    int: (int, "a whole number"),
    float: ((int, float), "a number"),
    str: (str, "a word"),
}


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


class ObstacleSection(Section):
    """[[obstacles]]: an ellipse, m and rad."""

    center: Pair
    semi_axes: tuple[Positive, Positive]
    angle: float = 0.0

    def build(self) -> Ellipse:
        """The obstacle itself."""
        return Ellipse(self.center, self.semi_axes, self.angle)


class SolverSection(Section):
    """[solver]: which search, how long, from which seed; the command line overrides."""

    name: str = "bso"
    population: int | None = None
    iterations: int | None = Field(default=None, gt=0)
    evaluations: int | None = Field(default=None, gt=0)
    time_limit: Positive | None = None
    within: Positive | None = None
    seed: int = Field(default=1, ge=0)
    polish_starts: int = Field(default=0, ge=0)
    settings: dict[str, int | float | str] = Field(default_factory=dict)

    def build(self) -> Solver | IPOPT:
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
        if kind is IPOPT and self.polish_starts:
            raise ScenarioError("solver.polish_starts: ipopt has nothing to polish, it descends by itself")
        if kind is IPOPT and self.within is not None:
            raise ScenarioError("solver.within: ipopt starts again and again by itself; say time_limit")
        if self.within is not None and self.time_limit is not None:
            raise ScenarioError("solver.within: has a time limit of its own; leave time_limit out")
        known = list(getattr(kind, "__dataclass_fields__", {}))
        for key, value in settings.items():
            if known and key not in known:
                raise ScenarioError(f"solver.settings.{key}: {self.name} has no such setting{_hint(key, known)}")
            needed, what = NEEDED.get(type(getattr(kind, key, None)), (object, ""))
            if not isinstance(value, needed):
                raise ScenarioError(f"solver.settings.{key}: {what} is needed, not {value!r}")
        try:
            return kind(**settings)
        except (TypeError, ValueError) as error:
            raise ScenarioError(f"solver.settings: {error}") from error

    def budget(self) -> Budget:
        """How long to search; 30,000 evaluations, or 20 starts of ipopt, unless something is said."""
        if self.evaluations is not None or self.iterations is not None or self.time_limit is not None:
            return Budget(self.evaluations, self.iterations, self.time_limit)
        return Budget(iterations=DEFAULT_STARTS) if self.name == "ipopt" else Budget(DEFAULT_EVALUATIONS)


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
        sections = {
            "link_lengths": "arm.",
            "joint_limits": "arm.",
            "obstacles": "",
            "samples": "model.",
            "knots": "model.",
            "knot_redundancy": "model.",
        }
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
    path = folder / task.points
    try:
        points = read_points(path)
    except ScenarioError as error:
        raise ScenarioError(f"task.points: {error}") from error
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
            raise ScenarioError(f"{path} line {number}: {line.strip()!r} is not x,y") from error
        if not (isfinite(x) and isfinite(y)):
            raise ScenarioError(f"{path} line {number}: {line.strip()!r} is not finite")
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
    named = location[:1] + location[2:] if location[0] == "task" else location  # the second is which task it is
    key = ".".join(str(part) for part in named if isinstance(part, int) or part in KEYS or part == unknown)
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
ALL_SECTIONS: list[type[Section]] = [Scenario, *SECTIONS.values(), *TASKS.values()]
KEYS = {key for section in ALL_SECTIONS for key in section.model_fields}


def _siblings(location: tuple[int | str, ...]) -> Iterable[str]:
    """The keys that are known where an unknown one was found."""
    if len(location) == 1:
        return list(Scenario.model_fields)
    section = TASKS[str(location[1])] if location[0] == "task" else SECTIONS[str(location[0])]
    return list(section.model_fields)


def _hint(word: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(word, list(known), n=1)
    return f"; did you mean {near[0]}?" if near else ""
