"""Price candidates with CasADi's virtual machine: no compiler needed.

An SX function interprets one scalar operation after the other, about a nanosecond each. The same tape over MX
columns spends that nanosecond on a whole column: one operation for all candidates of a batch. The first is built in
no time and best for few candidates; the second is for searches.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import casadi as ca
import numpy as np

from problems.matrix import FloatArray, Matrix
from problems.pricing.elementary import portable
from problems.pricing.tape import Symbolic, replay

BATCH = 64  # candidates a batch: the columns of a large model still fit the processor's cache
FEW = 16  # so many cost as much one by one as a whole batch, of which most would be padding
WARM = 2000  # candidates after which building the batch has paid

Buffer = tuple[ca.FunctionBuffer, Callable[[], None]]


class VirtualMachine:
    """A scalar CasADi function of one vector, interpreted for every row of an array.

    Args:
        function: SX function of one input (d,) and one scalar output.

    Raises:
        UnreadableTape: it holds an operation that :mod:`problems.pricing.tape` does not know.
    """

    def __init__(self, function: ca.Function) -> None:
        self._function = portable(function)
        self._priced = 0

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of contiguous points (m, d)."""
        self._priced += len(points)
        for start in range(0, len(points), BATCH):
            part, into = points[start : start + BATCH], costs[start : start + BATCH]
            if len(part) > FEW and self._priced > WARM:
                self._price_batch(part, into)
            else:
                self._price_singly(part, into)

    def _price_singly(self, points: FloatArray, costs: FloatArray) -> None:
        buffer, evaluate = self._single
        for k, point in enumerate(points):
            buffer.set_arg(0, point.data)  # type: ignore[call-arg]
            buffer.set_res(0, costs[k : k + 1].data)  # type: ignore[call-arg]
            evaluate()

    def _price_batch(self, points: FloatArray, costs: FloatArray) -> None:
        columns, results, (_, evaluate) = self._batch
        columns[:, : len(points)] = points.T
        evaluate()
        costs[:] = results[: len(points)]

    @cached_property
    def _single(self) -> Buffer:
        return self._function.buffer()

    @cached_property
    def _batch(self) -> tuple[FloatArray, FloatArray, Buffer]:
        """Input columns (d, BATCH), results (BATCH,) and the evaluation that joins them."""
        dimension = self._function.size1_in(0)
        points: Matrix = ca.MX.sym("points", BATCH, dimension)
        costs = replay(self._function, ca.horzsplit(points), Symbolic(ca.MX))
        column = ca.repmat(costs, BATCH // costs.numel())  # a constant cost is one number
        buffer, evaluate = ca.Function("batch", [points], [column]).buffer()
        columns, results = np.ones((dimension, BATCH)), np.empty(BATCH)
        buffer.set_arg(0, columns.data)  # type: ignore[call-arg]
        buffer.set_res(0, results.data)  # type: ignore[call-arg]
        return columns, results, (buffer, evaluate)
