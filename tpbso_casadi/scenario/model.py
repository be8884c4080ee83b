"""The model's table, a task's table, and which family of motions belongs to which task.

``[model] motion`` may be left out: the family is then the first that the task can be planned with, or the one to which
a key belongs that is stated.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Self

from problems import InvalidProblem, LimitKind, Objective, Obstacle, Problem, Robot
from problems.assembly import Criteria
from problems.base import CACHE_SIZE, Checked, Count, InvalidTable, Range, at, in_words
from problems.families.two_segments import FORMULATIONS
from problems.families.via_times import INTERVAL_ENCODINGS
from problems.tasks import KnotRedundancy
from tpbso_casadi.scenario.catalogues import LIMIT_CATALOGUE, OBJECTIVE_CATALOGUE, PluginError, find_objective
from tpbso_casadi.scenario.constraints import OwnConstraints, limit_kinds
from tpbso_casadi.scenario.expressions import ObjectiveSection, check_names
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.validation import (
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
    choice_of,
)

OF_CATALOGUE = choice_of(OBJECTIVE_CATALOGUE.registry, OBJECTIVE_CATALOGUE.find)
OwnObjectives = Annotated[list[ObjectiveSection], Count(0, MOST_EXPRESSIONS), Checked(check_names)]
LimitName = Annotated[Word, choice_of(LIMIT_CATALOGUE.registry, LIMIT_CATALOGUE.find)]
Formulation = Annotated[Word, choice_of(FORMULATIONS)]


def _at_least_one(weights: dict[str, float]) -> dict[str, float]:
    if not weights:
        raise ValueError("an objective with its weight is needed, such as { time = 1.0, energy = 0.02 }")
    return weights


ObjectiveChoice = Word | Annotated[dict[Word, Positive], Checked(_at_least_one)]


def without_empty(content: dict[str, Any], key: str) -> dict[str, Any]:
    """The content of a table without a key that has nothing to say."""
    return content if content.get(key, True) else {name: value for name, value in content.items() if name != key}


DEPENDENT = {"motion", "formulation", "retime"}  # keys of [model] whose defaults depend on the task


class ModelSection(Section):
    """[model]: the form of the model.

    In a scenario that has been read nothing depends on the task any more: what was left out is filled in.
    """

    samples: Annotated[int, Range(2, MOST_SAMPLES)] = 50
    motion: Literal["paper", "spline", "time-spline", "via-times"] = "paper"
    formulation: Formulation = "paper"
    pieces: Annotated[int, Range(2, MOST_PIECES)] | None = None
    retime: bool = False
    redundancy_values: Annotated[int, Range(2, 100)] = 5
    knots: Annotated[int, Range(2, MOST_POINTS)] | None = None
    knot_redundancy: KnotRedundancy = "free"
    limits: list[LimitName] = field(default_factory=list)
    constraints: OwnConstraints = field(default_factory=list)
    margin: NotNegative = 0.0
    self_collision: bool = False

    @property
    def further_limits(self) -> list[LimitKind]:
        """Kinds of limits that hold besides those of the robot and of the obstacles."""
        return [*(LIMIT_CATALOGUE.find(name) for name in self.limits), *limit_kinds(self.constraints)]

    def table(self) -> dict[str, Any]:
        return without_empty(super().table(), "constraints")

    def stated(self) -> dict[str, Any]:
        """The keys as plain data, without those that are filled in from the task."""
        filled = DEPENDENT - self.stated_keys
        return {key: value for key, value in self.table().items() if key not in filled}

    def kept_by(self, robot: Robot) -> Robot:
        """The robot that keeps the margin, and clear of itself where that is asked for.

        Raises:
            InvalidProblem: it cannot.
        """
        return _keeping(robot, self.margin, self.self_collision)

    def check_size(self, joints: int) -> None:
        """The model of so many joints can be built in less than a minute.

        Raises:
            ScenarioError: naming the key, and the most that is planned.
        """
        for key, most in (("samples", MOST_JOINT_SAMPLES), ("redundancy_values", MOST_JOINT_POINTS)):
            value = getattr(self, key)
            if joints * value > most:
                raise ScenarioError(f"model.{key}: {value} are too many for {joints} joints; at most {most // joints}")


@lru_cache(maxsize=CACHE_SIZE)
def _keeping(robot: Robot, margin: float, self_collision: bool) -> Robot:
    """The robot that keeps a margin, m, and maybe clear of itself, the same object for the same."""
    return replace(robot, margin=margin, self_collision=self_collision)


class TaskSection(Section):
    """[task]: the interface of every kind of task.

    Attributes:
        is_searched: whether a motion is one of a problem that is searched; if not, it is timed, or made of several.
        has_solver: whether anything is searched for.
        motions: families of motions that it can be planned with, the default first.
        keys_of: by family, keys that not all of them have.
    """

    is_searched: ClassVar[bool] = True
    has_solver: ClassVar[bool] = True
    motions: ClassVar[tuple[str, ...]] = ("paper",)
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType({})

    kind: Word

    def check(self) -> None:
        if "objective" not in self.stated_keys:
            return
        chosen, own = self.stated_objective, {each.name for each in getattr(self, "objectives", ())}
        for name in [chosen] if isinstance(chosen, str) else chosen:
            with at("objective", *[name][: not isinstance(chosen, str)]):
                if name not in own:
                    OF_CATALOGUE.function(name)

    def table(self) -> dict[str, Any]:
        return without_empty(super().table(), "objectives")

    @property
    def own_objectives(self) -> dict[str, Objective]:
        """The objectives that the task states itself, by name."""
        return {objective.name: objective.built() for objective in getattr(self, "objectives", ())}

    @property
    def stated_objective(self) -> str | dict[str, float]:
        """The objective by name, or weights by name; an empty name where a kind of task states none."""
        chosen = getattr(self, "objective", "")
        return chosen if isinstance(chosen, dict) else str(chosen)

    def foreign_keys(self, motion: str) -> Iterator[str]:
        """Keys that are stated although this family of motions does not have them."""
        for keys in self.keys_of.values():
            own = self.keys_of.get(motion, ())
            yield from (key for key in keys if key not in own and getattr(self, key) is not None)

    def with_files(self, folder: InputFolder) -> Self:
        """The task with the content of the files that it names.

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
        """The problem that the task states for a robot.

        Raises:
            InvalidProblem: the robot cannot do the task.
        """
        raise NotImplementedError

    def criteria(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        """The criteria of a motion.

        Raises:
            InvalidProblem: the robot cannot do the task.
        """
        return self.build(robot, obstacles, model).criteria

    def judged(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        """The criteria of a finished motion, without the parts that only a search needs.

        Raises:
            InvalidProblem: the robot cannot do the task.
        """
        return self.criteria(robot, obstacles, model).at_free_times()


@dataclass(frozen=True)
class MotionFamily:
    """The keys and forms that a family of motions allows in a scenario.

    Attributes:
        keys: of the [model] table, that belong to it alone.
        formulations: of the search vector, the default first.
        timed_at_the_end: whether its motions are always timed anew along their paths.
        keeps_its_timing: whether they never are, as when they leave while the robot moves.
    """

    keys: tuple[str, ...]
    formulations: tuple[str, ...]
    timed_at_the_end: bool = False
    keeps_its_timing: bool = False


FAMILIES = {
    "paper": MotionFamily(
        keys=("formulation", "knots", "knot_redundancy"),
        formulations=("paper", "reduced"),
    ),
    "spline": MotionFamily(keys=("pieces",), formulations=("reduced",), timed_at_the_end=True),
    "time-spline": MotionFamily(keys=("pieces",), formulations=("reduced",), keeps_its_timing=True),
    "via-times": MotionFamily(keys=("formulation",), formulations=tuple(INTERVAL_ENCODINGS), keeps_its_timing=True),
}


def with_motion(model: ModelSection, task: TaskSection) -> ModelSection:
    """The [model] table with everything filled in that depends on the task.

    Raises:
        InvalidTable: a key that the family of motions does not have.
    """
    stated = model.stated_keys
    motion = model.motion if "motion" in stated else _default_motion(model, task)
    if motion not in task.motions:
        reason = f"kind = {task.kind!r} is planned with {in_words([repr(name) for name in task.motions])}"
        raise InvalidTable(f"{reason}, not {motion!r}", "model", "motion")
    family = FAMILIES[motion]
    formulation = model.formulation if "formulation" in stated else family.formulations[0]
    if formulation not in family.formulations:
        owners = [name for name, other in FAMILIES.items() if formulation in other.formulations]
        raise InvalidTable(
            f"{formulation!r} needs motion = {in_words([repr(o) for o in owners])}", "model", "formulation"
        )
    for key, owner in _foreign(model, task, motion):
        raise InvalidTable(f"needs motion = {owner!r} in [model]", *key.split("."))
    if family.keeps_its_timing and "retime" in stated and model.retime:
        raise InvalidTable(f"motion = {motion!r} keeps the timing that is searched", "model", "retime")
    usual = family.timed_at_the_end or (not family.keeps_its_timing and _leaves_time_free(task))
    retime = model.retime if "retime" in stated else usual
    return model.filled_in(motion=motion, formulation=formulation, retime=retime)


def _default_motion(model: ModelSection, task: TaskSection) -> str:
    """The first family of the task, unless a key is stated that only another one has."""
    first, *others = task.motions
    foreign = {owner for _, owner in _foreign(model, task, first)}
    if "formulation" in model.stated_keys:
        foreign |= {name for name, family in FAMILIES.items() if "formulation" in family.keys}
    return next((name for name in others if name in foreign), first)


def _foreign(model: ModelSection, task: TaskSection, motion: str) -> Iterator[tuple[str, str]]:
    """Keys that are stated, with their tables, and do not belong to a motion; and to which they do."""
    fields = ModelSection.schema()
    for name, family in FAMILIES.items():
        if name == motion:
            continue
        for key in set(family.keys) - set(FAMILIES[motion].keys):
            chosen = key in fields and getattr(model, key) != fields[key].usual
            if key != "formulation" and key in model.stated_keys and chosen:
                yield f"model.{key}", name
    owners = [name for name in task.motions if name != motion]
    if owners:
        yield from ((f"task.{key}", _owner(key, task, owners)) for key in task.foreign_keys(motion))


def _owner(key: str, task: TaskSection, owners: list[str]) -> str:
    """The first family that has a key of a task as it is stated; the first of all where none does."""
    return next((name for name in owners if key not in task.foreign_keys(name)), owners[0])


def _leaves_time_free(task: TaskSection) -> bool:
    """Whether the objective does not depend on how long a motion takes, and less time is never worse."""
    try:
        objective = find_objective(task.stated_objective)
    except (PluginError, InvalidProblem):  # there is none, or the task itself will say what is wrong
        return False
    return not objective.is_time_dependent and objective.sooner_is_better
