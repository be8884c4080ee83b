"""What the [task] and [model] tables of all kinds of tasks share."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    SerializerFunctionWrapHandler,
    Tag,
    ValidationInfo,
    model_serializer,
)

from problems import LimitKind, Objective, Problem, Robot
from problems.assembly.criteria import Criteria
from problems.encodings import FORMULATIONS
from problems.scene.obstacle import Obstacle
from problems.tasks.paths.path_following import KnotRedundancy
from tpbso_casadi.scenario.catalogues import LIMIT_CATALOGUE, OBJECTIVE_CATALOGUE
from tpbso_casadi.scenario.expressions import ConstraintSection, ObjectiveSection, check_names
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import (
    MOST_EXPRESSIONS,
    MOST_JOINT_POINTS,
    MOST_JOINT_SAMPLES,
    MOST_PIECES,
    MOST_POINTS,
    MOST_SAMPLES,
    NotNegative,
    Positive,
    ScenarioError,
    Section,
    Word,
)
from tpbso_casadi.scenario.validation import choice_of

OfCatalogue = choice_of(OBJECTIVE_CATALOGUE.registry, OBJECTIVE_CATALOGUE.find)


def _known_objective(name: str, info: ValidationInfo) -> str:
    """A name that the task's own objectives have, which are validated before, or one of the catalogue."""
    own = {objective.name for objective in info.data.get("objectives", ())}
    return name if name in own else OfCatalogue.func(name)  # type: ignore[call-arg]


ObjectiveName = Annotated[Word, AfterValidator(_known_objective)]
OwnObjectives = Annotated[list[ObjectiveSection], Field(max_length=MOST_EXPRESSIONS), AfterValidator(check_names)]
OwnConstraints = Annotated[list[ConstraintSection], Field(max_length=MOST_EXPRESSIONS), AfterValidator(check_names)]
LimitName = Annotated[Word, choice_of(LIMIT_CATALOGUE.registry, LIMIT_CATALOGUE.find)]
Formulation = Annotated[Word, choice_of(FORMULATIONS)]


def _form_of_objective(value: object) -> str:
    return "weights" if isinstance(value, dict) else "name"


def _at_least_one(weights: dict[str, float]) -> dict[str, float]:
    if not weights:
        raise ValueError("an objective with its weight is needed, such as { time = 1.0, energy = 0.02 }")
    return weights


Weights = Annotated[dict[ObjectiveName, Positive], AfterValidator(_at_least_one)]
ObjectiveChoice = Annotated[
    Annotated[ObjectiveName, Tag("name")] | Annotated[Weights, Tag("weights")], Discriminator(_form_of_objective)
]


def without_empty(content: dict[str, Any], key: str) -> dict[str, Any]:
    """What is written of a section: without a key where it has nothing, as files had it before there was one."""
    return content if content.get(key, True) else {name: value for name, value in content.items() if name != key}


DEPENDENT = {"motion", "formulation", "retime"}  # keys of [model] whose defaults depend on the task


class ModelSection(Section):
    """[model]: the form of the model.

    In a scenario that has been read nothing depends on the task any more: what was left out is filled in.
    """

    samples: int = Field(default=50, ge=2, le=MOST_SAMPLES)
    motion: Literal["paper", "spline", "time-spline"] = "paper"
    formulation: Formulation = "paper"
    pieces: int | None = Field(default=None, ge=2, le=MOST_PIECES)
    retime: bool = False
    redundancy_values: int = Field(default=5, ge=2, le=100)
    knots: int | None = Field(default=None, ge=2, le=MOST_POINTS)
    knot_redundancy: KnotRedundancy = "free"
    limits: list[LimitName] = Field(default_factory=list)
    constraints: OwnConstraints = Field(default_factory=list)
    margin: NotNegative = 0.0
    self_collision: bool = False

    @property
    def further_limits(self) -> list[LimitKind]:
        """Kinds of limits that hold besides those of the robot and of the obstacles."""
        return [*(LIMIT_CATALOGUE.find(name) for name in self.limits), *(own.kind() for own in self.constraints)]

    @model_serializer(mode="wrap")
    def _without_empty_tables(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return without_empty(serialize(self), "constraints")

    def stated(self) -> dict[str, Any]:
        """What of it is not filled in from the task; plain data."""
        filled = DEPENDENT - self.model_fields_set
        return self.model_dump(exclude=filled)

    def kept_by(self, robot: Robot) -> Robot:
        """The robot that keeps the margin, and clear of itself where that is asked for.

        Raises:
            InvalidProblem: it cannot.
            ScenarioError: this kind of robot does not say which of its bodies could touch.
        """
        safe = replace(robot, margin=self.margin, self_collision=self.self_collision)
        if self.self_collision and not safe.says_what_could_touch:
            raise ScenarioError("model.self_collision: this robot does not say which of its bodies could touch")
        return safe

    def check_size(self, joints: int) -> None:
        """The model of so many joints can be built in less than a minute.

        Raises:
            ScenarioError: naming the key, and the most that is planned.
        """
        for key, most in (("samples", MOST_JOINT_SAMPLES), ("redundancy_values", MOST_JOINT_POINTS)):
            value = getattr(self, key)
            if joints * value > most:
                raise ScenarioError(f"model.{key}: {value} are too many for {joints} joints; at most {most // joints}")


class TaskSection(Section):
    """[task]: the interface of every kind of task.

    Attributes:
        is_searched: whether a motion has to be searched for; if not, there is nothing but a path to be timed.
        motions: families of motions that it can be planned with, the default first.
        keys_of: by family, keys that not all of them have.
    """

    is_searched: ClassVar[bool] = True
    motions: ClassVar[tuple[str, ...]] = ("paper",)
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({})

    kind: Word

    @model_serializer(mode="wrap")
    def _without_empty_tables(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return without_empty(serialize(self), "objectives")

    @property
    def own_objectives(self) -> dict[str, Objective]:
        """Those that the task states itself, by name."""
        return {objective.name: objective.built() for objective in getattr(self, "objectives", ())}

    @property
    def stated_objective(self) -> str | dict[str, float]:
        """What is minimised, by name or as weights by name; no name where a kind of task states none."""
        chosen = getattr(self, "objective", "")
        return chosen if isinstance(chosen, dict) else str(chosen)

    def foreign_keys(self, motion: str) -> Iterator[str]:
        """Keys that are stated although this family of motions does not have them."""
        for keys in self.keys_of.values():
            own = self.keys_of.get(motion, ())
            yield from (key for key in keys if key not in own and getattr(self, key) is not None)

    def with_files(self, folder: InputFolder) -> Self:
        """The same task with the content of the files that it names.

        Args:
            folder: of the scenario file; reads them, if it holds them.

        Raises:
            ScenarioError: a file cannot be read, or may not be.
        """
        return self

    def rest_places(self) -> tuple[Any, Any]:
        """Start and goal of a move from rest to rest that passes nothing, as they are stated.

        Raises:
            ScenarioError: the task is another.
        """
        raise ScenarioError(f"task.kind: {self.kind!r} is no move from one place to another")

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        """The problem itself.

        Raises:
            InvalidProblem: the robot cannot do the task.
        """
        raise NotImplementedError

    def criteria(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        """What a motion is judged by; the problem itself, where there is something to search.

        Raises:
            InvalidProblem: the robot cannot do the task.
        """
        return self.build(robot, obstacles, model)
