"""Solvers by name: ours, those of other libraries, those that plug-ins offer, and any class by its path."""

from __future__ import annotations

from solvers import EXTERNAL, GRADIENT_SOLVERS, IPOPT, SOLVERS, AnySolver, Solver
from tpbso_casadi.plugins import Catalogue, subclass_of

SOLVER_CATALOGUE: Catalogue[type[AnySolver]] = Catalogue(
    kind="solver",
    group="tpbso_casadi.solvers",
    registry={**SOLVERS, **GRADIENT_SOLVERS, **{name: external.path for name, external in EXTERNAL.items()}},
    accepts=subclass_of((Solver, IPOPT)),
    requirement="a subclass of solvers.Solver",
    extras={name: external.extra for name, external in EXTERNAL.items() if external.extra},
)


def find_solver(name: str) -> type[AnySolver]:
    """The class of a solver.

    Args:
        name: of a solver of ours or of another library, in the entry-point group ``tpbso_casadi.solvers``, or
            ``package.module:Class``.

    Raises:
        PluginError: nothing of that name, it is not a :class:`solvers.Solver`, or its library is not installed.
    """
    return SOLVER_CATALOGUE.find(name)
