"""Programs: loops, windows, accumulators and stacks, against the plainest way to run them, with the same bits."""

from __future__ import annotations

import dataclasses
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin
from helpers.evaluation import needs_compiler, points, same_bits, source_of, virtual_machine
from helpers.programs import interpreted, sym, typical, with_stacks
from helpers.slow import slow_except
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.array_cost import array_cost
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, InvalidProgram, Loop, PopulationFunction, Program, Step, codegen
from problems.evaluation import batches as virtual_machine_module
from problems.evaluation.batches import SETTINGS
from problems.evaluation.codegen import cpp
from problems.evaluation.compiler import Compiler
from problems.evaluation.kernel import kernels
from problems.evaluation.program import RowFunction

pytestmark = pytest.mark.usefixtures("cache_folder")
SLOW = pytest.mark.slow
PROGRAMS = {"typical": typical, "stacks": with_stacks}
SPECIAL = [0.0, -0.0, 1.0, -2.5, 1e-310, 7e300, np.inf, -np.inf, np.nan]


def by_virtual_machine(program: Program, candidates: FloatArray) -> list[FloatArray]:
    """Costs one by one, and in batches."""
    machine = virtual_machine(program)
    alone, together = np.empty(len(candidates)), np.empty(len(candidates))
    for k in range(len(candidates)):
        machine(candidates[k : k + 1], alone[k : k + 1])
    machine._evaluations = SETTINGS.batch_after
    machine(candidates, together)
    assert machine._batch is not None
    return [alone, together]


def source(program: Program) -> str:
    return cpp(kernels(program), program.sizes)


# The same numbers, the same bits


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("limit", [0, 10**9], ids=["called", "unrolled"])
def test_virtual_machine_against_plain_calls(name: str, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_machine_module, "SETTINGS", dataclasses.replace(SETTINGS, unrolled_operations=limit))
    program = PROGRAMS[name]()
    candidates = points(SETTINGS.batch_size + 20, program.dimension)
    alone, together = by_virtual_machine(program, candidates)
    assert same_bits(alone, together)
    np.testing.assert_allclose(alone, interpreted(program, candidates), rtol=1e-12)
    inlined = program.inlined()
    assert (inlined.name_in(), inlined.name_out()) == (["x"], ["cost"])
    np.testing.assert_allclose(alone, [float(inlined(x)) for x in candidates], rtol=1e-12)


@needs_compiler
@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("block", [5, 1000])
def test_native_gives_the_bits_of_the_virtual_machine(name: str, block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codegen, "BLOCK_STATEMENTS", block)
    monkeypatch.setattr(codegen, "LEAST_STATEMENTS", 1 if block < 1000 else 48)
    program = PROGRAMS[name]()
    candidates = points(2000, program.dimension)
    costs = PopulationFunction(program, EvaluationOptions("native", threads=3))(candidates)
    assert same_bits(costs, PopulationFunction(program, EvaluationOptions("vm"))(candidates))


def with_values(program: Program) -> Program:
    """The same with two more numbers behind the cost."""
    *front, last = program.steps
    inputs = sym(**last.inputs)
    [cost] = last.function.call([*inputs.values()])
    values = ca.vertcat(cost, -2.0 * cost, ca.fabs(cost))
    return Program(steps=(*front, Step.of("finish", inputs, {"cost": values})), parameters=program.parameters)


@needs_compiler
@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("limit", [0, 10**9], ids=["called", "unrolled"])
def test_several_values_of_one_candidate(name: str, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_machine_module, "SETTINGS", dataclasses.replace(SETTINGS, unrolled_operations=limit))
    program = PROGRAMS[name]()
    candidates = points(2000, program.dimension)
    costs = PopulationFunction(program, EvaluationOptions("vm"))(candidates)
    expected = np.column_stack([costs, -2.0 * costs, np.abs(costs)])
    for backend, rows in product(("vm", "native"), (0, 1, 20, 2000)):
        found = PopulationFunction(with_values(program), EvaluationOptions(backend, threads=3))(candidates[:rows])
        assert same_bits(found, expected[:rows])
    evaluate = PopulationFunction(with_values(program), EvaluationOptions("vm"))
    assert same_bits(np.concatenate([evaluate(part) for part in np.split(candidates, 20)]), expected)


