"""One plan: search, polish, timing, proof."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from math import isfinite
from typing import Any

import numpy as np

from problems import CertificateStatus, InvalidProblem, Problem, Trajectory
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import (
    IPOPT,
    Interruption,
    Result,
    deferred_interrupt,
    keep_best,
)
from tpbso_casadi.planning.branches import best_of_branches, best_within
from tpbso_casadi.planning.direct import directly, too_late
from tpbso_casadi.planning.finishing import (
    PlannedMotion,
    Refinement,
    has_descents,
    is_better,
    polish,
    retimed,
)
from tpbso_casadi.planning.known_motions import EarlierMotion
from tpbso_casadi.planning.motion import INFEASIBLE_MERIT, JudgedMotion
from tpbso_casadi.planning.planning import Planning, SharedSearches
from tpbso_casadi.planning.progress import Progress, log_search
from tpbso_casadi.planning.sequence import planned_sequence
from tpbso_casadi.planning.sequence_bound import SequenceBound, sequence_bound
from tpbso_casadi.scenario import FIELDS, Scenario, ScenarioError

LOG = logging.getLogger(__name__)
SILENT = Progress()
LEAST_WITHIN = 0.01  # s: that a search has in any case
RESTARTS = 2  # of a search in space without a certified plan


def plan(
    scenario: Scenario,
    progress: Progress = SILENT,
    evaluation: EvaluationOptions | None = None,
    problem: Problem[Any] | None = None,
    starts: Sequence[Trajectory] = (),
    warm_start: PlannedMotion | EarlierMotion | None = None,
    shared: SharedSearches | None = None,
) -> PlannedMotion:
    """Plan a scenario: search, refine, time, and judge the motion for all t.

    Args:
        scenario: robot, task, limits, solver, budget and seed.
        progress: is told what begins, and the status after every iteration.
        evaluation: how populations are evaluated; changes the time, not the result.
        problem: that of the scenario, if it is built already.
        starts: motions from which IPOPT descends before it does from candidates of the search; they count among the
            starts that the scenario asks for. Not where a scenario gives a time (``within``), nor in space where
            sequential programs refine.
        warm_start: a plan of a similar scenario, or its motion alone: the search begins with it, a descent too; a
            sequence keeps the motions of stages that are stated as they were.
        shared: searches that plans of the same scenario and problem, but for the polish, have in common.

    Returns:
        The plan. After Ctrl-C too, once there is a candidate: the best so far.

    Raises:
        ScenarioError: the task cannot be done, the solver is unknown, what is minimised has no value, or there is
            nothing to learn from the plan to start from.
        KeyboardInterrupt: Ctrl-C, before there was a candidate.
        BaseException: whatever a callback or a solver of a user's own raises. Once there is a candidate, the
            exception's attribute ``best_so_far`` is the plan until then, neither refined nor timed any further; not of
            a sequence, which is no motion before all of it is planned.
    """
    within = scenario.solver.within
    deadline = np.inf if within is None else time.perf_counter() + within
    with deferred_interrupt() as interruption:
        progress.phase("modelling")
        if not scenario.task.has_solver:
            return _valued(_timed(scenario, progress, interruption))
        planning = Planning(
            scenario=scenario,
            solver=scenario.solver.build(),
            settings=scenario.solver,
            evaluation=evaluation,
            progress=progress,
            interruption=interruption,
            starts=starts,
            deadline=deadline,
            shared=shared,
            warm_start=warm_start,
        )
        if not scenario.task.is_searched:
            return interruption.breakable(partial(_whole_sequence, scenario, planning))
        problem = interruption.breakable(scenario.problem) if problem is None else problem
        found = directly(problem, planning) or too_late(problem, planning) or by_search(problem, planning)
        for error in planning.failures[:1]:
            keep_best(error, found)
            raise error
        return _valued(found)


def bound(scenario: Scenario) -> SequenceBound:
    """The least time of a sequence between its postures; nothing is planned.

    Raises:
        ScenarioError: it states no sequence.
        KeyboardInterrupt: Ctrl-C.
    """
    with deferred_interrupt() as interruption:
        return interruption.breakable(partial(sequence_bound, scenario))


def _whole_sequence(scenario: Scenario, planning: Planning) -> PlannedMotion:
    """The plan of a sequence; what is raised while a stage is planned holds no plan, as that is of the stage alone."""
    try:
        return planned_sequence(scenario, planning, plan)
    except BaseException as error:
        keep_best(error, None)
        raise


def _timed(scenario: Scenario, progress: Progress, interruption: Interruption) -> PlannedMotion:
    """The motion of a scenario that states a path."""
    criteria = interruption.breakable(scenario.criteria)
    began = time.perf_counter()
    progress.phase("retiming")
    try:
        motion = interruption.breakable(lambda: JudgedMotion(criteria, criteria.given_motion(), {}))
    except InvalidProblem as error:
        raise ScenarioError(f"task.{FIELDS.get(error.field, error.field)}: {error.reason}") from error
    seconds = time.perf_counter() - began
    LOG.info("retiming: a given path in %.3f s", seconds)
    return PlannedMotion(scenario=scenario, motion=motion, seconds_timed=seconds)


def _valued(found: PlannedMotion) -> PlannedMotion:
    """The plan, if what is minimised has a value.

    Raises:
        ScenarioError: all limits hold, but the objective is no number.
    """
    if found.motion.status is CertificateStatus.CERTIFIED and not isfinite(found.objective):
        name, value = found.criteria.objective.name, found.objective
        raise ScenarioError(f"task.objective: {name!r} is undefined ({value:g}) along the motion that was found")
    return found


def by_search(problem: Problem[Any], planning: Planning) -> PlannedMotion:
    """The best plan that searches lead to, of all branches, in the time that is left."""
    if planning.settings.within is not None:
        planning = planning.with_settings(within=max(planning.left, LEAST_WITHIN))
    if not problem.branches or planning.solver.solves_program:
        return with_restarts(problem, planning)
    return best_of_branches(problem, planning, with_restarts)


def with_restarts(problem: Problem[Any], planning: Planning) -> PlannedMotion:
    """The plan of a problem that keeps to one branch, with other seeds where the first leads to nothing."""
    found = from_one_seed(problem, planning)
    for number in range(1, RESTARTS + 1 if may_start_again(planning.scenario, problem) else 1):
        if found.feasible or planning.is_cut_short:
            break
        again = planning.with_settings(seed=planning.settings.seed + number)
        other = planning.attempt(partial(_directly_or_by_search, problem, again))
        if other is None:
            return replace(found, interrupted=True)
        found = replace(other if is_better(other.motion, found.motion) else found, rounds=number + 1)
    return found


def _directly_or_by_search(problem: Problem[Any], planning: Planning) -> PlannedMotion:
    return directly(problem, planning) or from_one_seed(problem, planning)


def may_start_again(scenario: Scenario, problem: Problem[Any]) -> bool:
    """Whether searches with other seeds follow one that led to no certified plan: the way out of narrow passages."""
    timed = scenario.solver.within is not None or scenario.solver.time_limit is not None
    return problem.direct.replaces_descents and scenario.model.retime and not timed


def from_one_seed(problem: Problem[Any], planning: Planning) -> PlannedMotion:
    """The plan of one search, polished and timed.

    Raises:
        ScenarioError: a nonlinear program is asked for where there is none.
    """
    within = planning.settings.within is not None
    for key, asked in (("name", planning.solver.solves_program), ("within", within)):
        if asked and not problem.has_program:
            raise ScenarioError(f"solver.{key}: this task has no nonlinear program to descend")
    if isinstance(planning.solver, IPOPT):
        found = _descended(problem, planning, planning.solver)
    elif within:
        found = best_within(problem, planning, planning.solver, candidates_of(problem, planning.warm_start))
    else:
        found = _searched(problem, planning, candidates_of(problem, planning.warm_start))
    return finished(found, problem, planning) if planning.scenario.model.retime else found


def _descended(problem: Problem[Any], planning: Planning, solver: IPOPT) -> PlannedMotion:
    """A plan by gradients alone, from motions that are given, then from the program's own starts, again and again."""
    refinement = planning.interruption.breakable(partial(Refinement, problem, solver))
    planning.progress.phase("searching")
    settings = planning.settings
    own = refinement.program.starts(np.random.default_rng(settings.seed))
    known = planning.warm_start
    first = planning.starts if known is None else (known.trajectory, *planning.starts)
    starts = chain(map(refinement.program.from_trajectory, first), own)
    status = planning.progress.status
    search = planning.searched(partial(refinement.descend, starts, settings.budget(), settings.seed, status))
    log_search("descent", search)
    return PlannedMotion(
        scenario=planning.scenario,
        problem=problem,
        search=search,
        motion=refinement.motion(search.x),
        interrupted=planning.is_cut_short,
    )


