"""The best plan in a given time: a swarm's candidates and starts that know the structure, refined by turns."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import IPOPT, Archive, Box, Budget, Result, Solver, minimize
from solvers.driver.interruption import Interruption
from tpbso_casadi.planning.motion import Motion, motion_of
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.planning.refinement import Polish, Refinement, distinct, refine
from tpbso_casadi.scenario.scenario import SolverSection

ROUND = 10_000  # evaluations of a search in a series of them, unless the scenario says how many
SEARCH_SHARE = 0.5  # of the time that is left, at most, for a search
CANDIDATES = 3  # of each search that are refined, unless the scenario says how many
STRUCTURED = 4  # starts of the program after each of these


@dataclass(frozen=True)
class Round:
    """A search, and what was made of it.

    Attributes:
        search: of the metaheuristic.
        motion: the best of the round.
        polish: what descents did; None when there was no time.
    """

    search: Result
    motion: Motion
    polish: Polish | None


def best_within(
    problem: Problem[Any],
    solver: Solver,
    asked: SolverSection,
    evaluation: EvaluationOptions | None,
    progress: Progress,
    interruption: Interruption,
) -> tuple[Round, int]:
    """The best round of ``asked.within`` seconds, and how many there were: search, descend, and again with a new seed.

    The first search is done in any case; descents follow if time is left. Results depend on the machine.
    """
    assert asked.within is not None
    ends = time.perf_counter() + asked.within
    box = Box(*problem.bounds)
    evaluate = interruption.breakable(partial(problem.evaluator, evaluation))
    refinement = interruption.breakable(partial(Refinement, problem, IPOPT()))
    structured = refinement.program.starts(np.random.default_rng(asked.seed))
    rounds: list[Round] = []
    while not rounds or (time.perf_counter() < ends and not interruption.requested):
        left, archive = ends - time.perf_counter(), Archive(box)
        budget = Budget(asked.evaluations or ROUND, asked.iterations, SEARCH_SHARE * left if left > 0.0 else None)
        progress.phase("searching")
        search = minimize(evaluate, box, solver, budget, asked.seed + len(rounds), progress.status, archive)
        motion, left = motion_of(problem, search.x), ends - time.perf_counter()
        if left <= 0.0 or interruption.requested:
            rounds.append(Round(search, motion, None))
            continue
        chosen = distinct(problem, [search.x, *archive.x], asked.polish_starts or CANDIDATES)
        starts = by_turns(structured, map(refinement.program.from_search, chosen))
        progress.phase("polishing")
        polish = refine(motion, starts, refinement, Budget(seconds=left), progress)
        rounds.append(Round(search, polish.chosen, polish))
    return min(rounds, key=lambda each: (not each.motion.feasible, each.motion.merit)), len(rounds)


def by_turns(structured: Iterator[FloatArray], candidates: Iterable[FloatArray]) -> Iterator[FloatArray]:
    """``STRUCTURED`` of an endless series after each candidate."""
    for candidate in candidates:
        yield candidate
        yield from islice(structured, STRUCTURED)
