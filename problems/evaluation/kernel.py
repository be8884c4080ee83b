"""A program's tape without what depends on the scene alone: the kernel, and the data that it is given.

A step is a function of a candidate's vectors, of the parameters and of a row. Operations that see no candidate give the
same for all of them: they are taken out, evaluated once when the program is loaded, and their results handed to what is
left, the *kernel*, in place of the parameters and of the row. Both backends run the same kernels on the same numbers.

Elementary functions that every processor rounds alike.

IEEE 754 fixes every bit of those four operations and of no angle function: each mathematical library, and each vector
version of one, rounds them its own way, and a search follows the last bit. Written out like this, a cost has one
value, on every processor and in every backend, and a compiler that works on eight candidates at once needs no library.

Absolute errors stay below 1e-15 for angles up to 1e5 rad and lengths between 1e-150 and 1e150.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from math import pi

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix, Operand
from problems.evaluation.interpreter import SAME_NAMES, Interpreter, Symbolic, column, entries, interpret, rebuilt
from problems.evaluation.program import PARAMETERS, ROW, Program, Step

# pi in two parts: the first has 33 bits, so that its product with an integer below 2^20 is exact (Cody and Waite)
PI_HIGH, PI_LOW = float.fromhex("0x1.921fb544p+1"), float.fromhex("0x1.0b4611a626331p-33")
LENGTH_FLOOR = 1e-300  # added to a length: the angle of a zero vector is then 0, not 0 / 0

# Convergents of the continued fractions of tan h / h and atan h / h (Gauss, Lambert), as polynomials in h^2, lowest
# power first: relative error 9e-19 for |h| <= pi / 4 and 2e-17 for |h| <= tan(pi / 8).
TAN = (
    (34459425.0, -4729725.0, 135135.0, -990.0, 1.0),
    (34459425.0, -16216200.0, 945945.0, -13860.0, 45.0),
)
ATAN = (
    (316234143225.0, 802043116875.0, 733034672370.0, 289831331790.0, 46107386325.0, 2015310375.0),
    (316234143225.0, 907454497950.0, 972272676375.0, 477607630500.0, 105354624375.0, 8428369950.0, 108056025.0),
)


def portable(function: ca.Function) -> ca.Function:
    """The function with its angles written out.

    Args:
        function: SX function of dense columns.

    Raises:
        UnsupportedOperation: it holds an operation that :mod:`problems.evaluation.interpreter` does not know.
    """
    return rebuilt(function, Portable())


class Portable(Symbolic):
    """An interpreter in symbols in which angles are written out."""

    def __init__(self) -> None:
        x, y = ca.SX.sym("x"), ca.SX.sym("y")
        angle_of = ca.Function("angle", [y, x], [angle(y, x)])
        self._sine_cosine_of = ca.Function("sine_cosine", [x], sine_cosine(x))
        self._known: dict[int, tuple[ca.SX, ca.SX, ca.SX]] = {}
        self._unary: dict[str, Callable[[ca.SX], ca.SX]] = {
            "sin": lambda a: self._sine_cosine(a)[0],
            "cos": lambda a: self._sine_cosine(a)[1],
            "tan": lambda a: self._sine_cosine(a)[0] / self._sine_cosine(a)[1],
            "atan": lambda a: angle_of(a, 1.0),
            "asin": lambda a: angle_of(a, _other_leg(a)),
            "acos": lambda a: angle_of(_other_leg(a), a),
        }
        self._binary: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {"atan2": angle_of}

    def unary(self, name: str, a: ca.SX) -> ca.SX:
        return self._unary[name](a) if name in self._unary else super().unary(name, a)

    def binary(self, name: str, a: ca.SX, b: ca.SX) -> ca.SX:
        if name in ("fmin", "fmax") and a.is_constant():
            a, b = b, a  # the same number, and one instruction on processors that take the second where they are equal
        return self._binary[name](a, b) if name in self._binary else super().binary(name, a, b)

    def _sine_cosine(self, a: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Sine and cosine of an angle, once for each angle (stored with it: a hash may be reused)."""
        key = a.element_hash()
        if key not in self._known:
            self._known[key] = (*self._sine_cosine_of(a), a)
        return self._known[key][:2]


