"""Clearance from ellipses: exact for a posture, guarded between samples, proven for all t."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.cases import moving
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Ellipse, InvalidProblem, PlanarArm
from problems.base import FloatArray
from problems.certify import prove_clearance
from problems.limits import SAMPLING_MARGIN, Clearance, StepLimit, reachable_pairs
from problems.motions import Samples, Trajectory
from solvers import PSO, Box, Budget, minimize

coordinate = st.floats(-2.0, 2.0)
point = st.tuples(coordinate, coordinate)
ARM = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3)


def clearance_of(ellipse: Ellipse, start: tuple[float, float], end: tuple[float, float]) -> float:
    return float(ellipse.segment_clearance(ca.DM([start]), ca.DM([end])))


def clearance_limit(*obstacles: Ellipse) -> Clearance:
    return Clearance(ARM, reachable_pairs(ARM, obstacles))


def densest(limit: Clearance, trajectory: Trajectory, times: FloatArray) -> float:
    """The smallest clearance of any link at any of the times, m."""
    [constraint] = limit.constraints_at(trajectory.samples(times, ARM))
    return float(ca.mmin(constraint.expression))


@given(point, point, st.floats(0.1, 1.0), st.floats(0.1, 1.0), st.floats(-3.0, 3.0))
def test_sign_and_lower_bound_against_dense_points(
    start: tuple[float, float], end: tuple[float, float], wide: float, high: float, angle: float
) -> None:
    ellipse = Ellipse((0.3, -0.2), (wide, high), angle)
    clearance = clearance_of(ellipse, start, end)
    along = np.linspace(0.0, 1.0, 2001)[:, None]
    points = np.array(start) + along * (np.array(end) - np.array(start))
    turn = np.linspace(0.0, 2.0 * np.pi, 1000)
    turned = np.exp(1j * angle) * (wide * np.cos(turn) + 1j * high * np.sin(turn)) + (0.3 - 0.2j)
    inside = any(ellipse.contains(tuple(p)) for p in points[::20])
    if inside:
        assert clearance <= 0.0
    if clearance < -1e-3:
        local = (points @ [1.0, 1j] - (0.3 - 0.2j)) * np.exp(-1j * angle)
        assert ((local.real / wide) ** 2 + (local.imag / high) ** 2).min() < 1.0
    if clearance > 0.0:
        assert np.abs(points[::10] @ [[1.0], [1j]] - turned).min() >= clearance - 1e-9


def test_segments_hand_computed() -> None:
    disc, oval = Ellipse((0.0, 0.0), (0.5, 0.5)), Ellipse((0.0, 0.0), (0.5, 1.0))
    assert clearance_of(disc, (-2.0, 1.0), (2.0, 1.0)) == pytest.approx(0.5)
    assert clearance_of(disc, (1.0, 0.0), (2.0, 0.0)) == pytest.approx(0.5)
    assert clearance_of(disc, (-1.0, 0.0), (1.0, 0.0)) == pytest.approx(-0.5)
    assert clearance_of(disc, (1.5, 0.0), (1.5, 0.0)) == pytest.approx(1.0)
    assert clearance_of(oval, (-3.0, 2.0), (3.0, 2.0)) == pytest.approx(0.5)  # 1 in truth: a lower bound
    assert disc.contains((0.5, 0.0))
    assert not disc.contains((0.5, 1e-6))


def test_gradient_is_finite_everywhere() -> None:
    ends = ca.SX.sym("ends", 2, 2)
    disc = Ellipse((0.0, 0.0), (0.5, 0.5))
    log = disc.smooth(disc.segment_clearance(ends[0, :], ends[1, :]))
    derivatives = ca.Function("d", [ends], [ca.gradient(log, ca.vec(ends)), ca.hessian(log, ca.vec(ends))[0]])
    for xs, ys in (
        ((0.0, 0.0), (0.0, 0.0)),
        ((0.0, 1.0), (0.0, 0.0)),
        ((-1.0, 1.0), (0.0, 0.0)),
        ((2.0, 2.0), (1.0, 1.0)),
    ):
        assert all(np.isfinite(np.asarray(part)).all() for part in derivatives(ca.DM([xs, ys]).T))


@pytest.mark.parametrize(
    "bad",
    [{"semi_axes": (0.0, 1.0)}, {"semi_axes": (1.0, -1.0)}, {"center": (float("nan"), 0.0)}, {"angle": float("inf")}],
)
def test_impossible_ellipses(bad: dict[str, object]) -> None:
    with pytest.raises(InvalidProblem):
        Ellipse(**({"center": (0.0, 0.0), "semi_axes": (1.0, 1.0)} | bad))


def test_links_that_cannot_reach_are_left_out() -> None:
    far = Ellipse((1.6, 0.0), (0.1, 0.1))
    assert [str(pair) for pair in reachable_pairs(ARM, [far])] == ["link 3, obstacle 1"]
    assert reachable_pairs(ARM, [Ellipse((5.0, 0.0), (0.1, 0.1))]) == ()
    assert Clearance.for_robot(ARM, [Ellipse((5.0, 0.0), (0.1, 0.1))]) is None


def test_leaping_over_an_obstacle_between_two_samples_is_noticed() -> None:
    theta = ca.DM([[-0.4, 0.0, 0.0], [0.4, 0.0, 0.0]])
    samples = Samples(robot=ARM, derivatives=(theta, theta, theta), duration=ca.DM(1.0))
    at_the_tip, amid_the_links = Ellipse((1.85, 0.0), (0.05, 0.05)), Ellipse((1.2, 0.0), (0.05, 0.05))
    links, swept = clearance_limit(at_the_tip).constraints(samples)
    assert float(ca.mmin(links.expression)) > 0.0
    assert float(ca.mmin(swept.expression)) < 0.0
    links, swept = clearance_limit(amid_the_links).constraints(samples)
    assert float(ca.mmin(links.expression)) > 0.0
    assert float(ca.mmin(swept.expression)) > 0.0
    limit = StepLimit.for_robot(ARM, [amid_the_links])
    assert limit is not None
    [step] = limit.constraints(samples)
    assert bool(np.asarray(step.broken()).any())


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000), st.tuples(st.floats(0.2, 1.2), st.floats(0.3, 1.4)), st.floats(0.05, 0.3))
def test_proof_is_below_and_near_a_very_dense_sampling(seed: int, center: tuple[float, float], size: float) -> None:
    obstacle = Ellipse(center, (size, 0.5 * size), 0.4)
    problem = moving(ARM, (1.0, 0.0), (-0.5, 1.5), "length", "up")
    trajectory = problem.trajectory(Box(*problem.bounds).sample(np.random.default_rng(seed), 1)[0])
    limit = clearance_limit(obstacle)
    proof = prove_clearance(limit, trajectory)
    assert proof is not None
    dense = densest(limit, trajectory, np.linspace(0.0, trajectory.duration, 20_001))
    if dense < 0.0:
        assert proof.proven == -np.inf
        assert proof.smallest < 1e-6
    elif proof.proven >= 0.0:
        assert 0.8 * dense - 1e-6 <= proof.proven <= dense
    else:
        assert dense < 1e-6


def test_no_proof_is_needed_where_nothing_can_touch() -> None:
    problem = moving(ARM, (1.0, 0.0), (-0.5, 1.5))
    trajectory = problem.trajectory(Box(*problem.bounds).sample(np.random.default_rng(0), 1)[0])
    assert prove_clearance(clearance_limit(Ellipse((9.0, 0.0), (1.0, 1.0))), trajectory) is None


@pytest.mark.parametrize("center", [(0.8, 0.8), (0.85, 0.75)], ids=["beside", "in the way"])
def test_a_found_plan_is_clear_at_100_000_times(center: tuple[float, float]) -> None:
    obstacle = Ellipse(center, (0.15, 0.15))
    problem = moving(ARM, (1.0, 0.0), (0.5, 1.5), "length", "up", "reduced", obstacles=(obstacle,))
    result = minimize(problem.cost, Box(*problem.bounds), PSO(), Budget(10_000), 1)
    trajectory = problem.trajectory(result.x)
    verdicts = {verdict.name: verdict for verdict in problem.verify(trajectory)}
    assert verdicts["clearance"].satisfied
    dense = densest(clearance_limit(obstacle), trajectory, np.linspace(0.0, trajectory.duration, 100_000))
    assert dense >= verdicts["clearance"].worst >= 0.5 * SAMPLING_MARGIN * ARM.reach()[1]
