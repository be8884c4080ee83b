"""The driver of a gradient-based solver: descend from many starts and keep the best."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.box import FloatArray
from solvers.driver.budget import Budget, StopReason, Usage
from solvers.driver.interruption import deferred_interrupt
from solvers.driver.result import History, Result, Status
from solvers.gradients.ipopt import Solution, Stop
from solvers.traits import STARTS


@dataclass(frozen=True, kw_only=True, repr=False)
class DescentResult(Result):
    """The result of many descents.

    ``x`` holds the program's variables, ``iterations`` counts the starts, ``history`` has the best after each start.

    Attributes:
        solution: the best descent, and how it ended.
    """

    in_program_variables: ClassVar[bool] = True

    solution: Solution


def descend(
    solve: Callable[[FloatArray], Solution],
    stop: Stop,
    starts: Iterable[FloatArray],
    merit: Callable[[Solution], float],
    budget: Budget,
    seed: int | None = None,
    callback: Callable[[Status], object] | None = None,
) -> DescentResult:
    """Descend from one start after the other and keep the best.

    Args:
        solve: from a start (n,) to a solution: a :class:`Descent`, or a function that improves what it returns.
        stop: of the descent.
        starts: each (n,).
        merit: by which solutions are compared, lower is better; finite.
        budget: how long; its iterations are starts, its evaluations those of the objective. At least one start is done.
        seed: from which the starts were drawn, for the record.
        callback: gets the status after every start.

    Returns:
        The best by merit. After Ctrl-C too, with ``StopReason.INTERRUPTED``.

    Raises:
        ValueError: there is no start.
    """
    start_time = time.perf_counter()
    if budget.seconds is not None:
        stop.deadline = start_time + budget.seconds
    best: Solution | None = None
    cost = np.inf
    records: list[tuple[int, float, FloatArray]] = []
    evaluations, last_improvement, stop_reason = 0, 0, StopReason.EXHAUSTED
    with deferred_interrupt() as interruption:
        stop.interruption = interruption
        for number, start in enumerate(starts, start=1):
            solution = solve(start)
            evaluations += solution.evaluations
            value = merit(solution)
            if best is None or value < cost:
                best, cost, last_improvement = solution, value, number
            records.append((evaluations, cost, best.x))
            usage = Usage(
                evaluations=evaluations,
                requested=evaluations + 1,  # another start needs one at least
                iterations=number,
                seconds=time.perf_counter() - start_time,
                cost=cost,
                unimproved=number - last_improvement,
                interrupted=interruption.requested,
            )
            if callback is not None:
                callback(Status.of(usage, budget, STARTS))
            reached = budget.reached(usage)
            if reached is not None:
                stop_reason = reached
                break
    if best is None:
        raise ValueError("there was no start to descend from")
    return DescentResult(
        x=best.x,
        cost=cost,
        evaluations=evaluations,
        iterations=len(records),
        seconds=time.perf_counter() - start_time,
        seed=seed,
        stop_reason=stop_reason,
        history=History.of(records, STARTS),
        solution=best,
    )
