"""Solvers: metaheuristics that search a box of numbers, IPOPT that descends on a smooth program. Knows no robot."""

from solvers.abso import AdaptiveBeetleSwarm
from solvers.box import Box
from solvers.bso import BSO
from solvers.driver.archive import Archive
from solvers.driver.budget import Budget, StopReason, Usage
from solvers.driver.iterations import Iterations
from solvers.driver.minimize import minimize
from solvers.driver.result import History, Result, Status
from solvers.ga import GA
from solvers.gradients.ipopt import IPOPT, Descent, Program, Solution
from solvers.gradients.multistart import DescentResult, descend
from solvers.lshade import LSHADE
from solvers.pso import PSO
from solvers.registry import EXTERNAL, GRADIENT_SOLVERS, SOLVERS, AnySolver, External
from solvers.solver import Search, Solver
from solvers.standalone.ask_tell import AskTell
from solvers.traits import SolverTraits, Steps

__all__ = [
    "BSO",
    "EXTERNAL",
    "GA",
    "GRADIENT_SOLVERS",
    "IPOPT",
    "LSHADE",
    "PSO",
    "SOLVERS",
    "AdaptiveBeetleSwarm",
    "AnySolver",
    "Archive",
    "AskTell",
    "Box",
    "Budget",
    "Descent",
    "DescentResult",
    "External",
    "History",
    "Iterations",
    "Program",
    "Result",
    "Search",
    "Solution",
    "Solver",
    "SolverTraits",
    "Status",
    "Steps",
    "StopReason",
    "Usage",
    "descend",
    "minimize",
]
