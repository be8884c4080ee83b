"""Methods: one scalarised plan after the other, or NSGA-II as a baseline."""

from __future__ import annotations

import re
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from problems import Problem
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions
from solvers import Interruption, SearchBox
from tpbso_casadi.figures import figure_writers
from tpbso_casadi.planning import PlannedMotion, Progress, motion_of, plan
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.storage import write_plan
from tpbso_casadi.trade_off.front import Point, Request
from tpbso_casadi.trade_off.placement import ENDS, EpsilonConstraint, Objectives, Placement, WeightedSums
from tpbso_casadi.trade_off.store import POINTS, FrontStore


@dataclass(frozen=True, kw_only=True)
class FrontWork:
    """The work that a method is given.

    Attributes:
        objectives: the two, and the scenario.
        store: of the points.
        formats: of the figures of each plan; empty for none.
        evaluation: how populations are evaluated; changes the time, not the result.
        progress: is told what begins.
        interruption: polled between plans.
        told: gets every point once it is stored.
    """

    objectives: Objectives
    store: FrontStore
    formats: Sequence[str]
    evaluation: EvaluationOptions | None
    progress: Progress
    interruption: Interruption
    told: Callable[[Point], object]


@dataclass(frozen=True)
class Method(ABC):
    """A method of making a front.

    Args:
        name: of the method.
        count: of the points to place.
    """

    name: str
    count: int

    @property
    def settings(self) -> dict[str, Any]:
        """The settings that decide its points besides scenario and objectives; plain data."""
        return {"points": self.count}

    @abstractmethod
    def run(self, work: FrontWork) -> None:
        """Make and store the points that are not stored yet; less, where there is a request to stop.

        Raises:
            ScenarioError: there is no such plan.
            OutputError: a plan cannot be written.
        """


@dataclass(frozen=True)
class Scalarised(Method):
    """One objective out of two, again and again.

    Args:
        placement: says what to make next.
    """

    placement: Placement

    def run(self, work: FrontWork) -> None:
        """Make one plan after the other; each is stored the moment it is complete.

        Nothing more is placed where one of the ends is not certified: there is no front between them.
        """
        while not work.interruption.requested:
            points = work.store.points(self.name)
            if not all(point.certified for point in points[: len(ENDS)]):
                return
            request = self.placement.next(points)
            point = None if request is None else _planned(request, points, work)
            if point is None:
                return
            work.store.add(self.name, point)
            work.told(point)


def _planned(request: Request, points: Sequence[Point], work: FrontWork) -> Point | None:
    """The plan of a request, written to its folder; None where Ctrl-C cut it short."""
    began, number = time.perf_counter(), len(points) + 1
    scenario = work.objectives.asked_for(request)
    starts = [work.store.trajectory(points[start - 1]) for start in request.starts]
    found = work.interruption.attempt(
        partial(plan, scenario, _numbered(number, work.progress), work.evaluation, starts=starts)
    )
    if found is None or found.interrupted:
        return None
    folder = f"{POINTS}/{number:02d}-{_label(request, work.objectives)}"
    write_plan(work.store.folder / folder, found, figure_writers(found, work.formats), work.interruption)
    return Point(
        number=number,
        request=request,
        values=work.objectives.values(found.criteria, found.trajectory, found.times),
        duration=found.trajectory.duration,
        certified=found.feasible,
        seed=scenario.solver.seed,
        evaluations=_evaluations(found),
        seconds=time.perf_counter() - began,
        folder=folder,
    )


def _evaluations(found: PlannedMotion) -> int:
    return 0 if found.search is None else found.search.evaluations


def _numbered(number: int, progress: Progress) -> Progress:
    """The progress that says of which point it is."""
    return Progress(progress.status, lambda name: progress.phase(f"point {number}: {name}"))


def _label(request: Request, objectives: Objectives) -> str:
    """The name of a folder after its number."""
    asked = request.scalarisation
    parts = [name.rsplit(":")[-1] for name, weight in zip(objectives.names, asked.weights, strict=True) if weight]
    parts += [f"weight-{asked.weights[1]:.4g}"] * all(asked.weights)
    parts += [] if asked.longest is None else [f"within-{asked.longest:.4g}-s"]
    parts += ["again"] * (request.attempt > 0)
    return re.sub(r"[^\w.+-]+", "_", "-".join(parts))


