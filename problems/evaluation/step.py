"""One step of a program: a function with named inputs and outputs, and the rows that it runs for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray, Matrix
from problems.evaluation.tape import SAME_NAMES, UnsupportedOperation

CANDIDATE, PARAMETERS, ROW, WINDOW, COST = "x", "p", "row", "window", "cost"
RESERVED = frozenset({CANDIDATE, PARAMETERS, ROW, WINDOW})


class InvalidProgram(ValueError):
    """The steps of a program do not fit together; the message names the step and the vector."""


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
        """The step of expressions.

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
        """How often it runs."""
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
