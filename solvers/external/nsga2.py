"""NSGA-II of pymoo: two objectives or more at once.

Deb, Pratap, Agarwal and Meyarivan, "A fast and elitist multiobjective genetic algorithm: NSGA-II", 2002.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem

from solvers.box import Box, FloatArray

Evaluate: TypeAlias = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def nsga2(evaluate: Evaluate, objectives: int, box: Box, population: int, generations: int, seed: int) -> FloatArray:
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
