"""How a batch of candidates is run: unrolled or by calls, in CasADi's virtual machine.

Either way the numbers of a scene are an input, ``numbers``, so that CasADi folds nothing.

An SX function interprets one scalar operation after the other, about a nanosecond each. The same tape over MX
columns spends that nanosecond on a whole column: one operation for all candidates of a batch. The first is built in
no time and best for few candidates; the second is for searches.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import casadi as ca
import numpy as np

from problems.base import FloatArray
from problems.evaluation.interpreter import ColumnFunction, E, as_written, column, entries
from problems.evaluation.kernel import Kernel, KernelData
from problems.evaluation.program import CANDIDATE, COST, PARAMETERS, ROW, WINDOW

Call: TypeAlias = Callable[[Sequence[list[E]]], list[list[E]]]  # of the entries of vectors
NUMBERS = "numbers"


def numbers_of(data: Sequence[KernelData]) -> FloatArray:
    """Parameters and rows of all kernels, one after the other."""
    return np.concatenate([part.ravel() for each in data for part in (each.parameters, each.rows)])


def operations(kernels: Sequence[Kernel], data: Sequence[KernelData]) -> int:
    """The number of instructions that a candidate takes."""
    return sum(kernel.function.n_instructions() * len(each.rows) for kernel, each in zip(kernels, data, strict=True))


def unrolled(kernels: Sequence[Kernel], data: Sequence[KernelData], dimension: int) -> ca.Function:
    """One SX function ``(x, numbers) -> cost`` with all rows written out; the cost is a column (k, 1)."""
    x, numbers = ca.SX.sym(CANDIDATE, dimension), ca.SX.sym(NUMBERS, numbers_of(data).size)
    with as_written():
        calls = [partial(_called, kernel.function) for kernel in kernels]
        cost = _cost(kernels, data, calls, entries(x), entries(numbers))
        return ca.Function("unrolled", [x, numbers], [column(cost)], [CANDIDATE, NUMBERS], [COST])


def batch_of_unrolled(function: ca.Function, width: int) -> tuple[ca.Function, FloatArray]:
    """An unrolled function for several candidates at once, and the constants that it takes.

    Args:
        function: what :func:`unrolled` gave.
        width: how many candidates.

    Returns:
        The function of their coordinates (width, d) and of further numbers, and those numbers, which have to follow
        the scene's.
    """
    columns = ColumnFunction(function, width, [NUMBERS])
    points, size = ca.MX.sym(CANDIDATE, width, function.size1_in(CANDIDATE)), function.size1_in(NUMBERS)
    numbers = ca.MX.sym(NUMBERS, size + columns.constants.size)
    each = entries(numbers)
    [values] = columns([ca.horzsplit(points), each[:size]], each[size:])
    return ca.Function("batch", [points, numbers], [ca.horzcat(*values)]), columns.constants


def batch_of_calls(
    kernels: Sequence[Kernel], data: Sequence[KernelData], dimension: int, width: int
) -> tuple[ca.Function, FloatArray]:
    """A batch like that of :func:`batch_of_unrolled`, but calling each kernel for each of its rows."""
    columns = [ColumnFunction(kernel.function, width, [PARAMETERS, ROW]) for kernel in kernels]
    constants = np.concatenate([each.constants for each in columns])
    points, size = ca.MX.sym(CANDIDATE, width, dimension), numbers_of(data).size
    numbers = ca.MX.sym(NUMBERS, size + constants.size)
    each_number = entries(numbers)
    remaining = iter(each_number[size:])
    calls = [partial(each, constants=[next(remaining) for _ in each.constants]) for each in columns]
    values = _cost(kernels, data, calls, ca.horzsplit(points), each_number[:size])
    return ca.Function("batch", [points, numbers], [ca.horzcat(*values)]), constants


def _called(function: ca.Function, arguments: Sequence[list[ca.SX]]) -> list[list[ca.SX]]:
    """The entries of an SX function's outputs at entries of its inputs."""
    return [entries(result) for result in function.call([column(argument) for argument in arguments])]


def _cost(
    kernels: Sequence[Kernel], data: Sequence[KernelData], calls: Sequence[Call[E]], x: list[E], numbers: list[E]
) -> list[E]:
    """The cost of a candidate, or of a column of candidates, and what is written with it."""
    vectors, remaining = {CANDIDATE: x}, iter(numbers)
    for kernel, each, call in zip(kernels, data, calls, strict=True):
        _run(kernel, each, call, vectors, remaining)
    return vectors[COST]


