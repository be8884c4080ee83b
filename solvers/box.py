"""The search space: a box of real vectors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class Box:
    """All x with lower <= x <= upper.

    Args:
        lower: shape (d,).
        upper: shape (d,).

    Raises:
        ValueError: the corners differ in shape, are not finite, or are swapped.
    """

    lower: FloatArray
    upper: FloatArray

    def __post_init__(self) -> None:
        if self.lower.shape != self.upper.shape or self.lower.ndim != 1 or self.lower.size == 0:
            raise ValueError(f"corners of shapes {self.lower.shape} and {self.upper.shape} where two (d,) are needed")
        if not (np.isfinite(self.lower).all() and np.isfinite(self.upper).all()):
            raise ValueError("a box has finite corners")
        if (self.lower > self.upper).any():
            raise ValueError("a lower corner is above the upper one: did you swap them?")

    @property
    def dimension(self) -> int:
        """D."""
        return self.lower.size

    @property
    def span(self) -> FloatArray:
        """Edge lengths, (d,)."""
        return self.upper - self.lower

    def sample(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Uniform random points, (count, d)."""
        return rng.uniform(self.lower, self.upper, (count, self.dimension))

    def clip(self, points: FloatArray) -> FloatArray:
        """The nearest points of the box, same shape."""
        return np.clip(points, self.lower, self.upper)

    def from_unit(self, shares: FloatArray) -> FloatArray:
        """Map points (m, d) of the unit cube to the box; those outside the cube by rounding are clipped."""
        return self.clip(self.lower + shares * self.span)
