"""A program with the numbers of another problem of the same make, without deriving anything anew."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from problems.assembly.problem import Problem
from problems.assembly.repeated_loop import PLACES
from problems.base.matrix import FloatArray
from problems.evaluation import Program, Step


def restated(program: Program, problem: Problem[Any], parameters: FloatArray) -> Program:
    """The program of a problem, given that of one of the same make and the numbers of its statements (q,)."""
    penalised = problem.encoding.penalised(problem.searched_limits)
    repeated = iter([numbers for limit in penalised for numbers in limit.repeated_numbers()])
    steps = tuple(_with_rows(step, next(repeated)) if _is_repeated(step) else step for step in program.steps)
    return replace(program, steps=steps, parameters=parameters)


def _is_repeated(step: Step) -> bool:
    """Whether it runs for each of several things at each sample."""
    return step.loop is not None and step.loop.window == PLACES


def _with_rows(step: Step, numbers: FloatArray) -> Step:
    """The same for things (things, r) that have other numbers."""
    assert step.loop is not None
    samples = len(step.loop.rows) // len(numbers)
    return replace(step, loop=replace(step.loop, rows=np.tile(numbers, (samples, 1))))
