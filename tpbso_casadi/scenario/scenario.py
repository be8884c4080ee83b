"""The scenario file: robot, task, limits and solver, validated key by key.

Every error is a :class:`ScenarioError` of one line that names the file, the key and the reason.
"""

from __future__ import annotations

import json
import pathlib
import tomllib
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

from pydantic import Field, ValidationError, model_validator

from problems import Ellipse, InvalidProblem, PlanarArm, Problem, Robot
from solvers import AnySolver, Budget
from tpbso_casadi.plugins import PluginError
from tpbso_casadi.scenario.catalogues import LIMIT_CATALOGUE, OBJECTIVE_CATALOGUE, ROBOT_CATALOGUE
from tpbso_casadi.scenario.points import read_text
from tpbso_casadi.scenario.section import Interval, PlanarPoint, Positive, ScenarioError, Section
from tpbso_casadi.scenario.solvers import SOLVER_CATALOGUE, find_solver
from tpbso_casadi.scenario.tasks import TASKS, AnyTask, ModelSection
from tpbso_casadi.scenario.validation import describe, hint

NEEDED: dict[type, tuple[type | tuple[type, ...], str]] = {  # of a setting, by the type of its default
    int: (int, "a whole number"),
    float: ((int, float), "a number"),
    str: (str, "a word"),
}


class ArmSection(Section):
    """[arm]: lengths in m, limits in rad/s and rad/s^2, as one number or one per joint; joint ranges in rad."""

    link_lengths: list[Positive] = Field(min_length=2)
    max_speed: Positive | list[Positive]
    max_acceleration: Positive | list[Positive]
    joint_limits: list[Interval] | None = None

    def with_links(self, links: int) -> Self:
        """The same reach and limits with another number of equal links."""
        return self.model_copy(update={"link_lengths": [sum(self.link_lengths) / links] * links})

    def build(self) -> PlanarArm:
        """The robot arm itself."""
        joints = len(self.link_lengths)
        limits = [
            tuple(value) if isinstance(value, list) else (value,) * joints
            for value in (self.max_speed, self.max_acceleration)
        ]
        ranges = None if self.joint_limits is None else tuple(self.joint_limits)
        return PlanarArm(tuple(self.link_lengths), limits[0], limits[1], ranges)


class RobotSection(Section):
    """[robot]: a robot by the name of its kind, and the values of its fields."""

    model: str
    settings: dict[str, Any] = Field(default_factory=dict)

    def build(self) -> Robot:
        """The robot itself.

        Raises:
            InvalidProblem: it cannot be.
            ScenarioError: there is no such kind of robot.
        """
        try:
            kind = ROBOT_CATALOGUE.find(self.model)
        except PluginError as error:
            raise ScenarioError(f"robot.model: {error}") from error
        return kind.from_settings(self.settings)


class ObstacleSection(Section):
    """[[obstacles]]: an ellipse, m and rad."""

    center: PlanarPoint
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

    def kind(self) -> type[AnySolver]:
        """The class of the solver.

        Raises:
            ScenarioError: an unknown solver.
        """
        try:
            return find_solver(self.name)
        except ValueError as error:
            raise ScenarioError(f"solver.name: {error}") from error

    def build(self) -> AnySolver:
        """The solver with its settings.

        Raises:
            ScenarioError: an unknown solver or setting, or one out of its range.
        """
        settings: dict[str, Any] = dict(self.settings)
        if self.population is not None:
            settings["population"] = self.population
        kind = self.kind()
        if kind.solves_program and self.polish_starts:
            raise ScenarioError(f"solver.polish_starts: {self.name} has nothing to polish, it descends by itself")
        if kind.solves_program and self.within is not None:
            raise ScenarioError(f"solver.within: {self.name} starts again and again by itself; say time_limit")
        if self.within is not None and self.time_limit is not None:
            raise ScenarioError("solver.within: has a time limit of its own; leave time_limit out")
        known = list(getattr(kind, "__dataclass_fields__", {}))
        for key, value in settings.items():
            if known and key not in known:
                raise ScenarioError(f"solver.settings.{key}: {self.name} has no such setting{hint(key, known)}")
            needed, what = NEEDED.get(type(getattr(kind, key, None)), (object, ""))
            if not isinstance(value, needed):
                raise ScenarioError(f"solver.settings.{key}: {what} is needed, not {value!r}")
        try:
            return kind(**settings)
        except (TypeError, ValueError) as error:
            raise ScenarioError(f"solver.settings: {error}") from error

    def budget(self) -> Budget:
        """How long to search; the solver's default budget unless a limit is stated."""
        if self.evaluations is not None or self.iterations is not None or self.time_limit is not None:
            return Budget(self.evaluations, self.iterations, self.time_limit)
        return self.kind().default_budget


