"""Expressions as checked text: traced from Python, written, read without executing anything.

    w0 = sq(tool[0])
    w1 = add(w0, 0.25)
    = w1

Operations are those of :mod:`problems.evaluation.interpreter`; lines that begin with ``=`` are the outputs. Unlike
CasADi's own serialised functions, text is checked word by word: none can crash the reader or load a library.

Where the function only computes with what it is given, tool position and torques stay symbols of their own: short, and
readable. Where it differentiates them with respect to joint angles, they have to be written out in these; that is so
where the short form, with what its symbols stand for put in, is another one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from math import isfinite
from typing import Any, TypeVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, Matrix, number_of
from problems.evaluation import BINARY, UNARY, Interpreter, Symbolic, UnsupportedOperation, interpret, rebuilt
from problems.motions.samples import MISSING, SAMPLED_ORDERS, MotionView, Samples, quantity_named
from problems.robots import Robot

MOST_OPERATIONS = 20_000
CACHED_TEXTS = 64
LONGEST_LINE = 200  # characters
OUTPUT = re.compile(r"= (\S+)")
OPERATION = re.compile(r"w(\d{1,6}) = ([a-z_0-9]+)\(([^,()]+)(?:, ([^,()]+))?\)")
ENTRY = re.compile(r"([a-z_]+(?:\d{1,4})?)\[(\d{1,4})\]")
REGISTER = re.compile(r"w(\d{1,6})")


V = TypeVar("V")


class InvalidText(ValueError):
    """Raised for text that is no expression; the message is one line."""


Entry = tuple[str, int]  # a quantity's name and which of its numbers


@dataclass
class Writer(Interpreter[str]):
    """An interpreter that writes down what it is asked to compute."""

    lines: list[str] = field(default_factory=list)

    def constant(self, value: float) -> str:
        """A number, to the last bit."""
        if not isfinite(value):
            raise UnsupportedOperation(f"the expression holds the number {value}")
        return repr(float(value))

    def unary(self, name: str, a: str) -> str:
        return self._line(f"{name}({a})")

    def binary(self, name: str, a: str, b: str) -> str:
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


@lru_cache(maxsize=CACHED_TEXTS)
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
    """A reader of the lines of an expression, with what was read so far."""

    registers: list[ca.SX] = field(default_factory=list)
    symbols: dict[Entry, ca.SX] = field(default_factory=dict)
    outputs: list[ca.SX] = field(default_factory=list)

    def take(self, line: str) -> None:
        """Read one more line."""
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
            value = number_of(word)
        except ValueError:
            raise InvalidText(f"{word!r} is no number") from None
        if not isfinite(value):
            raise InvalidText(f"{word!r} is no finite number")
        return ca.SX(value)


LONGEST_FORMULA = 60  # operations that are written out for a reader
ROOT_OFFSET = 1e-20  # added under roots while searching: keeps the gradient of a length finite where it is 0


@dataclass(frozen=True)
class SampleFunction:
    """A function of one instant, the same for every robot that has what it depends on.

    Args:
        text: as in :mod:`problems.motions.expression_text`; must be valid.
    """

    text: str

    @cached_property
    def _read(self) -> tuple[tuple[Entry, ...], ca.Function]:
        return read(self.text)

    @cached_property
    def _smooth(self) -> ca.Function:
        """The function with gradients that are finite where a length is zero."""
        return rebuilt(self._read[1], _SmoothRoots())

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The numbers that it depends on: names of quantities, and places in them."""
        return self._read[0]

    @property
    def width(self) -> int:
        """The number of its values."""
        return int(self._read[1].size1_out(0))

    @property
    def operations(self) -> int:
        """The number of operations of the expression."""
        return self.text.count("(")

    def uses(self, *names: str) -> bool:
        """Whether it depends on any of some quantities."""
        return any(name in names for name, _ in self.entries)

    @cached_property
    def is_root(self) -> bool:
        """Whether every value is a square root."""
        function = self._read[1]
        symbols = ca.SX.sym("x", len(self.entries))
        return all(value.is_op(ca.OP_SQRT) for value in ca.vertsplit(function(symbols)))

    @cached_property
    def formula(self) -> str:
        """The formula, for a reader."""
        if self.operations > LONGEST_FORMULA:
            names = sorted({name for name, _ in self.entries})
            return f"({self.operations} operations on {', '.join(names)})"
        symbols = [ca.SX.sym(f"{name}_{index}") for name, index in self.entries]
        values = self._read[1](ca.vertcat(*symbols) if symbols else ca.SX(0, 1))
        return ", ".join(str(value) for value in ca.vertsplit(values))

    def interpreted(self, arguments: Sequence[V], interpreter: Interpreter[V]) -> list[V]:
        """The values, computed by an interpreter from what it has for :attr:`entries`."""
        return interpret(self._read[1], [arguments], interpreter)[0]

    def check(self, robot: Robot, field: str, name: str) -> None:
        """Check that a robot has what the expression depends on.

        Raises:
            InvalidProblem: of the field, naming whose expression it is.
        """
        for quantity, index in self.entries:
            width = quantity_named(quantity).width(robot)
            if width == 0:
                raise InvalidProblem(field, f"{name!r}: {MISSING.get(quantity, f'this robot has no {quantity}')}")
            if index >= width:
                raise InvalidProblem(field, f"{name!r}: {quantity}[{index}] of {width}")

    def at(self, samples: Samples, smooth: bool = False) -> Matrix:
        """The values at n samples, (n, width).

        Args:
            samples: of a motion.
            smooth: with gradients that are finite where a length is zero; other values by 1e-10 at most.
        """
        if samples.is_finished and not smooth:
            return self.of_state(samples.moving)(samples.states.T, samples.duration).T
        count = samples.count
        if not self.entries:
            return ca.repmat(self.of_numbers(ca.DM(0, 1), smooth).T, count, 1)
        known = {name: quantity_named(name).of(samples) for name, _ in self.entries}
        numbers = [known[name][:, index] for name, index in self.entries]
        columns = ca.horzcat(*(part if part.shape[0] == count else ca.repmat(part, count, 1) for part in numbers))
        return self.of_numbers(columns.T, smooth).T

    def of_numbers(self, numbers: Matrix, smooth: bool = False) -> Matrix:
        """The values (width, n) of what it depends on, (entries, n); smooth as in :meth:`at`."""
        return (self._smooth if smooth else self._read[1])(numbers)

    def of_state(self, robot: Robot) -> ca.Function:
        """The function of angles, three derivatives and time in s, (4 dof + 1,), and T, to its values (width,)."""
        known = self._of_states.get(id(robot))
        if known is not None:
            return known[1]
        state, duration = ca.SX.sym("state", SAMPLED_ORDERS * robot.dof + 1), ca.SX.sym("duration")
        *derivatives, time = ca.vertsplit(state, [*range(0, SAMPLED_ORDERS * robot.dof + 1, robot.dof), state.numel()])
        rows = tuple(part.T for part in derivatives)
        now = Samples(robot=robot, derivatives=rows, duration=duration, times=time)
        found = ca.Function("value", [state, duration], [ca.densify(self.at(now).T)], {"cse": True})
        self._of_states[id(robot)] = robot, found
        return found

    @cached_property
    def _of_states(self) -> dict[int, tuple[Robot, ca.Function]]:
        """The functions of states by the robot's identity, with the robot, so that the identity stays unique."""
        return {}

    def probed(self, robot: Robot, states: FloatArray, duration: float = 1.0) -> FloatArray:
        """The values (n, width) in states (n, 4 dof + 1): angles, three derivatives, time in s."""
        return np.asarray(self.of_state(robot)(states.T, duration)).T


