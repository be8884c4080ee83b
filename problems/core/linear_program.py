"""Linear programs: of control points and a change of the duration by the compiled core, any of them by HiGHS.

A row touches a few neighbouring control points: those of one joint, or of all. The core's interior-point method makes
use of that (:file:`problems/core/cpp/program.cpp`).
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import CDLL
from dataclasses import dataclass, fields
from typing import Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import csr_array

from problems.base import FloatArray
from problems.core.library import core_library

METHODS = ("highs-ds", "highs-ipm")
PRIMAL_TOLERANCE, DUAL_TOLERANCE = 1e-10, 1e-9  # HiGHS allows no smaller one than 1e-10


def minimizer(costs: FloatArray, matrix: csr_array, bound: FloatArray, box: FloatArray) -> FloatArray | None:
    """Minimise ``costs @ x`` subject to ``matrix @ x <= bound`` and the box; None where no method can.

    Args:
        costs: (n,).
        matrix: (rows, n).
        bound: (rows,).
        box: lower and upper bounds of x, (n, 2).
    """
    options = {"primal_feasibility_tolerance": PRIMAL_TOLERANCE, "dual_feasibility_tolerance": DUAL_TOLERANCE}
    for method in METHODS:
        result = linprog(costs, matrix, bound, bounds=box, method=method, options=options)  # type: ignore[call-overload]
        if result.status == 0:
            return np.asarray(result.x, dtype=np.float64)
    return None


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
        price: of each sigma, (m,).
    """

    first: NDArray[np.intp]
    weights: FloatArray
    by_time: FloatArray
    bound: FloatArray
    price: FloatArray

    @classmethod
    def none(cls, width: int, joints: int) -> Self:
        """No row, of so many control points."""
        empty = np.empty(0)
        return cls(np.empty(0, dtype=np.intp), np.empty((0, width, joints)), empty, empty, empty)


R = TypeVar("R", SingleRows, WholeRows)


def joined(parts: Sequence[R]) -> R:
    """Several as one."""
    names = [field.name for field in fields(parts[0])]
    return type(parts[0])(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _whole_numbers(*parts: NDArray[np.intp]) -> list[NDArray[np.int32]]:
    return [np.ascontiguousarray(part, dtype=np.int32) for part in parts]


def _numbers(*parts: FloatArray) -> list[FloatArray]:
    return [np.ascontiguousarray(part, dtype=np.float64) for part in parts]


@dataclass(frozen=True, eq=False)
class LinearProgram:
    """Minimise tau, what is paid, and the cost of control points.

    Attributes:
        single: rows of one joint each; of ``w`` control points, 2, 4 or 5.
        whole: rows of all joints; of as many.
        lower: bounds of the control points, (n, k).
        upper: likewise.
        times: bounds of tau.
        cost: of the control points, (n, k); none where None.
    """

    single: SingleRows
    whole: WholeRows
    lower: FloatArray
    upper: FloatArray
    times: tuple[float, float]
    cost: FloatArray | None = None

    def solved(self) -> tuple[FloatArray, float] | None:
        """Control points (n, k) and tau; None where nothing was found."""
        library = core_library()
        return self.by_highs() if library is None else self._by_core(library)

    def _by_core(self, library: CDLL) -> tuple[FloatArray, float] | None:
        n, k = self.lower.shape
        x, tau = np.empty((n, k)), np.empty(1)
        one, every = self.single, self.whole
        single: list[NDArray[Any]] = [
            *_whole_numbers(one.joint, one.first),
            *_numbers(one.weights, one.by_time, one.bound),
        ]
        whole: list[NDArray[Any]] = [
            *_whole_numbers(every.first),
            *_numbers(every.weights, every.by_time, every.bound, every.price),
        ]
        box = _numbers(self.lower, self.upper, *(() if self.cost is None else (self.cost,)))
        steps = library.core_program(
            one.weights.shape[1], k, n, len(self.single.bound), *(part.ctypes.data for part in single),
            len(self.whole.bound), *(part.ctypes.data for part in whole), *(part.ctypes.data for part in box),
            *((None,) if self.cost is None else ()), *self.times, x.ctypes.data, tau.ctypes.data,
        )  # fmt: skip
        return (x, float(tau[0])) if steps > 0 else None

    def by_highs(self) -> tuple[FloatArray, float] | None:
        """The same by HiGHS."""
        n, k = self.lower.shape
        one, all_ = self.single, self.whole
        wide, first, soft = one.weights.shape[1], n * k, np.flatnonzero(np.isfinite(all_.price))
        width = first + 1 + soft.size
        rows, columns, values = [], [], []

        def put(row: NDArray[np.intp], point: NDArray[np.intp], joint: NDArray[np.intp], value: FloatArray) -> None:
            kept = (point >= 0) & (point < n)
            rows.append(row[kept])
            columns.append((point * k + joint)[kept])
            values.append(value[kept])

        m, p = len(one.bound), len(all_.bound)
        steps = np.arange(wide)
        put(
            np.repeat(np.arange(m), wide), (one.first[:, None] + steps).ravel(), np.repeat(one.joint, wide),
            one.weights.ravel(),
        )  # fmt: skip
        points = np.broadcast_to((all_.first[:, None] + steps)[:, :, None], (p, wide, k)).ravel()
        put(np.repeat(m + np.arange(p), wide * k), points, np.tile(np.arange(k), p * wide), all_.weights.ravel())
        rows += [np.arange(m + p), m + soft]
        columns += [np.full(m + p, first), first + 1 + np.arange(soft.size)]
        values += [np.concatenate([one.by_time, all_.by_time]), np.full(soft.size, -1.0)]
        matrix = csr_array(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(m + p, width)
        )
        costs = np.concatenate([np.zeros(first) if self.cost is None else self.cost.ravel(), [1.0], all_.price[soft]])
        box = np.concatenate([
            np.column_stack([self.lower.ravel(), self.upper.ravel()]), [self.times],
            np.column_stack([np.zeros(soft.size), np.full(soft.size, np.inf)]),
        ])  # fmt: skip
        found = minimizer(costs, matrix, np.concatenate([one.bound, all_.bound]), box)
        return None if found is None else (found[:first].reshape(n, k), float(found[first]))