@needs_compiler
@pytest.mark.parametrize("limit", [0, 10**9], ids=["called", "unrolled"])
def test_nothing_is_simplified_across_steps(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_machine_module, "SETTINGS", dataclasses.replace(SETTINGS, unrolled_operations=limit))
    inputs = sym(x=3)
    [x] = inputs.values()
    constants = {"zero": ca.SX(0), "one": ca.SX(1), "inverse": 1 / x[1], "same": x[1]}
    prepare = Step.of("prepare", inputs, constants)
    inputs = sym(zero=1, one=1, inverse=1, same=1, x=3, p=2, row=2)
    zero, one, inverse, same, x, p, row = inputs.values()
    a, b = x[1], x[2]
    terms = [zero + b, zero - b, one * b, zero * b, 1 / inverse, same - a, same / a, p[0] * a, p[1] * b, p[0] - b]
    terms += [row[0] * b, row[1] * a, row[0] + b, row[0] - a, row[0] / row[1], ca.sqrt(a * same)]
    loop = Loop(rows=np.array([[0.0, 1.0], [1.0, 0.0]]))
    compute = Step.of("compute", inputs, {"terms": ca.vertcat(*terms)}, loop, ["terms"])
    inputs = sym(x=3, terms=2 * len(terms))
    x, stack = inputs.values()
    selection = sum(ca.if_else(x[0] == k, stack[k], 0) for k in range(stack.numel()))
    finish = Step.of("finish", inputs, {"cost": ca.if_else(x[0] < 0, stack[0], selection)})
    program = Program(steps=(prepare, compute, finish), parameters=np.array([0.0, 1.0]))
    candidates = np.array(list(product(range(-1, 2 * len(terms)), SPECIAL, SPECIAL)))
    alone, together = by_virtual_machine(program, candidates)
    assert same_bits(alone[::5], interpreted(program, candidates[::5]))
    assert same_bits(alone, together)
    assert same_bits(alone, PopulationFunction(program, EvaluationOptions("native")).of_any(candidates))


UNARY = [ca.sin, ca.cos, ca.fabs, ca.floor, lambda a: a * a, lambda a: 1 / (a * a + 0.1), lambda a: -a]
BINARY = [lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, ca.fmin, ca.fmax, ca.atan2, lambda a, b: a < b]


@st.composite
def random_programs(draw: st.DrawFn) -> Program:
    """A loop of random operations over everything that it can read, in random order; all of them of small numbers."""
    inputs = sym(x=2, p=2, window=2, row=2, sums=2)
    values = [entry for symbol in inputs.values() for entry in ca.vertsplit(symbol)]
    for _ in range(draw(st.integers(2, 12))):
        a, b = (values[draw(st.integers(0, len(values) - 1))] for _ in range(2))
        unary = draw(st.booleans())
        operation: Any = draw(st.sampled_from(UNARY if unary else BINARY))
        result = operation(a) if unary else operation(a, b)
        values.append(ca.fmin(ca.fmax(result, -9.0), 9.0))
    x = ca.SX.sym("x", 2)
    first = Step.of("first", {"x": x}, {"sums": x[::-1], "vector": ca.vertcat(x, 1.0, x[0] * x[1])})
    starts = np.array(draw(st.lists(st.integers(0, 2), min_size=1, max_size=4)))
    rows = np.random.default_rng(0).normal(size=(starts.size, 2))
    loop = Loop(rows=rows, window="vector", starts=starts)
    second = Step.of("second", inputs, {"sums": ca.vertcat(*values[-2:]) + inputs["sums"]}, loop)
    third = Step.of("third", {"sums": inputs["sums"]}, {"cost": ca.sum1(inputs["sums"])})
    return Program(steps=(first, second, third), parameters=np.array([0.3, -0.7]))


