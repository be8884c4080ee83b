"""A program's tape without what depends on the scene alone: the kernel, and the data that it is given.

A step is a function of a candidate's vectors, of the parameters and of a row. Operations that see no candidate give the
same for all of them: they are taken out, evaluated once when the program is loaded, and their results handed to what is
left, the *kernel*, in place of the parameters and of the row. Both backends run the same kernels on the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.evaluation.interpreter import SAME_NAMES, Symbolic, column, entries, interpret
from problems.evaluation.portable_math import portable
from problems.evaluation.program import PARAMETERS, ROW, Program, Step


class Stage(IntEnum):
    """The latest input that a value depends on, and so how often it is computed."""

    CONSTANT = 0
    PARAMETERS = 1  # once
    ROW = 2  # once a row
    CANDIDATE = 3  # for each row of each candidate


@dataclass(frozen=True)
class Kernel:
    """The part of a step that is computed for each candidate.

    Attributes:
        function: SX function with the step's inputs and outputs; ``p`` and ``row`` hold what was computed beforehand.
        stacked: as in the step.
        window: as in the step's loop; empty for none.
        parameters_of: (p) -> the kernel's ``p``.
        row_of: (p, row) -> the kernel's ``row``.
    """

    function: ca.Function
    stacked: tuple[str, ...]
    window: str
    parameters_of: ca.Function
    row_of: ca.Function


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
        parameters_of=ca.Function("parameters", [p], [column(splitter.values[Stage.PARAMETERS])]),
        row_of=ca.Function("row", [p, row], [column(splitter.values[Stage.ROW])]),
    )


def kernel_data(split: Kernel, step: Step, parameters: FloatArray) -> KernelData:
    """The numbers of one scene for a kernel."""
    rows = np.empty((1, 0)) if step.loop is None else step.loop.rows
    starts = None if step.loop is None else step.loop.starts
    p = parameters if PARAMETERS in step.inputs else parameters[:0]
    r = rows if ROW in step.inputs else rows[:, :0]
    return KernelData(
        parameters=np.array(split.parameters_of(p)).ravel(),
        rows=_row_data(split.row_of, p, r),
        starts=np.zeros(len(rows), np.int64) if starts is None else starts.astype(np.int64),
    )


def _row_data(row_of: ca.Function, parameters: FloatArray, rows: FloatArray) -> FloatArray:
    """What follows from parameters (q,) and each of the rows (n, r): (n, v). Rows that repeat are evaluated once."""
    if not row_of.numel_out(0):
        return np.empty((len(rows), 0))
    different, which = np.unique(rows, axis=0, return_inverse=True)
    values = np.array(row_of(parameters, different.T)).reshape(-1, len(different))
    return np.ascontiguousarray(values[:, which.ravel()].T)


def kernels(program: Program) -> tuple[Kernel, ...]:
    """The kernels of all steps."""
    return tuple(kernel(step) for step in program.steps)


def data(program: Program, split: tuple[Kernel, ...]) -> tuple[KernelData, ...]:
    """The numbers of a program's scene for its kernels."""
    each = zip(split, program.steps, strict=True)
    return tuple(kernel_data(part, step, program.parameters) for part, step in each)


@dataclass(frozen=True, eq=False)
class Staged:
    """An expression and what it depends on."""

    value: ca.SX
    stage: Stage


class Splitter:
    """Interpreter that notes where a value of an early stage meets a candidate's.

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
        """A constant."""
        return Staged(self._symbolic.constant(value), Stage.CONSTANT)

    def unary(self, name: str, a: Staged) -> Staged:
        """One operation, as early as its operand allows."""
        return Staged(self._symbolic.unary(name, a.value), a.stage)

    def binary(self, name: str, a: Staged, b: Staged) -> Staged:
        """One operation, as early as its operands allow."""
        stage = max(a.stage, b.stage)
        if stage is Stage.CANDIDATE:
            a, b = self.handed_over(a), self.handed_over(b)
        return Staged(self._symbolic.binary(name, a.value, b.value), stage)

    def handed_over(self, a: Staged) -> Staged:
        """The value itself, or for a value of an early stage the symbol that replaces it in the kernel."""
        if a.stage in (Stage.CONSTANT, Stage.CANDIDATE):
            return a
        if a not in self._handed_over:
            symbols = self.symbols[a.stage]
            symbols.append(ca.SX.sym(f"{a.stage.name.lower()}_{len(symbols)}"))
            self.values[a.stage].append(a.value)
            self._handed_over[a] = Staged(symbols[-1], Stage.CANDIDATE)
        return self._handed_over[a]
