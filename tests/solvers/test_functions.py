"""Benchmark functions: values by hand, minima that nothing is below, shifted and rotated ones, names and errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import rosen

import tpbso_casadi as tp
from solvers.functions import BENCHMARK_FUNCTIONS, CLASSICAL, InvalidFunction, benchmark_function, schwefel

ONES, TWOS = np.ones(3), np.full(2, 2.0)
each_classical = pytest.mark.parametrize("family", CLASSICAL)


BY_HAND = [
    ("sphere-3", ONES, 3.0),
    ("ellipsoid-3", ONES, 1.0 + 1e3 + 1e6),
    ("bent-cigar-3", ONES, 1.0 + 2e6),
    ("rosenbrock-2", TWOS, 401.0),
    ("rastrigin-2", np.full(2, 0.5), 2 * (0.25 + 20.0)),
    ("ackley-2", ONES[:2], 20.0 - 20.0 * np.exp(-0.2)),
    ("griewank-1", np.array([np.pi]), np.pi**2 / 4000.0 + 2.0),
    ("schwefel-2", np.zeros(2), 2 * 418.9828872724338),
    ("levy-1", np.array([3.0]), np.sin(np.pi * 1.5) ** 2 + 0.25),
    ("zakharov-2", ONES[:2], 2.0 + 1.5**2 + 1.5**4),
    ("dixon-price-2", TWOS, 1.0 + 2 * 36.0),
    ("styblinski-tang-2", ONES[:2], -10.0),
    ("salomon-2", np.array([3.0, 4.0]), 0.5),
]


def test_values_by_hand() -> None:
    for name, x, value in BY_HAND:
        function = benchmark_function(name)
        assert function(x) == pytest.approx(value, rel=1e-12), name
        assert function(np.stack([x, x])) == pytest.approx([value, value], rel=1e-12), name


def test_rosenbrock_against_scipy() -> None:
    function = benchmark_function("rosenbrock-6")
    points = function.box.sample(np.random.default_rng(1), 50)
    assert function(points) == pytest.approx(rosen(points.T), rel=1e-12)


@each_classical
def test_no_point_is_below_the_minimum(family: str) -> None:
    for suffix in ("", "@1", "@77"):
        function = benchmark_function(f"{family}-4{suffix}")
        rng = np.random.default_rng(3)
        steps = rng.standard_normal((500, 4)) * 10.0 ** rng.uniform(-6, 0, (500, 1)) * function.box.span
        points = np.concatenate([function.box.sample(rng, 2000), function.box.clip(function.minimum + steps)])
        assert function(points).min() >= function.optimum
        assert (function.minimum >= function.box.lower).all()
        assert (function.minimum <= function.box.upper).all()


@each_classical
def test_an_instance_is_the_function_moved_and_rotated(family: str) -> None:
    published, first, again, other = (benchmark_function(f"{family}-5{of}") for of in ("", "@3", "@3", "@4"))
    assert first.optimum == pytest.approx(published.optimum, abs=1e-9)
    points = first.box.sample(np.random.default_rng(0), 9)
    assert (first(points) == again(points)).all()
    assert (first(points) != other(points)).all()
    assert (first.minimum != other.minimum).all()


@given(arrays(np.float64, 3, elements=st.floats(-4.0, 4.0)), st.integers(1, 10**6))
@settings(max_examples=25, deadline=None)
def test_a_sphere_stays_one(step: np.ndarray, instance: int) -> None:
    function = benchmark_function(f"sphere-3@{instance}")
    assert function(function.minimum + step) == pytest.approx(step @ step, abs=1e-10)


def test_schwefel_rises_outside_its_box() -> None:
    outside = np.array([[1e3, 420.9687462275036], [-2e4, 7e3]])
    assert (schwefel(outside) > schwefel(np.clip(outside, -500.0, 500.0))).all()


@pytest.mark.parametrize("number", [1, 15, 24])
def test_functions_of_coco(number: int) -> None:
    cocoex = pytest.importorskip("cocoex")
    function, first = benchmark_function(f"bbob-f{number}-3@2"), benchmark_function(f"bbob-f{number}-3")
    points = function.box.sample(np.random.default_rng(0), 200)
    theirs = cocoex.BareProblem("bbob", number, 3, 2)
    assert function(points).tolist() == [theirs(x) for x in points]
    assert function.optimum == theirs.best_value() <= function(points).min()
    assert first.optimum == cocoex.BareProblem("bbob", number, 3, 1).best_value() != function.optimum


def test_a_solver_alone_finds_a_shifted_minimum() -> None:
    function = tp.benchmark_function("rastrigin-3@5")
    result = tp.minimize(function, function.bounds, "abso", 6000, vectorized=True)
    assert result.x == pytest.approx(function.minimum, abs=1e-3)
    assert tp.minimize(function, function.bounds, "abso", 6000).x.tolist() == result.x.tolist()


def test_what_a_function_says() -> None:
    function = benchmark_function("styblinski-tang-2")
    assert repr(function) == "BenchmarkFunction('styblinski-tang-2', 2 variables, optimum=-78.3323)"
    assert function.bounds.tolist() == [[-5.0, 5.0], [-5.0, 5.0]]
    with pytest.raises(ValueError, match=r"styblinski-tang-2: x of shape \(3,\) where \(d,\) or \(m, d\) with d = 2"):
        function(np.zeros(3))


NO_NAMES = [
    ("rastrigin", "'rastrigin' is not FUNCTION-D or FUNCTION-D@N, such as rastrigin-10 or rastrigin-10@3"),
    ("rastrigin-0", "is not FUNCTION-D"),
    ("rastrigin-3@0", "is not FUNCTION-D"),
    ("rastrigin-3\n", "is not FUNCTION-D"),
    ("rastrign-3", "no benchmark function 'rastrign'; did you mean rastrigin?"),
    ("zzz-3", "no benchmark function 'zzz'; there are sphere, ellipsoid,"),
    ("rosenbrock-1", "rosenbrock-1: needs 2 variables or more"),
    ("sphere-1001", "sphere-1001: at most 1000 variables"),
    ("bbob-f25-3", "no benchmark function 'bbob-f25'; did you mean bbob-f5?"),
]


def test_names_that_are_none() -> None:
    for name, reason in NO_NAMES:
        with pytest.raises(InvalidFunction) as caught:
            benchmark_function(name)
        assert reason in str(caught.value)
        assert "\n" not in str(caught.value)


def test_coco_in_one_variable_or_without_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("cocoex")
    with pytest.raises(InvalidFunction, match="bbob-f1-1: needs 2 variables or more"):
        benchmark_function("bbob-f1-1")
    monkeypatch.setattr("solvers.functions.find_spec", lambda name: None)
    with pytest.raises(InvalidFunction, match=r"bbob-f1-3: needs .* pip install 'tpbso-casadi\[coco\]'"):
        benchmark_function("bbob-f1-3")


def test_every_function_is_listed() -> None:
    assert len(BENCHMARK_FUNCTIONS) == len(CLASSICAL) + 24
    assert tp.BENCHMARK_FUNCTIONS is BENCHMARK_FUNCTIONS
