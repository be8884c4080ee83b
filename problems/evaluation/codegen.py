"""Write a compiled expression as C++ that evaluates several candidates at once.

Every number of the tape becomes a vector with one candidate in each lane (``simd.hpp``), every comparison a mask of
lanes: there are no branches, and the processor works on as many candidates as its registers hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, auto
from math import inf, isfinite
from pathlib import Path

import casadi as ca

from problems.evaluation.tape import interpret

BLOCK = 400  # operations in one C++ function: the time to compile grows faster than their number
ARITHMETIC = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
COMPARISONS = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}
LOGIC = {"and": "&", "or": "|"}
OF_ONE = {"neg": "-{0}", "sq": "{0} * {0}", "twice": "{0} + {0}", "inv": "1.0 / {0}"}
PRICE = """
extern "C" void price(const double *points, double *costs, long long count) {{
    lanes x[{dimension}], w[{size}]; // w[0] is the result
    for (long long start = 0; start < count; start += LANES) {{
        const long long rest = count - start < LANES ? count - start : LANES;
        for (int lane = 0; lane < LANES; lane++) {{
            const double *point = points + (start + (lane < rest ? lane : 0)) * {dimension};
            for (int i = 0; i < {dimension}; i++) x[i][lane] = point[i];
        }}
{calls}
        for (int lane = 0; lane < rest; lane++) costs[start + lane] = w[0][lane];
    }}
}}
"""


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
    """One variable: how it is computed, and from what."""

    value: Value
    text: str
    operands: tuple[Value, ...]


class Writer:
    """Reading of a tape that writes one statement an operation."""

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
            return self._state(Kind.NUMBER, "where({}, {})", self._truth(a), self._number(b))
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

    def _state(self, kind: Kind, text: str, *operands: Value) -> Value:
        place = len(self.statements)
        value = Value(f"v{place}", kind, place)
        self.statements.append(Statement(value, text.format(*(operand.text for operand in operands)), operands))
        return value


class Store:
    """The array ``w``, in which one block of statements leaves what a later one needs."""

    def __init__(self, statements: list[Statement]) -> None:
        self.size = 1
        self._slots: dict[Value, int] = {}
        self._free: list[int] = []
        self._last_block = {operand: s.value.place // BLOCK for s in statements for operand in s.operands}

    def loads(self, chunk: list[Statement]) -> Iterator[str]:
        """Read back what a block uses of earlier ones."""
        for value in dict.fromkeys(operand for statement in chunk for operand in statement.operands):
            if value in self._slots:
                slot = f"w[{self._slots[value]}]"
                yield _assignment(value, f"whole({slot})" if value.kind is Kind.TRUTH else slot)

    def release(self, block: int) -> None:
        """Free the slots of what no block after this one needs."""
        for value in [value for value in self._slots if self._last_block[value] == block]:
            self._free.append(self._slots.pop(value))

    def saves(self, chunk: list[Statement], block: int) -> Iterator[str]:
        """Keep what later blocks need of this one."""
        for value in (statement.value for statement in chunk):
            if self._last_block.get(value, block) > block:
                self._slots[value] = self._free.pop() if self._free else self._grown()
                saved = f"bits({value.text})" if value.kind is Kind.TRUTH else value.text
                yield f"    w[{self._slots[value]}] = {saved};\n"

    def _grown(self) -> int:
        self.size += 1
        return self.size - 1


def cpp(function: ca.Function) -> str:
    """The C++ source of ``price(points, costs, count)``.

    Args:
        function: SX function of one vector (d,) and one scalar result.

    Raises:
        UnsupportedOperation: it holds an operation without a reading.
    """
    dimension = function.size1_in(0)
    writer = Writer()
    result = writer.result(interpret(function, [Value(f"x[{i}]") for i in range(dimension)], writer))
    store = Store(writer.statements)
    blocks = list(_blocks(writer.statements, store))
    blocks[-1] += f"    w[0] = {result.text};\n"
    functions = (
        f"static __attribute__((noinline)) void block_{number}(const lanes *x, lanes *w) {{\n{lines}}}\n"
        for number, lines in enumerate(blocks)
    )
    calls = "".join(f"        block_{number}(x, w);\n" for number in range(len(blocks)))
    price = PRICE.format(dimension=dimension, size=store.size, calls=calls)
    return Path(__file__).with_name("simd.hpp").read_text() + "".join(functions) + price


def _blocks(statements: list[Statement], store: Store) -> Iterator[str]:
    """The lines of each block."""
    for block, start in enumerate(range(0, len(statements), BLOCK)):
        chunk = statements[start : start + BLOCK]
        lines = [*store.loads(chunk), *(_assignment(statement.value, statement.text) for statement in chunk)]
        store.release(block)
        yield "".join([*lines, *store.saves(chunk, block)])


def _assignment(value: Value, text: str) -> str:
    return f"    const {'mask' if value.kind is Kind.TRUTH else 'lanes'} {value.text} = {text};\n"
