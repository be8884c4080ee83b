"""One plan: search, polish, timing, proof."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import isfinite
from typing import Any, TypeVar

import numpy as np

from problems import CertificateStatus, InvalidProblem, Problem, Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import IPOPT, AnySolver, Archive, Box, Interruption, Result, Solver, deferred_interrupt, minimize
from tpbso_casadi.planning.branches import best_of_branches, best_within
from tpbso_casadi.planning.finishing import PlannedMotion, Refinement, SearchedMotion, is_better, polish, retimed
from tpbso_casadi.planning.motion import INFEASIBLE_MERIT, Motion, motion_of
from tpbso_casadi.planning.progress import Progress, log_search
from tpbso_casadi.scenario import FIELDS, Scenario, ScenarioError, SolverSection

LOG = logging.getLogger(__name__)


def timed(scenario: Scenario, criteria: Criteria, progress: Progress, interruption: Interruption) -> PlannedMotion:
    """The motion of a scenario that states a path.

    Raises:
        ScenarioError: there is no motion along it.
        KeyboardInterrupt: Ctrl-C.
    """
    began = time.perf_counter()
    progress.phase("retiming")
    try:
        motion = interruption.breakable(partial(motion_along, criteria))
    except InvalidProblem as error:
        raise ScenarioError(f"task.{FIELDS.get(error.field, error.field)}: {error.reason}") from error
    seconds = time.perf_counter() - began
    LOG.info("retiming: a given path in %.3f s", seconds)
    return PlannedMotion(scenario=scenario, motion=motion, seconds_timed=seconds)


def motion_along(criteria: Criteria) -> Motion:
    """The motion along a given path in the least time, verified.

    Raises:
        InvalidProblem: there is none.
    """
    return Motion(criteria, criteria.given_motion(), {})


def candidates_of(problem: Problem[Any], previous: PlannedMotion | Motion | None) -> FloatArray | None:
    """The candidates (m, d) that a plan leaves for the search of another problem; None where no plan is given.

    They are the best candidate of its own search, where that had the same variables, and the motion itself, where the
    problem can tell which candidate is nearest to it.

    Raises:
        ScenarioError: it has neither, or is of another number of joints.
    """
    if previous is None:
        return None
    joints = previous.trajectory.coefficients.shape[2]
    if joints != problem.robot.dof:
        raise ScenarioError(f"warm_start: a motion of {joints} joints for a robot of {problem.robot.dof}")
    rows = [x for x in (_searched(problem, previous), problem.nearest_candidate(previous.trajectory)) if x is not None]
    if not rows:
        raise ScenarioError("warm_start: its search had other variables, and none can be fitted to its motion")
    return np.stack(rows)


def _searched(problem: Problem[Any], previous: PlannedMotion | Motion) -> FloatArray | None:
    """The best candidate (d,) of its search, where there was one with the same variables."""
    found = previous.searched if isinstance(previous, PlannedMotion) else None
    if found is None or found.search.in_program_variables:
        return None
    names = [[variable.name for variable in each.variables] for each in (found.problem, problem)]
    return found.search.x if names[0] == names[1] else None


P = TypeVar("P", bound=PlannedMotion)
SILENT = Progress()
RESTARTS = 2  # of a search in space without a certified plan


def plan(
    scenario: Scenario,
    progress: Progress = SILENT,
    evaluation: EvaluationOptions | None = None,
    problem: Problem[Any] | None = None,
    starts: Sequence[Trajectory] = (),
    warm_start: PlannedMotion | Motion | None = None,
) -> PlannedMotion:
    """Plan a scenario; a :class:`SearchedMotion` where there is something to search.

    Args:
        scenario: robot, task, limits, solver, budget and seed.
        progress: is told what begins, and the status after every iteration.
        evaluation: how populations are evaluated; changes the time, not the result.
        problem: that of the scenario, if it is built already.
        starts: motions from which IPOPT descends before it does from candidates of the search; they count among the
            starts that the scenario asks for. Not where a scenario gives a time (``within``), nor in space where
            sequential programs refine.
        warm_start: a plan of a similar scenario, or its motion: the search begins with it, a descent too.

    Returns:
        The plan. After Ctrl-C too, once there is a candidate: the best so far.

    Raises:
        ScenarioError: the task cannot be done, the solver is unknown, what is minimised has no value, or there is
            nothing to learn from the plan to start from.
        KeyboardInterrupt: Ctrl-C, before there was a candidate.
    """
    with deferred_interrupt() as interruption:
        progress.phase("modelling")
        if not scenario.task.is_searched:
            return _valued(timed(scenario, interruption.breakable(scenario.criteria), progress, interruption))
        problem = interruption.breakable(scenario.problem) if problem is None else problem
        solver = scenario.solver.build()

        def once(branch: Problem[Any], settings: SolverSection) -> SearchedMotion:
            stated = scenario.model_copy(update={"solver": settings})
            found = untimed(stated, branch, solver, evaluation, progress, interruption, starts, warm_start)
            found = finished(found, progress, interruption) if scenario.model.retime else found
            return replace(found, scenario=scenario)

        def planned(branch: Problem[Any], settings: SolverSection) -> SearchedMotion:
            found = once(branch, settings)
            for number in range(1, RESTARTS + 1 if may_start_again(scenario, branch) else 1):
                if found.feasible or interruption.requested:
                    break
                other = once(branch, settings.model_copy(update={"seed": settings.seed + number}))
                found = replace(other if is_better(other.motion, found.motion) else found, rounds=number + 1)
            return found

        if not problem.branches or solver.solves_program:
            return _valued(planned(problem, scenario.solver))
        return _valued(best_of_branches(problem, solver, scenario.solver, evaluation, progress, interruption, planned))


def _valued(found: P) -> P:
    """The plan, if what is minimised has a value.

    Raises:
        ScenarioError: all limits hold, but the objective is no number.
    """
    if found.motion.status is CertificateStatus.CERTIFIED and not isfinite(found.objective):
        name, value = found.criteria.objective.name, found.objective
        raise ScenarioError(f"task.objective: {name!r} is undefined ({value:g}) along the motion that was found")
    return found


def may_start_again(scenario: Scenario, problem: Problem[Any]) -> bool:
    """Whether searches with other seeds follow one that led to no certified plan: the way out of narrow passages."""
    timed = scenario.solver.within is not None or scenario.solver.time_limit is not None
    return problem.is_polished and scenario.model.retime and not timed


def untimed(
    scenario: Scenario,
    problem: Problem[Any],
    solver: AnySolver,
    evaluation: EvaluationOptions | None,
    progress: Progress,
    interruption: Interruption,
    starts: Sequence[Trajectory] = (),
    warm_start: PlannedMotion | Motion | None = None,
) -> SearchedMotion:
    """A plan as search and polish find it.

    Raises:
        ScenarioError: a nonlinear program is asked for where there is none.
    """
    if not problem.has_program:
        for key, asked in (("name", solver.solves_program), ("within", scenario.solver.within is not None)):
            if asked:
                raise ScenarioError(f"solver.{key}: this task has no nonlinear program to descend")
    if solver.solves_program:
        first = starts if warm_start is None else (warm_start.trajectory, *starts)
        return descended(scenario, problem, solver, progress, interruption, first)
    known = candidates_of(problem, warm_start)
    if scenario.solver.within is None:
        return searched(scenario, problem, solver, evaluation, progress, interruption, starts, known)
    best, rounds = best_within(problem, solver, scenario.solver, evaluation, progress, interruption, known)
    return SearchedMotion(
        scenario=scenario,
        problem=problem,
        search=best.search,
        motion=best.motion,
        polish=best.polish,
        rounds=rounds,
        interrupted=interruption.requested,
    )


def finished(found: SearchedMotion, progress: Progress, interruption: Interruption) -> SearchedMotion:
    """The plan as fast as its limits allow; as it was found where the user has asked to stop."""
    retiming = interruption.attempt(partial(retimed, found.motion, progress))
    motion = found.motion if retiming is None else retiming.chosen
    return replace(found, motion=motion, retiming=retiming, interrupted=interruption.requested)


def descended(
    scenario: Scenario,
    problem: Problem[Any],
    solver: IPOPT,
    progress: Progress,
    interruption: Interruption,
    starts: Sequence[Trajectory] = (),
) -> SearchedMotion:
    """A plan by gradients alone."""
    refinement = interruption.breakable(partial(Refinement, problem, solver))
    progress.phase("searching")
    search = refinement.multistart(scenario.solver.budget(), scenario.solver.seed, progress.status, starts)
    log_search("descent", search)
    motion = refinement.motion(search.x)
    return SearchedMotion(
        scenario=scenario, problem=problem, search=search, motion=motion, interrupted=interruption.requested
    )


def searched(
    scenario: Scenario,
    problem: Problem[Any],
    solver: Solver,
    evaluation: EvaluationOptions | None,
    progress: Progress,
    interruption: Interruption,
    starts: Sequence[Trajectory] = (),
    known: FloatArray | None = None,
) -> SearchedMotion:
    """A plan by a metaheuristic, polished if the scenario says so."""
    settings, box = scenario.solver, Box(*problem.bounds)
    archive = Archive(box) if settings.polish_starts and problem.is_descended else None
    evaluate = interruption.breakable(partial(problem.evaluator, evaluation))
    progress.phase("searching")
    search = minimize(evaluate, box, solver, settings.budget(), settings.seed, progress.status, archive, known)
    log_search("search", search)
    motion = motion_of(problem, search.x)
    refined = None
    if archive is not None:
        work = partial(polish, problem, motion, search.x, archive, settings.polish_starts, progress, starts)
        refined = interruption.attempt(work)
    chosen = motion if refined is None else refined.chosen
    return SearchedMotion(
        scenario=scenario,
        problem=problem,
        search=search,
        motion=chosen,
        polish=refined,
        interrupted=interruption.requested,
    )


def convergence(search: Result) -> tuple[FloatArray, FloatArray]:
    """Best cost so far over iterations: both (n,). The last entry may be an iteration that was cut short."""
    return search.history.numbers, search.history.cost


def first_feasible(plan: SearchedMotion) -> int | None:
    """The index in the history from which the best candidate was feasible at the samples; None if there was none."""
    descended = plan.search.in_program_variables
    least_infeasible = INFEASIBLE_MERIT if descended else np.nextafter(plan.problem.objective_upper_bound, np.inf)
    feasible = np.flatnonzero(plan.search.history.cost < least_infeasible)
    return int(feasible[0]) if feasible.size else None


def step_name(search: Result) -> str:
    """What the history of a search counts."""
    return search.history.steps.name
