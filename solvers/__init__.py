"""Solvers: metaheuristics that search a box of numbers, IPOPT that descends on a smooth program. Knows no robot."""

from solvers.abso import AdaptiveBeetleSwarm
from solvers.ask_tell import AskTell
from solvers.bso import BSO
from solvers.budget import Budget, StopReason, Usage
from solvers.driver import Archive, History, Result, Status, minimize
from solvers.ga import GA
from solvers.ipopt import IPOPT, Descent, DescentResult, Program, Solution, descend
from solvers.lshade import LSHADE
from solvers.pso import PSO
from solvers.registry import EXTERNAL, GRADIENT_SOLVERS, SOLVERS, AnySolver, External
from solvers.solver import Box, Iterations, Search, Solver, SolverTraits, Steps

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
