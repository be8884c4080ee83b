"""The box of numbers that a solver searches."""

from __future__ import annotations

from dataclasses import dataclass, replace
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
        known: candidates that take the first places of initial populations, (m, d), as :meth:`with_known` gives them;
            None for none.

    Raises:
        ValueError: the corners differ in shape, are not finite, or are swapped.
    """

    lower: FloatArray
    upper: FloatArray
    known: FloatArray | None = None

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

    def initial(self, rng: np.random.Generator, count: int) -> FloatArray:
        """The initial population (count, d): the known candidates, and uniform random points in the other places."""
        points = self.sample(rng, count)
        if self.known is not None:
            points[: len(self.known)] = self.known[:count]
        return points

    def initial_shares(self, shares: FloatArray) -> FloatArray:
        """The same in the unit cube: its points (m, d) with the known candidates in the first places."""
        if self.known is None:
            return shares
        return np.concatenate([self.to_unit(self.known), shares[len(self.known) :]])[: len(shares)]

    def with_known(self, known: FloatArray | None) -> Box:
        """The same box with known candidates (m, d), clipped to it.

        Raises:
            ValueError: they are not (m, d), or not finite.
        """
        if known is None:
            return self
        if known.ndim != 2 or known.shape[1] != self.dimension or not np.isfinite(known).all():
            raise ValueError(f"known candidates of shape {known.shape} where finite (m, {self.dimension}) are needed")
        return replace(self, known=self.clip(known))

    def clip(self, points: FloatArray) -> FloatArray:
        """The nearest points of the box, same shape."""
        return np.clip(points, self.lower, self.upper)

    def from_unit(self, shares: FloatArray) -> FloatArray:
        """Map points (m, d) of the unit cube to the box; those outside the cube by rounding are clipped."""
        return self.clip(self.lower + shares * self.span)

    def to_unit(self, points: FloatArray) -> FloatArray:
        """The inverse: points (m, d) of the box as shares of its edges, 0 where an edge has no length."""
        return (points - self.lower) / np.where(self.span > 0.0, self.span, 1.0)
