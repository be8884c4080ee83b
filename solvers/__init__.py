"""Solvers: metaheuristics that search a box of numbers, IPOPT that descends on a smooth program; for no robot alone."""

from solvers.abso import AdaptiveBeetleSwarm
from solvers.ask_tell import AskTell
from solvers.bas import BAS
from solvers.bso import BSO
from solvers.budget import Budget, Interruption, StopReason, Usage, deferred_interrupt
from solvers.driver import (
    Archive,
    History,
    Result,
    Status,
    Unsearched,
    best_so_far,
    keep_best,
    minimize,
    unsearched,
)
from solvers.functions import BENCHMARK_FUNCTIONS, BenchmarkFunction, InvalidFunction, benchmark_function
from solvers.ga import GA
from solvers.ipopt import IPOPT, Descent, DescentResult, Program, Solution, descend
from solvers.lshade import LSHADE
from solvers.pso import PSO
from solvers.random_search import RandomSearch
from solvers.registry import EXTERNAL, GRADIENT_SOLVERS, NO_SEARCH, SOLVERS, AnySolver, External
from solvers.solver import (
    STARTS,
    Iterations,
    Preset,
    Search,
    SearchBox,
    Solver,
    SolverTraits,
    Steps,
    checked_candidates,
    is_solver_class,
)
from solvers.standalone import minimize as minimize_function
from solvers.standalone import solver_of

__all__ = [
    "BAS",
    "BENCHMARK_FUNCTIONS",
    "BSO",
    "EXTERNAL",
    "GA",
    "GRADIENT_SOLVERS",
    "IPOPT",
    "LSHADE",
    "NO_SEARCH",
    "PSO",
    "SOLVERS",
    "STARTS",
    "AdaptiveBeetleSwarm",
    "AnySolver",
    "Archive",
    "AskTell",
    "BenchmarkFunction",
    "Budget",
    "Descent",
    "DescentResult",
    "External",
    "History",
    "Interruption",
    "InvalidFunction",
    "Iterations",
    "Preset",
    "Program",
    "RandomSearch",
    "Result",
    "Search",
    "SearchBox",
    "Solution",
    "Solver",
    "SolverTraits",
    "Status",
    "Steps",
    "StopReason",
    "Unsearched",
    "Usage",
    "benchmark_function",
    "best_so_far",
    "checked_candidates",
    "deferred_interrupt",
    "descend",
    "is_solver_class",
    "keep_best",
    "minimize",
    "minimize_function",
    "solver_of",
    "unsearched",
]
