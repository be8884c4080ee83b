"""A front by one run of NSGA-II over the search vectors of both objectives, to compare with."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray
from solvers import Box
from tpbso_casadi.planning.motion import motion_of
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.point import Point
from tpbso_casadi.trade_off.work import Method, Work

LIBRARY = "pymoo"
POPULATION = 100  # unless the scenario says how many


@dataclass(frozen=True)
class Baseline(Method):
    """As many evaluations as the searches of all points have together; each member of its front is verified."""

    def run(self, work: Work) -> None:
        """One run, which leaves nothing where it is interrupted."""
        if work.store.points(self.name):
            return
        began = time.perf_counter()
        made = work.interruption.attempt(partial(self._points, work))
        if made:
            seconds = time.perf_counter() - began
            made[0] = replace(made[0], seconds=seconds)
            work.store.add(self.name, *made)

    def _points(self, work: Work) -> list[Point]:
        """Every member of the last front, with its verified motion; the first has all evaluations."""
        settings = work.objectives.scenario.solver
        work.progress.phase("modelling")
        problems = same_box(work.objectives)
        population = max(settings.population or POPULATION, 2)
        evaluations = (settings.budget().evaluations or 0) * self.count
        generations = max(1, evaluations // (len(problems) * population))
        work.progress.phase("searching")
        members = _searched(problems, population, generations, settings.seed, work)
        work.progress.phase("verifying")
        points = []
        for number, x in enumerate(members, start=1):
            motion = motion_of(problems[0], x)
            points.append(
                Point(
                    number=number,
                    request=None,
                    values=work.objectives.values(motion.criteria, motion.trajectory, motion.times),
                    duration=motion.trajectory.duration,
                    certified=motion.feasible,
                    seed=settings.seed,
                    evaluations=generations * population * len(problems) if number == 1 else 0,
                    seconds=0.0,
                    folder="",
                )
            )
        return points


def same_box(objectives: Objectives) -> tuple[Problem[Any], Problem[Any]]:
    """Both problems over the same search vectors: those of the one that needs more variables."""
    first, second = objectives.problems()
    if first.variables == second.variables and np.array_equal(first.bounds, second.bounds):
        return first, second
    if len(first.variables) > len(second.variables):
        return first, replace(first, objective=second.objective)
    return replace(second, objective=first.objective), second


def _searched(
    problems: tuple[Problem[Any], Problem[Any]], population: int, generations: int, seed: int, work: Work
) -> FloatArray:
    """The members (m, d) of the last front.

    Raises:
        ScenarioError: the library is not installed.
    """
    if find_spec(LIBRARY) is None:
        raise ScenarioError(f"--method nsga2: needs the package {LIBRARY}: pip install 'tpbso-casadi[{LIBRARY}]'")
    from solvers.external.nsga2 import nsga2  # noqa: PLC0415 (an extra, and slow to load)

    evaluators = [problem.evaluator(work.evaluation) for problem in problems]
    bounds = np.array([problem.objective_upper_bound for problem in problems])

    def evaluate(candidates: FloatArray) -> tuple[FloatArray, FloatArray]:
        costs = np.column_stack([evaluator(candidates) for evaluator in evaluators])
        return np.minimum(costs, bounds), np.maximum(costs - bounds, 0.0).max(axis=1)

    return nsga2(evaluate, len(problems), Box(*problems[0].bounds), population, generations, seed)
