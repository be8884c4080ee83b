"""Interpolations of the literature against SciPy, and what interval times cost."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

from benchmarks.through import published
from problems import Ellipse, InvalidProblem, Joints, Move, PlanarArm, Position
from problems.base import FloatArray
from problems.families.via_times import INTERPOLATIONS, INTERVAL_ENCODINGS, ViaTimesProblem, via_times
from solvers import IPOPT, LSHADE, Budget, Descent, SearchBox, StopReason, minimize

LIN = next(published())
LIN_BEST = 17.8360  # s, of Lin's cubic splines, by Nelder-Mead from 16 starts and by L-SHADE
RNG = np.random.default_rng(4)


def passing(postures: FloatArray, **changes: Any) -> Move:
    arm = PlanarArm((0.3,) * postures.shape[1], (1.5,) * postures.shape[1], (3.0,) * postures.shape[1])
    first, *vias, last = (Joints(tuple(posture)) for posture in postures.tolist())
    arm = replace(arm, max_jerk=(20.0,) * postures.shape[1])
    return Move(**({"robot": arm, "start": first, "goals": (last,), "vias": tuple(vias)} | changes))


def curve(name: str, postures: FloatArray, times: FloatArray) -> PPoly:
    problem = via_times(passing(postures), interpolation=name, formulation="paper")
    trajectory = problem.trajectory(times)
    return PPoly(trajectory.coefficients, trajectory.breakpoints)


@given(seed=st.integers(0, 10_000), name=st.sampled_from(sorted(INTERPOLATIONS)))
@settings(max_examples=15, deadline=None)
def test_postures_are_passed_smoothly_from_rest_to_rest(seed: int, name: str) -> None:
    rng, rule = np.random.default_rng(seed), INTERPOLATIONS[name]
    count = int(rng.integers(2, 7)) if rule.vias is None else rule.vias + 2
    postures = rng.uniform(-2.0, 2.0, (count, 3))
    times = rng.uniform(0.3, 2.0, rule.intervals(count))
    theta = curve(name, postures, times)
    knots = theta.x if len(theta.x) == count else np.delete(theta.x, [1, -2])
    np.testing.assert_allclose(theta(knots), postures, atol=1e-9)
    np.testing.assert_allclose(theta(theta.x[[0, -1]], 1), 0.0, atol=1e-7)
    np.testing.assert_allclose(theta(theta.x[[0, -1]], 2), 0.0, atol=1e-6)
    for order in (1, 2, 3, 4) if name == "b-spline" else (1, 2):
        size = np.abs(theta(theta.x, order)).max()
        sides = [theta(theta.x[1:-1] + side, order) for side in (-1e-10, 0.0)]
        np.testing.assert_allclose(*sides, atol=1e-6 * max(size, 1.0))


def test_cubic_and_quintic_splines_are_those_of_scipy() -> None:
    postures, times = RNG.uniform(-1.0, 1.0, (5, 2)), RNG.uniform(0.5, 1.5, 6)
    theta = curve("cubic", postures, times)
    own = CubicSpline(theta.x, theta(theta.x), bc_type="clamped")
    np.testing.assert_allclose(theta(np.linspace(0.0, theta.x[-1], 99)), own(np.linspace(0.0, theta.x[-1], 99)))
    np.testing.assert_allclose(own(theta.x[[0, -1]], 2), 0.0, atol=1e-9)  # which two virtual knots make room for
    theta = curve("b-spline", postures, times[:4])
    rest = [(1, np.zeros(2)), (2, np.zeros(2))]
    spline = make_interp_spline(theta.x, postures, 5, bc_type=(rest, rest))
    between = np.linspace(0.0, theta.x[-1], 99)
    np.testing.assert_allclose(theta(between), spline(between), atol=1e-10)


def test_3_5_3_by_hand_and_a_joint_that_turns_back_stands_still() -> None:
    postures = np.array([[0.0, 0.0], [1.0, 1.0], [3.0, 0.5], [4.0, 2.0]])
    theta = curve("3-5-3", postures, np.array([1.0, 2.0, 0.5]))
    np.testing.assert_allclose(theta(0.5), [0.125, 0.125])  # d tau^3
    np.testing.assert_allclose(theta(1.0, 1), [3.0, 3.0])
    np.testing.assert_allclose(theta(3.0, 2), [-24.0, -36.0])  # -6 d / h^2
    theta = curve("quintic", postures, np.ones(3))
    np.testing.assert_allclose(theta(1.0, 1), [1.5, 0.0])
    np.testing.assert_allclose(theta(1.0, 2), 0.0, atol=1e-12)


@pytest.mark.parametrize("name", INTERPOLATIONS)
def test_only_the_ratios_of_scaled_times_count_and_limits_just_hold(name: str) -> None:
    postures = np.array([[0.0, 0.0], [1.0, 1.0], [1.5, -0.5], [0.4, 0.2]])
    problem = via_times(passing(postures), interpolation=name, samples=300)
    x = np.mean(problem.bounds, axis=0)
    motion = problem.trajectory(x)
    np.testing.assert_allclose(problem.trajectory(1.7 * x).breakpoints, motion.breakpoints)
    assert problem.cost(x[None])[0] == pytest.approx(motion.duration)
    assert problem.criteria.safe_time_scale(motion) == pytest.approx(1.0, abs=2e-3)
    as_they_are = via_times(
        passing(postures), interpolation=name, formulation="paper", samples=300, interval_time=(0.1, 9.0)
    )
    slower, faster = (np.diff(motion.breakpoints) * factor for factor in (1.01, 0.98))
    costs = as_they_are.cost(np.array([slower, faster]))
    assert costs[0] == pytest.approx(slower.sum()) and costs[0] <= as_they_are.objective_upper_bound < costs[1]


def lin(interpolation: str = "cubic") -> ViaTimesProblem:
    arm = PlanarArm((0.2,) * 6, LIN.limits.speed, LIN.limits.acceleration, max_jerk=LIN.limits.jerk)
    return via_times(passing(LIN.postures, robot=arm), interpolation=interpolation)


@pytest.mark.slow
def test_lins_encoding_reaches_its_best_known_time_and_no_better() -> None:
    problem = lin()
    found = minimize(problem.cost, SearchBox(*problem.bounds), LSHADE(), Budget(6_000), 1)
    motion = problem.trajectory(found.x)
    assert LIN_BEST - 1e-4 < motion.duration < LIN_BEST + 2e-2
    assert all(verdict.satisfied for verdict in problem.criteria.verify(motion))
    assert [each.label for each in problem.criteria.milestones(motion)] == [f"knot {n}" for n in range(2, 10)]
    np.testing.assert_allclose(problem.quantities(found.x)["h"], np.diff(motion.breakpoints))


@pytest.mark.slow
def test_gradients_lead_any_interval_times_to_the_best_of_lins_encoding() -> None:
    program = lin().nlp()
    descent = Descent(program, IPOPT())
    for start in islice(program.starts(np.random.default_rng(4)), 3):
        found = descent(start)
        assert found.stop_reason is StopReason.CONVERGED
        assert program.trajectory(found.x).duration == pytest.approx(LIN_BEST, abs=1e-3)
        np.testing.assert_allclose(program.quantities(found.x)["h"].sum(), LIN_BEST, atol=1e-3)


def test_the_program_sees_what_the_search_sees() -> None:
    oval, postures = Ellipse((0.45, 0.35), (0.05, 0.05)), np.array([[0.0, 0.0], [1.0, 1.0], [1.5, -0.5], [0.4, 0.2]])
    problem = via_times(passing(postures, obstacles=(oval,)), "rotation", "b-spline", samples=30)
    program, x = problem.nlp(), np.mean(problem.bounds, axis=0)
    z = program.from_search(x)
    assert len(program.names) == z.size == program.bounds_near(z)[0].size
    np.testing.assert_allclose(program.trajectory(z).breakpoints, problem.trajectory(x).breakpoints, rtol=1e-2)
    np.testing.assert_allclose(program.from_trajectory(problem.trajectory(x)), z)
    value = ca.Function("f", [program.x], [program.f * program.objective_size])
    assert float(value(z)) == pytest.approx(
        problem.criteria.objective_value(problem.trajectory(x), np.zeros(1)), rel=0.02
    )
    assert {"clearance", "rotation forward"} <= {row.name for row in program.rows} - {"speed", "jerk"}
    both = ca.vertcat(program.f, program.g)
    slopes, values = (ca.Function("v", [program.x], [each]) for each in (ca.jacobian(both, program.x), both))
    way = np.random.default_rng(1).normal(size=z.size)
    numeric = (np.array(values(z + 1e-6 * way)) - np.array(values(z - 1e-6 * way))).ravel() / 2e-6
    exact = np.array(slopes(z)) @ way
    assert (np.abs(exact - numeric) <= 1e-4 * (1.0 + np.abs(exact))).mean() > 0.98  # a row may stand at a kink
    other = program.from_trajectory(problem.trajectory(x).part(0.0, 0.5))
    assert other.size == z.size and (other[:3] > 0.0).all()


def test_an_objective_that_chooses_the_duration_has_a_time_scale() -> None:
    postures = np.array([[0.0, 0.0], [1.0, 1.0], [0.4, 0.2]])
    task = passing(postures)
    assert via_times(task).variables[-1].name == "h_4"
    with pytest.raises(InvalidProblem, match="needs masses"):
        via_times(task, "energy")
    assert set(INTERVAL_ENCODINGS) == {"reduced", "paper"}


@pytest.mark.parametrize(
    ("changes", "options", "message"),
    [
        ({}, {"interpolation": "3-5-3"}, "interpolation.*'3-5-3' passes 2 vias, not 1"),
        ({}, {"interpolation": "cubc"}, "interpolation.*cubc"),
        ({}, {"formulation": "papr"}, "formulation"),
        ({"vias": (Position((0.3, 0.2)),)}, {}, "via.*needs joint values"),
        ({"vias": (Joints((1.0, 1.0), 0.1),)}, {}, "via.*needs joint values"),
        ({"goals": (Joints((0.0, 0.1)), Joints((0.2, 0.1)))}, {}, "goal.*has one"),
        ({"start_velocity": (0.1, 0.0)}, {}, "start_velocity.*from rest to rest"),
        ({"vias": (Joints((0.0, 0.0)),)}, {}, "via.*posture 2 is the same"),
        ({"goals": (Joints((1.0, 1.0)),)}, {}, "goal.*posture 3 is the same"),
    ],
)
def test_what_the_encoding_cannot_state_is_refused(
    changes: dict[str, Any], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InvalidProblem) as error:
        via_times(passing(np.array([[0.0, 0.0], [1.0, 1.0], [0.4, 0.2]]), **changes), **options)
    assert re.search(message, f"{error.value.field}: {error.value}")
