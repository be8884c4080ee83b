"""Statements for all inputs or all t: interval arithmetic, Bernstein bounds, proofs over cells of time."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from problems import CertificateStatus, Constraint, Limit, PlanarArm, Trajectory
from problems.base import Matrix, as_array, bernstein, unproven_part
from problems.certify import limit_verdicts
from problems.certify.cells import prove_by_cells
from problems.certify.structure import bounds
from problems.families.two_segments import Quantities
from problems.motions import Samples

X = ca.SX.sym("x", 2)
EXPRESSIONS = {
    "arithmetic": (X[0] - 2.0 * X[1]) * X[0] + 3.0,
    "quotient": X[0] / (X[1] + 4.0) - 1.0 / (X[0] + 5.0),
    "powers": X[0] ** 2 + X[1] ** 3 - X[0] ** 4,
    "circles": ca.sin(X[0] * 3.0) * ca.cos(X[1]) + ca.cos(2.0 * X[0]),
    "roots": ca.sqrt(X[0] ** 2 + 1.0) + ca.log(X[1] ** 2 + 0.5) + ca.exp(X[0]),
    "inverse": ca.acos(X[0] / 4.0) + ca.atan2(X[1], X[0]) + ca.atan(X[0]) + ca.asin(X[1] / 9.0),
    "kinks": ca.fabs(X[0]) + ca.fmax(X[0], X[1]) - ca.fmin(0.5, X[1]) + ca.ceil(X[0]) + ca.sign(X[1]) + ca.floor(X[1]),
    "branches": ca.if_else(X[0] < X[1], X[0], -X[1]) + ca.logic_and(X[0] <= 1.0, ca.logic_not(X[1] < 0.0)),
}
corner = st.floats(-3.0, 3.0)


@pytest.mark.parametrize("expression", EXPRESSIONS.values(), ids=EXPRESSIONS)
@settings(max_examples=20, deadline=None)
@given(st.tuples(corner, corner), st.tuples(corner, corner), st.integers(0, 1000))
def test_values_stay_in_their_interval(
    expression: ca.SX, first: tuple[float, float], second: tuple[float, float], seed: int
) -> None:
    lower, upper = np.minimum(first, second), np.maximum(first, second)
    function = ca.Function("f", [X], [expression])
    least, most = bounds(function, lower, upper)
    for x in np.random.default_rng(seed).uniform(lower, upper, (30, 2)):
        value = float(function(x))
        assert least[0] - 1e-9 <= value <= most[0] + 1e-9


@pytest.mark.parametrize("x", [(-2.0, -1.0), (-1.0, 1.0), (1.0, 2.0)])
@pytest.mark.parametrize("y", [(1.0, 2.0), (-2.0, -1.0)])
def test_an_angle_is_sharp_wherever_it_does_not_jump(x: tuple[float, float], y: tuple[float, float]) -> None:
    least, most = bounds(ca.Function("f", [X], [ca.atan2(X[1], X[0])]), *np.array([x, y]).T)
    corners = np.arctan2(*np.array(list(itertools.product(y, x))).T)
    np.testing.assert_allclose([least[0], most[0]], [corners.min(), corners.max()], atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 5))
def test_bernstein_bounds_decide_as_dense_samples_do(seed: int, degree: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(np.append(0.0, rng.uniform(0.2, 1.0, 3)))
    curve = PPoly(rng.normal(size=(degree + 1, 3, 2)), times)
    control = bernstein(curve.c, np.diff(times))
    t = np.concatenate([np.linspace(a, b, 5001)[:-1] for a, b in itertools.pairwise(times)])
    dense = np.concatenate([curve(t), curve(np.nextafter(times[1:], 0.0))])
    low, high = dense.min(axis=0), dense.max(axis=0)
    assert (control.min(axis=(0, 1)) <= low + 1e-9).all()
    assert (control.max(axis=(0, 1)) >= high - 1e-9).all()
    assert unproven_part(control, low - 1e-4, high + 1e-4) is None
    for lower, upper in ((low + 1e-6, high + 1.0), (low - 1.0, high - 1e-6)):
        part = unproven_part(control, lower, upper)
        assert part is not None and 0.0 <= part.start < part.end <= 1.0
        local = np.linspace(part.start, part.end, 5001) * np.diff(times)[part.piece]
        values = np.stack([np.polyval(curve.c[:, part.piece, joint], local) for joint in (0, 1)], axis=1)
        assert ((values < lower + 1e-9) | (values > upper - 1e-9)).any()


CERTIFIED, VIOLATED, UNDECIDED = CertificateStatus
CHECK_SAMPLES = 20_000
SEEN = 1e-6  # of the largest value: equally spaced times may miss so much of it
ARM = equal_links(2)


@dataclass(frozen=True)
class Toy(Limit):
    """``|formula| <= bound``, in whatever a sample has."""

    name: ClassVar[str] = "toy"

    robot: PlanarArm
    formula: Callable[[Samples], Matrix]
    bound: float

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        bound = ca.DM(self.bound)
        stated: dict[str, Any] = {"name": self.name, "unit": "1", "columns": ("toy",), "symmetric": True}
        return [Constraint(expression=self.formula(samples), lower=-bound, upper=bound, **stated)]


FORMULAS: dict[str, Callable[[Samples], Any]] = {
    "sum of angles": lambda s: s.theta[:, 0] + s.theta[:, 1],
    "speed of the wrist": lambda s: s.speed[:, 0] * ca.cos(s.theta[:, 1]),
    "product of speeds": lambda s: s.speed[:, 0] * s.speed[:, 1] / 10.0,
    "a torque": lambda s: (2.0 + ca.cos(s.theta[:, 1])) * s.acceleration[:, 0] / 10.0 - s.speed[:, 1] ** 2 / 10.0,
    "jerk": lambda s: s.derivatives[3][:, 0] / 100.0 + s.theta[:, 1],
    "tool": lambda s: s.tool[:, 0] * s.tool[:, 1],
    "per duration": lambda s: s.theta[:, 0] / s.duration,
}
number = st.floats(-2.0, 2.0)


def motion_of(numbers: list[float], t1: float = 0.8, t2: float = 1.1) -> Trajectory:
    """A two-segment motion of two joints."""
    parts = [ca.DM(numbers[i : i + 2]).T for i in range(0, 8, 2)]
    return Quantities(*parts, ca.DM(t1), ca.DM(t2)).trajectory()


def densest(formula: Callable[[Samples], Any], trajectory: Trajectory, count: int = CHECK_SAMPLES) -> float:
    """The largest absolute value at equally spaced times, and just before the pieces join."""
    times = np.linspace(0.0, trajectory.duration, count)
    times = np.unique(np.concatenate([times, trajectory.breakpoints, np.nextafter(trajectory.breakpoints[1:-1], 0.0)]))
    return float(np.abs(as_array(formula(trajectory.samples(times, ARM)))).max())


@settings(max_examples=10, deadline=None)
@given(st.sampled_from(list(FORMULAS.values())), st.lists(number, min_size=8, max_size=8), st.floats(-0.5, 0.5))
def test_a_certificate_is_never_false(formula: Callable[[Samples], Any], numbers: list[float], room: float) -> None:
    trajectory = motion_of(numbers)
    largest = densest(formula, trajectory)
    if largest < 1e-3:
        return
    bound = largest * (1.0 + room)
    [verdict] = prove_by_cells(Toy(ARM, formula, bound), trajectory)
    assert (verdict.name, verdict.unit) == ("toy", "1")
    if largest > bound + 1e-9:
        assert verdict.status is not CERTIFIED
    elif largest < (1.0 - SEEN) * bound:
        assert verdict.status is not VIOLATED
        assert abs(verdict.worst) <= bound + 1e-9
    if verdict.status is VIOLATED:
        assert abs(verdict.worst) > bound
        assert verdict.excess == pytest.approx(abs(verdict.worst) - bound)


def test_a_bound_that_is_touched_by_what_may_jump_stays_undecided() -> None:
    """Two angles turn in opposite directions where their sum is largest: no cell there is ever narrow enough."""
    trajectory = motion_of([0.0, 0.0, 1.0, 0.5, 3.0, -2.0, 0.5, -1.0])
    smooth = FORMULAS["sum of angles"]
    largest = densest(smooth, trajectory, 200_001)
    assert prove_by_cells(Toy(ARM, smooth, largest), trajectory)[0].status is not VIOLATED

    def guarded(samples: Samples) -> Any:
        return ca.if_else(samples.theta[:, 0] > -9.0, smooth(samples), 0.0)

    [verdict] = prove_by_cells(Toy(ARM, guarded, largest), trajectory)
    assert verdict.status is UNDECIDED
    assert not verdict.satisfied
    assert verdict.excess == 0.0
    assert verdict.cell is not None
    start, end = verdict.cell
    assert 0.0 < end - start < 1e-3
    assert verdict.time is not None and abs(verdict.time - start) < 0.05  # near where the bound is touched
    assert verdict.where.endswith(f"; undecided from t = {start:.6g} s on for {end - start:.2g} s")


def test_limits_without_a_proof_of_their_own_are_proven_by_cells_and_a_violation_is_named_with_its_time() -> None:
    trajectory = motion_of([0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 2.0, 0.75])
    loose, tight = (Toy(ARM, FORMULAS["sum of angles"], bound) for bound in (4.0, 2.0))
    kept, verdict = limit_verdicts([loose, tight], trajectory)
    assert (kept.status, verdict.status) == (CERTIFIED, VIOLATED)
    assert (verdict.worst, verdict.bound) == (pytest.approx(2.75), 2.0)
    assert verdict.where == f"toy, t = {trajectory.duration:.4g} s"
