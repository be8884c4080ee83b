"""What the tests of evaluation share: a small cost, candidates, equality of bits."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems.base import FloatArray
from problems.evaluation.batches import VirtualMachine
from problems.evaluation.codegen import cpp
from problems.evaluation.compiler import NativeUnavailable, find_compiler
from problems.evaluation.kernel import data, kernels
from problems.evaluation.program import Program


def has_compiler() -> bool:
    try:
        find_compiler()
    except NativeUnavailable:
        return False
    return True


needs_compiler = pytest.mark.skipif(not has_compiler(), reason="no C++ compiler on PATH")


def small(scale: float = 1.0) -> ca.Function:
    """A cost that compiles in no time."""
    x = ca.SX.sym("x", 3)
    return ca.Function("cost", [x], [scale * ca.sumsqr(x - 0.3) + ca.if_else(x[0] > 0, ca.sin(x[1]), x[2])])


def points(rows: int = 500, columns: int = 3, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).uniform(-3, 3, (rows, columns))


def same_bits(first: FloatArray, second: FloatArray) -> bool:
    """Equal, signs of zeros included; any NaN equals any other."""
    return bool(
        np.array_equal(first, second, equal_nan=True)
        and (np.signbit(first) == np.signbit(second))[~np.isnan(first)].all()
    )


def source_of(function: ca.Function) -> str:
    """The C++ of a plain function."""
    program = Program.of(function)
    return cpp(kernels(program), program.sizes)


def virtual_machine(program: Program) -> VirtualMachine:
    parts = kernels(program)
    return VirtualMachine(parts, data(program, tuple(part.preparation for part in parts)), program.dimension)
