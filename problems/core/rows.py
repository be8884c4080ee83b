"""Rows and bounds of programs of control points and a change of the duration.

A row touches a few neighbouring control points: those of one joint, or of all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray


@dataclass(frozen=True, eq=False)
class SingleRows:
    """Rows that touch control points of one joint each: ``weights @ x + by_time tau <= bound``.

    Attributes:
        joint: (m,).
        first: number of the first control point, (m,). Those that are not free count for nothing.
        weights: of control points from the first on, (m, w).
        by_time: (m,).
        bound: (m,).
    """

    joint: NDArray[np.intp]
    first: NDArray[np.intp]
    weights: FloatArray
    by_time: FloatArray
    bound: FloatArray


@dataclass(frozen=True, eq=False)
class WholeRows:
    """Rows that touch control points of all joints: ``weights @ x + by_time tau - sigma <= bound``, sigma >= 0.

    Attributes:
        first: as above, (m,).
        weights: (m, w, k).
        by_time: (m,).
        bound: (m,).
        price: of each sigma, (m,); of squares their weights.
    """

    first: NDArray[np.intp]
    weights: FloatArray
    by_time: FloatArray
    bound: FloatArray
    price: FloatArray

    @classmethod
    def none(cls, width: int, joints: int) -> Self:
        """An empty set of rows for ``width`` control points of each joint."""
        empty = np.empty(0)
        return cls(np.empty(0, dtype=np.intp), np.empty((0, width, joints)), empty, empty, empty)

    def moved(self, points: FloatArray, before: int, tau: float = 0.0) -> FloatArray:
        """The values of the rows at control points and a tau, (m,).

        Args:
            points: control points of all joints, (n, k), with so many before the first that rows count.
            before: how many.
            tau: likewise.
        """
        touched = points[self.first[:, None] + before + np.arange(self.weights.shape[1])]
        return np.asarray(np.einsum("mak,mak->m", self.weights, touched) + self.by_time * tau)


R = TypeVar("R", SingleRows, WholeRows)


def stacked(parts: Sequence[R]) -> R:
    """The rows of all parts as one."""
    names = [field.name for field in fields(parts[0])]
    return type(parts[0])(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


@dataclass(frozen=True, eq=False)
class ProgramData:
    """A program: minimise the cost of tau and control points, prices paid, and half the squares.

    It is linear where there are no squares, else convex and quadratic.

    Attributes:
        single: rows of one joint each; of ``w`` control points, 2, 4 or 5.
        whole: rows of all joints; of as many.
        lower: bounds of the control points, (n, k).
        upper: likewise.
        times: bounds of tau.
        cost: of the control points, (n, k); none where None.
        time_cost: of tau.
        squares: rows of all joints whose differences from their bounds are squared and weighted; none where None.
    """

    single: SingleRows
    whole: WholeRows
    lower: FloatArray
    upper: FloatArray
    times: tuple[float, float]
    cost: FloatArray | None = None
    time_cost: float = 1.0
    squares: WholeRows | None = None
