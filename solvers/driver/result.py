"""What a search reports: its status while it runs, its result and history at the end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.box import FloatArray
from solvers.driver.budget import Budget, StopReason, Usage
from solvers.traits import Steps

MOST_SHOWN = 6  # numbers of a candidate, in the short form of a result


@dataclass(frozen=True, kw_only=True)
class Status:
    """The state of a running search, given to a callback after each iteration.

    Attributes:
        evaluations: done.
        iterations: completed.
        seconds: since the start.
        cost: the lowest so far.
        progress: share of the budget used, from 0 to 1.
        steps: what an iteration is.
    """

    evaluations: int
    iterations: int
    seconds: float
    cost: float
    progress: float
    steps: Steps

    @classmethod
    def of(cls, usage: Usage, budget: Budget, steps: Steps) -> Status:
        """The status of a search that has used so much of its budget."""
        return cls(
            evaluations=usage.evaluations,
            iterations=usage.iterations,
            seconds=usage.seconds,
            cost=usage.cost,
            progress=budget.share_used(usage),
            steps=steps,
        )


@dataclass(frozen=True, kw_only=True)
class History:
    """Best-so-far after each step of a search.

    Attributes:
        evaluations: done, (n,).
        cost: the lowest, (n,).
        best: its candidate, (n, d).
        steps: what a step is.
    """

    evaluations: FloatArray
    cost: FloatArray
    best: FloatArray
    steps: Steps

    @classmethod
    def of(cls, records: list[tuple[int, float, FloatArray]], steps: Steps) -> History:
        """From one record a step: evaluations, cost, candidate (d,)."""
        evaluations, cost, best = (np.array(column) for column in zip(*records, strict=True))
        return cls(evaluations=evaluations, cost=cost, best=best, steps=steps)

    @property
    def numbers(self) -> FloatArray:
        """Numbers of the steps, (n,)."""
        return np.arange(self.steps.first, self.steps.first + len(self.cost), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Result:
    """The outcome of a search and the effort it took.

    Attributes:
        in_program_variables: whether ``x`` holds variables of a smooth program rather than a point of the box.
        x: the best candidate, (d,).
        cost: its cost; inf when no candidate had a finite one.
        evaluations: done.
        iterations: completed iterations of the solver's loop.
        seconds: wall-clock time of the search.
        seed: as given; None when a generator was.
        stop_reason: which criterion ended the search.
        history: best-so-far, the initial population first.
    """

    in_program_variables: ClassVar[bool] = False

    x: FloatArray
    cost: float
    evaluations: int
    iterations: int
    seconds: float
    seed: int | None
    stop_reason: StopReason
    history: History

    def __repr__(self) -> str:
        shown = ", ".join(f"{value:.6g}" for value in self.x[:MOST_SHOWN])
        more = f", ... {len(self.x)} numbers" if len(self.x) > MOST_SHOWN else ""
        return (
            f"{type(self).__name__}(cost={self.cost:.6g}, x=[{shown}{more}], evaluations={self.evaluations}, "
            f"iterations={self.iterations}, seconds={self.seconds:.3g}, seed={self.seed}, "
            f"stop_reason={self.stop_reason.value!r})"
        )
