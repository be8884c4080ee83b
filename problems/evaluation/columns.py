"""From a function of one candidate to the same function of a batch: scalars become columns.

CasADi simplifies expressions as they are built: ``x - x`` becomes 0 even where x may be infinite, ``0 - x`` loses the
sign of a zero, and what is called with a zero may become one. What is built here has to keep every bit of what is
computed one by one, so that simplification is switched off meanwhile, and numbers are hidden behind symbols.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Generic

import casadi as ca
import numpy as np

from problems.evaluation.tape import BINARY, UNARY, E, interpret


@contextmanager
def as_written() -> Iterator[None]:
    """Build expressions without simplifying them."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)


class Columns(Generic[E]):
    """Interpreter in symbols that hides constants, which CasADi would fold even so.

    Args:
        kind: ``ca.SX`` or ``ca.MX``.

    Attributes:
        constants: every constant and the scalar symbol that stands for it, by its bits.
    """

    def __init__(self, kind: type[E]) -> None:
        self._kind: type[E] = kind
        self.constants: dict[str, tuple[float, E]] = {}

    def symbol(self, name: str, rows: int = 1) -> E:
        """A column of symbols."""
        return self._kind.sym(name, rows)

    def constant(self, value: float) -> E:
        """A symbol for a constant."""
        if value.hex() not in self.constants:
            self.constants[value.hex()] = value, self.symbol("constant")
        return self.constants[value.hex()][1]

    def unary(self, name: str, a: E) -> E:
        """One operation, column by column; two reciprocals of each other would cancel."""
        return self.binary("div", self.constant(1.0), a) if name == "inv" else self._kind.unary(UNARY[name], a)

    def binary(self, name: str, a: E, b: E) -> E:
        """One operation, column by column."""
        return self._kind.binary(BINARY[name], a, b)


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
        with as_written():
            if width == 1:  # one operation after the other is quickest in SX
                self._function, numbers = _in_columns(function, width, shared, Columns(ca.SX))
            else:
                self._function, numbers = _in_columns(function, width, shared, Columns(ca.MX))
        self.constants = np.array(numbers)

    def __call__(self, arguments: Sequence[Sequence[ca.MX]], constants: Sequence[ca.MX]) -> list[list[ca.MX]]:
        """The entries of each output, given those of each input and symbols for the constants."""
        given = [entry for argument in arguments for entry in argument]
        results = iter(self._function.call([*given, *constants]))
        return [[next(results) for _ in range(size)] for size in self._sizes]


def _in_columns(
    function: ca.Function, width: int, shared: Sequence[str], columns: Columns[E]
) -> tuple[ca.Function, list[float]]:
    """The function of a batch, of entries and then constants, and these constants."""
    arguments = [
        [columns.symbol(name, 1 if name in shared else width) for _ in range(function.size1_in(name))]
        for name in function.name_in()
    ]
    results = [entry for result in interpret(function, arguments, columns) for entry in result]
    results = [entry if entry.numel() == width else ca.repmat(entry, width) for entry in results]
    constants = columns.constants.values()
    inputs = [entry for argument in arguments for entry in argument] + [symbol for _, symbol in constants]
    return ca.Function("columns", inputs, results), [value for value, _ in constants]