def _searched(problem: Problem[Any], planning: Planning, known: FloatArray | None) -> PlannedMotion:
    """A plan by a metaheuristic, polished if the scenario says so; the search begins with known candidates (m, d)."""
    settings, progress = planning.settings, planning.progress
    progress.phase("searching")
    found = planning.search(problem, settings.budget(), known)
    search = found.result
    log_search("search", search)
    motion = found.motion
    refined = None
    if settings.polish_starts and has_descents(problem):
        good = [search.x] if found.archive is None else [search.x, *found.archive.x]
        work = partial(polish, problem, motion, good, settings.polish_starts, progress, planning.starts)
        refined = planning.breakable_attempt(work)
    return PlannedMotion(
        scenario=planning.scenario,
        problem=problem,
        search=search,
        motion=motion if refined is None else refined.chosen,
        polish=refined,
        interrupted=planning.is_cut_short,
    )


def finished(found: PlannedMotion, problem: Problem[Any], planning: Planning) -> PlannedMotion:
    """The plan as fast as its limits allow; as it was found where it is cut short."""
    work = partial(retimed, found.motion, problem.direct, planning.progress, planning.satisfied)
    retiming = found.retiming or planning.breakable_attempt(work)
    motion = found.motion if retiming is None else retiming.chosen
    return replace(found, motion=motion, retiming=retiming, interrupted=planning.is_cut_short)


