"""Write kernels as C++ statements that work on several candidates at once.

Every number of the tape becomes a vector with one candidate in each lane (``simd.hpp``), every comparison a mask of
lanes: there are no branches, and the processor works on as many candidates as its registers hold.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto
from math import inf, isfinite

ARITHMETIC = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
COMPARISONS = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}
LOGIC = {"and": "&", "or": "|"}
OF_ONE = {"neg": "-{0}", "sq": "{0} * {0}", "twice": "{0} + {0}", "inv": "1.0 / {0}"}


class Kind(Enum):
    """What an operand is in C++."""

    NUMBER = auto()
    TRUTH = auto()
    CONSTANT = auto()


@dataclass(frozen=True)
class Value:
    """An operand.

    Attributes:
        text: a variable's name, an input or the digits of a constant.
        kind: a number or a truth in each lane, or one constant for all.
        place: index of the statement that computes it, -1 for inputs and constants.
    """

    text: str
    kind: Kind = Kind.NUMBER
    place: int = -1


@dataclass(frozen=True)
class Statement:
    """One variable: how it is computed, and from what.

    Attributes:
        value: itself.
        text: of the expression.
        operands: in it.
        condition: that of them without which it is zero in a lane; None where there is none.
    """

    value: Value
    text: str
    operands: tuple[Value, ...]
    condition: Value | None = None


class Writer:
    """Interpreter that writes one statement an operation."""

    def __init__(self) -> None:
        self.statements: list[Statement] = []

    def constant(self, value: float) -> Value:
        """A constant, exact to the bit."""
        if isfinite(value):
            return Value(f"({value.hex()})", Kind.CONSTANT)
        return Value({inf: "INFINITY", -inf: "(-INFINITY)"}.get(value, "NAN"), Kind.CONSTANT)

    def unary(self, name: str, a: Value) -> Value:
        """The statement of one operation."""
        if name == "not":
            return self._state(Kind.TRUTH, "~{}", self._truth(a))
        return self._state(Kind.NUMBER, OF_ONE.get(name, f"{name}_({{}})"), self._number(a))

    def binary(self, name: str, a: Value, b: Value) -> Value:
        """The statement of one operation."""
        if name == "if_else_zero":
            condition = self._truth(a)
            return self._state(Kind.NUMBER, "where({}, {})", condition, self._number(b), condition=condition)
        if name in LOGIC:
            return self._state(Kind.TRUTH, f"{{}} {LOGIC[name]} {{}}", self._truth(a), self._truth(b))
        if name in ARITHMETIC:
            return self._state(Kind.NUMBER, f"{{}} {ARITHMETIC[name]} {{}}", *self._numbers(a, b))
        if name in COMPARISONS:
            return self._state(Kind.TRUTH, f"{{}} {COMPARISONS[name]} {{}}", *self._numbers(a, b))
        return self._state(Kind.NUMBER, f"{name}_({{}}, {{}})", self._number(a), self._number(b))

    def result(self, a: Value) -> Value:
        """The value as a number with a statement of its own."""
        return self._state(Kind.NUMBER, "{}", self._number(a))

    def _numbers(self, a: Value, b: Value) -> tuple[Value, Value]:
        """Operands of an operator, which spreads a constant on one of its sides over the lanes by itself."""
        if b.kind is Kind.CONSTANT:
            return self._number(a), b
        return a if a.kind is Kind.CONSTANT else self._number(a), self._number(b)

    def _number(self, a: Value) -> Value:
        if a.kind is Kind.NUMBER:
            return a
        return self._state(Kind.NUMBER, "number({})" if a.kind is Kind.TRUTH else "all({})", a)

    def _truth(self, a: Value) -> Value:
        return a if a.kind is Kind.TRUTH else self._state(Kind.TRUTH, "truth({})", self._number(a))

    def _state(self, kind: Kind, text: str, *operands: Value, condition: Value | None = None) -> Value:
        place = len(self.statements)
        value = Value(f"v{place}", kind, place)
        self.statements.append(
            Statement(value, text.format(*(operand.text for operand in operands)), operands, condition)
        )
        return value
