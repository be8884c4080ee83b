"""Solvers of pymoo, and its NSGA-II.

Deb, Pratap, Agarwal and Meyarivan, "A fast and elitist multiobjective genetic algorithm: NSGA-II", 2002.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.algorithms.soo.nonconvex.g3pcx import G3PCX
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.algorithms.soo.nonconvex.pso import PSO
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem

from solvers.external.callbacks import LARGEST_COST
from solvers.solver import FloatArray, Iterations, Search, SearchBox, Solver, require

ALGORITHMS = {"pso": PSO, "de": DE, "ga": GA, "g3pcx": G3PCX, "nsga2": NSGA2}


@dataclass(frozen=True)
class Pymoo(Solver):
    """An algorithm of pymoo with pymoo's defaults, except for the population. NSGA-II takes several costs, too."""

    minimum_population: ClassVar[int] = 6

    population: int = 50  # m >= 6
    algorithm: str = "pso"  # pso (adaptive), de, ga, g3pcx or nsga2

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.algorithm in ALGORITHMS, f"algorithm = {self.algorithm!r} is none of {', '.join(ALGORITHMS)}")

    @property
    def takes_several_costs(self) -> bool:
        return self.algorithm == "nsga2"

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        problem = Problem(n_var=box.dimension, n_obj=1, xl=0.0, xu=1.0)
        algorithm = ALGORITHMS[self.algorithm](pop_size=self.population, **self._sampling(box, rng))
        algorithm.setup(problem, termination=NoTermination(), seed=int(rng.integers(2**31)))
        while True:
            population = algorithm.ask()
            costs = np.minimum((yield box.from_unit(population.get("X").astype(np.float64))), LARGEST_COST)
            columns = costs.reshape(len(costs), -1)
            stated = Problem(n_var=box.dimension, n_obj=columns.shape[1], xl=0.0, xu=1.0)
            Evaluator().eval(StaticProblem(stated, F=columns), population)
            algorithm.tell(infills=population)
            if next(iterations, None) is None:
                return

    def _sampling(self, box: SearchBox, rng: np.random.Generator) -> dict[str, Any]:
        """The initial population, where some of it is known; else pymoo draws it."""
        if box.known is None:
            return {}
        return {"sampling": box.initial_shares(rng.random((self.population, box.dimension)))}


Evaluate: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def nsga2(
    evaluate: Evaluate, objectives: int, box: SearchBox, population: int, generations: int, seed: int
) -> FloatArray:
    """The feasible members of the last population that no other one dominates, (m, d); m may be 0.

    Feasibility comes first: of two infeasible candidates the one with the smaller violation is better.

    Args:
        evaluate: objectives (m, objectives) and violations (m,), positive where infeasible, of candidates (m, d).
        objectives: how many there are.
        box: to search.
        population: members, and new candidates in each generation.
        generations: the initial population is the first.
        seed: same seed, same result.
    """
    algorithm = NSGA2(pop_size=population)
    stated = Problem(n_var=box.dimension, n_obj=objectives, n_ieq_constr=1, xl=0.0, xu=1.0)
    algorithm.setup(stated, termination=NoTermination(), seed=seed % 2**31)
    for _ in range(generations):
        candidates = algorithm.ask()
        values, violations = evaluate(box.from_unit(candidates.get("X").astype(np.float64)))
        Evaluator().eval(StaticProblem(stated, F=values, G=violations[:, None]), candidates)
        algorithm.tell(infills=candidates)
    best = algorithm.opt
    feasible = best.get("CV").ravel() <= 0.0
    return box.from_unit(best.get("X").astype(np.float64)[feasible].reshape(-1, box.dimension))
