"""Put kernels together for CasADi's virtual machine: written out for every row, or called for it.

Either way the numbers of a scene are an input, ``numbers``, so that CasADi folds nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TypeAlias

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation.columns import ColumnFunction, as_written
from problems.evaluation.kernel import Kernel, KernelData
from problems.evaluation.step import CANDIDATE, COST, PARAMETERS, ROW, WINDOW
from problems.evaluation.tape import E, column, entries

Call: TypeAlias = Callable[[Sequence[list[E]]], list[list[E]]]  # of the entries of vectors
NUMBERS = "numbers"


def numbers_of(data: Sequence[KernelData]) -> FloatArray:
    """Parameters and rows of all kernels behind each other."""
    return np.concatenate([part.ravel() for each in data for part in (each.parameters, each.rows)])


def operations(kernels: Sequence[Kernel], data: Sequence[KernelData]) -> int:
    """How many instructions a candidate takes."""
    return sum(kernel.function.n_instructions() * len(each.rows) for kernel, each in zip(kernels, data, strict=True))


def unrolled(kernels: Sequence[Kernel], data: Sequence[KernelData], dimension: int) -> ca.Function:
    """One SX function ``(x, numbers) -> cost`` with all rows written out."""
    x, numbers = ca.SX.sym(CANDIDATE, dimension), ca.SX.sym(NUMBERS, numbers_of(data).size)
    with as_written():
        calls = [partial(_called, kernel.function) for kernel in kernels]
        cost = _cost(kernels, data, calls, entries(x), entries(numbers))
        return ca.Function("unrolled", [x, numbers], [cost], [CANDIDATE, NUMBERS], [COST])


def batch_of_unrolled(function: ca.Function, width: int) -> tuple[ca.Function, FloatArray]:
    """The same for several candidates at once.

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
    [[cost]] = columns([ca.horzsplit(points), each[:size]], each[size:])
    return ca.Function("batch", [points, numbers], [cost]), columns.constants


def batch_of_calls(
    kernels: Sequence[Kernel], data: Sequence[KernelData], dimension: int, width: int
) -> tuple[ca.Function, FloatArray]:
    """The same as :func:`batch_of_unrolled`, but as a function that calls each kernel for each of its rows."""
    columns = [ColumnFunction(kernel.function, width, [PARAMETERS, ROW]) for kernel in kernels]
    constants = np.concatenate([each.constants for each in columns])
    points, size = ca.MX.sym(CANDIDATE, width, dimension), numbers_of(data).size
    numbers = ca.MX.sym(NUMBERS, size + constants.size)
    each_number = entries(numbers)
    remaining = iter(each_number[size:])
    calls = [partial(each, constants=[next(remaining) for _ in each.constants]) for each in columns]
    cost = _cost(kernels, data, calls, ca.horzsplit(points), each_number[:size])
    return ca.Function("batch", [points, numbers], [cost]), constants


def _called(function: ca.Function, arguments: Sequence[list[ca.SX]]) -> list[list[ca.SX]]:
    """An SX function of entries."""
    return [entries(result) for result in function.call([column(argument) for argument in arguments])]


def _cost(
    kernels: Sequence[Kernel], data: Sequence[KernelData], calls: Sequence[Call[E]], x: list[E], numbers: list[E]
) -> E:
    """The cost of a candidate, or of a column of candidates."""
    vectors, remaining = {CANDIDATE: x}, iter(numbers)
    for kernel, each, call in zip(kernels, data, calls, strict=True):
        _run(kernel, each, call, vectors, remaining)
    [cost] = vectors[COST]
    return cost


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
