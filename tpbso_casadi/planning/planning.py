"""One plan as it is asked for: what all strategies are given, and searches that several plans share."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf
from typing import Any, Self, TypeVar

import numpy as np

from problems import Problem, Trajectory
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import (
    AnySolver,
    Archive,
    Budget,
    Interruption,
    Result,
    SearchBox,
    Solver,
    StopReason,
    best_so_far,
    minimize,
)
from tpbso_casadi.planning.finishing import PlannedMotion
from tpbso_casadi.planning.known_motions import EarlierMotion
from tpbso_casadi.planning.motion import JudgedMotion, motion_of
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.scenario import Scenario, SolverSection

FAILURES = (Exception, SystemExit)  # a plug-in may exit
T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class SearchRecord:
    """The result of a metaheuristic on a problem.

    Attributes:
        problem: that was searched.
        result: the best, and the effort.
        archive: good candidates that differ from it; None where nobody needs them.
    """

    problem: Problem[Any]
    result: Result
    archive: Archive | None

    @property
    def motion(self) -> JudgedMotion:
        """The motion of the best candidate."""
        return motion_of(self.problem, self.result.x)


class SharedSearches:
    """Searches of several plans that differ in their polish alone: each is run once and serves all of them.

    Args:
        archived: whether any of the plans refines more than the best candidate.

    Attributes:
        seconds_saved: by searches that were not run again.
    """

    def __init__(self, archived: bool) -> None:
        self.archived = archived
        self.seconds_saved = 0.0
        self._known: dict[tuple[Any, ...], SearchRecord] = {}

    def known(self, key: tuple[Any, ...]) -> SearchRecord | None:
        """An earlier search; None where there is none that ended by itself."""
        search = self._known.get(key)
        self.seconds_saved += 0.0 if search is None else search.result.seconds
        return search

    def keep(self, key: tuple[Any, ...], search: SearchRecord) -> None:
        """Keep a search for other plans."""
        if search.result.stop_reason not in (StopReason.INTERRUPTED, StopReason.ERROR):
            self._known[key] = search


@dataclass(frozen=True, kw_only=True)
class Planning:
    """One plan as it is asked for; every stage of it is given the same.

    Attributes:
        scenario: robot, task and limits.
        solver: of all searches.
        settings: of this search: budget, seed, polish; those of the scenario or of a part of it.
        evaluation: how populations are evaluated; None for the usual way.
        progress: is told what begins, and how far it is.
        interruption: Ctrl-C.
        starts: motions that a descent begins with, before any candidate.
        deadline: when it has to be done, as of ``time.perf_counter``, s; infinite where nobody says.
        failures: what a callback or a solver has raised; the first is raised again, with the best plan so far.
        shared: searches that other plans have in common with this one; None where it is planned alone.
        warm_start: a plan of a similar scenario, or its motion alone; None where none is given.
    """

    scenario: Scenario
    solver: AnySolver
    settings: SolverSection
    evaluation: EvaluationOptions | None
    progress: Progress
    interruption: Interruption
    starts: Sequence[Trajectory] = ()
    deadline: float = inf
    shared: SharedSearches | None = None
    warm_start: PlannedMotion | EarlierMotion | None = None
    failures: list[BaseException] = field(default_factory=list)

    @property
    def is_cut_short(self) -> bool:
        """Whether to leave it at what there is: the user says so, or something has raised."""
        return self.interruption.requested or bool(self.failures)

    @property
    def left(self) -> float:
        """The time that is left, s."""
        return self.deadline - time.perf_counter()

    def running_out(self) -> bool:
        """Whether to come to an end: no time is left, or it is cut short."""
        return self.left <= 0.0 or self.is_cut_short

    def satisfied(self, is_known: bool = True) -> bool:
        """Whether to come to an end: no time is left, or a plan is known and the first is all that was asked for."""
        return self.running_out() or (is_known and self.settings.first)

    def with_settings(self, **changes: Any) -> Self:
        """The planning with other keys of [solver]."""
        return replace(self, settings=self.settings.replaced(**changes))

    def evaluator(self, problem: Problem[Any]) -> PopulationFunction:
        """The batch evaluator of a problem.

        Raises:
            KeyboardInterrupt: Ctrl-C.
        """
        return self.interruption.breakable(partial(problem.evaluator, self.evaluation))

    def searched(self, search: Callable[[], Result]) -> Result:
        """The result of a search; where it raises, which cuts the plan short, the best candidate until then.

        Raises:
            BaseException: whatever it raises before there is a candidate; Ctrl-C in any case.
        """
        try:
            return search()
        except FAILURES as error:
            found = best_so_far(error, Result)
            if found is None:
                raise
            self.failures.append(error)
            return found

    def attempt(self, work: Callable[[], T]) -> T | None:
        """The result of work that improves on what there is; None where it raises, which cuts the plan short."""
        try:
            return None if self.failures else work()
        except FAILURES as error:
            self.failures.append(error)
            return None

    def breakable_attempt(self, work: Callable[[], T]) -> T | None:
        """The result of work that Ctrl-C breaks off at once; None where it raises."""
        return self.attempt(partial(self.interruption.attempt, work))

    def search(self, problem: Problem[Any], budget: Budget, known: FloatArray | None = None) -> SearchRecord:
        """Search a problem by the metaheuristic of this plan, unless another plan has done just that.

        Args:
            problem: to search.
            budget: of the search.
            known: candidates (m, d) to begin with.

        Raises:
            KeyboardInterrupt: Ctrl-C, before there was a candidate.
        """
        key = id(problem), self.settings.seed, budget, None if known is None else np.asarray(known).tobytes()
        earlier = None if self.shared is None else self.shared.known(key)
        if earlier is not None:
            return earlier
        solver, box, evaluate = self.solver, SearchBox(*problem.bounds), self.evaluator(problem)
        assert isinstance(solver, Solver)
        needed = self.settings.polish_starts > 1 if self.shared is None else self.shared.archived
        archive = Archive(box) if needed else None
        seed, status = self.settings.seed, self.progress.status
        result = self.searched(partial(minimize, evaluate, box, solver, budget, seed, status, archive, known))
        search = SearchRecord(problem=problem, result=result, archive=archive)
        if self.shared is not None:
            self.shared.keep(key, search)
        return search
