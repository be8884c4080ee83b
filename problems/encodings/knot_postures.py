"""Postures at the knots of a path, each found from the one at the knot before."""

from __future__ import annotations

from abc import abstractmethod
from typing import TypeVar

import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.encodings.encoding import Encoding

P = TypeVar("P")


class KnotPostures(Encoding[P]):
    """Search vectors that decide about postures along a path."""

    @property
    @abstractmethod
    def knot_rows(self) -> FloatArray:
        """What is known of each knot: how it depends on the search vector, and where the tool is; (lead + M, w)."""

    @property
    def lead(self) -> int:
        """How many rows only lead to the posture at the first knot; none by default."""
        return 0

    @abstractmethod
    def posture_before(self, x: Matrix) -> Matrix:
        """The posture from which the first one is found, (1, dof), rad."""

    @abstractmethod
    def posture_at(self, x: Matrix, row: Matrix, before: Matrix) -> Matrix:
        """The posture at a knot, (1, dof), rad.

        Args:
            x: search vector, (d, 1).
            row: of :attr:`knot_rows`, (w, 1).
            before: the posture at the knot before, (1, dof), rad.
        """

    @abstractmethod
    def postures(self, x: Matrix) -> Matrix:
        """Joint angles at all knots, (M, dof), rad."""


def largest_values(operator: FloatArray, most: float = np.pi) -> FloatArray:
    """Bounds of an operator (n, M) on knot angles that do not change by more than ``most`` from knot to knot, (n,)."""
    steps = operator @ np.tril(np.ones((operator.shape[1],) * 2))[:, 1:]
    return np.asarray(most * np.abs(steps).sum(axis=1))
