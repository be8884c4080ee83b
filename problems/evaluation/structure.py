"""What is made of the structure of a program: kernels and C++; and what of both is kept for the next process.

A process that finds a compiled library needs of the kernels only what prepares the numbers of a scene for them. That,
and the name of the source, are kept under the functions of the steps: equal functions make equal kernels and an equal
source.
"""

from __future__ import annotations

import json
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, cached_text, structure_key
from problems.evaluation.codegen import cpp
from problems.evaluation.kernel import Kernel, Preparation, data, kernels
from problems.evaluation.native import name_of, scene_of
from problems.evaluation.program import Program


class ProgramStructure:
    """Kernels and code of a program, whatever its numbers.

    Args:
        program: any one of that structure.
    """

    def __init__(self, program: Program) -> None:
        self._program = program

    @cached_property
    def kernels(self) -> tuple[Kernel, ...]:
        """The kernels of all steps.

        Raises:
            UnsupportedOperation: a step holds an operation that :mod:`problems.evaluation.interpreter` does not know.
        """
        return kernels(self._program)

    @cached_property
    def source(self) -> str:
        """The kernels in C++."""
        return cpp(self.kernels, self._program.sizes)

    @property
    def source_name(self) -> str:
        """The digest of the C++, which need not be written for it."""
        return self._kept[0]

    @property
    def preparations(self) -> tuple[Preparation, ...]:
        """The preparations of all steps."""
        known = "kernels" in self.__dict__
        return tuple(kernel.preparation for kernel in self.kernels) if known else self._kept[1]

    def scene(self) -> tuple[FloatArray, NDArray[np.int64]]:
        """The numbers, counts and starts of rows that compiled code reads of the program's own scene."""
        return scene_of(data(self._program, self.preparations))

    @property
    def key(self) -> str | None:
        """The cache key of the structure, from which all else follows."""
        steps = [
            (step.function.serialize(), step.stacked, None if step.loop is None else step.loop.window)
            for step in self._program.steps
        ]
        return structure_key("program", steps, dict(self._program.sizes))

    @cached_property
    def _kept(self) -> tuple[str, tuple[Preparation, ...]]:
        content = json.loads(cached_text(self.key, "fun", self._text))
        functions = (map(ca.Function.deserialize, pair) for pair in content["preparations"])
        return content["source"], tuple(Preparation(*pair) for pair in functions)

    def _text(self) -> str:
        each = [kernel.preparation for kernel in self.kernels]
        pairs = [[made.parameters_of.serialize(), made.row_of.serialize()] for made in each]
        return json.dumps({"source": name_of(self.source), "preparations": pairs})