def _run(kernel: Kernel, data: KernelData, call: Call[E], vectors: dict[str, list[E]], numbers: Iterator[E]) -> None:
    """Run a kernel for all of its rows and add what it writes to the vectors."""
    names, outputs = kernel.function.name_in(), kernel.function.name_out()
    width = kernel.function.size1_in(WINDOW) if kernel.window else 0
    given = {PARAMETERS: [next(numbers) for _ in data.parameters]}
    stacks: dict[str, list[E]] = {name: [] for name in kernel.stacked}
    for row, start in zip(data.rows, data.starts, strict=True):
        given[ROW] = [next(numbers) for _ in row]
        if kernel.window:
            given[WINDOW] = vectors[kernel.window][start : start + width]
        results = call([given[name] if name in given else vectors[name] for name in names])
        for name, result in zip(outputs, results, strict=True):
            if name in stacks:
                stacks[name] += result
            else:
                vectors[name] = result
    vectors |= stacks


@dataclass(frozen=True, kw_only=True)
class BatchSettings:
    """Settings of how many candidates are evaluated together.

    Values are chosen.

    Attributes:
        batch_size: candidates per batch at most: the columns of a large model still fit the processor's cache.
        most_unbatched: candidates that are evaluated one by one: a batch, mostly padding, takes as long.
        batch_after: evaluations after which the time to build the batch is won back.
        unrolled_operations: operations per candidate; larger programs call a function for each row.
    """

    batch_size: int = 64
    most_unbatched: int = 16
    batch_after: int = 2000
    unrolled_operations: int = 50_000


SETTINGS = BatchSettings()


class VirtualMachine:
    """A program that CasADi's virtual machine runs for every row of an array.

    Args:
        kernels: of its steps.
        data: what they work on.
        dimension: entries d of a candidate.
    """

    def __init__(self, kernels: Sequence[Kernel], data: Sequence[KernelData], dimension: int) -> None:
        self._numbers = numbers_of(data)
        self._program = kernels, data, dimension
        self._unrolled = unrolled(*self._program) if operations(kernels, data) <= SETTINGS.unrolled_operations else None
        self._single = self._batch_of(1)
        self._batch: Batch | None = None
        self._evaluations = 0

    def with_data(self, data: Sequence[KernelData]) -> VirtualMachine:
        """The program with the numbers of another scene, for which nothing is built anew."""
        other = copy(self)
        other._numbers = numbers_of(data)
        other._single = self._single.with_numbers(other._numbers)
        other._batch = None if self._batch is None else self._batch.with_numbers(other._numbers)
        return other

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) or (m, k) of contiguous points (m, d)."""
        self._evaluations += len(points)
        if self._batch is None and len(points) > SETTINGS.most_unbatched and self._evaluations > SETTINGS.batch_after:
            self._batch = self._batch_of(min(len(points), SETTINGS.batch_size))
        width = self._batch.width if self._batch is not None else SETTINGS.batch_size
        for start in range(0, len(points), width):
            part, into = points[start : start + width], costs[start : start + width]
            if self._batch is not None and len(part) > SETTINGS.most_unbatched:
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
        function: of their coordinates, (width * d,), one coordinate after the other, and of the numbers; to the values
            of each candidate, (width * k,), likewise.
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
        self._columns, self._results = np.ones((dimension, width)), np.empty((function.numel_out(0) // width, width))
        self._numbers = np.append(numbers, constants)
        self._buffer.set_arg(0, self._columns.data)  # type: ignore[call-arg]
        self._buffer.set_arg(1, self._numbers.data)  # type: ignore[call-arg]
        self._buffer.set_res(0, self._results.data)  # type: ignore[call-arg]

    def with_numbers(self, numbers: FloatArray) -> Batch:
        """The batch for the numbers of another scene."""
        return Batch(self._function, numbers, self._constants, len(self._columns), self.width)

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) or (m, k) of at most ``width`` points (m, d)."""
        self._columns[:, : len(points)] = points.T
        self._evaluate()
        costs[:] = self._results[:, : len(points)].T.reshape(costs.shape)