LIBRARY = "pymoo"
POPULATION = 100  # unless the scenario says how many


@dataclass(frozen=True)
class Baseline(Method):
    """One search with the evaluations of all points together; each member of its front is verified."""

    def run(self, work: FrontWork) -> None:
        if work.store.points(self.name):
            return
        began = time.perf_counter()
        made = work.interruption.attempt(partial(self._points, work))
        if made:
            seconds = time.perf_counter() - began
            made[0] = replace(made[0], seconds=seconds)
            work.store.add(self.name, *made)

    def _points(self, work: FrontWork) -> list[Point]:
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
    """The two problems over one kind of search vectors: those of the one that needs more variables."""
    first, second = objectives.problems()
    if first.variables == second.variables and np.array_equal(first.bounds, second.bounds):
        return first, second
    if len(first.variables) > len(second.variables):
        return first, first.with_objective(second.criteria.objective)
    return second.with_objective(first.criteria.objective), second


def _searched(
    problems: tuple[Problem[Any], Problem[Any]], population: int, generations: int, seed: int, work: FrontWork
) -> FloatArray:
    """The members (m, d) of the last front.

    Raises:
        ScenarioError: the library is not installed.
    """
    if find_spec(LIBRARY) is None:
        raise ScenarioError(f"--method nsga2: needs the package {LIBRARY}: pip install 'tpbso-casadi[{LIBRARY}]'")
    from solvers.external.pymoo_solvers import nsga2  # noqa: PLC0415 (an extra, and slow to load)

    evaluators = [problem.evaluator(work.evaluation) for problem in problems]
    bounds = np.array([problem.objective_upper_bound for problem in problems])

    def evaluate(candidates: FloatArray) -> tuple[FloatArray, FloatArray]:
        costs = np.column_stack([evaluator(candidates) for evaluator in evaluators])
        return np.minimum(costs, bounds), np.maximum(costs - bounds, 0.0).max(axis=1)

    return nsga2(evaluate, len(problems), SearchBox(*problems[0].bounds), population, generations, seed)


EPSILON_CONSTRAINT, WEIGHTED_SUM, NSGA2 = "epsilon-constraint", "weighted-sum", "nsga2"


def _epsilon_constraint(objectives: Objectives, count: int) -> Method:
    if objectives.duration is None:
        raise ScenarioError(f"--method {EPSILON_CONSTRAINT}: needs time as one objective, and a task with total_time")
    return Scalarised(EPSILON_CONSTRAINT, count, EpsilonConstraint(count, objectives.duration))


METHODS: dict[str, Callable[[Objectives, int], Method]] = {
    EPSILON_CONSTRAINT: _epsilon_constraint,
    WEIGHTED_SUM: lambda objectives, count: Scalarised(WEIGHTED_SUM, count, WeightedSums(count)),
    NSGA2: lambda objectives, count: Baseline(NSGA2, count),
}


def method_named(name: str | None, objectives: Objectives, count: int) -> Method:
    """A method; where none is named, a bound on the duration if that will do, else weighted sums.

    Raises:
        ScenarioError: it is not for these objectives.
    """
    usual = WEIGHTED_SUM if objectives.duration is None else EPSILON_CONSTRAINT
    return METHODS[usual if name is None else name](objectives, count)


def open_front(
    objectives: Objectives, method: str | None, points: int, folder: Path, overwrite: bool
) -> tuple[Method, FrontStore]:
    """A method, and the store in a folder, with the points of it that an earlier call has left there.

    Args:
        objectives: the two, and the scenario.
        method: its name; None for the usual one.
        points: to place.
        folder: of the front.
        overwrite: whether to drop what another scenario or setting left in it.

    Raises:
        ScenarioError: the method is not for these objectives, or one of them cannot be planned at all.
        OutputError: the folder cannot be written, or holds another front.
    """
    chosen = method_named(method, objectives, points)
    asked = {"scenario": objectives.scenario.table(), "objectives": objectives.names}
    store = FrontStore.open(folder, asked, chosen.name, chosen.settings, overwrite)
    objectives.problems()  # what cannot be planned is said before anything is
    return chosen, store