class _SmoothRoots(Symbolic):
    """An interpreter in symbols in which every root has something under it."""

    def unary(self, name: str, a: ca.SX) -> ca.SX:
        return ca.sqrt(a + ROOT_OFFSET) if name == "sqrt" else super().unary(name, a)


BASIC = ("q", "speed", "acceleration", "jerk", "time", "duration")
MISUSED = "truth value"  # what CasADi says of ``if`` on symbols
OUTSIDE, LENGTH = "out of bounds", re.compile(r"supplied length of (\d+)")  # what it says of an index
NO_NUMBER = "nan"  # what Python's own functions make of symbols
OF_SYMBOLS = "say ca.sin in place of math.sin, and so on: only CasADi's functions take symbols"
PLACE = re.compile(r"^\.\.\./\S+:\d+: ")  # in CasADi's own source
KNOWN = [name for name, part in vars(MotionView).items() if isinstance(part, property)]

Stated = Callable[[MotionView], Any]


def traced(stated: Stated, robot: Robot, called: str, differentiates: bool = True) -> SampleFunction:
    """The function of one instant that a Python function states.

    Args:
        stated: a function of a :class:`MotionView`.
        robot: that moves.
        called: what messages call it, such as ``constraint 'table'``.
        differentiates: whether it may, so that the long form is needed to find out.

    Raises:
        InvalidProblem: it raises, or what it gives is no scalar or vector of CasADi's symbols.
    """
    short, of = _Symbols(robot), partial(_expression, stated, robot, called)
    expression = of(short)
    text = _text(expression, short.known, called)
    if differentiates:
        long = _WrittenOut(robot)
        full = _text(of(long), long.known, called)
        text = text if _inserted(expression, short.known, long, called) == full else full
    return SampleFunction(text)


