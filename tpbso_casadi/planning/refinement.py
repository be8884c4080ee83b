"""IPOPT on a problem: as a polish of what a metaheuristic found, and on its own from many starts."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np

from problems import Problem
from problems.assembly.problem import SAMPLING_MARGIN
from problems.base.matrix import FloatArray, as_array
from solvers import IPOPT, Archive, Budget, Descent, DescentResult, Solution, Status, StopReason, descend
from tpbso_casadi.planning.motion import Motion

MARGINS = (3e-3, 1e-2)  # tried in turn when a solution breaks a limit between its samples
APART = 0.5  # rad: postures of two starts differ by more than that in some joint at some time
LOOKED_AT = 21  # times at which they are compared


class Refinement:
    """A problem's nonlinear program, compiled; its solutions are judged as motions.

    Args:
        problem: to be solved.
        solver: with which settings.
    """

    def __init__(self, problem: Problem, solver: IPOPT) -> None:
        self.problem = problem
        self.program = problem.nlp()
        self.descent = Descent(self.program, solver)

    def motion(self, x: FloatArray) -> Motion:
        """The motion of a solution's variables (n,)."""
        return Motion(self.problem, self.program.trajectory(x), self.program.quantities(x))

    def price(self, solution: Solution) -> float:
        """What a solution is worth as a motion."""
        return self.motion(solution.x).price

    def multipliers(self, solution: Solution) -> dict[str, float]:
        """By constraint, the sum of the absolute multipliers of its scaled rows."""
        rows = self.program.constraints(SAMPLING_MARGIN)
        parts = np.split(solution.row_multipliers, np.cumsum([c.expression.numel() for c in rows])[:-1])
        return {c.name: float(np.abs(part).sum()) for c, part in zip(rows, parts, strict=True)}

    def __call__(self, start: FloatArray) -> Solution:
        """Descend; where the solution holds at its samples but not between, descend on with more margin."""
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
        return descend(self, self.descent.stop, starts, self.price, budget, seed, callback)

    def multistart(self, budget: Budget, seed: int, callback: Callable[[Status], object] | None) -> DescentResult:
        """From inverse kinematics at the points of the task, again and again."""
        return self.descend(self.program.starts(np.random.default_rng(seed)), budget, seed, callback)


@dataclass(frozen=True)
class Polish:
    """What IPOPT made of a metaheuristic's best.

    Attributes:
        before: the best motion of the search.
        after: the best of the refined ones, accepted or not.
        search: of IPOPT; its iterations are starts.
        seconds: with the compilation of the program.
        multipliers: by constraint, the sum of the absolute values that IPOPT ended with, of the scaled rows.
    """

    before: Motion
    after: Motion
    search: DescentResult
    seconds: float
    multipliers: dict[str, float]

    @property
    def accepted(self) -> bool:
        """Whether the refined motion is feasible and better; if not it is discarded."""
        return self.after.feasible and self.after.price < self.before.price

    @property
    def chosen(self) -> Motion:
        """Never worse than what went in."""
        return self.after if self.accepted else self.before


def polish(
    before: Motion,
    best: FloatArray,
    archive: Archive,
    starts: int,
    refinement: Refinement | None = None,
    seconds: float | None = None,
) -> Polish:
    """Refine the best candidate (d,) of a search, and ``starts - 1`` others that differ from it.

    Args:
        before: the motion of the best.
        best: the candidate.
        archive: of the search.
        starts: how many to refine.
        refinement: the compiled program of an earlier polish; made here if None.
        seconds: to stop after.
    """
    began = time.perf_counter()
    refinement = Refinement(before.problem, IPOPT(warm=True)) if refinement is None else refinement
    chosen = distinct(before.problem, [best, *archive.x], starts)
    budget = Budget(iterations=starts, seconds=seconds)
    search = refinement.descend((refinement.program.from_search(x) for x in chosen), budget)
    seconds = time.perf_counter() - began
    return Polish(before, refinement.motion(search.x), search, seconds, refinement.multipliers(search.solution))


def distinct(problem: Problem, candidates: Iterable[FloatArray], count: int) -> list[FloatArray]:
    """The first ``count`` candidates whose motions lie apart in joint space, in the given order."""
    shares = np.linspace(0.0, 1.0, LOOKED_AT)

    def apart() -> Iterable[FloatArray]:
        seen: list[FloatArray] = []
        for x in candidates:
            trajectory = problem.trajectory(x)
            theta = as_array(trajectory.samples(shares * trajectory.duration).theta)
            if all(np.abs(theta - other).max() > APART for other in seen):
                seen.append(theta)
                yield x

    return list(islice(apart(), count))
