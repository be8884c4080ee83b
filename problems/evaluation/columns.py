"""From a function of one candidate to the same function of a batch: scalars become columns.

CasADi simplifies expressions as they are built: ``x - x`` becomes 0 even where x may be infinite, ``0 - x`` loses the
sign of a zero, and what is called with a zero may become one. What is built here has to keep every bit of what is
computed one by one, so that simplification is switched off meanwhile, and numbers are hidden behind symbols.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix
from problems.evaluation.tape import Symbolic, interpret


@contextmanager
def as_written() -> Iterator[None]:
    """Build expressions without simplifying them."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)


class Columns(Symbolic):
    """Interpreter in symbols that hides constants, which CasADi would fold even so.

    Args:
        kind: ``ca.SX`` or ``ca.MX``.

    Attributes:
        constants: every constant and the scalar symbol that stands for it, by its bits.
    """

    def __init__(self, kind: Matrix) -> None:
        super().__init__(kind)
        self.constants: dict[str, tuple[float, Matrix]] = {}

    def constant(self, value: float) -> Matrix:
        """A symbol for a constant."""
        if value.hex() not in self.constants:
            self.constants[value.hex()] = value, self.kind.sym("constant")
        return self.constants[value.hex()][1]

    def unary(self, name: str, a: Matrix) -> Matrix:
        """One operation, column by column; two reciprocals of each other would cancel."""
        return super().binary("div", self.constant(1.0), a) if name == "inv" else super().unary(name, a)


class ColumnFunction:
    """A function for ``width`` candidates at once: each entry of its inputs and outputs is a column (width, 1).

    Args:
        function: SX function.
        width: how many candidates.
        shared: names of inputs whose entries are the same scalars for all candidates.

    Attributes:
        constants: the numbers written in the function, which it expects as further scalars (u,).
    """

    def __init__(self, function: ca.Function, width: int, shared: Sequence[str]) -> None:
        self._sizes = [function.size1_out(i) for i in range(function.n_out())]
        kind: Matrix = ca.SX if width == 1 else ca.MX  # one operation after the other is quickest in SX
        columns = Columns(kind)
        with as_written():
            arguments = [
                [kind.sym(name, 1 if name in shared else width) for _ in range(function.size1_in(name))]
                for name in function.name_in()
            ]
            results = [entry for result in interpret(function, arguments, columns) for entry in result]
            results = [entry if entry.numel() == width else ca.repmat(entry, width) for entry in results]
            self.constants = np.array([value for value, _ in columns.constants.values()])
            inputs = [*chain.from_iterable(arguments), *(symbol for _, symbol in columns.constants.values())]
            self._function = ca.Function("columns", inputs, results)

    def __call__(self, arguments: Sequence[Sequence[Matrix]], constants: Sequence[Matrix]) -> list[list[Matrix]]:
        """The entries of each output, given those of each input and symbols for the constants; MX."""
        given = [entry for argument in arguments for entry in argument]
        results = iter(self._function.call([*given, *constants]))
        return [[next(results) for _ in range(size)] for size in self._sizes]
