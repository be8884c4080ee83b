"""Runs and targets: after how many evaluations each run came how near to the best plan, as in COCO [1].

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.convergence import Convergence
from tpbso_casadi.campaign.analysis.references import gaps_of


def evaluations_needed(run: Convergence, reference: float | None, targets: FloatArray) -> FloatArray:
    """After how many evaluations a run first had a plan within each gap.

    Args:
        run: its convergence.
        reference: the objective that gaps are measured from; None where no run has a plan.
        targets: gaps (n,).

    Returns:
        Shape (n,); inf where it never had.
    """
    gaps = gaps_of(run.objectives, reference)
    first = np.searchsorted(-gaps, -targets * (1.0 + 1e-12))
    return np.append(run.evaluations, np.inf)[first]


def shares_reached(needed: Sequence[FloatArray] | Iterable[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """The empirical distribution of evaluations needed: at each number (m,), the share of all targets reached (m,)."""
    every = np.concatenate(list(needed))
    evaluations, counts = np.unique(every[np.isfinite(every)], return_counts=True)
    return evaluations, np.cumsum(counts) / every.size