def sine_cosine(x: Matrix) -> tuple[Matrix, Matrix]:
    """Sine and cosine of x in rad.

    With n half turns taken off, h = (x - n pi) / 2 lies within pi / 4; from tan h = N / D,
    sin 2h = 2 N D / (D^2 + N^2) and cos 2h = (D^2 - N^2) / (D^2 + N^2), both times (-1)^n.
    """
    n = ca.floor(x * (1.0 / pi) + 0.5)
    h = ((x - n * PI_HIGH) - n * PI_LOW) * 0.5
    z = h * h
    top, bottom = h * _polynomial(TAN[0], z), _polynomial(TAN[1], z)
    top_squared, bottom_squared = top * top, bottom * bottom
    odd = n - 2.0 * ca.floor(0.5 * n)
    scale = (1.0 - 2.0 * odd) / (bottom_squared + top_squared)
    return 2.0 * (top * bottom) * scale, (bottom_squared - top_squared) * scale


def angle(y: Matrix, x: Matrix) -> Matrix:
    """The angle in rad, within [-pi, pi], of the vector (x, y); 0 for (0, 0).

    Within the first octant the half angle has the tangent h = min / (max + r), at most tan(pi / 8).
    """
    r = ca.sqrt(x * x + y * y)
    wide, high = ca.fabs(x), ca.fabs(y)
    h = ca.fmin(wide, high) / (ca.fmax(wide, high) + r + LENGTH_FLOOR)
    z = h * h
    octant = 2.0 * h * (_polynomial(ATAN[0], z) / _polynomial(ATAN[1], z))
    quadrant = octant + (high > wide) * (pi / 2 - 2.0 * octant)
    return ca.copysign(quadrant + (x < 0.0) * (pi - 2.0 * quadrant), y)


def _other_leg(a: ca.SX) -> ca.SX:
    """The other leg of a right triangle with hypotenuse 1; NaN where |a| > 1."""
    return ca.sqrt((1.0 - a) * (1.0 + a))


def _polynomial(coefficients: tuple[float, ...], z: Matrix) -> Operand:
    value: Operand = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * z + coefficient
    return value


class Stage(IntEnum):
    """The latest input that a value depends on, and so how often it is computed."""

    CONSTANT = 0
    PARAMETERS = 1  # once
    ROW = 2  # once a row
    CANDIDATE = 3  # for each row of each candidate


@dataclass(frozen=True)
class Preparation:
    """The part of a step that does not depend on a candidate.

    Attributes:
        parameters_of: (p) -> the kernel's ``p``.
        row_of: (p, row) -> the kernel's ``row``.
    """

    parameters_of: ca.Function
    row_of: ca.Function


@dataclass(frozen=True)
class Kernel:
    """The part of a step that is computed for each candidate.

    Attributes:
        function: SX function with the step's inputs and outputs; ``p`` and ``row`` hold what was computed beforehand.
        stacked: as in the step.
        window: as in the step's loop; empty for none.
        preparation: makes those of the step's.
    """

    function: ca.Function
    stacked: tuple[str, ...]
    window: str
    preparation: Preparation


@dataclass(frozen=True)
class KernelData:
    """The numbers of one scene that a kernel works on.

    Attributes:
        parameters: its input ``p``, (u,).
        rows: its input ``row`` for each run, (n, v).
        starts: of its window for each run, (n,); zeros without a window.
    """

    parameters: FloatArray
    rows: FloatArray
    starts: NDArray[np.int64]


def kernel(step: Step) -> Kernel:
    """Split a step by what its operations depend on, and write the angles of what is left out.

    Raises:
        UnsupportedOperation: it holds an operation that :mod:`problems.evaluation.interpreter` does not know.
    """
    symbols = {name: ca.SX.sym(name, size) for name, size in step.inputs.items()}
    stages = {PARAMETERS: Stage.PARAMETERS, ROW: Stage.ROW}
    splitter = Splitter()
    arguments = [
        [Staged(entry, stages.get(name, Stage.CANDIDATE)) for entry in entries(symbol)]
        for name, symbol in symbols.items()
    ]
    results = [
        [splitter.handed_over(a).value for a in result] for result in interpret(step.function, arguments, splitter)
    ]
    inputs = {name: symbol for name, symbol in symbols.items() if name not in stages}
    for name, stage in stages.items():
        inputs[name] = column(splitter.symbols[stage])
    p, row = (symbols.get(name, ca.SX.sym(name, 0)) for name in (PARAMETERS, ROW))
    columns = [column(result) for result in results]
    function = ca.Function("kernel", [*inputs.values()], columns, [*inputs], [*step.outputs], SAME_NAMES)
    return Kernel(
        function=portable(function),
        stacked=step.stacked,
        window="" if step.loop is None else step.loop.window,
        preparation=Preparation(
            ca.Function("parameters", [p], [column(splitter.values[Stage.PARAMETERS])]),
            ca.Function("row", [p, row], [column(splitter.values[Stage.ROW])]),
        ),
    )


