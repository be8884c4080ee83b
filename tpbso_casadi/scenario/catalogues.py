"""Robots, limits, objectives and solvers by name: ours, those that plug-ins offer, and any class by its path."""

from __future__ import annotations

from collections.abc import Mapping

from problems import LIMITS, OBJECTIVES, ROBOTS, Limit, Objective, Robot
from problems.objectives import WeightedSum
from problems.robots.spatial.models import BUILT_IN
from solvers import EXTERNAL, GRADIENT_SOLVERS, IPOPT, SOLVERS, AnySolver, Solver
from tpbso_casadi.plugins import Catalogue, subclass_of

ROBOT_CATALOGUE: Catalogue[type[Robot]] = Catalogue(
    kind="robot",
    group="tpbso_casadi.robots",
    registry=ROBOTS,
    accepts=subclass_of(Robot),
    requirement="a subclass of problems.Robot",
    elsewhere=BUILT_IN,
)
LIMIT_CATALOGUE: Catalogue[type[Limit]] = Catalogue(
    kind="limit",
    group="tpbso_casadi.limits",
    registry=LIMITS,
    accepts=subclass_of(Limit),
    requirement="a subclass of problems.Limit",
)
OBJECTIVE_CATALOGUE: Catalogue[type[Objective]] = Catalogue(
    kind="objective",
    group="tpbso_casadi.objectives",
    registry={name: type(objective) for name, objective in OBJECTIVES.items()},
    accepts=subclass_of(Objective),
    requirement="a subclass of problems.Objective",
)
SOLVER_CATALOGUE: Catalogue[type[AnySolver]] = Catalogue(
    kind="solver",
    group="tpbso_casadi.solvers",
    registry={**SOLVERS, **GRADIENT_SOLVERS, **{name: external.path for name, external in EXTERNAL.items()}},
    accepts=subclass_of((Solver, IPOPT)),
    requirement="a subclass of solvers.Solver",
    extras={name: external.extra for name, external in EXTERNAL.items() if external.extra},
)


NONE: Mapping[str, Objective] = {}


def find_objective(chosen: str | Mapping[str, float], own: Mapping[str, Objective] = NONE) -> Objective:
    """The objective of a name; of a table of weights the weighted sum, or the one that alone has weight 1.

    Args:
        chosen: the name, or weights by name.
        own: those that a scenario states itself, by name.

    Raises:
        PluginError: there is none of a name, or it is of another kind.
        InvalidProblem: two names stand for the same objective.
    """
    if isinstance(chosen, str):
        return own[chosen] if chosen in own else OBJECTIVE_CATALOGUE.find(chosen)()
    found = tuple(find_objective(name, own) for name in chosen)
    weights = tuple(chosen.values())
    return found[0] if weights == (1.0,) else WeightedSum(weights, found)


def find_solver(name: str) -> type[AnySolver]:
    """The class of a solver.

    Args:
        name: of a solver of ours or of another library, in the entry-point group ``tpbso_casadi.solvers``, or
            ``package.module:Class``.

    Raises:
        PluginError: nothing of that name, it is not a :class:`solvers.Solver`, or its library is not installed.
    """
    return SOLVER_CATALOGUE.find(name)
