"""The metaheuristics by name: ours, and where to find those of other libraries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from solvers.abso import AdaptiveBeetleSwarm
from solvers.bso import BSO
from solvers.ga import GA
from solvers.ipopt import IPOPT
from solvers.ladder import Ladder
from solvers.lshade import LSHADE
from solvers.pso import PSO
from solvers.solver import Solver

AnySolver: TypeAlias = Solver | IPOPT


@dataclass(frozen=True, kw_only=True)
class External:
    """A solver of another library, imported only when it is used.

    Attributes:
        path: "package.module:Class".
        extra: of this distribution, which installs the package of the same name; "" if none is needed.
    """

    path: str
    extra: str = ""

    @property
    def install(self) -> str:
        """The command that installs its package."""
        return f"pip install 'tpbso-casadi[{self.extra}]'"


SOLVERS: dict[str, type[Solver]] = {
    "bso": BSO,
    "abso": AdaptiveBeetleSwarm,
    "ladder": Ladder,
    "pso": PSO,
    "ga": GA,
    "lshade": LSHADE,
}
GRADIENT_SOLVERS: dict[str, type[IPOPT]] = {"ipopt": IPOPT}
EXTERNAL = {
    "scipy-de": External(path="solvers.external.scipy_solvers:SciPyDE"),
    "annealing": External(path="solvers.external.scipy_solvers:DualAnnealing"),
    "cma": External(path="solvers.external.cma_es:CMAES", extra="cma"),
    "pymoo": External(path="solvers.external.pymoo_solvers:Pymoo", extra="pymoo"),
    "nevergrad": External(path="solvers.external.nevergrad_solvers:Nevergrad", extra="nevergrad"),
    "mealpy": External(path="solvers.external.mealpy_solvers:Mealpy", extra="mealpy"),
}
