"""Read a compiled expression instruction by instruction, in any arithmetic.

CasADi compiles an SX function into a tape: a list of scalar operations on numbered registers. :func:`interpret` runs
that tape over whatever an :class:`Interpreter` computes with: symbols (to rewrite the expression), matrices (to
evaluate many candidates at once) or text (to generate code). One tape, so that all of them compute the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol, TypeVar

import casadi as ca

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
    """A function holds an operation that this package does not know."""


class Interpreter(Protocol[V]):
    """How to compute with values of one kind: numbers, symbols or text."""

    def constant(self, value: float) -> V:
        """A number written in the expression."""

    def unary(self, name: str, a: V) -> V:
        """The operation ``UNARY[name]``."""

    def binary(self, name: str, a: V, b: V) -> V:
        """The operation ``BINARY[name]``."""


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
    """A dense column of scalars, which may be none."""
    return ca.densify(ca.vertcat(*values)) if values else ca.SX(0, 1)


class Symbolic:
    """Interpreter in CasADi's own scalar symbols, SX."""

    def constant(self, value: float) -> ca.SX:
        """A scalar constant."""
        return ca.SX(value)

    def unary(self, name: str, a: ca.SX) -> ca.SX:
        """One operation."""
        return ca.SX.unary(UNARY[name], a)

    def binary(self, name: str, a: ca.SX, b: ca.SX) -> ca.SX:
        """One operation."""
        return ca.SX.binary(BINARY[name], a, b)
