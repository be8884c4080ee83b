"""IPOPT on a problem: as a polish of a metaheuristic's best candidates, and on its own from many starts."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import chain, islice
from typing import Any

import numpy as np

from problems import Problem, Trajectory
from problems.base.matrix import FloatArray, as_array
from solvers import IPOPT, Archive, Budget, Descent, DescentResult, Solution, Status, StopReason, descend
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.planning.search_log import log_search

MARGINS = (3e-3, 1e-2)  # tried in turn when a solution breaks a limit between its samples
START_DISTANCE = 0.5  # rad: two starts differ by more than that in some joint at some time
COMPARISON_TIMES = 21  # at which they are compared


class Refinement:
    """A problem's nonlinear program, compiled; its solutions are compared by the merit of their motions.

    Args:
        problem: to be solved.
        solver: IPOPT's settings.
    """

    def __init__(self, problem: Problem[Any], solver: IPOPT) -> None:
        self.problem = problem
        self.program = problem.nlp()
        self.descent = Descent(self.program, solver)

    def motion(self, x: FloatArray) -> Motion:
        """The motion of a solution's variables (n,)."""
        return Motion(self.problem, self.program.trajectory(x), self.program.quantities(x))

    def merit(self, solution: Solution) -> float:
        """The merit of a solution as a motion: lower is better."""
        return self.motion(solution.x).merit

    def multipliers(self, solution: Solution) -> dict[str, float]:
        """By constraint, the sum of the absolute multipliers of its scaled rows."""
        rows = self.program.rows
        parts = np.split(solution.row_multipliers, np.cumsum([c.expression.numel() for c in rows])[:-1])
        return {c.name: float(np.abs(part).sum()) for c, part in zip(rows, parts, strict=True)}

    def __call__(self, start: FloatArray) -> Solution:
        """Descend; if the solution is feasible at its samples but not between them, continue with a larger margin."""
        solution = self.descent(start)
        for margin in MARGINS:
            if solution.stop_reason is not StopReason.CONVERGED or self.motion(solution.x).feasible:
                return solution
            solution = self.descent(solution.x, margin).after(solution)
        return solution

    def descend(
        self,
        starts: Iterable[FloatArray],
        budget: Budget,
        seed: int | None = None,
        callback: Callable[[Status], object] | None = None,
    ) -> DescentResult:
        """From one start (n,) after the other; the best motion counts."""
        return descend(self, self.descent.stop, starts, self.merit, budget, seed, callback)

    def multistart(
        self,
        budget: Budget,
        seed: int,
        callback: Callable[[Status], object] | None,
        first: Sequence[Trajectory] = (),
    ) -> DescentResult:
        """From motions that are given, then from the program's own starts, again and again."""
        own = self.program.starts(np.random.default_rng(seed))
        starts = chain(map(self.program.from_trajectory, first), own)
        return self.descend(starts, budget, seed, callback)


@dataclass(frozen=True)
class Polish:
    """The refinement of a metaheuristic's best candidates by IPOPT.

    Attributes:
        before: the best motion of the search.
        after: the best of the refined ones, accepted or not.
        search: by IPOPT; its iterations are starts.
        seconds: with the compilation of the program.
        multipliers: by constraint, the sum of the absolute final multipliers of its scaled rows.
    """

    before: Motion
    after: Motion
    search: DescentResult
    seconds: float
    multipliers: dict[str, float]

    @property
    def accepted(self) -> bool:
        """Whether the refined motion is feasible and better; if not it is discarded."""
        return self.after.feasible and self.after.merit < self.before.merit

    @property
    def chosen(self) -> Motion:
        """The better of the two motions."""
        return self.after if self.accepted else self.before


def polish(
    problem: Problem[Any],
    before: Motion,
    best: FloatArray,
    archive: Archive,
    starts: int,
    progress: Progress,
    first: Sequence[Trajectory] = (),
) -> Polish:
    """Refine the best candidate (d,) of a search, and ``starts - 1`` others that differ from it.

    Args:
        problem: that has been searched.
        before: the motion of the best.
        best: the candidate.
        archive: of the search.
        starts: how many to refine.
        progress: is told the status after every start.
        first: motions to refine before any candidate; they count among the starts.
    """
    began = time.perf_counter()
    progress.phase("polishing")
    refinement = Refinement(problem, IPOPT())
    chosen = distinct(problem, [best, *archive.x], max(0, starts - len(first)))
    given = map(refinement.program.from_trajectory, first)
    program_starts = chain(given, map(refinement.program.from_search, chosen))
    polished = refine(before, program_starts, refinement, Budget(iterations=starts), progress)
    return replace(polished, seconds=time.perf_counter() - began)


def refine(
    before: Motion, starts: Iterable[FloatArray], refinement: Refinement, budget: Budget, progress: Progress
) -> Polish:
    """Descend from starts (n,) of the compiled program; the best counts, if it is better than ``before``."""
    search = refinement.descend(starts, budget, callback=progress.status)
    log_search("polish", search)
    multipliers = refinement.multipliers(search.solution)
    return Polish(before, refinement.motion(search.x), search, search.seconds, multipliers)


def distinct(problem: Problem[Any], candidates: Iterable[FloatArray], count: int) -> list[FloatArray]:
    """The first ``count`` candidates whose motions lie apart in joint space, in the given order."""
    phases = np.linspace(0.0, 1.0, COMPARISON_TIMES)

    def apart() -> Iterable[FloatArray]:
        earlier: list[FloatArray] = []
        for x in candidates:
            trajectory = problem.trajectory(x)
            theta = as_array(trajectory.samples(phases * trajectory.duration).theta)
            if all(np.abs(theta - other).max() > START_DISTANCE for other in earlier):
                earlier.append(theta)
                yield x

    return list(islice(apart(), count))
