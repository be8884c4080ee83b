"""The families of motions that a scenario can be planned with, and what depends on which it is.

``[model] motion`` may be left out: the family is then the first that the task can be planned with, or the one to which
a key belongs that is stated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from problems import InvalidProblem
from tpbso_casadi.plugins import PluginError
from tpbso_casadi.scenario.catalogues import find_objective
from tpbso_casadi.scenario.task import ModelSection, TaskSection
from tpbso_casadi.scenario.validation import in_words


@dataclass(frozen=True)
class MotionFamily:
    """What a family of motions has to do with a scenario.

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
}


def with_motion(model: ModelSection, task: TaskSection) -> ModelSection:
    """The [model] table with everything filled in that depends on the task.

    Raises:
        ValueError: a key that the family of motions does not have; the message begins with the key's table.
    """
    stated = model.model_fields_set
    motion = model.motion if "motion" in stated else _default_motion(model, task)
    if motion not in task.motions:
        reason = f"kind = {task.kind!r} is planned with {in_words([repr(name) for name in task.motions])}"
        raise ValueError(f"model.motion: {reason}, not {motion!r}")
    family = FAMILIES[motion]
    formulation = model.formulation if "formulation" in stated else family.formulations[0]
    if formulation not in family.formulations:
        owners = [name for name, other in FAMILIES.items() if formulation in other.formulations]
        raise ValueError(f"model.formulation: {formulation!r} needs motion = {in_words([repr(o) for o in owners])}")
    for key, owner in _foreign(model, task, motion):
        raise ValueError(f"{key}: needs motion = {owner!r} in [model]")
    if family.keeps_its_timing and "retime" in stated and model.retime:
        raise ValueError(f"model.retime: motion = {motion!r} keeps the timing that is searched")
    usual = family.timed_at_the_end or (not family.keeps_its_timing and _leaves_time_free(task))
    retime = model.retime if "retime" in stated else usual
    values = {**dict(model), "motion": motion, "formulation": formulation, "retime": retime}
    return ModelSection.model_construct(stated, **values)


def _default_motion(model: ModelSection, task: TaskSection) -> str:
    """The first family of the task, unless a key is stated that only another one has."""
    first, *others = task.motions
    foreign = {owner for _, owner in _foreign(model, task, first)}
    if "formulation" in model.model_fields_set:
        foreign |= {name for name, family in FAMILIES.items() if "formulation" in family.keys}
    return next((name for name in others if name in foreign), first)


def _foreign(model: ModelSection, task: TaskSection, motion: str) -> Iterator[tuple[str, str]]:
    """Keys that are stated, with their tables, and do not belong to a motion; and to which they do."""
    fields = ModelSection.model_fields
    for name, family in FAMILIES.items():
        if name == motion:
            continue
        for key in set(family.keys) - set(FAMILIES[motion].keys):
            chosen = key in fields and getattr(model, key) != fields[key].default
            if key != "formulation" and key in model.model_fields_set and chosen:
                yield f"model.{key}", name
    owners = [name for name in task.motions if name != motion]
    if owners:
        yield from ((f"task.{key}", _owner(key, task, owners)) for key in task.foreign_keys(motion))


def _owner(key: str, task: TaskSection, owners: list[str]) -> str:
    """The family to which a key of a task belongs; the first where none claims it."""
    return next((name for name in owners if key in task.keys_of.get(name, ())), owners[0])


def _leaves_time_free(task: TaskSection) -> bool:
    """Whether the objective does not depend on how long a motion takes, and less time is never worse."""
    try:
        objective = find_objective(task.stated_objective)
    except (PluginError, InvalidProblem):  # there is none, or the task itself will say what is wrong
        return False
    return not objective.timed and objective.sooner_is_better
