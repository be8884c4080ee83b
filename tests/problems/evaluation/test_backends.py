"""Backends: the same bits from all of them, whatever happens to compilers and caches."""

from __future__ import annotations

import math
import pickle
from itertools import product
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin
from helpers.compilers import each_compiler
from helpers.evaluation import needs_compiler, points, same_bits, small, source_of, virtual_machine
from helpers.slow import slow_except
from helpers.waiting import wait_until
from hypothesis import given
from hypothesis import strategies as st

from problems.base import FloatArray, cache
from problems.evaluation import EvaluationOptions, InvalidEvaluation, PopulationFunction, Program, population
from problems.evaluation.batches import SETTINGS
from problems.evaluation.interpreter import BINARY, UNARY, UnsupportedOperation
from problems.evaluation.kernel import angle, portable, sine_cosine
from problems.evaluation.native import find_library, name_of
from solvers import BSO, Budget, SearchBox, minimize

pytestmark = pytest.mark.usefixtures("cache_folder", "compiled_once")
SLOW = pytest.mark.slow
SPECIAL = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 1e-310, 7e300, -7e300, math.inf, -math.inf, math.nan, 2**60, 0.3]


def hostile(box: SearchBox, rows: int) -> FloatArray:
    """Random candidates, some of them outside of the box, infinite or no numbers at all."""
    generator = np.random.default_rng(0)
    candidates = box.sample(generator, rows)
    candidates[: rows // 10] += generator.normal(0, 1, (rows // 10, box.lower.size)) * (box.upper - box.lower)
    places = generator.integers(rows // 2, rows, rows // 10), generator.integers(0, box.lower.size, rows // 10)
    candidates[places] = generator.choice([math.nan, math.inf, -math.inf, 0.0, -0.0, 1e300], rows // 10)
    return candidates


# The same bits


@needs_compiler
@pytest.mark.parametrize(
    ("case", "formulation"),
    slow_except(product(BUILTIN, ("paper", "reduced")), [("time-3", "paper"), ("pentagram-rotation", "reduced")]),
)
def test_backends_agree_to_the_bit(case: str, formulation: str) -> None:
    problem = builtin(case, formulation)
    candidates = hostile(SearchBox(*problem.bounds), 2_000)
    evaluators = (problem.evaluator(EvaluationOptions(backend)) for backend in ("vm", "native"))
    vm, compiled_costs = (evaluator.of_any(candidates) for evaluator in evaluators)
    assert same_bits(vm, compiled_costs)
    assert np.isfinite(vm).mean() > 0.85
    assert (vm < problem.objective_upper_bound).any() or formulation == "paper"


OPERATIONS = [*product(UNARY, [1]), *product(BINARY, [2])]


@each_compiler
@pytest.mark.parametrize("flags", slow_except(["", "-DLANES=4", "-DLANES=2"], 1))
def test_every_operation_and_every_special_value(compiler: str, flags: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CXX", f"{compiler} {flags}")
    x = ca.SX.sym("x", 3)  # which operation, and its operands
    known = UNARY | BINARY
    results = [
        getattr(ca.SX, "unary" if n == 1 else "binary")(known[name], *ca.vertsplit(x)[1 : n + 1])
        for name, n in OPERATIONS
    ]
    selection = sum(ca.if_else(x[0] == k, result, 0) for k, result in enumerate(results))
    function = ca.Function("operations", [x], [selection])
    candidates = np.array([(k, a, b) for k in range(len(OPERATIONS)) for a, b in product(SPECIAL, SPECIAL)])
    with_vm, natively = virtual_machine(Program.of(function)), PopulationFunction(function, EvaluationOptions("native"))
    one_by_one, at_once = (np.empty(len(candidates)) for _ in range(2))
    for k in range(len(candidates)):
        with_vm(candidates[k : k + 1], one_by_one[k : k + 1])
    with_vm(candidates, at_once)
    in_lanes = natively.of_any(candidates)
    for other in (at_once, in_lanes):
        wrong = ~((one_by_one == other) | (np.isnan(one_by_one) & np.isnan(other)))
        assert not wrong.any(), [(OPERATIONS[int(k)][0], a, b) for k, a, b in candidates[wrong]]
    angles = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2"}
    exact = np.array([float(function(row)) for row in candidates])
    plain = np.array([OPERATIONS[int(k)][0] not in angles for k in candidates[:, 0]])
    assert np.array_equal(one_by_one[plain], exact[plain], equal_nan=True)


@needs_compiler
def test_logic_reads_numbers_and_numbers_read_logic() -> None:
    x = ca.SX.sym("x", 2)
    both, either = ca.logic_and(x[0], x[1] > 0), ca.logic_or(x[0] > 1, ca.logic_not(x[1]))
    function = ca.Function(
        "logic", [x], [both + 2 * either + 4 * (x[0] < x[1]) * ca.if_else(both, x[0], 0.5) + (x[0] == 1)]
    )
    candidates = np.array(list(product([0.0, 1.0, 2.0, -1.0, math.nan], repeat=2)))
    assert same_bits(
        PopulationFunction(function, EvaluationOptions("native")).of_any(candidates),
        np.array([float(function(row)) for row in candidates]),
    )


@needs_compiler
@pytest.mark.parametrize("expression", [lambda x: ca.SX(1.5), lambda x: x[1], lambda x: ca.SX(1, 1)])
def test_costs_without_operations(expression: object) -> None:
    x = ca.SX.sym("x", 2)
    function = ca.Function("plain", [x], [expression(x)])  # type: ignore[operator]
    candidates = points(SETTINGS.batch_after + SETTINGS.batch_size, 2)
    expected = [float(function(row)) for row in candidates]
    for backend in ("vm", "native"):
        evaluate = PopulationFunction(function, EvaluationOptions(backend))
        evaluate(candidates)
        assert (evaluate(candidates) == expected).all()


@given(st.floats(-1e5, 1e5))
def test_sine_and_cosine(x: float) -> None:
    sine, cosine = sine_cosine(ca.DM(x))
    assert abs(float(sine) - math.sin(x)) < 1e-15
    assert abs(float(cosine) - math.cos(x)) < 1e-15


LENGTH = st.one_of(st.just(0.0), st.floats(1e-150, 1e150), st.floats(-1e150, -1e-150))


@given(LENGTH, LENGTH)
def test_angle_of_a_vector(y: float, x: float) -> None:
    assert abs(float(angle(ca.DM(y), ca.DM(x))) - math.atan2(y, x)) < 1e-15


@pytest.mark.parametrize("name", ["acos", "asin", "atan", "tan"])
def test_inverse_functions(name: str) -> None:
    x = ca.SX.sym("x")
    ours, exact = portable(ca.Function("f", [x], [getattr(ca, name)(x)])), getattr(math, name)
    for a in [-1.0, 0.0, 1.0, *np.random.default_rng(1).uniform(-1.0, 1.0, 200)]:
        assert abs(float(ours(a)) - exact(a)) < 2e-15


@needs_compiler
def test_neither_threads_nor_another_process_change_anything() -> None:
    candidates, alone = points(5_000), PopulationFunction(small(), EvaluationOptions("native"))
    threads = PopulationFunction(small(), EvaluationOptions("native", threads=3))
    assert same_bits(threads(candidates), alone(candidates))
    assert same_bits(pickle.loads(pickle.dumps(alone))(candidates), alone(candidates))
    assert alone(points(0)).shape == (0,)


def test_what_cannot_be_read_is_refused() -> None:
    x = ca.MX.sym("x", 2)
    with pytest.raises(UnsupportedOperation, match="not written out in scalars"):
        PopulationFunction(ca.Function("matrix", [x], [ca.sumsqr(x)]))(np.zeros((1, 2)))


# From one backend to the next


@needs_compiler
@pytest.mark.process
def test_a_search_changes_over_and_finds_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(population, "processors", lambda: 2)
    monkeypatch.setattr(population, "WORTH_COMPILING_SECONDS", 0.0)
    monkeypatch.setattr(population, "COMPILE_AFTER_SECONDS", 0.0)
    box = SearchBox(np.full(3, -3.0), np.full(3, 3.0))
    auto = PopulationFunction(small(), EvaluationOptions("auto"))
    backends = []

    def watched(candidates: FloatArray) -> FloatArray:
        if len(backends) == 60:
            wait_until(lambda: auto._background is not None and auto._background.finished())
        backends.append(auto.backend)
        return auto(candidates)

    result = minimize(watched, box, BSO(population=20), Budget(20_000), 1)
    expected = minimize(
        PopulationFunction(small(), EvaluationOptions("vm")), box, BSO(population=20), Budget(20_000), 1
    )
    assert (backends[0], backends[-1]) == ("vm", "native")
    assert same_bits(result.history.cost, expected.history.cost)
    assert same_bits(result.x, expected.x)
    again = PopulationFunction(small(), EvaluationOptions("auto"))
    again(points())
    assert again.backend == "native"


@needs_compiler
@pytest.mark.process
def test_after_a_search_the_next_one_finds_compiled_code(monkeypatch: pytest.MonkeyPatch, cache_folder: Path) -> None:
    monkeypatch.setattr(population, "processors", lambda: 2)
    monkeypatch.setattr(population, "WORTH_COMPILING_SECONDS", 0.0)
    first = PopulationFunction(small(), EvaluationOptions("auto"))
    first(points())
    assert first.backend == "vm"
    assert not [*cache_folder.glob("*.so")]
    del first
    wait_until(lambda: find_library(name_of(source_of(small()))) is not None)
    second = PopulationFunction(small(), EvaluationOptions("auto"))
    second(points())
    assert second.backend == "native"


@pytest.mark.parametrize("reason", ["one processor", "little work", "read-only cache"])
def test_auto_does_not_compile_in_vain(reason: str, monkeypatch: pytest.MonkeyPatch, cache_folder: Path) -> None:
    monkeypatch.setattr(population, "processors", lambda: 1 if reason == "one processor" else 2)
    monkeypatch.setattr(cache, "writable", lambda: reason != "read-only cache")
    if reason != "little work":
        monkeypatch.setattr(population, "WORTH_COMPILING_SECONDS", 0.0)
        monkeypatch.setattr(population, "COMPILE_AFTER_SECONDS", 0.0)
    evaluate = PopulationFunction(small(), EvaluationOptions("auto"))
    for _ in range(3):
        evaluate(points())
    assert evaluate.backend == "vm"
    del evaluate
    assert not [*cache_folder.glob("*.so")]


def test_invalid_options(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InvalidEvaluation, match="0 threads"):
        EvaluationOptions("vm", 0)
    monkeypatch.setenv(population.VARIABLE, "gpu")
    with pytest.raises(InvalidEvaluation, match="'gpu' is none of auto, vm, native"):
        EvaluationOptions()
