"""Robots, limits, objectives and tasks by name: ours, those that plug-ins offer, and any class by its path."""

from __future__ import annotations

from problems import LIMITS, OBJECTIVES, ROBOTS, Limit, Objective, Robot
from tpbso_casadi.plugins import Catalogue, subclass_of

ROBOT_CATALOGUE: Catalogue[type[Robot]] = Catalogue(
    kind="robot",
    group="tpbso_casadi.robots",
    registry=ROBOTS,
    accepts=subclass_of(Robot),
    requirement="a subclass of problems.Robot",
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


def find_objective(name: str) -> Objective:
    """The objective of a name.

    Raises:
        PluginError: there is none, or it is of another kind.
    """
    return OBJECTIVE_CATALOGUE.find(name)()
