"""Evaluate candidates with CasADi's virtual machine: no compiler needed.

An SX function interprets one scalar operation after the other, about a nanosecond each. The same tape over MX
columns spends that nanosecond on a whole column: one operation for all candidates of a batch. The first is built in
no time and best for few candidates; the second is for searches.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation.kernel import Kernel, KernelData
from problems.evaluation.native.assembly import batch_of_calls, batch_of_unrolled, numbers_of, operations, unrolled

BATCH_SIZE = 64  # candidates per batch at most: the columns of a large model still fit the processor's cache
MAX_UNBATCHED = 16  # up to so many candidates are evaluated one by one: a batch, mostly padding, takes as long
BATCH_AFTER_CANDIDATES = 2000  # evaluations after which the time to build the batch is won back
UNROLLED_OPERATIONS = 50_000  # per candidate; larger programs call a function for each row instead of writing it out


class VirtualMachine:
    """A program, interpreted for every row of an array.

    Args:
        kernels: of its steps.
        data: what they work on.
        dimension: entries d of a candidate.
    """

    def __init__(self, kernels: Sequence[Kernel], data: Sequence[KernelData], dimension: int) -> None:
        self._numbers = numbers_of(data)
        self._program = kernels, data, dimension
        self._unrolled = unrolled(*self._program) if operations(kernels, data) <= UNROLLED_OPERATIONS else None
        self._single = self._batch_of(1)
        self._batch: Batch | None = None
        self._evaluations = 0

    def with_data(self, data: Sequence[KernelData]) -> VirtualMachine:
        """The same program with the numbers of another scene, for which nothing is built anew."""
        other = copy(self)
        other._numbers = numbers_of(data)
        other._single = self._single.with_numbers(other._numbers)
        other._batch = None if self._batch is None else self._batch.with_numbers(other._numbers)
        return other

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of contiguous points (m, d)."""
        self._evaluations += len(points)
        if self._batch is None and len(points) > MAX_UNBATCHED and self._evaluations > BATCH_AFTER_CANDIDATES:
            self._batch = self._batch_of(min(len(points), BATCH_SIZE))
        width = self._batch.width if self._batch is not None else BATCH_SIZE
        for start in range(0, len(points), width):
            part, into = points[start : start + width], costs[start : start + width]
            if self._batch is not None and len(part) > MAX_UNBATCHED:
                self._batch(part, into)
            else:
                for k in range(len(part)):
                    self._single(part[k : k + 1], into[k : k + 1])

    def _batch_of(self, width: int) -> Batch:
        constants = np.empty(0)
        if self._unrolled is None:
            function, constants = batch_of_calls(*self._program, width)
        elif width == 1:
            function = self._unrolled
        else:
            function, constants = batch_of_unrolled(self._unrolled, width)
        return Batch(function, self._numbers, constants, self._program[2], width)


class Batch:
    """Up to ``width`` candidates at once.

    Args:
        function: of their coordinates, (width * d,), one coordinate after the other, and of the numbers.
        numbers: of the scene.
        constants: further numbers that the function takes behind them.
        dimension: entries d of a candidate.
        width: how many; fewer cost as much.
    """

    def __init__(
        self, function: ca.Function, numbers: FloatArray, constants: FloatArray, dimension: int, width: int
    ) -> None:
        self.width = width
        self._function, self._constants = function, constants
        self._buffer, self._evaluate = function.buffer()
        self._columns, self._results = np.ones((dimension, width)), np.empty(width)
        self._numbers = np.append(numbers, constants)
        self._buffer.set_arg(0, self._columns.data)  # type: ignore[call-arg]
        self._buffer.set_arg(1, self._numbers.data)  # type: ignore[call-arg]
        self._buffer.set_res(0, self._results.data)  # type: ignore[call-arg]

    def with_numbers(self, numbers: FloatArray) -> Batch:
        """The same for another scene."""
        return Batch(self._function, numbers, self._constants, len(self._columns), self.width)

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of at most ``width`` points (m, d)."""
        self._columns[:, : len(points)] = points.T
        self._evaluate()
        costs[:] = self._results[: len(points)]
