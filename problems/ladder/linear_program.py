"""Linear programs of control points and a change of the duration: by the compiled core, else by HiGHS.

A row touches four neighbouring control points: those of one joint, or of all. The core's interior-point method makes
use of that (:file:`problems/core/cpp/program.cpp`).
"""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import CDLL
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from problems.base import FloatArray
from problems.core import core_library
from problems.timing import minimizer

WIDTH = 4  # control points that a row touches


@dataclass(frozen=True, eq=False)
class SingleRows:
    """Rows that touch control points of one joint each: ``weights @ x + by_time tau <= bound``.

    Attributes:
        joint: (m,).
        first: number of the first of four control points, of which those that are not free count for nothing, (m,).
        weights: (m, 4).
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
        weights: (m, 4, k).
        by_time: (m,).
        bound: (m,).
        price: of each sigma, (m,).
    """

    first: NDArray[np.intp]
    weights: FloatArray
    by_time: FloatArray
    bound: FloatArray
    price: FloatArray


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
    """Minimise tau and what is paid.

    Attributes:
        single: rows of one joint each.
        whole: rows of all joints.
        lower: bounds of the control points, (n, k).
        upper: likewise.
        times: bounds of tau.
    """

    single: SingleRows
    whole: WholeRows
    lower: FloatArray
    upper: FloatArray
    times: tuple[float, float]

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
        box = _numbers(self.lower, self.upper)
        steps = library.core_program(
            k, n, len(self.single.bound), *(part.ctypes.data for part in single),
            len(self.whole.bound), *(part.ctypes.data for part in whole), *(part.ctypes.data for part in box),
            *self.times, x.ctypes.data, tau.ctypes.data,
        )  # fmt: skip
        return (x, float(tau[0])) if steps > 0 else None

    def by_highs(self) -> tuple[FloatArray, float] | None:
        """The same by HiGHS."""
        n, k = self.lower.shape
        one, all_ = self.single, self.whole
        first, soft = n * k, np.flatnonzero(np.isfinite(all_.price))
        width = first + 1 + soft.size
        rows, columns, values = [], [], []

        def put(row: NDArray[np.intp], point: NDArray[np.intp], joint: NDArray[np.intp], value: FloatArray) -> None:
            kept = (point >= 0) & (point < n)
            rows.append(row[kept])
            columns.append((point * k + joint)[kept])
            values.append(value[kept])

        m, p = len(one.bound), len(all_.bound)
        steps = np.arange(WIDTH)
        put(
            np.repeat(np.arange(m), WIDTH), (one.first[:, None] + steps).ravel(), np.repeat(one.joint, WIDTH),
            one.weights.ravel(),
        )  # fmt: skip
        points = np.broadcast_to((all_.first[:, None] + steps)[:, :, None], (p, WIDTH, k)).ravel()
        put(np.repeat(m + np.arange(p), WIDTH * k), points, np.tile(np.arange(k), p * WIDTH), all_.weights.ravel())
        rows += [np.arange(m + p), m + soft]
        columns += [np.full(m + p, first), first + 1 + np.arange(soft.size)]
        values += [np.concatenate([one.by_time, all_.by_time]), np.full(soft.size, -1.0)]
        matrix = csr_array(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(m + p, width)
        )
        costs = np.concatenate([np.zeros(first), [1.0], all_.price[soft]])
        box = np.concatenate([
            np.column_stack([self.lower.ravel(), self.upper.ravel()]), [self.times],
            np.column_stack([np.zeros(soft.size), np.full(soft.size, np.inf)]),
        ])  # fmt: skip
        found = minimizer(costs, matrix, np.concatenate([one.bound, all_.bound]), box)
        return None if found is None else (found[:first].reshape(n, k), float(found[first]))
