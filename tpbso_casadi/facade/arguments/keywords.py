"""Keywords of a call, by the table of a scenario that has such a key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

from solvers import IPOPT, AnySolver, Solver
from solvers.registry import GRADIENT_SOLVERS, SOLVERS
from tpbso_casadi.facade.arguments.messages import check_keywords
from tpbso_casadi.facade.plain_data import path_of, plain
from tpbso_casadi.scenario.scenario import SolverSection
from tpbso_casadi.scenario.section import ScenarioError, Section
from tpbso_casadi.scenario.task import ModelSection, TaskSection
from tpbso_casadi.scenario.tasks.path import PointsTask
from tpbso_casadi.scenario.tasks.point_to_point import PointToPointTask
from tpbso_casadi.scenario.validation import shown
from tpbso_casadi.storage.plain import settings_of

AnySolverChoice: TypeAlias = str | AnySolver | type[AnySolver]
TABLES: dict[str, tuple[type[Section], ...]] = {
    "task": (PointToPointTask, PointsTask),
    "model": (ModelSection,),
    "solver": (SolverSection,),
}


def solver_table(solver: AnySolverChoice | None) -> dict[str, Any]:
    """The keys of [solver] that name a solver and its settings."""
    if solver is None:
        return {}
    if isinstance(solver, str):
        return {"name": solver}
    kind = solver if isinstance(solver, type) else type(solver)
    if not issubclass(kind, Solver | IPOPT):
        raise ScenarioError(f"solver: {shown(solver)} is none; say a name, a class, or a solver with its settings")
    registered: dict[str, type[AnySolver]] = {**SOLVERS, **GRADIENT_SOLVERS}
    name = next((name for name, known in registered.items() if known is kind), None)
    settings = {} if isinstance(solver, type) else settings_of(solver)
    kept = {key: value for key, value in settings.items() if value is not None}
    return {"name": name or path_of(kind), "settings": kept}


def sorted_into_tables(keys: Mapping[str, Any], task: TaskSection | None = None) -> dict[str, dict[str, Any]]:
    """Keywords by the table that has such a key.

    Args:
        keys: the keywords.
        task: of the scenario that is given, which may be of another kind.

    Raises:
        TypeError: none has, with the nearest that one has.
    """
    known = {name: {key for section in sections for key in section.model_fields} for name, sections in TABLES.items()}
    known["task"] |= {"path", *(() if task is None else type(task).model_fields)}
    check_keywords(keys, set().union(*known.values(), {"obstacles"}))
    found: dict[str, dict[str, Any]] = {name: {} for name in TABLES}
    for key, value in keys.items():
        table = next(name for name in TABLES if key in known[name])
        found[table][key] = plain(value) if table == "solver" else value
    return found
