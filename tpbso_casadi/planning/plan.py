"""From a scenario to a verified plan: build the problem, search it, refine and judge what was found."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from problems import Problem, Trajectory, Verdict
from problems.base.matrix import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import IPOPT, Archive, Box, Budget, DescentResult, Result, Solver, Status, StopReason, minimize
from tpbso_casadi.planning.motion import Motion, found_motion
from tpbso_casadi.planning.refinement import Polish, Refinement, polish
from tpbso_casadi.scenario.scenario import Scenario

ROUND = 10_000  # evaluations of a search in a series of them, unless the scenario says how many
STARTS = 3  # candidates that are polished after each of them


@dataclass(frozen=True)
class Plan:
    """A motion and everything needed to judge it.

    Attributes:
        scenario: what was asked.
        problem: its model.
        search: what the search found, and its record; before any polish.
        motion: the plan itself.
        polish: what a polish did; None when none was asked for.
        rounds: how often it was searched; the others than ``search`` found nothing better.
    """

    scenario: Scenario
    problem: Problem
    search: Result
    motion: Motion
    polish: Polish | None = None
    rounds: int = 1

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C cut the search or the polish short."""
        searches = [self.search] if self.polish is None else [self.search, self.polish.search]
        return any(search.stop_reason is StopReason.INTERRUPTED for search in searches)

    @property
    def trajectory(self) -> Trajectory:
        """The motion's trajectory."""
        return self.motion.trajectory

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """How the motion stands to every constraint, for all t."""
        return self.motion.verdicts

    @property
    def feasible(self) -> bool:
        """Whether every constraint holds."""
        return self.motion.feasible

    @property
    def objective(self) -> float:
        """The objective of the motion, measured at the rows of ``trajectory.csv``."""
        return self.motion.objective

    @property
    def times(self) -> FloatArray:
        """The times in s of the rows of ``trajectory.csv``."""
        return self.motion.times


def plan(
    scenario: Scenario,
    callback: Callable[[Status], object] | None = None,
    pricing: EvaluationOptions | None = None,
    problem: Problem | None = None,
) -> Plan:
    """Plan a scenario.

    Args:
        scenario: arm, task, limits, solver, budget and seed.
        callback: gets the status of the search after every iteration.
        pricing: how a population is evaluated; changes how long it takes, not what is found.
        problem: that of the scenario, where it is at hand.

    Raises:
        ScenarioError: the task cannot be done, or the solver is unknown.
    """
    problem, solver = scenario.problem() if problem is None else problem, scenario.solver.build()
    if isinstance(solver, IPOPT):
        return descended(scenario, problem, solver, callback)
    if scenario.solver.within is not None:
        return best_within(scenario, problem, solver, scenario.solver.within, callback, pricing)
    return searched(scenario, problem, solver, callback, pricing)


def descended(scenario: Scenario, problem: Problem, solver: IPOPT, callback: Callable[[Status], object] | None) -> Plan:
    """A plan by gradients alone."""
    refinement = Refinement(problem, solver)
    found = refinement.multistart(scenario.solver.budget(), scenario.solver.seed, callback)
    return Plan(scenario, problem, found, refinement.motion(found.x))


def searched(
    scenario: Scenario,
    problem: Problem,
    solver: Solver,
    callback: Callable[[Status], object] | None,
    pricing: EvaluationOptions | None,
) -> Plan:
    """A plan by a metaheuristic, polished if the scenario says so."""
    asked, box = scenario.solver, Box(*problem.bounds)
    archive = Archive(box) if asked.polish_starts else None
    found = minimize(problem.evaluator(pricing), box, solver, asked.budget(), asked.seed, callback, archive)
    motion = found_motion(problem, found.x)
    if archive is None or found.stop_reason is StopReason.INTERRUPTED:
        return Plan(scenario, problem, found, motion)
    refined = polish(motion, found.x, archive, asked.polish_starts)
    return Plan(scenario, problem, found, refined.chosen, refined)


def best_within(
    scenario: Scenario,
    problem: Problem,
    solver: Solver,
    seconds: float,
    callback: Callable[[Status], object] | None,
    pricing: EvaluationOptions | None,
) -> Plan:
    """The best plan of a given time: search, polish what lies apart, and again from the next seed.

    The first search is done in any case; what it found is polished if time is left. Results depend on the machine.
    """
    ends = time.perf_counter() + seconds
    asked, box, price = scenario.solver, Box(*problem.bounds), problem.evaluator(pricing)
    refinement = Refinement(problem, IPOPT(warm=True))
    plans: list[Plan] = []
    while not plans or (time.perf_counter() < ends and not plans[-1].interrupted):
        left, archive = ends - time.perf_counter(), Archive(box)
        budget = Budget(asked.evaluations or ROUND, asked.iterations, left if left > 0.0 else None)
        found = minimize(price, box, solver, budget, asked.seed + len(plans), callback, archive)
        motion, left = found_motion(problem, found.x), ends - time.perf_counter()
        if left <= 0.0 or found.stop_reason is StopReason.INTERRUPTED:
            plans.append(Plan(scenario, problem, found, motion))
        else:
            refined = polish(motion, found.x, archive, asked.polish_starts or STARTS, refinement, left)
            plans.append(Plan(scenario, problem, found, refined.chosen, refined))
    best = min(plans, key=lambda plan: (not plan.feasible, plan.motion.price))
    return replace(best, rounds=len(plans))


def convergence(search: Result) -> tuple[FloatArray, FloatArray]:
    """Best cost so far over iterations: both (n,). The last entry may be an iteration that was cut short."""
    first = int(isinstance(search, DescentResult))  # a swarm's initial population is iteration 0
    return np.arange(first, first + len(search.history.cost), dtype=np.float64), search.history.cost


def first_feasible(plan: Plan) -> int | None:
    """The index in the history from which the best candidate was feasible at the samples; None if there was none."""
    held = np.flatnonzero(plan.search.history.cost <= plan.problem.objective_upper_bound)
    return int(held[0]) if held.size else None


def step_name(search: Result) -> str:
    """What the history of a search counts."""
    return "start" if isinstance(search, DescentResult) else "iteration"
