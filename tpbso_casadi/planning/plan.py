"""From a scenario to a verified plan: build the problem, search it, refine and verify the best motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from problems import Problem, Trajectory, Verdict
from problems.base.matrix import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import IPOPT, Archive, Box, Result, Solver, minimize
from solvers.driver.interruption import Interruption, deferred_interrupt
from tpbso_casadi.planning.motion import INFEASIBLE_MERIT, Motion, motion_of
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.planning.refinement import Polish, Refinement, polish
from tpbso_casadi.planning.within import best_within
from tpbso_casadi.scenario.scenario import Scenario

SILENT = Progress()


@dataclass(frozen=True)
class Plan:
    """A motion and everything needed to judge it.

    Attributes:
        scenario: robot, task, limits and solver.
        problem: its model.
        search: result and record of the search; before any polish.
        motion: the plan itself.
        polish: the refinement by IPOPT; None where there was none.
        rounds: searches made; ``search`` is the one that led to the best motion.
        interrupted: whether Ctrl-C cut the search or the polish short.
    """

    scenario: Scenario
    problem: Problem[Any]
    search: Result
    motion: Motion
    polish: Polish | None = None
    rounds: int = 1
    interrupted: bool = False

    @property
    def trajectory(self) -> Trajectory:
        """The motion's trajectory."""
        return self.motion.trajectory

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each constraint of the motion, judged for all t."""
        return self.motion.verdicts

    @property
    def feasible(self) -> bool:
        """Whether every constraint holds."""
        return self.motion.feasible

    @property
    def objective(self) -> float:
        """The objective of the motion."""
        return self.motion.objective

    @property
    def times(self) -> FloatArray:
        """The times in s of the rows of ``trajectory.csv``."""
        return self.motion.times


def plan(
    scenario: Scenario,
    progress: Progress = SILENT,
    evaluation: EvaluationOptions | None = None,
    problem: Problem[Any] | None = None,
) -> Plan:
    """Plan a scenario.

    Args:
        scenario: robot, task, limits, solver, budget and seed.
        progress: is told what begins, and the status after every iteration.
        evaluation: how populations are evaluated; changes the time, not the result.
        problem: that of the scenario, if it is built already.

    Returns:
        The plan. After Ctrl-C too, once there is a candidate: the best so far.

    Raises:
        ScenarioError: the task cannot be done, or the solver is unknown.
        KeyboardInterrupt: Ctrl-C, before there was a candidate.
    """
    with deferred_interrupt() as interruption:
        progress.phase("modelling")
        problem = interruption.breakable(scenario.problem) if problem is None else problem
        solver = scenario.solver.build()
        if solver.solves_program:
            return descended(scenario, problem, solver, progress, interruption)
        if scenario.solver.within is None:
            return searched(scenario, problem, solver, evaluation, progress, interruption)
        best, rounds = best_within(problem, solver, scenario.solver, evaluation, progress, interruption)
        return Plan(scenario, problem, best.search, best.motion, best.polish, rounds, interruption.requested)


def descended(
    scenario: Scenario,
    problem: Problem[Any],
    solver: IPOPT,
    progress: Progress,
    interruption: Interruption,
) -> Plan:
    """A plan by gradients alone."""
    refinement = interruption.breakable(partial(Refinement, problem, solver))
    progress.phase("searching")
    search = refinement.multistart(scenario.solver.budget(), scenario.solver.seed, progress.status)
    return Plan(scenario, problem, search, refinement.motion(search.x), interrupted=interruption.requested)


def searched(
    scenario: Scenario,
    problem: Problem[Any],
    solver: Solver,
    evaluation: EvaluationOptions | None,
    progress: Progress,
    interruption: Interruption,
) -> Plan:
    """A plan by a metaheuristic, polished if the scenario says so."""
    settings, box = scenario.solver, Box(*problem.bounds)
    archive = Archive(box) if settings.polish_starts else None
    evaluate = interruption.breakable(partial(problem.evaluator, evaluation))
    progress.phase("searching")
    search = minimize(evaluate, box, solver, settings.budget(), settings.seed, progress.status, archive)
    motion = motion_of(problem, search.x)
    refined = None
    if archive is not None:
        work = partial(polish, motion, search.x, archive, settings.polish_starts, progress)
        refined = interruption.attempt(work)
    chosen = motion if refined is None else refined.chosen
    return Plan(scenario, problem, search, chosen, refined, interrupted=interruption.requested)


def convergence(search: Result) -> tuple[FloatArray, FloatArray]:
    """Best cost so far over iterations: both (n,). The last entry may be an iteration that was cut short."""
    return search.history.numbers, search.history.cost


def first_feasible(plan: Plan) -> int | None:
    """The index in the history from which the best candidate was feasible at the samples; None if there was none."""
    descended = plan.search.in_program_variables
    least_infeasible = INFEASIBLE_MERIT if descended else np.nextafter(plan.problem.objective_upper_bound, np.inf)
    feasible = np.flatnonzero(plan.search.history.cost < least_infeasible)
    return int(feasible[0]) if feasible.size else None


def step_name(search: Result) -> str:
    """What the history of a search counts."""
    return search.history.steps.name
