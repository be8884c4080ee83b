"""A cost as small functions: steps, loops over the samples of a motion, and the program that joins them.

A cost that is written out for every sample grows with their number, and with the numbers of a scene folded into it, it
has to be compiled for each scene. A :class:`Program` says the same in a few small functions: what all samples share,
what happens at one sample, and what follows from the accumulated values. For example:

    prepare    (x, p)                               -> (shared, blocks, total, previous)
    sample     (p, shared, window, row, total, previous) -> (total, previous)      # once a row, in place
    finish     (x, p, shared, total)                -> cost

The vectors that steps write have names, and so have their sizes; everything is checked when the program is made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix
from problems.evaluation.interpreter import SAME_NAMES, ColumnFunction, UnsupportedOperation, entries

CANDIDATE, PARAMETERS, ROW, WINDOW, COST = "x", "p", "row", "window", "cost"
RESERVED = frozenset({CANDIDATE, PARAMETERS, ROW, WINDOW})


class InvalidProgram(ValueError):
    """Raised where the steps of a program do not fit together; the message names the step and the vector."""


@dataclass(frozen=True, kw_only=True)
class Loop:
    """The n rows for which a step runs, and what each of them reads.

    Attributes:
        rows: the numbers that each row brings, input ``row``, (n, r); r may be 0.
        window: the vector of which each row sees a part, input ``window``; empty for none.
        starts: index of the first entry of that part for each row, (n,).
    """

    rows: FloatArray
    window: str = ""
    starts: NDArray[np.intp] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", np.array(self.rows, dtype=np.float64))
        if self.rows.ndim != 2 or not len(self.rows):
            raise InvalidProgram(f"rows of shape {self.rows.shape} where (n, r) with n >= 1 is needed")
        if bool(self.window) != (self.starts is not None):
            raise InvalidProgram("a window needs its starts, and starts need the name of a vector")
        if self.starts is not None:
            object.__setattr__(self, "starts", np.array(self.starts, dtype=np.intp))
            if self.starts.shape != (len(self.rows),):
                raise InvalidProgram(f"starts of shape {self.starts.shape} for {len(self.rows)} rows")


@dataclass(frozen=True, kw_only=True)
class Step:
    """One function of a program.

    Inputs are called ``x`` (the candidate), ``p`` (the parameters), ``row`` and ``window`` (of the loop), or as a
    vector that an earlier step wrote. Outputs are new vectors, or have the name of an input: then they replace it,
    which in a loop makes an accumulator. All inputs of a row are read before its outputs are written.

    Attributes:
        function: SX function with named inputs and outputs, all of them columns, the inputs dense.
        loop: its rows; None for a step that runs once.
        stacked: outputs of a loop that are kept row after row: vectors of n times their size. Of other new outputs
            the last row's values remain.
    """

    function: ca.Function
    loop: Loop | None = None
    stacked: tuple[str, ...] = ()

    @classmethod
    def of(
        cls,
        name: str,
        inputs: Mapping[str, ca.SX],
        outputs: Mapping[str, Matrix],
        loop: Loop | None = None,
        stacked: Sequence[str] = (),
    ) -> Step:
        """The step of named expressions.

        Args:
            name: what errors call it.
            inputs: symbols by name, columns.
            outputs: expressions of them by name, columns.
            loop: its rows; None for a step that runs once.
            stacked: outputs that are kept row after row.
        """
        columns = [ca.densify(ca.SX(output)) for output in outputs.values()]
        function = ca.Function(name, [*inputs.values()], columns, [*inputs], [*outputs], SAME_NAMES)
        return cls(function=function, loop=loop, stacked=tuple(stacked))

    @property
    def runs(self) -> int:
        """The number of times that it runs."""
        return 1 if self.loop is None else len(self.loop.rows)

    @cached_property
    def inputs(self) -> dict[str, int]:
        """Sizes of the inputs, by name, in order."""
        return {self.function.name_in(i): self.function.size1_in(i) for i in range(self.function.n_in())}

    @cached_property
    def outputs(self) -> dict[str, int]:
        """Sizes of the outputs of one run, by name, in order."""
        return {self.function.name_out(i): self.function.size1_out(i) for i in range(self.function.n_out())}

    def written(self) -> dict[str, int]:
        """Sizes of the vectors that it leaves behind, by name."""
        return {name: size * (self.runs if name in self.stacked else 1) for name, size in self.outputs.items()}


def check_step(step: Step, sizes: dict[str, int]) -> None:
    """Check that a step fits the vectors written so far.

    Raises:
        InvalidProgram: it does not.
    """
    function = step.function
    if not function.is_a("SXFunction"):
        raise UnsupportedOperation(f"{function.name()} is not written out in scalars")
    known = dict(sizes)
    if step.loop is not None:
        known[ROW] = step.loop.rows.shape[1]
        if step.loop.window:
            known[WINDOW] = step.inputs.get(WINDOW, 0)
            _check_window(step.loop, known)
    for i, (name, size) in enumerate(step.inputs.items()):
        if name not in known:
            raise InvalidProgram(f"input {name!r} is none of {', '.join(known)}")
        if size != known[name] or function.size2_in(i) != 1 or not function.sparsity_in(i).is_dense():
            shape = function.sparsity_in(i).dim()
            raise InvalidProgram(f"input {name!r} of shape {shape} where a dense ({known[name]}, 1) is needed")
    _check_outputs(step, sizes)


def _check_window(loop: Loop, known: dict[str, int]) -> None:
    assert loop.starts is not None
    if loop.window not in known or loop.window in {PARAMETERS, ROW, WINDOW}:
        raise InvalidProgram(f"there is no vector {loop.window!r} for a window")
    last = known[loop.window] - known[WINDOW]
    if loop.starts.min() < 0 or loop.starts.max() > last:
        raise InvalidProgram(
            f"starts from {loop.starts.min()} to {loop.starts.max()} where 0 to {last} keep a window of"
            f" {known[WINDOW]} within the {known[loop.window]} entries of {loop.window!r}"
        )


def _check_outputs(step: Step, sizes: dict[str, int]) -> None:
    for i, (name, size) in enumerate(step.outputs.items()):
        if step.function.size2_out(i) != 1:
            raise InvalidProgram(f"output {name!r} is no column")
        if name in RESERVED or (step.loop is not None and name == step.loop.window):
            raise InvalidProgram(f"output {name!r} has the name of something that is only read")
        if name in sizes and (name not in step.inputs or name in step.stacked):
            raise InvalidProgram(f"output {name!r} would replace a vector that is not its input")
        if name in step.inputs and size != sizes[name]:
            raise InvalidProgram(f"output {name!r} has {size} entries, the vector it replaces {sizes[name]}")
    if step.stacked and (step.loop is None or not set(step.stacked) <= set(step.outputs)):
        raise InvalidProgram(f"{', '.join(step.stacked)} cannot be stacked: not outputs of a loop")


@dataclass(frozen=True)
class Program:
    """Steps from a candidate to its cost.

    Attributes:
        steps: in order; the last one writes ``cost``, a scalar, or a column whose first entry is the cost.
        parameters: values of the input ``p``, (q,): what changes from scene to scene.

    Raises:
        InvalidProgram: a step reads what no earlier one wrote, or sizes or starts do not fit.
        UnsupportedOperation: a function is not written out in scalars (SX).
    """

    _: KW_ONLY
    steps: tuple[Step, ...]
    parameters: FloatArray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", np.array(self.parameters, dtype=np.float64))
        if self.parameters.ndim != 1:
            raise InvalidProgram(f"parameters of shape {self.parameters.shape} where (q,) is needed")
        _ = self.sizes

    @classmethod
    def of(cls, function: ca.Function) -> Program:
        """The program of a plain function.

        Args:
            function: SX function of one vector (d,) and one scalar result.
        """
        if not function.is_a("SXFunction"):
            raise UnsupportedOperation(f"{function.name()} is not written out in scalars")
        x = ca.SX.sym("x", function.size1_in(0))
        return cls(steps=(Step(function=ca.Function("cost", [x], [function(x)], ["x"], ["cost"])),))

    @property
    def dimension(self) -> int:
        """The number of entries d of a candidate."""
        return self.sizes[CANDIDATE]

    @property
    def values(self) -> int:
        """The number of values that a candidate is given: the cost, and others that the last step writes."""
        return self.sizes[COST]

    @cached_property
    def sizes(self) -> dict[str, int]:
        """The number of entries of every vector, by name: candidate, parameters and all that steps write."""
        dimension = next((step.inputs[CANDIDATE] for step in self.steps if CANDIDATE in step.inputs), None)
        if dimension is None:
            raise InvalidProgram("no step reads the candidate x")
        sizes = {CANDIDATE: dimension, PARAMETERS: self.parameters.size}
        for number, step in enumerate(self.steps):
            try:
                check_step(step, sizes)
            except InvalidProgram as error:
                raise InvalidProgram(f"step {number} ({step.function.name()}): {error}") from None
            sizes.update(step.written())
        if not self.steps[-1].written().get(COST):
            raise InvalidProgram("the last step does not write what is called cost")
        return sizes

    def with_numbers(self, parameters: FloatArray) -> Program:
        """The steps for another scene.

        Raises:
            InvalidProgram: it has not as many numbers.
        """
        return replace(self, parameters=parameters)

    def inlined(self) -> ca.Function:
        """The program as one SX function x -> cost, with all rows and numbers written out."""
        x = ca.SX.sym("x", self.dimension)
        values: dict[str, ca.SX] = {CANDIDATE: x, PARAMETERS: ca.SX(ca.DM(self.parameters))}
        for step in self.steps:
            values.update(_inlined(step, values))
        return ca.Function("cost", [x], [values[COST]], ["x"], ["cost"], {"cse": True})


def _inlined(step: Step, values: dict[str, ca.SX]) -> dict[str, ca.SX]:
    """The vectors that a step writes, as expressions."""
    values = dict(values)
    stacks: dict[str, list[ca.SX]] = {name: [] for name in step.stacked}
    for i in range(step.runs):
        if step.loop is not None:
            values[ROW] = ca.SX(ca.DM(step.loop.rows[i]))
            if step.loop.starts is not None:
                start = int(step.loop.starts[i])
                values[WINDOW] = values[step.loop.window][start : start + step.inputs.get(WINDOW, 0)]
        results = step.function.call([values[name] for name in step.inputs])
        for name, result in zip(step.outputs, results, strict=True):
            values[name] = ca.densify(result)
            if name in stacks:
                stacks[name].append(values[name])
    return {name: ca.vertcat(*stacks[name]) if name in stacks else values[name] for name in step.outputs}


class RowFunction:
    """A function of rows, whose bits are those of one row after the other.

    Args:
        formula: SX function of a column (m, 1) and, if there is a second input called ``p``, of numbers (q, 1) that all
            rows share; of one dense column (r, 1).
        width: rows that are computed at once, the last ones padded.
    """

    def __init__(self, formula: ca.Function, width: int) -> None:
        self._formula, self._width = formula, width

    def __call__(self, columns: FloatArray, parameters: FloatArray | None = None) -> FloatArray:
        """Results (r, n) of n rows, given as columns (m, n)."""
        count = columns.shape[1]
        results = np.empty((self._formula.size1_out(0), count))
        block = self._one if count == 1 else self._block
        for first in range(0, count, block.width):
            last = min(first + block.width, count)
            results[:, first:last] = block(columns[:, first:last], parameters)
        return results

    @cached_property
    def _one(self) -> _Block:
        return _Block(self._formula, 1)

    @cached_property
    def _block(self) -> _Block:
        return _Block(self._formula, self._width)


class _Block:
    """The formula for ``width`` rows."""

    def __init__(self, formula: ca.Function, width: int) -> None:
        self.width = width
        inputs, outputs, shared = formula.size1_in(0), formula.size1_out(0), formula.n_in() - 1
        columns = ColumnFunction(formula, width, [PARAMETERS])
        matrix = ca.MX.sym("columns", width, inputs)
        parameters = ca.MX.sym(PARAMETERS, formula.size1_in(1) if shared else 0)
        constants = ca.MX.sym("constants", columns.constants.size)
        given = [ca.horzsplit(matrix), *[entries(parameters)] * shared]
        results = ca.horzcat(*columns(given, entries(constants))[0])
        self._function = ca.Function("rows", [matrix, parameters, constants], [ca.densify(results)])
        self._constants, self._parameters = columns.constants, np.zeros(parameters.numel())
        self._columns, self._results = np.zeros((inputs, width)), np.empty((outputs, width))
        self._buffer, self._evaluate = self._function.buffer()
        for number, array in enumerate((self._columns, self._parameters, self._constants)):
            self._buffer.set_arg(number, array.data)  # type: ignore[call-arg]
        self._buffer.set_res(0, self._results.data)  # type: ignore[call-arg]

    def __call__(self, columns: FloatArray, parameters: FloatArray | None) -> FloatArray:
        """Results (r, n) of at most ``width`` rows."""
        count = columns.shape[1]
        self._columns[:, :count] = columns
        if parameters is not None:
            self._parameters[:] = parameters
        self._evaluate()
        return self._results[:, :count]
