"""What the tests of costs share: candidates, the virtual machine, the source that a problem compiles."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import Problem
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions
from problems.evaluation.codegen import cpp
from problems.evaluation.kernel import kernels

VM = EvaluationOptions("vm")


def sampled(problem: Problem[Any], count: int, seed: int = 0) -> FloatArray:
    """Candidates anywhere in the search box, (count, d)."""
    return np.random.default_rng(seed).uniform(*problem.bounds, (count, len(problem.variables)))


def source(problem: Problem[Any]) -> str:
    """The C++ of a problem's cost."""
    return cpp(kernels(problem.program), problem.program.sizes)
