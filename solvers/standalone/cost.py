"""A user's function as the driver needs it: of a whole population, its values checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.box import FloatArray


@dataclass(frozen=True)
class PopulationCost:
    """A function of a whole population, (m, d) -> (m,).

    Raises:
        ValueError: when called: the function returned another shape.
    """

    f: Callable[[FloatArray], Any]

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d)."""
        if not len(candidates):
            return np.empty(0)
        costs = _numbers(self.f(candidates.copy()))
        if costs.shape != (len(candidates),):
            raise ValueError(
                f"f returned shape {costs.shape} for {len(candidates)} candidates {candidates.shape}; with "
                "vectorized=True it takes a population (m, d) and returns (m,)"
            )
        return costs


@dataclass(frozen=True)
class SingleCost:
    """A function of one vector, (d,) -> a number; called once a candidate.

    Raises:
        ValueError: when called: the function returned something else than a number.
    """

    f: Callable[[FloatArray], Any]

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d)."""
        return np.array([self._one(x) for x in candidates], dtype=np.float64)

    def _one(self, x: FloatArray) -> float:
        cost = _numbers(self.f(x.copy()))
        if cost.size != 1:
            raise ValueError(
                f"f returned shape {cost.shape} for one vector {x.shape}; a function of a whole population (m, d) "
                "needs vectorized=True"
            )
        return float(cost.reshape(()))


def _numbers(values: Any) -> FloatArray:
    try:
        numbers = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"f returned {values!r:.60}: rows of different lengths") from error
    if numbers.dtype.kind not in "biuf":
        raise ValueError(f"f returned {values!r:.60} where real numbers are needed")
    return numbers.astype(np.float64)