@given(random_programs())
@settings(max_examples=10)
def test_random_programs(program: Program) -> None:
    candidates = points(SETTINGS.batch_size, 2)
    alone, together = by_virtual_machine(program, candidates)
    assert same_bits(alone, together)
    np.testing.assert_allclose(alone, interpreted(program, candidates), rtol=1e-9, atol=1e-9)


# What has to be compiled


@needs_compiler
def test_a_second_scene_compiles_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    sources, library = [], Compiler.library

    def counted(compiler: Compiler, source: str) -> bytes:
        sources.append(source)
        return library(compiler, source)

    monkeypatch.setattr(Compiler, "library", counted)
    for program in (typical(), typical(scale=2.0, seed=3), typical(samples=40)):
        evaluate = PopulationFunction(program, EvaluationOptions("native"))
        candidates = points(50, 4)
        np.testing.assert_allclose(evaluate(candidates), interpreted(program, candidates), rtol=1e-12)
        assert evaluate.backend == "native"
    assert len(sources) == 1


def test_what_follows_from_the_scene_is_not_computed_for_each_candidate() -> None:
    inputs = sym(x=1, p=2, row=1)
    x, p, row = inputs.values()
    outputs = {"cost": x * ca.exp(p[0] + p[1]) + ca.exp(row * p[0])}
    program = Program(
        steps=(Step.of("cost", inputs, outputs, Loop(rows=np.ones((2, 1)))),), parameters=np.array([1.0, 2.0])
    )
    [kernel] = kernels(program)
    names = [kernel.function.instruction_id(k) for k in range(kernel.function.n_instructions())]
    assert ca.OP_EXP not in names
    assert (kernel.function.size1_in("p"), kernel.function.size1_in("row")) == (1, 1)


# What does not fit


def program_of(inputs: dict[str, int], outputs: dict[str, Any], **options: Any) -> Program:
    """One step, and one that makes a cost of ``x``."""
    finish = Step.of("finish", {"x": ca.SX.sym("x", 2)}, {"cost": ca.SX(1)})
    first = Step.of("first", sym(**inputs), {name: ca.SX(value) for name, value in outputs.items()}, **options)
    return Program(steps=(first, finish), parameters=np.zeros(2))


LOOP = Loop(rows=np.zeros((2, 1)))
WINDOW = Loop(rows=np.zeros((2, 1)), window="x", starts=np.array([0, 1]))


NOT_FITTING: list[tuple[dict[str, int], dict[str, Any], dict[str, Any], str]] = [
    ({"x": 2, "y": 1}, {"a": 1}, {}, r"step 0 \(first\): input 'y' is none of x, p"),
    ({"x": 2, "row": 1}, {"a": 1}, {}, "input 'row' is none of"),
    ({"x": 2, "p": 3}, {"a": 1}, {}, r"input 'p' of shape 3.* where a dense \(2, 1\) is needed"),
    ({"x": 3}, {"a": 1}, {}, "step 1 .*input 'x'"),
    ({"x": 2}, {"p": 1}, {}, "output 'p' has the name of something that is only read"),
    ({"x": 2}, {"a": ca.SX(1, 2)}, {}, "output 'a' is no column"),
    ({"x": 2, "row": 2}, {"a": 1}, {"loop": LOOP}, "input 'row' of shape 2"),
    (
        {"x": 2, "window": 2},
        {"a": 1},
        {"loop": WINDOW},
        "starts from 0 to 1 where 0 to 0 keep a window of 2 within the 2",
    ),
    ({"x": 2}, {"a": 1}, {"stacked": ["a"]}, "a cannot be stacked"),
    ({"x": 2}, {"a": 1}, {"stacked": ["b"], "loop": LOOP}, "b cannot be stacked"),
]


