"""A cost in steps: compiled code loops over the samples of a motion, and the numbers of a scene are its arguments.

A cost that is written out for every sample grows with their number, and with the numbers of a scene folded into it, it
has to be compiled for each scene. A :class:`Program` says the same in a few small functions: what all samples share,
what happens at one sample, and what follows from the accumulated values. For example:

    prepare    (x, p)                               -> (shared, blocks, total, previous)
    sample     (p, shared, window, row, total, previous) -> (total, previous)      # once a row, in place
    finish     (x, p, shared, total)                -> cost

The vectors that steps write have names, and so have their sizes; everything is checked when the program is made.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation.step import CANDIDATE, COST, PARAMETERS, ROW, WINDOW, InvalidProgram, Step, check_step
from problems.evaluation.tape import UnsupportedOperation


@dataclass(frozen=True)
class Program:
    """Steps from a candidate to its cost.

    Attributes:
        steps: in order; the last one writes ``cost``, a scalar.
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
        """Entries d of a candidate."""
        return self.sizes[CANDIDATE]

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Entries of every vector, by name: the candidate, the parameters and all that steps write."""
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
        if self.steps[-1].written().get(COST) != 1:
            raise InvalidProgram("the last step does not write a scalar called cost")
        return sizes

    def with_numbers(self, parameters: FloatArray) -> Program:
        """The same steps for another scene.

        Raises:
            InvalidProgram: it has not as many numbers.
        """
        return replace(self, parameters=parameters)

    def inlined(self) -> ca.Function:
        """The same as one SX function x -> cost, all rows written out and all numbers in it."""
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
