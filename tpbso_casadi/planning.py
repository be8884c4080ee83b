"""From a scenario to a verified plan: build the problem, search it, make the motion exact, judge it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems import Problem, Trajectory, Verdict
from problems.matrix import FloatArray
from solvers import Box, Result, Status, minimize
from tpbso_casadi.scenario import Scenario

ROWS = 201  # of trajectory.csv, at the least


@dataclass(frozen=True)
class Plan:
    """A motion and everything needed to judge it.

    Attributes:
        scenario: what was asked.
        problem: its model.
        search: what the search found, and its record.
        time_stretch: the factor by which the found motion was slowed so that the speed and acceleration limits hold
            between the samples too; 1 when they did already.
        trajectory: the motion.
        verdicts: how it stands to every constraint, for all t.
    """

    scenario: Scenario
    problem: Problem
    search: Result
    time_stretch: float
    trajectory: Trajectory
    verdicts: tuple[Verdict, ...]

    @property
    def feasible(self) -> bool:
        """Whether every constraint holds."""
        return all(verdict.satisfied for verdict in self.verdicts)

    @cached_property
    def times(self) -> FloatArray:
        """The times in s of the rows of ``trajectory.csv``."""
        return self.problem.row_times(self.trajectory, ROWS)

    @cached_property
    def objective(self) -> float:
        """The objective of the motion, measured at the rows of ``trajectory.csv``."""
        return self.problem.objective_value(self.trajectory, self.times)


def plan(scenario: Scenario, callback: Callable[[Status], object] | None = None) -> Plan:
    """Plan a scenario.

    Args:
        scenario: arm, task, limits, solver, budget and seed.
        callback: gets the status of the search after every iteration.

    Raises:
        ScenarioError: the task cannot be done, or the solver is unknown.
    """
    problem = scenario.problem()
    solver, budget = scenario.solver.build(), scenario.solver.budget()
    search = minimize(problem.cost, Box(*problem.bounds), solver, budget, scenario.solver.seed, callback)
    found = problem.trajectory(search.x)
    stretch = least_repair(problem, found)
    trajectory = found.stretched(stretch)
    return Plan(scenario, problem, search, stretch, trajectory, tuple(problem.verify(trajectory)))


def least_repair(problem: Problem, trajectory: Trajectory) -> float:
    """The smallest time stretch that keeps the limits for all t; the search only looks at samples."""
    return max(1.0, trajectory.safe_stretch(problem.arm))


def convergence(search: Result) -> tuple[FloatArray, FloatArray]:
    """Best cost so far over iterations: both (n,). The last entry may be an iteration that was cut short."""
    return np.arange(len(search.history.cost), dtype=np.float64), search.history.cost


def first_feasible(plan: Plan) -> int | None:
    """The iteration from which the best candidate was feasible at the samples; None if there was none."""
    held = np.flatnonzero(plan.search.history.cost <= plan.problem.feasible_below)
    return int(held[0]) if held.size else None