def test_steps_and_loops_that_do_not_fit() -> None:
    for inputs, outputs, options, message in NOT_FITTING:
        with pytest.raises(InvalidProgram, match=message):
            program_of(inputs, outputs, **options)


def test_vectors_are_replaced_only_by_those_that_read_them() -> None:
    x, a = ca.SX.sym("x", 2), ca.SX.sym("a", 1)
    first, cost = Step.of("first", {"x": x}, {"a": x[0]}), Step.of("cost", {"a": a}, {"cost": a})
    for replace, message in [
        (Step.of("replace", {"x": x}, {"a": x[1]}), "'a' would replace a vector that is not its input"),
        (Step.of("replace", {"a": a}, {"a": ca.vertcat(a, a)}), "'a' has 2 entries, the vector it replaces 1"),
        (Step.of("replace", {"a": a}, {"a": a}, LOOP, ["a"]), "'a' would replace"),
    ]:
        with pytest.raises(InvalidProgram, match=message):
            Program(steps=(first, replace, cost))
    with pytest.raises(InvalidProgram, match="last step does not write what is called cost"):
        Program(steps=(first,))
    with pytest.raises(InvalidProgram, match="no step reads the candidate"):
        Program(steps=(Step.of("cost", {}, {"cost": ca.SX(1)}),))


def test_loops_without_rows_or_starts() -> None:
    rows, starts = np.zeros((2, 1)), np.zeros(2, int)
    arguments: tuple[tuple[dict[str, Any], str], ...] = (
        ({"rows": np.zeros(3)}, r"rows of shape \(3,\)"),
        ({"rows": np.zeros((0, 3))}, r"rows of shape \(0, 3\)"),
        ({"rows": rows, "window": "x"}, "a window needs its starts"),
        ({"rows": rows, "starts": starts}, "starts need the name"),
        ({"rows": rows, "window": "x", "starts": np.zeros(3, int)}, r"starts of shape \(3,\) for 2 rows"),
    )
    for wrong, message in arguments:
        with pytest.raises(InvalidProgram, match=message):
            Loop(**wrong)


# What a condition alone asks for is jumped over where it holds for no candidate, and nothing else changes

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
@pytest.mark.parametrize(
    ("name", "block"),
    [
        pytest.param(
            name, block, marks=[] if block == (1000 if name in {"either", "condition shared"} else 7) else SLOW
        )
        for name, block in product(COSTS, (7, 1000))
    ],
)
def test_jumps_leave_the_bits_of_the_virtual_machine(name: str, block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codegen, "BLOCK_STATEMENTS", block)
    program = Program.of(ca.Function("cost", [X], [COSTS[name]]))
    candidates = points(300)
    candidates[:100, 0] = np.abs(candidates[:100, 0])  # batches in which the condition holds for all
    candidates[100:200, 0] = -np.abs(candidates[100:200, 0])  # or for none
    candidates[200:210] = np.nan
    native = PopulationFunction(program, EvaluationOptions("native"))
    costs, expected = native.of_any(candidates), np.empty(300)
    virtual_machine(program)(candidates, expected)
    assert native.backend == "native"
    assert same_bits(costs, expected)


def test_regions_are_found_and_little_work_is_done_in_any_case() -> None:
    little = ca.if_else(X[0] > 0.0, long(X[1], 3), 0.0)
    for name, jumps in (("one", 1), ("either", 2), ("nested", 1), ("one after the other", 2), ("little", 0)):
        cost = COSTS.get(name, little)
        assert source_of(ca.Function("cost", [X], [cost])).count("if (!any(") == jumps


# Populations: the same numbers as one by one, whatever the size and the layout in memory

WIDTH = 8
QUICK = {
    ("time-3", "paper"),
    ("obstacle-3", "reduced"),
    ("pentagram-rotation", "paper"),
    ("closed-curve-time", "reduced"),
}


