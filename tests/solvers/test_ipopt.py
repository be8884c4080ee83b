"""IPOPT on small programs whose solutions are known, and its driver."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np
import pytest

from solvers import IPOPT, Budget, Descent, Solution, StopReason, descend


@dataclass
class Toy:
    """Minimise f(x, y), rows g between bounds, variables between bounds."""

    f: Any
    g: Any
    x: Any
    rows: tuple[list[float], list[float]]
    bounds: tuple[list[float], list[float]] = field(default=([-np.inf] * 2, [np.inf] * 2))

    def row_bounds(self, margin: float | None = None) -> tuple[np.ndarray, np.ndarray]:
        lower, upper = (np.array(side, dtype=float) for side in self.rows)
        return lower + (margin or 0.0), upper

    def bounds_near(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array(self.bounds[0], dtype=float), np.array(self.bounds[1], dtype=float)


def toy(case: str) -> Toy:
    x = ca.SX.sym("x", 2)
    bowl = (x[0] - 2.0) ** 2 + (x[1] - 1.0) ** 2
    if case == "line":  # nearest point of x + y = 1 to (2, 1)
        return Toy(bowl, x[0] + x[1], x, ([1.0], [1.0]))
    if case == "corner":  # x <= 1 by a bound, y >= 1.5 by a row
        return Toy(bowl, x[1], x, ([1.5], [np.inf]), ([-np.inf, -np.inf], [1.0, np.inf]))
    if case == "infeasible":
        return Toy(bowl, ca.vertcat(x[0], x[0]), x, ([1.0, -np.inf], [np.inf, 0.0]))
    if case == "two valleys":
        return Toy((x[0] ** 2 - 1.0) ** 2 + 0.3 * x[0] + x[1] ** 2, x[1], x, ([-5.0], [5.0]))
    raise AssertionError(case)


def valley(solution: Solution) -> float:
    return solution.objective


def starts() -> Iterator[np.ndarray]:
    rng = np.random.default_rng(0)
    while True:
        yield rng.uniform(-2.0, 2.0, 2)


def test_equality_and_its_multiplier() -> None:
    result = Descent(toy("line"), IPOPT())(np.array([5.0, 5.0]))
    assert result.x == pytest.approx([1.0, 0.0], abs=1e-6)
    assert result.objective == pytest.approx(2.0)
    assert result.stop_reason is StopReason.CONVERGED
    assert result.row_multipliers == pytest.approx([2.0], abs=1e-6)  # grad f + lambda = 0 at (1, 0)
    assert all(value < 1e-6 for value in result.residuals.values())
    assert result.iterations > 0
    assert result.evaluations > 0


def test_signs_of_multipliers_at_bounds() -> None:
    result = Descent(toy("corner"), IPOPT())(np.array([0.0, 3.0]))
    assert result.x == pytest.approx([1.0, 1.5], abs=1e-5)
    assert result.bound_multipliers[0] == pytest.approx(2.0, abs=1e-4)  # at an upper bound: positive
    assert result.row_multipliers[0] == pytest.approx(-1.0, abs=1e-4)  # at a lower bound: negative
    assert result.residuals["stationarity"] < 1e-5


def test_margin_moves_the_rows() -> None:
    assert Descent(toy("corner"), IPOPT())(np.array([0.0, 3.0]), 0.25).x[1] == pytest.approx(1.75, abs=1e-5)


def test_statuses_are_mapped() -> None:
    assert Descent(toy("infeasible"), IPOPT())(np.zeros(2)).stop_reason is StopReason.FAILED
    cut_short = Descent(toy("two valleys"), IPOPT(max_iterations=1))(np.array([2.0, 2.0]))
    assert cut_short.stop_reason is StopReason.ITERATIONS
    late = Descent(toy("two valleys"), IPOPT())
    late.stop.deadline = 0.0
    assert late(np.array([2.0, 2.0])).stop_reason is StopReason.INTERRUPTED


def test_says_nothing_unless_asked(capfd: pytest.CaptureFixture[str]) -> None:
    Descent(toy("line"), IPOPT())(np.zeros(2))
    assert capfd.readouterr() == ("", "")
    Descent(toy("line"), IPOPT(print_level=5))(np.zeros(2))
    assert "iter" in capfd.readouterr().out


def test_many_starts_find_the_deeper_valley() -> None:
    descent = Descent(toy("two valleys"), IPOPT())
    result = descend(descent, descent.stop, starts(), valley, Budget(iterations=12), 0)
    assert result.x[0] < 0.0
    assert (result.iterations, result.stop_reason, result.seed) == (12, StopReason.ITERATIONS, 0)
    assert (np.diff(result.history.cost) <= 0.0).all()
    assert (result.history.best[-1] == result.x).all()
    assert result.solution.objective == result.cost


def test_starts_may_run_out() -> None:
    descent = Descent(toy("line"), IPOPT())
    few = [np.zeros(2), np.ones(2)]
    result = descend(descent, descent.stop, few, valley, Budget(iterations=5))
    assert (result.stop_reason, result.iterations) == (StopReason.EXHAUSTED, 2)
    with pytest.raises(ValueError, match="no start"):
        descend(descent, descent.stop, [], valley, Budget(iterations=5))


def test_settings_out_of_range() -> None:
    for bad in ({"tolerance": 0.0}, {"acceptable": -1.0}, {"max_iterations": 0}, {"print_level": 13}):
        with pytest.raises(ValueError, match=r"tolerances|max_iterations|print_level"):
            IPOPT(**bad)
