"""Quantiles of samples in which a run without a plan is infinitely bad, and gaps to a reference."""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray


def quantile(values: FloatArray, share: float) -> FloatArray:
    """The quantile of each column, linear between neighbours (Hyndman and Fan's type 7); inf beside an infinite one.

    Args:
        values: (n, ...), n > 0; inf allowed.
        share: from 0 to 1.

    Returns:
        Shape (...).
    """
    ordered = np.sort(values, axis=0)
    place = share * (len(ordered) - 1)
    below, weight = int(place), place - int(place)
    if weight == 0.0:
        return np.asarray(ordered[below])
    low, high = ordered[below], ordered[below + 1]
    finite = np.isfinite(high)
    return np.where(finite, (1.0 - weight) * low + weight * np.where(finite, high, 0.0), np.inf)


def gap(values: FloatArray, reference: float) -> FloatArray:
    """How far values lie above a reference, relative to its size; absolute where it is 0."""
    return (values - reference) / (abs(reference) or 1.0)
