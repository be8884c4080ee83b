"""A formula of a few numbers, for many rows of them, in NumPy's own memory: what proofs evaluate again and again."""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation.columns import ColumnFunction
from problems.evaluation.step import PARAMETERS
from problems.evaluation.tape import entries


class RowFunction:
    """A function of rows; the bits are those of one row after the other.

    Args:
        formula: SX function of a column (m, 1) and, if there is a second input called ``p``, of numbers (q, 1) that all
            rows share; of one dense column (r, 1).
        width: rows that are computed at once, the last ones padded.
    """

    def __init__(self, formula: ca.Function, width: int) -> None:
        self._formula, self._width = formula, width

    def __call__(self, columns: FloatArray, parameters: FloatArray | None = None) -> FloatArray:
        """Results (r, n) of n rows, given as columns (m, n)."""
        count = columns.shape[1]
        results = np.empty((self._formula.size1_out(0), count))
        block = self._one if count == 1 else self._block
        for first in range(0, count, block.width):
            last = min(first + block.width, count)
            results[:, first:last] = block(columns[:, first:last], parameters)
        return results

    @cached_property
    def _one(self) -> _Block:
        return _Block(self._formula, 1)

    @cached_property
    def _block(self) -> _Block:
        return _Block(self._formula, self._width)


class _Block:
    """The formula for ``width`` rows."""

    def __init__(self, formula: ca.Function, width: int) -> None:
        self.width = width
        inputs, outputs, shared = formula.size1_in(0), formula.size1_out(0), formula.n_in() - 1
        columns = ColumnFunction(formula, width, [PARAMETERS])
        matrix = ca.MX.sym("columns", width, inputs)
        parameters = ca.MX.sym(PARAMETERS, formula.size1_in(1) if shared else 0)
        constants = ca.MX.sym("constants", columns.constants.size)
        given = [ca.horzsplit(matrix), *[entries(parameters)] * shared]
        results = ca.horzcat(*columns(given, entries(constants))[0])
        self._function = ca.Function("rows", [matrix, parameters, constants], [ca.densify(results)])
        self._constants, self._parameters = columns.constants, np.zeros(parameters.numel())
        self._columns, self._results = np.zeros((inputs, width)), np.empty((outputs, width))
        self._buffer, self._evaluate = self._function.buffer()
        for number, array in enumerate((self._columns, self._parameters, self._constants)):
            self._buffer.set_arg(number, array.data)  # type: ignore[call-arg]
        self._buffer.set_res(0, self._results.data)  # type: ignore[call-arg]

    def __call__(self, columns: FloatArray, parameters: FloatArray | None) -> FloatArray:
        """Results (r, n) of at most ``width`` rows."""
        count = columns.shape[1]
        self._columns[:, :count] = columns
        if parameters is not None:
            self._parameters[:] = parameters
        self._evaluate()
        return self._results[:, :count]
