"""CasADi functions as tapes of operations, interpreted in any arithmetic.

CasADi compiles an SX function into a tape: a list of scalar operations on numbered registers. :func:`interpret` runs
that tape over whatever an :class:`Interpreter` computes with: symbols (to rewrite the expression), matrices (to
evaluate many candidates at once) or text (to generate code). One tape, so that all of them compute the same.

CasADi simplifies expressions as they are built: ``x - x`` becomes 0 even where x may be infinite, ``0 - x`` loses the
sign of a zero, and what is called with a zero may become one. What is built here has to keep every bit of what is
computed one by one, so that simplification is switched off meanwhile, and numbers are hidden behind symbols.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Generic, Protocol, TypeVar

import casadi as ca
import numpy as np

V = TypeVar("V")
E = TypeVar("E", ca.SX, ca.MX)  # an expression
SAME_NAMES = {"allow_duplicate_io_names": True}  # CasADi's option for functions with an output that replaces an input

UNARY = {
    "neg": ca.OP_NEG,
    "sq": ca.OP_SQ,
    "twice": ca.OP_TWICE,
    "inv": ca.OP_INV,
    "sqrt": ca.OP_SQRT,
    "fabs": ca.OP_FABS,
    "sign": ca.OP_SIGN,
    "floor": ca.OP_FLOOR,
    "ceil": ca.OP_CEIL,
    "not": ca.OP_NOT,
    "sin": ca.OP_SIN,
    "cos": ca.OP_COS,
    "tan": ca.OP_TAN,
    "asin": ca.OP_ASIN,
    "acos": ca.OP_ACOS,
    "atan": ca.OP_ATAN,
    "exp": ca.OP_EXP,
    "log": ca.OP_LOG,
    "sinh": ca.OP_SINH,
    "cosh": ca.OP_COSH,
    "tanh": ca.OP_TANH,
    "asinh": ca.OP_ASINH,
    "acosh": ca.OP_ACOSH,
    "atanh": ca.OP_ATANH,
    "erf": ca.OP_ERF,
    "log1p": ca.OP_LOG1P,
    "expm1": ca.OP_EXPM1,
}
BINARY = {
    "add": ca.OP_ADD,
    "sub": ca.OP_SUB,
    "mul": ca.OP_MUL,
    "div": ca.OP_DIV,
    "fmin": ca.OP_FMIN,
    "fmax": ca.OP_FMAX,
    "lt": ca.OP_LT,
    "le": ca.OP_LE,
    "eq": ca.OP_EQ,
    "ne": ca.OP_NE,
    "and": ca.OP_AND,
    "or": ca.OP_OR,
    "if_else_zero": ca.OP_IF_ELSE_ZERO,
    "copysign": ca.OP_COPYSIGN,
    "atan2": ca.OP_ATAN2,
    "hypot": ca.OP_HYPOT,
    "pow": ca.OP_POW,
    "fmod": ca.OP_FMOD,
}
_UNARY_NAME = {code: name for name, code in UNARY.items()}
_BINARY_NAME = {code: name for name, code in BINARY.items()} | {ca.OP_CONSTPOW: "pow"}


class UnsupportedOperation(Exception):
    """Raised for a function with an operation that this package does not know."""


class Interpreter(Protocol[V]):
    """Arithmetic with values of one kind: numbers, symbols or text."""

    def constant(self, value: float) -> V:
        """A number written in the expression."""

    def unary(self, name: str, a: V) -> V:
        """The result of the operation ``UNARY[name]``."""

    def binary(self, name: str, a: V, b: V) -> V:
        """The result of the operation ``BINARY[name]``."""


def interpret(function: ca.Function, arguments: Sequence[Sequence[V]], interpreter: Interpreter[V]) -> list[list[V]]:
    """The values of a function's outputs.

    Args:
        function: SX function of dense columns.
        arguments: the entries of each input.
        interpreter: how to compute with them.

    Returns:
        The entries of each output, structural zeros included.

    Raises:
        UnsupportedOperation: an operation is in neither table, or the function is no SX function.
    """
    if not function.is_a("SXFunction"):
        raise UnsupportedOperation(f"{function.name()} is not written out in scalars")
    registers: dict[int, V] = {}
    zero = interpreter.constant(0.0)  # a structural zero has no instruction
    results = [[zero] * function.size1_out(i) for i in range(function.n_out())]
    entries = [function.sparsity_out(i).row() for i in range(function.n_out())]
    for k in range(function.n_instructions()):
        code, inputs, outputs = (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
        )
        if code == ca.OP_OUTPUT:
            results[outputs[0]][entries[outputs[0]][outputs[1]]] = registers[inputs[0]]
            continue
        if code in _BINARY_NAME:
            value = interpreter.binary(_BINARY_NAME[code], registers[inputs[0]], registers[inputs[1]])
        elif code in _UNARY_NAME:
            value = interpreter.unary(_UNARY_NAME[code], registers[inputs[0]])
        elif code == ca.OP_CONST:
            value = interpreter.constant(function.instruction_constant(k))
        elif code == ca.OP_INPUT:
            value = arguments[inputs[0]][inputs[1]]
        else:
            raise UnsupportedOperation(f"{function.name()} holds operation {code} of CasADi, which is in no table")
        registers[outputs[0]] = value
    return results


def rebuilt(function: ca.Function, interpreter: Interpreter[ca.SX]) -> ca.Function:
    """The SX function that an interpreter of symbols makes of another one, with the same names and dense outputs."""
    arguments = [ca.SX.sym(function.name_in(i), function.size1_in(i)) for i in range(function.n_in())]
    results = interpret(function, [entries(argument) for argument in arguments], interpreter)
    columns = [column(result) for result in results]
    return ca.Function(function.name(), arguments, columns, function.name_in(), function.name_out(), SAME_NAMES)


def entries(vector: E) -> list[E]:
    """The entries of a column."""
    return list(ca.vertsplit(vector)) if vector.numel() else []


def column(values: Sequence[ca.SX]) -> ca.SX:
    """A dense column of scalars, possibly empty."""
    return ca.densify(ca.vertcat(*values)) if values else ca.SX(0, 1)


class Symbolic(Interpreter[ca.SX]):
    """An interpreter in CasADi's own scalar symbols, SX."""

    def constant(self, value: float) -> ca.SX:
        return ca.SX(value)

    def unary(self, name: str, a: ca.SX) -> ca.SX:
        return ca.SX.unary(UNARY[name], a)

    def binary(self, name: str, a: ca.SX, b: ca.SX) -> ca.SX:
        return ca.SX.binary(BINARY[name], a, b)


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
    """An interpreter in symbols that hides constants, which CasADi would fold even so.

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
        results = iter(self._function.call([*given, ca.vertcat(*constants)]))
        return [[next(results) for _ in range(size)] for size in self._sizes]


def _in_columns(
    function: ca.Function, width: int, shared: Sequence[str], columns: Columns[E]
) -> tuple[ca.Function, list[float]]:
    """The function of a batch, of entries and then a column of constants, and these constants."""
    arguments = [
        [columns.symbol(name, 1 if name in shared else width) for _ in range(function.size1_in(name))]
        for name in function.name_in()
    ]
    results = [entry for result in interpret(function, arguments, columns) for entry in result]
    results = [entry if entry.numel() == width else ca.repmat(entry, width) for entry in results]
    constants = columns.constants.values()
    inputs = [entry for argument in arguments for entry in argument]
    inputs.append(ca.vertcat(*(symbol for _, symbol in constants)))  # one input: there may be thousands
    return ca.Function("columns", inputs, results), [value for value, _ in constants]
