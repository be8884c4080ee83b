"""The best plan in a given time: a swarm's candidates and starts that know the structure, refined by turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, TypeAlias

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import IPOPT, Archive, Box, Budget, Result, Solver, minimize
from solvers.driver.interruption import Interruption
from tpbso_casadi.planning.finishing import retimed
from tpbso_casadi.planning.motion import Motion, motion_of
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.planning.refinement import Polish, Refinement, distinct, refine
from tpbso_casadi.planning.search_log import log_search
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
        polish: what descents did; None when there was no time, or nothing to descend.
        outlook: what the last stage of the plan will make of the motion.
    """

    search: Result
    motion: Motion
    polish: Polish | None
    outlook: Motion

    @property
    def rank(self) -> tuple[bool, float]:
        """The smaller, the better."""
        return not self.outlook.feasible, self.outlook.merit


Improve: TypeAlias = Callable[[Result, Motion, Archive, float], Round]


def best_within(
    problem: Problem[Any],
    solver: Solver,
    asked: SolverSection,
    evaluation: EvaluationOptions | None,
    progress: Progress,
    interruption: Interruption,
    known: FloatArray | None = None,
) -> tuple[Round, int]:
    """The best round of ``asked.within`` seconds, and how many there were: search, refine, and again with a new seed.

    The first search is done in any case, and begins with what is known, candidates (m, d); refining follows if time is
    left. Results depend on the machine.
    """
    assert asked.within is not None
    ends = time.perf_counter() + asked.within
    box = Box(*problem.bounds)
    evaluate = interruption.breakable(partial(problem.evaluator, evaluation))
    improve = _descents(problem, asked, progress, interruption) if problem.is_descended else _programs(progress)
    rounds: list[Round] = []
    while not rounds or (time.perf_counter() < ends and not interruption.requested):
        left, archive = ends - time.perf_counter(), Archive(box)
        budget = Budget(asked.evaluations or ROUND, asked.iterations, SEARCH_SHARE * left if left > 0.0 else None)
        progress.phase("searching")
        search = minimize(evaluate, box, solver, budget, asked.seed + len(rounds), progress.status, archive, known)
        log_search("search", search)
        known = None
        motion, left = motion_of(problem, search.x), ends - time.perf_counter()
        last = left <= 0.0 or interruption.requested
        rounds.append(Round(search, motion, None, motion) if last else improve(search, motion, archive, left))
    return min(rounds, key=lambda each: each.rank), len(rounds)


def _descents(problem: Problem[Any], asked: SolverSection, progress: Progress, interruption: Interruption) -> Improve:
    """Descents of the nonlinear program from good candidates and structured starts."""
    refinement = interruption.breakable(partial(Refinement, problem, IPOPT()))
    structured = refinement.program.starts(np.random.default_rng(asked.seed))

    def improve(search: Result, motion: Motion, archive: Archive, seconds: float) -> Round:
        chosen = distinct(problem, [search.x, *archive.x], asked.polish_starts or CANDIDATES)
        starts = by_turns(structured, map(refinement.program.from_search, chosen))
        progress.phase("polishing")
        polish = refine(motion, starts, refinement, Budget(seconds=seconds), progress)
        return Round(search, polish.chosen, polish, polish.chosen)

    return improve


def _programs(progress: Progress) -> Improve:
    """Sequential linear programs, which are also the plan's last stage: they tell what each motion will become."""

    def improve(search: Result, motion: Motion, archive: Archive, seconds: float) -> Round:
        return Round(search, motion, None, retimed(motion, progress).chosen)

    return improve


def by_turns(structured: Iterator[FloatArray], candidates: Iterable[FloatArray]) -> Iterator[FloatArray]:
    """``STRUCTURED`` of an endless series after each candidate."""
    for candidate in candidates:
        yield candidate
        yield from islice(structured, STRUCTURED)
