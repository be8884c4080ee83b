"""The metaheuristics by name: ours, and where to find those of other libraries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from solvers.abso import AdaptiveBeetleSwarm
from solvers.bas import BAS
from solvers.bso import BSO
from solvers.ga import GA
from solvers.ipopt import IPOPT
from solvers.lshade import LSHADE
from solvers.pso import PSO
from solvers.random_search import RandomSearch
from solvers.solver import Solver

AnySolver: TypeAlias = Solver | IPOPT


@dataclass(frozen=True, kw_only=True)
class External:
    """A solver of another library, imported only when it is used.

    Attributes:
        path: "package.module:Class".
        package: that it needs beyond those of this distribution; "" for none.
        extra: of this distribution, which installs it; "" if none is needed.
    """

    path: str
    package: str = ""
    extra: str = ""

    @property
    def install(self) -> str:
        """The command that installs its package."""
        return f"pip install 'tpbso-casadi[{self.extra}]'"


SOLVERS: dict[str, type[Solver]] = {
    "bso": BSO,
    "abso": AdaptiveBeetleSwarm,
    "pso": PSO,
    "ga": GA,
    "lshade": LSHADE,
    "bas": BAS,
    "random": RandomSearch,
}
NO_SEARCH = "direct plans motions and searches nothing else; DIRECT of SciPy is scipy-direct"  # asked for by name
GRADIENT_SOLVERS: dict[str, type[IPOPT]] = {"ipopt": IPOPT}
EXTERNAL = {
    "scipy-de": External(path="solvers.external.scipy_solvers:SciPyDE"),
    "annealing": External(path="solvers.external.scipy_solvers:DualAnnealing"),
    "scipy-direct": External(path="solvers.external.scipy_solvers:DirectRectangles"),
    "cma": External(path="solvers.external.cma_es:CMAES", package="cma", extra="cma"),
    "pymoo": External(path="solvers.external.pymoo_solvers:Pymoo", package="pymoo", extra="pymoo"),
    "nevergrad": External(path="solvers.external.nevergrad_solvers:Nevergrad", package="nevergrad", extra="nevergrad"),
    "mealpy": External(path="solvers.external.mealpy_solvers:Mealpy", package="mealpy", extra="mealpy"),
    "pygmo": External(path="solvers.external.pygmo_solvers:Pygmo", package="pygmo", extra="suite"),
    "minion": External(path="solvers.external.minion_solvers:Minion", package="minionpy", extra="suite"),
}
