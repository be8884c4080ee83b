"""Programs: loops, windows, accumulators and stacks, against the plainest way to run them, with the same bits."""

from __future__ import annotations

import pickle
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.evaluation import needs_compiler, points, same_bits, virtual_machine
from helpers.programs import interpreted, sym, typical, with_stacks
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, InvalidProgram, Loop, PopulationFunction, Program, Step
from problems.evaluation import batches as virtual_machine_module
from problems.evaluation import codegen as regions_module
from problems.evaluation.batches import BATCH_AFTER_CANDIDATES, BATCH_SIZE
from problems.evaluation.codegen import cpp
from problems.evaluation.compiler import Compiler
from problems.evaluation.kernel import kernels

pytestmark = pytest.mark.usefixtures("cache_folder")
PROGRAMS = {"typical": typical, "stacks": with_stacks}
SPECIAL = [0.0, -0.0, 1.0, -2.5, 1e-310, 7e300, np.inf, -np.inf, np.nan]


def by_virtual_machine(program: Program, candidates: FloatArray) -> list[FloatArray]:
    """Costs one by one, and in batches."""
    machine = virtual_machine(program)
    alone, together = np.empty(len(candidates)), np.empty(len(candidates))
    for k in range(len(candidates)):
        machine(candidates[k : k + 1], alone[k : k + 1])
    machine._evaluations = BATCH_AFTER_CANDIDATES
    machine(candidates, together)
    assert machine._batch is not None
    return [alone, together]


def source(program: Program) -> str:
    return cpp(kernels(program), program.sizes)


# The same numbers, the same bits


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("limit", [0, 10**9], ids=["called", "unrolled"])
def test_virtual_machine_against_plain_calls(name: str, limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_machine_module, "UNROLLED_OPERATIONS", limit)
    program = PROGRAMS[name]()
    candidates = points(BATCH_SIZE + 20, program.dimension)
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
    monkeypatch.setattr(regions_module, "BLOCK_STATEMENTS", block)
    monkeypatch.setattr(regions_module, "LEAST_STATEMENTS", 1 if block < 1000 else 48)
    program = PROGRAMS[name]()
    candidates = points(2000, program.dimension)
    costs = PopulationFunction(program, EvaluationOptions("native", threads=3))(candidates)
    assert same_bits(costs, PopulationFunction(program, EvaluationOptions("vm"))(candidates))


@needs_compiler
@pytest.mark.parametrize("limit", [0, 10**9], ids=["called", "unrolled"])
def test_nothing_is_simplified_across_steps(limit: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(virtual_machine_module, "UNROLLED_OPERATIONS", limit)
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
    assert same_bits(alone, interpreted(program, candidates))
    assert same_bits(alone, together)
    assert same_bits(alone, PopulationFunction(program, EvaluationOptions("native"))(candidates))


UNARY = [
    ca.sin,
    ca.cos,
    ca.fabs,
    ca.floor,
    lambda a: a * a,
    lambda a: 1 / (a * a + 0.1),
    lambda a: -a,
    lambda a: ca.sqrt(ca.fabs(a)),
]
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
@settings(max_examples=60, deadline=None)
def test_random_programs(program: Program) -> None:
    candidates = points(BATCH_SIZE, 2)
    alone, together = by_virtual_machine(program, candidates)
    assert same_bits(alone, together)
    np.testing.assert_allclose(alone, interpreted(program, candidates), rtol=1e-9, atol=1e-9)


def test_a_program_travels_between_processes() -> None:
    program = typical()
    copy = pickle.loads(pickle.dumps(program))
    assert same_bits(PopulationFunction(copy)(points(20, 4)), PopulationFunction(program)(points(20, 4)))


# What has to be compiled


def test_the_source_depends_on_the_structure_alone() -> None:
    assert source(typical()) == source(typical(scale=3.0, seed=1)) == source(typical(samples=50))
    assert source(with_stacks(4)) != source(with_stacks(5))
    program = typical()
    assert source(program) != source(Program(steps=program.steps[::2], parameters=program.parameters))


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


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (({"x": 2, "y": 1}, {"a": 1}), r"step 0 \(first\): input 'y' is none of x, p"),
        (({"x": 2, "row": 1}, {"a": 1}), "input 'row' is none of"),
        (({"x": 2, "window": 1}, {"a": 1}), "input 'window' is none of"),
        (({"x": 2, "p": 3}, {"a": 1}), r"input 'p' of shape 3.* where a dense \(2, 1\) is needed"),
        (({"x": 3}, {"a": 1}), "step 1 .*input 'x'"),
        (({"x": 2}, {"p": 1}), "output 'p' has the name of something that is only read"),
        (({"x": 2}, {"x": 1}), "output 'x' has the name of something that is only read"),
        (({"x": 2}, {"a": ca.SX(1, 2)}), "output 'a' is no column"),
    ],
)
def test_steps_that_do_not_fit(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(InvalidProgram, match=message):
        program_of(*arguments)


@pytest.mark.parametrize(
    ("inputs", "options", "message"),
    [
        ({"x": 2, "row": 2}, {"loop": LOOP}, "input 'row' of shape 2"),
        ({"x": 2, "window": 2}, {"loop": WINDOW}, "starts from 0 to 1 where 0 to 0 keep a window of 2 within the 2"),
        ({"x": 2}, {"stacked": ["a"]}, "a cannot be stacked"),
        ({"x": 2}, {"stacked": ["b"], "loop": LOOP}, "b cannot be stacked"),
    ],
)
def test_loops_that_do_not_fit(inputs: dict[str, int], options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidProgram, match=message):
        program_of(inputs, {"a": 1}, **options)


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
    with pytest.raises(InvalidProgram, match="last step does not write a scalar called cost"):
        Program(steps=(first,))
    with pytest.raises(InvalidProgram, match="no step reads the candidate"):
        Program(steps=(Step.of("cost", {}, {"cost": ca.SX(1)}),))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"rows": np.zeros(3)}, r"rows of shape \(3,\)"),
        ({"rows": np.zeros((0, 3))}, r"rows of shape \(0, 3\)"),
        ({"rows": np.zeros((2, 1)), "window": "x"}, "a window needs its starts"),
        ({"rows": np.zeros((2, 1)), "starts": np.zeros(2, int)}, "starts need the name"),
        ({"rows": np.zeros((2, 1)), "window": "x", "starts": np.zeros(3, int)}, r"starts of shape \(3,\) for 2 rows"),
    ],
)
def test_loops_without_rows_or_starts(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidProgram, match=message):
        Loop(**arguments)
