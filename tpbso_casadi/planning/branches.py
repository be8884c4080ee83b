"""Branches of a move, and plans within a time.

Which branch leads to the best motion shows only when it is searched: the one that is nearest in free space may lie
behind an obstacle.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from math import inf
from typing import Any, TypeAlias, TypeVar

import casadi as ca
import numpy as np

from problems import Problem
from problems.base import FloatArray
from solvers import IPOPT, Archive, Budget, Result, SearchBox, Solver, minimize
from tpbso_casadi.planning.finishing import (
    PlannedMotion,
    Polish,
    Refinement,
    Retiming,
    distinct,
    has_descents,
    is_better,
    refine,
    retimed,
)
from tpbso_casadi.planning.motion import JudgedMotion, motion_of
from tpbso_casadi.planning.planning import Planning, SearchRecord
from tpbso_casadi.planning.progress import log_search

T = TypeVar("T")
FINALISTS = 3  # the race's own pick alone is unreliable
CLOSE = 1.15  # times the best cost of the race: what is above is not planned
DEEP = 0.02  # m or rad/s^n: a polish mends less, what breaks a limit by more is a way through an obstacle
RACE_SHARE = 0.3  # of the evaluations and iterations of a finalist's search, for each branch
WORTH = 0.8  # of what a branch's own posture takes in free space: about what a free one near it may gain
RACE_TIME = 0.4  # of a time limit, for all branches together


def best_of_branches(
    problem: Problem[Any], planning: Planning, planned: Callable[[Problem[Any], Planning], PlannedMotion]
) -> PlannedMotion:
    """The best plan of the race's finalists.

    Ctrl-C ends the race; the best so far is planned with what is left of its search. Where something raises in the
    race, the best of it is the plan.

    Args:
        problem: with several branches.
        planning: its settings are those of a finalist's search; a time limit is that of everything.
        planned: the whole plan of a problem that keeps to one branch.
    """
    planning.progress.phase("racing branches")
    settings = planning.settings
    whole = settings.budget() if settings.within is None else Budget(seconds=settings.within)
    budget = _short(whole, len(problem.branches))
    raced: list[SearchRecord] = []
    for branch in problem.branches:
        if planning.is_cut_short and raced:
            break
        if WORTH * _in_time(branch) + _added(branch) < min(map(_compared, raced), default=inf):
            raced += _attempted(raced, planning, partial(planning.search, branch, budget))
    if planning.failures:
        return _as_plan(_finalists(raced)[0], planning, len(raced))
    limits = {"time_limit": settings.time_limit, "within": settings.within}
    share = (1.0 - RACE_TIME) / FINALISTS  # of the time, for each finalist
    left = planning.with_settings(**{key: share * s for key, s in limits.items() if s is not None})
    best: PlannedMotion | None = None
    for number, finalist in enumerate(_finalists(raced), start=1):
        if best is not None and planning.is_cut_short:
            break
        for found in _attempted(best, planning, partial(planned, finalist.problem, left)):
            best = found if best is None or is_better(found.motion, best.motion) else best
            best = replace(best, rounds=len(raced) + number)
    assert best is not None
    return replace(best, interrupted=planning.is_cut_short)


def _attempted(before: object, planning: Planning, work: Callable[[], T]) -> list[T]:
    """The result of work, if any; whatever it raises passes where there is nothing before it to be kept."""
    if not before:
        return [work()]
    found = planning.attempt(work)
    return [] if found is None else [found]


def _finalists(raced: Sequence[SearchRecord]) -> list[SearchRecord]:
    """The best of the race, those last that slip through something between their samples."""
    clear: list[SearchRecord] = []
    slipping: list[SearchRecord] = []
    for each in sorted(raced, key=_compared):
        if len(clear) < FINALISTS and not (clear and _compared(each) > CLOSE * _compared(clear[0])):
            (slipping if each.motion.worst_violation > DEEP else clear).append(each)
    return (clear or slipping)[:FINALISTS]


def _compared(raced: SearchRecord) -> float:
    """The cost of a search's motion with that of its goal."""
    return raced.result.cost + _added(raced.problem)


def _added(branch: Problem[Any]) -> float:
    return branch.criteria.task.goal_cost


def _in_time(branch: Problem[Any]) -> float:
    """The objective at the time that the branch's posture takes in free space; minus infinity where time may help."""
    objective = branch.criteria.objective
    if not (objective.is_time_dependent and objective.sooner_is_better):
        return -inf
    return float(objective.terminal(ca.DM(branch.direct.free_space_time)))


def _as_plan(raced: SearchRecord, planning: Planning, rounds: int) -> PlannedMotion:
    """The plan of a race that was cut short."""
    return PlannedMotion(
        scenario=planning.scenario,
        problem=raced.problem,
        search=raced.result,
        motion=raced.motion,
        rounds=rounds,
        interrupted=True,
    )


