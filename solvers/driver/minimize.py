"""The driver of all metaheuristics: evaluates what a search asks for, until it ends."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from solvers.box import Box, FloatArray
from solvers.driver.archive import Archive
from solvers.driver.budget import Budget
from solvers.driver.interruption import deferred_interrupt
from solvers.driver.result import Result, Status
from solvers.driver.run import SearchRun
from solvers.solver import Solver

Cost = Callable[[FloatArray], FloatArray]


def minimize(
    cost: Cost,
    box: Box,
    solver: Solver,
    budget: Budget,
    seed: int | np.random.Generator,
    callback: Callable[[Status], object] | None = None,
    archive: Archive | None = None,
    known: FloatArray | None = None,
) -> Result:
    """Search a box for the lowest cost.

    Args:
        cost: evaluates candidates (m, d) -> (m,). NaN and infinite costs count as worst.
        box: where to search.
        solver: the algorithm.
        budget: how long.
        seed: of the search's own random generator, or a generator to draw from.
        callback: gets the status after the initial population and after every iteration.
        archive: collects good candidates that differ from each other.
        known: candidates (m, d), clipped to the box, that take the first places of the initial population: what a
            search of almost the same cost has found, say. A solver without a population begins at the first.

    Returns:
        The best candidate and the record of the search. After Ctrl-C too, with ``StopReason.INTERRUPTED``: the
        search stops once the current batch is evaluated.

    Raises:
        ValueError: a candidate outside the box, or costs that do not match the candidates (a solver's bug); known
            candidates that are not (m, d).
    """
    started = box.with_known(known)
    with deferred_interrupt() as interruption:
        run = SearchRun(solver, started, budget, np.random.default_rng(seed), interruption, callback, archive)
        try:
            while run.pending is not None:
                run.tell(np.asarray(cost(run.pending), dtype=np.float64))
        finally:
            run.close()
    return run.result(seed if not isinstance(seed, np.random.Generator) else None)
