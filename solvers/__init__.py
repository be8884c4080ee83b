"""How it is searched: metaheuristics over a box of numbers. Knows no robot."""

from solvers.box import Box
from solvers.bso import BSO
from solvers.budget import Budget, StopReason
from solvers.ga import GA
from solvers.minimize import History, Result, Status, minimize
from solvers.pso import PSO
from solvers.registry import SOLVERS, UnknownSolver, find_solver
from solvers.solver import Search, Solver

__all__ = [
    "BSO",
    "GA",
    "PSO",
    "SOLVERS",
    "Box",
    "Budget",
    "History",
    "Result",
    "Search",
    "Solver",
    "Status",
    "StopReason",
    "UnknownSolver",
    "find_solver",
    "minimize",
]