def candidates_of(problem: Problem[Any], previous: PlannedMotion | EarlierMotion | None) -> FloatArray | None:
    """The candidates (m, d) that a plan leaves for the search of another problem; None where no plan is given.

    They are the best candidate of its own search, where that had the same variables, and the motion itself, where the
    problem can tell which candidate is nearest to it.

    Raises:
        ScenarioError: it has neither, or is of another number of joints.
    """
    if previous is None:
        return None
    joints, dof = previous.trajectory.coefficients.shape[2], problem.motion.robot.dof
    if joints != dof:
        raise ScenarioError(f"warm_start: a motion of {joints} joints for a robot of {dof}")
    rows = []
    if isinstance(previous, PlannedMotion) and previous.search is not None and previous.problem is not None:
        search = previous.search
        if not search.x.size:
            return None
        before, now = ([variable.name for variable in each.variables] for each in (previous.problem, problem))
        rows = [search.x] if before == now and not search.in_program_variables else []
    nearest = problem.nearest_candidate(previous.trajectory)
    rows += [] if nearest is None else [nearest]
    if not rows:
        raise ScenarioError("warm_start: its search had other variables, and none can be fitted to its motion")
    return np.stack(rows)


def convergence(search: Result) -> tuple[FloatArray, FloatArray]:
    """Best cost so far over iterations: both (n,). The last entry may be an iteration that was cut short."""
    return search.history.numbers, search.history.cost


def first_feasible(problem: Problem[Any], search: Result) -> int | None:
    """The index in the history from which the best candidate was feasible at the samples; None if there was none."""
    descended = search.in_program_variables
    least_infeasible = INFEASIBLE_MERIT if descended else np.nextafter(problem.objective_upper_bound, np.inf)
    feasible = np.flatnonzero(search.history.cost < least_infeasible)
    return int(feasible[0]) if feasible.size else None


def step_name(search: Result) -> str:
    """The name of the steps that a history counts."""
    return search.history.steps.name
