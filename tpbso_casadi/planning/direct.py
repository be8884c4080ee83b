"""The strategy that takes no search: motions at a lower bound of what is minimised, else along paths, polished."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any

import numpy as np

from problems import InvalidProblem, Problem, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.certify import ROUNDING_ALLOWANCE
from solvers import StopReason, unsearched
from tpbso_casadi.planning.finishing import AS_FAST, PlannedMotion, is_better, slowed
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.planning.planning import Planning
from tpbso_casadi.scenario import FAMILIES, ScenarioError

LOG = logging.getLogger(__name__)
ABOUT_AS_GOOD = 1.002
MOST_PROOFS = 20  # of motions that are clear where they were looked at
MOST_APPROACHES = 8  # postures at the ends whose ways are polished, where one leads to a plan
APART = 0.4  # rad, of some joint: postures at the ends that are less are much the same
WORTH_TRYING = 1.002  # of a bound: what is gained below that is not worth a way


def directly(problem: Problem[Any], planning: Planning) -> PlannedMotion | None:
    """A certified plan that takes no search; None where the solver is another one, or none is found."""
    model = planning.scenario.model
    if not (planning.settings.is_direct and (model.retime or FAMILIES[model.motion].keeps_its_timing)):
        return None
    try:
        return planning.interruption.attempt(partial(_directly, problem, planning))
    except InvalidProblem as error:
        raise ScenarioError(f"task.{error.field}: {error.reason}") from error


def _directly(problem: Problem[Any], planning: Planning) -> PlannedMotion | None:
    """A plan at a bound, unless an end may move and be reached sooner elsewhere: then the best along paths."""
    found = at_the_bound(problem, planning)
    if found is None:
        return along_paths(problem, planning, None)
    if planning.settings.first or found.problem is None or not found.problem.direct.ends_may_move:
        return found
    least = min(branch.direct.least_bound for branch in problem.branches or (problem,))
    return found if found.motion.compared <= ABOUT_AS_GOOD * least else along_paths(problem, planning, found)


def at_the_bound(problem: Problem[Any], planning: Planning) -> PlannedMotion | None:
    """A certified motion that nothing between its ends can beat; None where none is found.

    Past vias it is the fastest that is found, which need not be the fastest of all. Of several branches, the first one
    that has such a motion counts, the quickest in free space first.
    """
    began = time.perf_counter()
    planning.progress.phase("trying motions at the bound")
    for rounds, branch in enumerate(problem.branches or (problem,), start=1):
        rng = np.random.default_rng(planning.settings.seed)
        for trajectory in islice(branch.direct.at_the_bound(rng), MOST_PROOFS):
            if planning.running_out():
                return None
            motion = judged(branch.criteria, trajectory)
            if motion.trajectory.duration <= AS_FAST * trajectory.duration and motion.feasible:
                LOG.info("bound: a motion as fast as can be, in %.3f s", time.perf_counter() - began)
                is_bound = branch.criteria.task.passes_nothing
                reason = StopReason.TARGET if is_bound else StopReason.CONVERGED
                return _plan(planning, branch, motion, began, reason, rounds)
    return None


def along_paths(problem: Problem[Any], planning: Planning, known: PlannedMotion | None) -> PlannedMotion | None:
    """The best certified motion along paths between postures at the ends, or the one that is known; None for none.

    Postures are tried in the order of their bounds, until none can lead to better than the best motion; of those that
    lie together one is.
    """
    began = time.perf_counter()
    planning.progress.phase("polishing ways around")
    best = None if known is None or known.problem is None else (known.motion, known.problem)
    approaches = [(branch, each) for branch in problem.branches or (problem,) for each in branch.direct.approaches()]
    tried: list[FloatArray] = []
    for branch, approach in sorted(approaches, key=lambda one: one[1].bound):
        to_beat = np.inf if best is None else best[0].compared
        if WORTH_TRYING * approach.bound >= to_beat:
            break
        ends = np.concatenate([approach.start, approach.goal])
        if any(np.abs(ends - other).max() < APART for other in tried):
            continue
        tried.append(ends)
        for trajectory in branch.direct.along_paths(approach, planning.settings.seed, to_beat, planning.satisfied):
            motion = judged(branch.criteria, trajectory)
            if motion.feasible and (best is None or is_better(motion, best[0])):
                best = motion, branch
        if planning.satisfied(best is not None) or (best is not None and len(tried) >= MOST_APPROACHES):
            break
    LOG.info("direct: ways to %d of %d postures in %.3f s", len(tried), len(approaches), time.perf_counter() - began)
    if best is None or (known is not None and best[0] is known.motion):
        return known
    return _plan(planning, best[1], best[0], began, StopReason.CONVERGED, len(tried))


def too_late(problem: Problem[Any], planning: Planning) -> PlannedMotion | None:
    """The fastest motion in free space, judged, where no time is left for a better one; None where some is left."""
    branch = (problem.branches or (problem,))[0]
    fastest = branch.direct.in_free_space if planning.settings.is_direct and planning.left <= 0.0 else None
    if fastest is None:
        return None
    motion = JudgedMotion(branch.criteria.at_free_times(), fastest, {}, retimed=True)
    return _plan(planning, branch, motion, time.perf_counter(), StopReason.SECONDS, 1)


def judged(criteria: Criteria, trajectory: Trajectory) -> JudgedMotion:
    """A motion that is to keep its limits, judged; slower, where it does not."""
    motion = JudgedMotion(criteria.at_free_times(), trajectory.time_scaled(1.0 + ROUNDING_ALLOWANCE), {}, retimed=True)
    return motion if motion.feasible else slowed(replace(motion, trajectory=trajectory))


def polished(
    problem: Problem[Any], criteria: Criteria, motion: Trajectory, is_enough: Callable[[bool], bool]
) -> Trajectory | None:
    """The first certified motion that programs make of one, if it is faster; else None."""
    with suppress(InvalidProblem):
        tried = (judged(criteria, trajectory) for trajectory in problem.direct.polished(motion, is_enough))
        found = next((other.trajectory for other in tried if other.feasible), motion)
        return found if found.duration < motion.duration else None
    return None


def _plan(
    planning: Planning, problem: Problem[Any], motion: JudgedMotion, began: float, reason: StopReason, rounds: int
) -> PlannedMotion:
    search = unsearched(motion.objective, time.perf_counter() - began, planning.settings.seed, reason)
    return PlannedMotion(scenario=planning.scenario, problem=problem, search=search, motion=motion, rounds=rounds)
