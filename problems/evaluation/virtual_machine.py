"""Price candidates with CasADi's virtual machine: no compiler needed.

An SX function interprets one scalar operation after the other, about a nanosecond each. The same tape over MX
columns spends that nanosecond on a whole column: one operation for all candidates of a batch. The first is built in
no time and best for few candidates; the second is for searches.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.evaluation.portable_math import portable
from problems.evaluation.tape import Symbolic, interpret

BATCH = 64  # candidates a batch at the most: the columns of a large model still fit the processor's cache
FEW = 16  # so many cost as much one by one as a whole batch, of which most would be padding
WARM = 2000  # candidates after which building the batch has paid

Buffer = tuple[ca.FunctionBuffer, Callable[[], None]]


class VirtualMachine:
    """A scalar CasADi function of one vector, interpreted for every row of an array.

    Args:
        function: SX function of one input (d,) and one scalar output.

    Raises:
        UnsupportedOperation: it holds an operation that :mod:`problems.evaluation.tape` does not know.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = portable(function)
        self._single: Buffer = self._function.buffer()
        self._batch: Batch | None = None
        self._evaluators = 0

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of contiguous points (m, d)."""
        self._evaluators += len(points)
        if self._batch is None and len(points) > FEW and self._evaluators > WARM:
            self._batch = Batch(self._function, min(len(points), BATCH))
        width = self._batch.width if self._batch is not None else BATCH
        for start in range(0, len(points), width):
            part, into = points[start : start + width], costs[start : start + width]
            if self._batch is not None and len(part) > FEW:
                self._batch(part, into)
            else:
                self._price_singly(part, into)

    def _price_singly(self, points: FloatArray, costs: FloatArray) -> None:
        buffer, evaluate = self._single
        for k, point in enumerate(points):
            buffer.set_arg(0, point.data)  # type: ignore[call-arg]
            buffer.set_res(0, costs[k : k + 1].data)  # type: ignore[call-arg]
            evaluate()


class Batch:
    """Up to ``width`` candidates at once.

    Args:
        function: SX function of one input (d,) and one scalar output.
        width: how many; fewer cost as much.
    """

    def __init__(self, function: ca.Function, width: int) -> None:
        self.width = width
        dimension = function.size1_in(0)
        points: Matrix = ca.MX.sym("points", width, dimension)
        costs = interpret(function, ca.horzsplit(points), Symbolic(ca.MX))
        column = ca.repmat(costs, width // costs.numel())  # a constant cost is one number
        self._buffer, self._evaluate = ca.Function("batch", [points], [column]).buffer()
        self._columns, self._results = np.ones((dimension, width)), np.empty(width)
        self._buffer.set_arg(0, self._columns.data)  # type: ignore[call-arg]
        self._buffer.set_res(0, self._results.data)  # type: ignore[call-arg]

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of at most ``width`` points (m, d)."""
        self._columns[:, : len(points)] = points.T
        self._evaluate()
        costs[:] = self._results[: len(points)]
