"""What is behind the numbers of a problem: the model, motions of candidates, proofs, pictures."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from problems import Problem, Trajectory, Verdict
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction
from tpbso_casadi.planning import JudgedMotion, PlannedMotion, motion_of
from tpbso_casadi.scenario import Scenario, parse_scenario
from tpbso_casadi.suite.frozen import INTEGRALS_AT_SAMPLES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CACHED_PROBLEMS = 16


@dataclass(frozen=True, repr=False)
class SuiteMotion:
    """The motion of a candidate.

    Attributes:
        planned: it, and its scenario.
    """

    planned: PlannedMotion

    def __repr__(self) -> str:
        return f"<{self.planned.name}: {self.objective:.6g}, {self.motion.status}>"

    @property
    def motion(self) -> JudgedMotion:
        """The motion with everything that is known of it."""
        return self.planned.motion

    @property
    def trajectory(self) -> Trajectory:
        """Angles and their derivatives at any time."""
        return self.planned.trajectory

    @property
    def objective(self) -> float:
        """Exact; of two objectives their weighted sum."""
        return self.motion.objective

    @property
    def certified(self) -> bool:
        """Whether all limits are proven to hold for all t."""
        return self.motion.feasible

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """Each limit, judged for all t."""
        return self.motion.verdicts

    def plot(self, kind: str = "path") -> Figure:
        """A figure of it.

        Raises:
            ValueError: there is none of that kind; the message lists those that there are.
        """
        from tpbso_casadi.figures.notebook import figure_of  # noqa: PLC0415 (matplotlib)

        return figure_of(self.planned, kind)


def motion(scenario: Scenario, x: FloatArray, suite: str, name: str) -> SuiteMotion:
    """The motion of a candidate (d,) of a suite's problem, given the problem's name too."""
    found = motion_of(problem_of(scenario, suite), x)
    return SuiteMotion(PlannedMotion(scenario=scenario, motion=found, name=name))


def interpreted(scenario: Scenario, form: str, suite: str) -> list[Callable[[FloatArray], FloatArray]]:
    """Functions of merit, objective and violations in CasADi's virtual machine, for each objective."""
    programs = [problem.parts_program()[0] for problem in problems_of(problem_of(scenario, suite), form)]
    return [PopulationFunction(program, EvaluationOptions("vm")).of_any for program in programs]


def problems_of(problem: Problem[Any], form: str) -> list[Problem[Any]]:
    """One problem for each objective, all with the same search box: each term of a sum where there are two."""
    whole = problem.criteria.objective
    objectives = [part for _, part in whole.terms] if form == "two objectives" else [whole]
    return [problem.with_objective(objective) for objective in objectives]


def problem_of(scenario: Scenario, suite: str) -> Problem[Any]:
    """The problem of a scenario as a suite has it, built once."""
    return _problem(scenario.as_text(), suite in INTEGRALS_AT_SAMPLES)


@lru_cache(maxsize=CACHED_PROBLEMS)
def _problem(scenario: str, at_samples: bool) -> Problem[Any]:
    problem = parse_scenario(json.loads(scenario)).problem()
    return problem.with_integrals_at_samples() if at_samples else problem
