"""Searches for the front of two objectives: by a solver that ranks fronts, or by sums of both with weights."""

from __future__ import annotations

from functools import partial
from itertools import repeat

import numpy as np

from problems.base import FloatArray
from solvers import Box, Budget, Iterations, Solver, StopReason, checked_candidates, deferred_interrupt, minimize
from tpbso_casadi.suite import Recording

SUMS = 10  # of both objectives, each with its share of the budget


def search_front(
    recording: Recording, solver: Solver, evaluations: int, seed: int, known: FloatArray | None = None
) -> None:
    """Search for the front of the recording's problem; what was found is what the recording keeps.

    Args:
        recording: of the run.
        solver: one that takes several costs, or any other.
        evaluations: of the run.
        seed: of the run.
        known: candidates (m, d) to begin with.

    Raises:
        InterruptedError: Ctrl-C.
    """
    box = Box(*recording.problem.bounds).with_known(known)
    search = _ranked if solver.takes_several_costs else _weighted
    search(recording, box, solver, evaluations, np.random.default_rng(seed))


def _ranked(recording: Recording, box: Box, solver: Solver, evaluations: int, rng: np.random.Generator) -> None:
    """By a solver that is told both merits of each candidate."""
    search = solver.search(box, rng, Iterations(repeat(0.0), evaluations))
    candidates = checked_candidates(next(search), box, solver)
    with deferred_interrupt() as interruption:
        while len(candidates) <= evaluations - recording.done:
            candidates = checked_candidates(search.send(recording.of_population(candidates)), box, solver)
            _check(interruption.requested)
    search.close()
    recording.of_population(candidates[: evaluations - recording.done])


def _weighted(recording: Recording, box: Box, solver: Solver, evaluations: int, rng: np.random.Generator) -> None:
    """By one search after the other for the least weighted sum of merits, which keeps feasibility first.

    First each objective by itself; then sums, in which an objective counts by how much it differs between these two
    ends. Every search begins with what those before it have found.
    """

    def total(candidates: FloatArray, by: FloatArray) -> FloatArray:
        return recording.of_population(candidates) @ by

    weights = [(1.0, 0.0), (0.0, 1.0), *((1.0 - w, w) for w in np.linspace(0.0, 1.0, SUMS)[1:-1])]
    found = np.empty((0, box.dimension)) if box.known is None else box.known
    ends = np.empty((0, 2))
    for number, pair in enumerate(weights, start=1):
        apart = np.abs(ends[1] - ends[0]) if len(ends) > 1 else np.ones(2)
        by = np.array(pair) / np.where(apart > 0.0, apart, 1.0)
        budget = Budget(evaluations=number * evaluations // SUMS - recording.done)
        known = found if len(found) else None
        result = minimize(partial(total, by=by), box, solver, budget, rng, known=known)
        _check(result.stop_reason is StopReason.INTERRUPTED)
        found = np.vstack([found, result.x])
        ends = np.vstack([ends, recording.problem.merit(result.x[None])])


def _check(interrupted: bool) -> None:
    if interrupted:
        raise InterruptedError("the run was interrupted")
