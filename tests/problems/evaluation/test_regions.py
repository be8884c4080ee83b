"""What a condition alone asks for is jumped over where it holds for no candidate, and nothing else changes."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.evaluation import needs_compiler, points, same_bits, source_of, virtual_machine

from problems.evaluation import EvaluationOptions, PopulationFunction, Program, codegen

pytestmark = pytest.mark.usefixtures("cache_folder")
X = ca.SX.sym("x", 3)


def long(x: ca.SX, steps: int = 40) -> ca.SX:
    """Many operations, each of which needs the one before."""
    for k in range(steps):
        x = ca.sqrt(x * x + 0.1 * k) - 0.3 * x
    return x


def chained() -> ca.SX:
    first = ca.if_else(X[0] > 1.0, long(X[1]), 0.0)
    return first + ca.if_else(first + X[2] > 2.0, long(X[2] + first), 0.0)


SHARED = long(X[1])
COSTS = {
    "one": ca.if_else(X[0] > 0.0, long(X[1]), 0.0),
    "either": ca.if_else(X[0] > 0.0, long(X[1]), long(X[2])),
    "nested": ca.if_else(X[0] > 0.0, long(X[1]) + ca.if_else(X[1] > 0.0, long(X[2]), 0.0), 0.0),
    "one after the other": chained(),
    "shared": ca.if_else(X[0] > 0.0, SHARED + long(X[2]), 0.0) + SHARED,
    "condition shared": ca.if_else(long(X[0]) > 0.5, long(X[0]) * X[1], 0.0),
    "not a number": ca.if_else(X[0] > 0.0, long(ca.log(X[0])), 0.0),
}


@needs_compiler
@pytest.mark.parametrize("name", COSTS)
@pytest.mark.parametrize("block", [7, 1000])
def test_bits_are_those_of_the_virtual_machine(name: str, block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codegen, "BLOCK_STATEMENTS", block)
    program = Program.of(ca.Function("cost", [X], [COSTS[name]]))
    candidates = points(300)
    candidates[:100, 0] = np.abs(candidates[:100, 0])  # batches in which the condition holds for all
    candidates[100:200, 0] = -np.abs(candidates[100:200, 0])  # or for none
    candidates[200:210] = np.nan
    native = PopulationFunction(program, EvaluationOptions("native"))
    costs, expected = native(candidates), np.empty(300)
    virtual_machine(program)(candidates, expected)
    assert native.backend == "native"
    assert same_bits(costs, expected)


@pytest.mark.parametrize(("name", "jumps"), [("one", 1), ("either", 2), ("nested", 1), ("one after the other", 2)])
def test_regions_are_found(name: str, jumps: int) -> None:
    assert source_of(ca.Function("cost", [X], [COSTS[name]])).count("if (!any(") == jumps


def test_little_work_is_done_in_any_case() -> None:
    cost = ca.if_else(X[0] > 0.0, long(X[1], 3), 0.0)
    assert "if (!any(" not in source_of(ca.Function("cost", [X], [cost]))
