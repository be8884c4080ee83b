"""Expressions as text, one operation a line: what a run folder keeps, and what nobody has to trust.

    w0 = sq(tool[0])
    w1 = add(w0, 0.25)
    = w1

Operations are those of :mod:`problems.evaluation.tape`; lines that begin with ``=`` are the outputs. Unlike CasADi's
own serialised functions, text is checked word by word, so that none can crash the reader or load a library.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite

import casadi as ca

from problems.evaluation.tape import BINARY, UNARY, UnsupportedOperation, interpret
from problems.motions.expressions.quantities import quantity_named

MOST_OPERATIONS = 20_000
LONGEST_LINE = 200  # characters
OUTPUT = re.compile(r"= (\S+)")
OPERATION = re.compile(r"w(\d{1,6}) = ([a-z_0-9]+)\(([^,()]+)(?:, ([^,()]+))?\)")
ENTRY = re.compile(r"([a-z_]+(?:\d{1,4})?)\[(\d{1,4})\]")
REGISTER = re.compile(r"w(\d{1,6})")


class InvalidText(ValueError):
    """Text that is no expression; the message is one line."""


Entry = tuple[str, int]  # a quantity's name and which of its numbers


@dataclass
class Writer:
    """Interpreter that writes down what it is asked to compute."""

    lines: list[str] = field(default_factory=list)

    def constant(self, value: float) -> str:
        """A number, to the last bit."""
        if not isfinite(value):
            raise UnsupportedOperation(f"the expression holds the number {value}")
        return repr(float(value))

    def unary(self, name: str, a: str) -> str:
        """A line."""
        return self._line(f"{name}({a})")

    def binary(self, name: str, a: str, b: str) -> str:
        """A line."""
        return self._line(f"{name}({a}, {b})")

    def _line(self, operation: str) -> str:
        if len(self.lines) >= MOST_OPERATIONS:
            raise UnsupportedOperation(f"the expression has more than {MOST_OPERATIONS} operations")
        register = f"w{len(self.lines)}"
        self.lines.append(f"{register} = {operation}")
        return register


def written(expression: ca.SX, symbols: Mapping[str, ca.SX]) -> str:
    """An expression as text.

    Args:
        expression: dense column.
        symbols: by names of quantities, all that it depends on, dense columns.

    Raises:
        UnsupportedOperation: it holds an operation that has no name, a number that is none, or is too large.
    """
    function = ca.Function("expression", list(symbols.values()), [expression], {"cse": True})
    writer = Writer()
    arguments = [[f"{name}[{i}]" for i in range(symbol.numel())] for name, symbol in symbols.items()]
    [outputs] = interpret(function, arguments, writer)
    return "\n".join([*writer.lines, *(f"= {output}" for output in outputs)])


def read(text: str) -> tuple[tuple[Entry, ...], ca.Function]:
    """The expression of a text.

    Returns:
        What it depends on, and a function from these numbers (n, 1) to its values (m, 1).

    Raises:
        InvalidText: naming the line.
    """
    reader = _Reader()
    lines = text.strip().split("\n", 2 * MOST_OPERATIONS)
    if len(lines) >= 2 * MOST_OPERATIONS:
        raise InvalidText(f"more than {MOST_OPERATIONS} operations")
    for number, line in enumerate(lines, start=1):
        try:
            reader.take(line.strip())
        except InvalidText as error:
            raise InvalidText(f"line {number}, {line.strip()[:40]!r}: {error}") from None
    if not reader.outputs:
        raise InvalidText("no line begins with =, which says what comes out")
    symbols = ca.vertcat(*reader.symbols.values()) if reader.symbols else ca.SX(0, 1)
    outputs = ca.densify(ca.vertcat(*reader.outputs))
    return tuple(reader.symbols), ca.Function("expression", [symbols], [outputs])


@dataclass
class _Reader:
    """What has been read so far."""

    registers: list[ca.SX] = field(default_factory=list)
    symbols: dict[Entry, ca.SX] = field(default_factory=dict)
    outputs: list[ca.SX] = field(default_factory=list)

    def take(self, line: str) -> None:
        """One more line."""
        if len(line) > LONGEST_LINE:
            raise InvalidText("too long")
        output, operation = OUTPUT.fullmatch(line), OPERATION.fullmatch(line)
        if output is not None:
            self.outputs.append(self._operand(output[1]))
        elif operation is not None:
            self.registers.append(self._result(operation))
        else:
            raise InvalidText("neither 'w0 = operation(a, b)' nor '= w0'")

    def _result(self, operation: re.Match[str]) -> ca.SX:
        number, name, first, second = operation.groups()
        if int(number) != len(self.registers):
            raise InvalidText(f"w{len(self.registers)} is next")
        if second is None and name in UNARY:
            return ca.SX.unary(UNARY[name], self._operand(first))
        if second is not None and name in BINARY:
            return ca.SX.binary(BINARY[name], self._operand(first), self._operand(second))
        raise InvalidText(f"no operation {name!r} of {1 if second is None else 2}")

    def _operand(self, word: str) -> ca.SX:
        register, entry = REGISTER.fullmatch(word), ENTRY.fullmatch(word)
        if register is not None:
            if int(register[1]) >= len(self.registers):
                raise InvalidText(f"{word} is not known yet")
            return self.registers[int(register[1])]
        return self._number(word) if entry is None else self._symbol((entry[1], int(entry[2])))

    def _symbol(self, entry: Entry) -> ca.SX:
        name, index = entry
        try:
            quantity_named(name)
        except KeyError:
            raise InvalidText(f"nothing of a motion is called {name!r}") from None
        return self.symbols.setdefault(entry, ca.SX.sym(f"{name}_{index}"))

    def _number(self, word: str) -> ca.SX:
        try:
            value = float(word)
        except ValueError:
            raise InvalidText(f"{word!r} is no number") from None
        if not isfinite(value):
            raise InvalidText(f"{word!r} is no finite number")
        return ca.SX(value)