def test_population_equals_a_loop() -> None:
    problem = builtin("time-3")
    lower, upper = problem.bounds
    size = SETTINGS.batch_size
    points = np.random.default_rng(0).uniform(lower, upper, (SETTINGS.batch_after + 2 * size + 3, lower.size))
    alone = np.array([problem.cost(x[None])[0] for x in points])
    inlined = problem.program.inlined()
    np.testing.assert_allclose(alone[:20], [float(inlined(x)) for x in points[:20]], rtol=1e-11)
    one_by_one = SETTINGS.most_unbatched
    for count in (0, 1, one_by_one, one_by_one + 1, size - 1, size, size + 1, len(points)):
        assert (problem.cost(points[:count]) == alone[:count]).all()
    assert (problem.cost(points[::-1]) == alone[::-1]).all()
    assert (problem.cost(np.asfortranarray(points)) == alone).all()


@pytest.mark.parametrize(("case", "formulation"), slow_except(product(BUILTIN, ("paper", "reduced")), QUICK))
def test_the_benchmark_compares_with_the_same_cost(case: str, formulation: str) -> None:
    problem = builtin(case, formulation)
    points = np.random.default_rng(0).uniform(*problem.bounds, (100, len(problem.variables)))
    np.testing.assert_allclose(array_cost(problem, np)(points), problem.cost(points), rtol=1e-8)


def test_wrong_shapes_are_refused() -> None:
    problem = builtin("time-2")
    for shape in ((3, 5), (6,), (1, 2, 6)):
        with pytest.raises(ValueError, match="is needed"):
            problem.cost(np.zeros(shape))


@pytest.mark.parametrize("case", ["time-2", "obstacle-3", "pentagram-time"])
def test_every_problem_names_its_variables_and_constraints(case: str) -> None:
    problem = builtin(case)
    lower, upper = problem.bounds
    assert len({variable.name for variable in problem.variables}) == lower.size
    assert (lower < upper).all()
    assert len({constraint.name for constraint in problem.model.constraints}) == len(problem.model.constraints)
    assert all(constraint.unit and constraint.equation for constraint in problem.model.constraints)
    assert all(len(constraint.columns) == constraint.expression.shape[1] for constraint in problem.model.constraints)


# Formulas for many rows at once


def formula() -> ca.Function:
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 2)
    return ca.Function(
        "f",
        [x, p],
        [ca.vertcat(ca.sqrt(ca.sumsqr(x)) - p[0], ca.if_else(x[0] > p[1], 2.0, x[2]), 7.0)],
        ["x", "p"],
        ["y"],
    )


@pytest.mark.parametrize("count", [0, 1, 2, WIDTH - 1, WIDTH, WIDTH + 1, 3 * WIDTH + 5])
def test_rows_are_computed_as_one_by_one(count: int) -> None:
    rng, function = np.random.default_rng(count), RowFunction(formula(), WIDTH)
    for _ in range(2):
        columns, numbers = rng.normal(size=(3, count)), rng.normal(size=2)
        expected = [np.array(formula()(column, numbers)).ravel() for column in columns.T]
        assert function(columns, numbers).T.tolist() == [row.tolist() for row in expected]


def test_results_of_an_earlier_call_stay_as_they_are() -> None:
    x = ca.SX.sym("x", 2)
    double = RowFunction(ca.Function("double", [x], [2.0 * x]), WIDTH)
    first = double(np.ones((2, 3)))
    double(np.zeros((2, 3)))
    assert first.tolist() == np.full((2, 3), 2.0).tolist()


def test_thousands_of_constants_are_one_input(capfd: pytest.CaptureFixture[str]) -> None:
    x = ca.SX.sym("x")
    values = np.sqrt(np.arange(2.0, 10_102.0))
    formula = ca.Function("sums", [x], [sum(float(value) * x for value in values)])
    found = RowFunction(formula, 2)(np.array([[1.0, 2.0]]))
    np.testing.assert_allclose(found, [[values.sum(), 2.0 * values.sum()]])
    assert "max_io" not in "".join(capfd.readouterr())