def kernel_data(preparation: Preparation, step: Step, parameters: FloatArray) -> KernelData:
    """The numbers of one scene for a kernel."""
    rows = np.empty((1, 0)) if step.loop is None else step.loop.rows
    starts = None if step.loop is None else step.loop.starts
    p = parameters if PARAMETERS in step.inputs else parameters[:0]
    r = rows if ROW in step.inputs else rows[:, :0]
    return KernelData(
        parameters=np.array(preparation.parameters_of(p)).ravel(),
        rows=_row_data(preparation.row_of, p, r),
        starts=np.zeros(len(rows), np.int64) if starts is None else starts.astype(np.int64),
    )


def _row_data(row_of: ca.Function, parameters: FloatArray, rows: FloatArray) -> FloatArray:
    """Results (n, v) of parameters (q,) and each of the rows (n, r); repeated rows are evaluated once."""
    if not row_of.numel_out(0):
        return np.empty((len(rows), 0))
    different, which = np.unique(rows, axis=0, return_inverse=True)
    values = np.array(row_of(parameters, different.T)).reshape(-1, len(different))
    return np.ascontiguousarray(values[:, which.ravel()].T)


def kernels(program: Program) -> tuple[Kernel, ...]:
    """The kernels of all steps."""
    return tuple(kernel(step) for step in program.steps)


def data(program: Program, preparations: tuple[Preparation, ...]) -> tuple[KernelData, ...]:
    """The numbers of a program's scene for each of its kernels."""
    each = zip(preparations, program.steps, strict=True)
    return tuple(kernel_data(part, step, program.parameters) for part, step in each)


@dataclass(frozen=True, eq=False)
class Staged:
    """An expression and what it depends on."""

    value: ca.SX
    stage: Stage


class Splitter(Interpreter[Staged]):
    """An interpreter that notes where a value of an early stage meets a candidate's.

    Attributes:
        symbols: by stage, what stands for those values from there on.
        values: by stage, the values.
    """

    def __init__(self) -> None:
        self.symbols: dict[Stage, list[ca.SX]] = {Stage.PARAMETERS: [], Stage.ROW: []}
        self.values: dict[Stage, list[ca.SX]] = {Stage.PARAMETERS: [], Stage.ROW: []}
        self._symbolic = Symbolic()
        self._handed_over: dict[Staged, Staged] = {}

    def constant(self, value: float) -> Staged:
        return Staged(self._symbolic.constant(value), Stage.CONSTANT)

    def unary(self, name: str, a: Staged) -> Staged:
        """A value of one operation, at the stage of its operand."""
        return Staged(self._symbolic.unary(name, a.value), a.stage)

    def binary(self, name: str, a: Staged, b: Staged) -> Staged:
        """A value of one operation, at the later stage of its operands."""
        stage = max(a.stage, b.stage)
        if stage is Stage.CANDIDATE:
            a, b = self.handed_over(a), self.handed_over(b)
        return Staged(self._symbolic.binary(name, a.value, b.value), stage)

    def handed_over(self, a: Staged) -> Staged:
        """The value, or for a value of an early stage the symbol that replaces it in the kernel."""
        if a.stage in (Stage.CONSTANT, Stage.CANDIDATE):
            return a
        if a not in self._handed_over:
            symbols = self.symbols[a.stage]
            symbols.append(ca.SX.sym(f"{a.stage.name.lower()}_{len(symbols)}"))
            self.values[a.stage].append(a.value)
            self._handed_over[a] = Staged(symbols[-1], Stage.CANDIDATE)
        return self._handed_over[a]