class Scenario(Section):
    """A whole scenario file."""

    arm: ArmSection | None = None
    robot: RobotSection | None = None
    task: AnyTask
    obstacles: list[ObstacleSection] = Field(default_factory=list)
    model: ModelSection = ModelSection()
    solver: SolverSection = SolverSection()

    @property
    def plugins(self) -> list[str]:
        """What of it is not ours: names of plug-ins, which may raise anything."""
        named = [self.task.kind, getattr(self.task, "objective", ""), *self.model.limits, self.solver.name]
        named += [] if self.robot is None else [self.robot.model]
        ours = {*TASKS, *OBJECTIVE_CATALOGUE.registry, *LIMIT_CATALOGUE.registry, *ROBOT_CATALOGUE.registry}
        return [name for name in named if name and name not in ours | {"path", *SOLVER_CATALOGUE.registry}]

    @model_validator(mode="after")
    def _one_robot(self) -> Self:
        if self.arm is None and self.robot is None:
            raise ValueError("arm: missing key")
        if self.arm is not None and self.robot is not None:
            raise ValueError("robot: the robot is stated twice, as [arm] and as [robot]")
        return self

    def problem(self) -> Problem[Any]:
        """The problem itself.

        Raises:
            ScenarioError: the robot cannot do the task.
        """
        robot_table = "arm." if self.robot is None else "robot.settings."
        try:
            obstacles = tuple(obstacle.build() for obstacle in self.obstacles)
            robot = (self.arm or self.robot).build()  # type: ignore[union-attr]
        except InvalidProblem as error:
            raise ScenarioError(f"{robot_table}{error.field}: {error.reason}") from error
        tables = {"link_lengths": robot_table, "joint_limits": robot_table, "obstacles": ""}
        tables |= dict.fromkeys(("samples", "knots", "knot_redundancy", "formulation", "limits"), "model.")
        try:
            return self.task.build(robot, obstacles, self.model)
        except InvalidProblem as error:
            raise ScenarioError(f"{tables.get(error.field, 'task.')}{error.field}: {error.reason}") from error


@contextmanager
def plugin_failures_named(scenario: Scenario, *known: type[Exception]) -> Iterator[None]:
    """Turn whatever a scenario's plug-ins raise into one line.

    Args:
        scenario: whose plug-ins run in this context.
        known: errors of ours, which pass, as do those of the operating system.

    Raises:
        ScenarioError: naming the plug-ins and what was raised; exceptions of scenarios without plug-ins pass.
    """
    try:
        yield
    except Exception as error:
        if not scenario.plugins or isinstance(error, (ScenarioError, OSError, *known)):
            raise
        where = traceback.extract_tb(error.__traceback__)[-1]
        line = f"{type(error).__name__}: {error} ({pathlib.Path(where.filename).name}:{where.lineno})"
        raise ScenarioError(f"plug-ins ({', '.join(scenario.plugins)}) failed: {' '.join(line.split())}") from error


def read_scenario(path: pathlib.Path) -> Scenario:
    """Read and check a scenario file.

    Raises:
        ScenarioError: unreadable, not TOML, or not a scenario.
    """
    text = read_text(path)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from error
    try:
        scenario = parse_scenario(content)
        return scenario.model_copy(update={"task": scenario.task.with_files(path.parent)})
    except ScenarioError as error:
        raise ScenarioError(f"{path}: {error}") from error


def parse_scenario(content: dict[str, Any]) -> Scenario:
    """Check the content of a scenario.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    try:
        return Scenario.model_validate_json(json.dumps(content, default=str), strict=True)
    except ValidationError as error:
        raise ScenarioError(describe(error, Scenario, content)) from error
