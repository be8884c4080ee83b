"""How it is searched: metaheuristics over a box of numbers, IPOPT on a program. Knows no robot."""

from solvers.abso import AdaptiveBeetleSwarm
from solvers.archive import Archive
from solvers.box import Box
from solvers.bso import BSO
from solvers.budget import Budget, StopReason
from solvers.ga import GA
from solvers.ipopt import IPOPT, Descent, DescentResult, Program, Solution, descend
from solvers.lshade import LSHADE
from solvers.minimize import History, Result, Status, minimize
from solvers.pso import PSO
from solvers.registry import OUTSIDE, SOLVERS, UnknownSolver, find_solver
from solvers.solver import Search, Solver

__all__ = [
    "BSO",
    "GA",
    "IPOPT",
    "LSHADE",
    "OUTSIDE",
    "PSO",
    "SOLVERS",
    "AdaptiveBeetleSwarm",
    "Archive",
    "Box",
    "Budget",
    "Descent",
    "DescentResult",
    "History",
    "Program",
    "Result",
    "Search",
    "Solution",
    "Solver",
    "Status",
    "StopReason",
    "UnknownSolver",
    "descend",
    "find_solver",
    "minimize",
]