def _short(whole: Budget, branches: int) -> Budget:
    """The budget of one branch in the race."""

    def share(number: int | None) -> int | None:
        return None if number is None else max(1, round(RACE_SHARE * number))

    seconds = None if whole.seconds is None else RACE_TIME * whole.seconds / branches
    return Budget(share(whole.evaluations), share(whole.iterations), seconds)


ROUND_EVALUATIONS = 10_000  # of a search in a series of them, unless the scenario says how many
SEARCH_SHARE = 0.5  # of the time that is left, at most, for a search
LEAST_LEFT = 1.0  # s: a search that begins when no time is left may take its share of so much
CANDIDATES = 3  # of each search that are refined, unless the scenario says how many
STRUCTURED = 4  # starts of the program after each of these


@dataclass(frozen=True)
class SearchRound:
    """A search, and what was made of it.

    Attributes:
        search: of the metaheuristic.
        motion: the best of the round.
        polish: what descents did; None when there was no time, or nothing to descend.
        retiming: what the last stage of the plan makes of the motion; None where that is still to come.
    """

    search: Result
    motion: JudgedMotion
    polish: Polish | None
    retiming: Retiming | None = None

    @property
    def rank(self) -> tuple[bool, float]:
        """The smaller, the better."""
        outlook = self.motion if self.retiming is None else self.retiming.chosen
        return not outlook.feasible, outlook.merit


Improve: TypeAlias = Callable[[Result, JudgedMotion, Archive, float], SearchRound]


def best_within(problem: Problem[Any], planning: Planning, solver: Solver, known: FloatArray | None) -> PlannedMotion:
    """The best of as many rounds as the seconds of the settings allow: search, refine, and again with a new seed.

    A first search is made in any case, a short one where no time is left, and begins with what is known, candidates
    (m, d); refining follows if time is left. Results depend on the machine.
    """
    asked, progress = planning.settings, planning.progress
    assert asked.within is not None
    ends = time.perf_counter() + asked.within
    box = SearchBox(*problem.bounds)
    evaluate = planning.evaluator(problem)
    improve = _descents(problem, planning) if has_descents(problem) else _programs(problem, planning)
    rounds: list[SearchRound] = []
    while not rounds or (time.perf_counter() < ends and not planning.is_cut_short):
        left, archive = ends - time.perf_counter(), Archive(box)
        evaluations = asked.evaluations or ROUND_EVALUATIONS
        budget = Budget(evaluations, asked.iterations, SEARCH_SHARE * max(left, LEAST_LEFT))
        progress.phase("searching")
        seed, status = asked.seed + len(rounds), progress.status
        work = partial(minimize, evaluate, box, solver, budget, seed, status, archive, known)
        for search in _attempted(rounds, planning, partial(planning.searched, work)):
            log_search("search", search)
            motion, left = motion_of(problem, search.x), ends - time.perf_counter()
            last = left <= 0.0 or planning.is_cut_short
            better = None if last else planning.attempt(partial(improve, search, motion, archive, left))
            rounds.append(better or SearchRound(search, motion, None))
        known = None
    best = min(rounds, key=lambda each: each.rank)
    return PlannedMotion(
        scenario=planning.scenario,
        problem=problem,
        search=best.search,
        motion=best.motion,
        polish=best.polish,
        rounds=len(rounds),
        retiming=best.retiming if planning.scenario.model.retime else None,
        interrupted=planning.is_cut_short,
    )


def _descents(problem: Problem[Any], planning: Planning) -> Improve:
    """Descents of the nonlinear program from good candidates and structured starts."""
    refinement = planning.interruption.breakable(partial(Refinement, problem, IPOPT()))
    structured = refinement.program.starts(np.random.default_rng(planning.settings.seed))

    def improve(search: Result, motion: JudgedMotion, archive: Archive, seconds: float) -> SearchRound:
        chosen = distinct(problem, [search.x, *archive.x], planning.settings.polish_starts or CANDIDATES)
        starts = by_turns(structured, map(refinement.program.from_search, chosen))
        planning.progress.phase("polishing")
        polish = refine(motion, starts, refinement, Budget(seconds=seconds), planning.progress)
        return SearchRound(search, polish.chosen, polish)

    return improve


def _programs(problem: Problem[Any], planning: Planning) -> Improve:
    """Sequential linear programs, which are the plan's last stage."""

    def improve(search: Result, motion: JudgedMotion, archive: Archive, seconds: float) -> SearchRound:
        retiming = retimed(motion, problem.direct, planning.progress, planning.satisfied)
        return SearchRound(search, motion, None, retiming)

    return improve


def by_turns(structured: Iterator[FloatArray], candidates: Iterable[FloatArray]) -> Iterator[FloatArray]:
    """``STRUCTURED`` of an endless series after each candidate."""
    for candidate in candidates:
        yield candidate
        yield from islice(structured, STRUCTURED)