def _expression(stated: Stated, robot: Robot, called: str, value: Callable[[str], ca.SX]) -> ca.SX:
    """The dense column that a function states of a motion's quantities."""
    return _column(_called(stated, MotionView(robot, value), called), called)


@dataclass
class _Symbols:
    """A symbol for every quantity that is asked for."""

    robot: Robot
    known: dict[str, ca.SX] = field(default_factory=dict)

    def __call__(self, name: str) -> ca.SX:
        if name not in self.known:
            self.known[name] = ca.SX.sym(name, quantity_named(name).width(self.robot))
        return self.known[name]


class _WrittenOut:
    """Every quantity as an expression of angles, derivatives and times."""

    def __init__(self, robot: Robot) -> None:
        self.known = {name: ca.SX.sym(name, quantity_named(name).width(robot)) for name in BASIC}
        derivatives = tuple(self.known[name].T for name in BASIC[:4])
        times, duration = self.known["time"], self.known["duration"]
        self._samples = Samples(robot=robot, derivatives=derivatives, duration=duration, times=times)

    def __call__(self, name: str) -> ca.SX:
        return self.known[name] if name in self.known else ca.SX(quantity_named(name).of(self._samples).T)


def _called(stated: Stated, view: MotionView, called: str) -> Any:
    try:
        return stated(view)
    except InvalidProblem as error:
        raise InvalidProblem(called, f"{error.field}: {error.reason}") from error
    except Exception as error:
        reason = PLACE.sub("", " ".join(str(error).split()))
        if OUTSIDE in reason:
            raise InvalidProblem(called, _outside(reason, view.robot)) from error
        advice = "say ca.if_else(condition, a, b) in place of if" if MISUSED in reason else f"m has {', '.join(KNOWN)}"
        raise InvalidProblem(called, f"raised {type(error).__name__}: {reason[:150]}; {advice}") from error


def _outside(reason: str, robot: Robot) -> str:
    """The message about an index that is too large or too small."""
    length = LENGTH.search(reason)
    known = f"{robot.dof} joints, {robot.dim} coordinates of a point" if length is None else f"{length[1]} in all"
    return f"an index is out of range: {known}, counted from 0"


def _column(value: Any, called: str) -> ca.SX:
    """The value of a function as a dense column."""
    try:
        expression = ca.vertcat(*value) if isinstance(value, list | tuple) else value
        expression = ca.SX(expression if isinstance(expression, ca.SX) else ca.DM(expression))
    except Exception as error:
        raise InvalidProblem(
            called, f"gives {type(value).__name__}, where a number or vector of CasADi's SX is needed"
        ) from error
    if not expression.is_vector() or expression.numel() == 0:
        rows, columns = expression.shape
        raise InvalidProblem(called, f"gives a matrix of {rows} x {columns}, where a number or vector is needed")
    return ca.densify(ca.vec(expression))


def _text(expression: ca.SX, symbols: Mapping[str, ca.SX], called: str) -> str:
    own = {symbol.element_hash() for part in symbols.values() for symbol in ca.vertsplit(part)}
    foreign = [symbol for symbol in ca.symvar(expression) if symbol.element_hash() not in own]
    if foreign:
        raise InvalidProblem(called, f"depends on {foreign[0]}, which is nothing of the motion")
    try:
        return written(expression, symbols)
    except UnsupportedOperation as error:
        advice = f"; {OF_SYMBOLS}" if str(error).endswith(NO_NUMBER) else ""
        raise InvalidProblem(called, f"{error}{advice}") from error


def _inserted(expression: ca.SX, symbols: Mapping[str, ca.SX], long: _WrittenOut, called: str) -> str:
    """The short form with its symbols replaced by the long form, unless something was differentiated."""
    function = ca.Function("short", list(symbols.values()), [expression])
    inserted = function.call([long(name) for name in symbols])[0]
    return _text(ca.densify(ca.SX(inserted)), long.known, called)


def random_states(robot: Robot, count: int) -> FloatArray:
    """States (count, 4 dof + 1) to probe an expression in: angles, three derivatives, time; always the same."""
    rng, shape = np.random.default_rng(0), (count, 4 * robot.dof + 1)
    return np.asarray(rng.uniform(0.1, 1.5, shape) * rng.choice([-1.0, 1.0], shape))
