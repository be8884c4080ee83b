"""Solvers by name: ours, those of outside libraries, those that plug-ins offer, and any class by its path."""

from __future__ import annotations

import difflib
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec

from solvers.abso import AdaptiveBeetleSwarm
from solvers.bso import BSO
from solvers.ga import GA
from solvers.ipopt import IPOPT
from solvers.lshade import LSHADE
from solvers.pso import PSO
from solvers.solver import Solver

SOLVERS: dict[str, type[Solver]] = {
    "bso": BSO,
    "abso": AdaptiveBeetleSwarm,
    "pso": PSO,
    "ga": GA,
    "lshade": LSHADE,
}
OUTSIDE = {  # name: where, and the extra that installs what it needs
    "scipy-de": ("solvers.external.scipy_solvers:SciPyDE", ""),
    "annealing": ("solvers.external.scipy_solvers:DualAnnealing", ""),
    "cma": ("solvers.external.cma_es:CMAES", "cma"),
    "pymoo": ("solvers.external.pymoo_solvers:Pymoo", "pymoo"),
}
GROUP = "tpbso_casadi.solvers"


class UnknownSolver(ValueError):
    """No solver of that name; the message names the nearest."""


def find_solver(name: str) -> type[Solver] | type[IPOPT]:
    """The class of a solver.

    Args:
        name: a key of ``SOLVERS`` or ``OUTSIDE``, ``ipopt``, a name in the entry-point group
            ``tpbso_casadi.solvers``, or ``package.module:Class``.

    Raises:
        UnknownSolver: nothing of that name, it is not a :class:`Solver`, or its library is not installed.
    """
    if name == "ipopt":
        return IPOPT
    if name in SOLVERS:
        return SOLVERS[name]
    if name in OUTSIDE:
        return _outside(name)
    if ":" in name:
        return _checked(name, _load(name))
    offered = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name in offered:
        return _checked(name, offered[name].load())
    known = sorted({*SOLVERS, *OUTSIDE, *offered, "ipopt"})
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
    hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(known)}"
    raise UnknownSolver(f"no solver {name!r}; {hint}")


def _outside(name: str) -> type[Solver]:
    path, extra = OUTSIDE[name]
    if extra and find_spec(extra) is None:
        raise UnknownSolver(f"{name} needs the package {extra}: pip install 'tpbso-casadi[{extra}]'")
    return _checked(name, _load(path))


def _load(path: str) -> object:
    module, _, attribute = path.partition(":")
    try:
        return getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise UnknownSolver(f"cannot load solver {path!r}: {error}") from error


def _checked(name: str, found: object) -> type[Solver]:
    if isinstance(found, type) and issubclass(found, Solver):
        return found
    raise UnknownSolver(f"{name!r} is not a subclass of solvers.Solver")
