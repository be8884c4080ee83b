"""Ellipses: distances of segments, gradients, the outline; clearance guarded between samples and proven for all t."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.slow import slow_except
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.outlines import to_segment

from problems import Ellipse, PlanarArm, Trajectory
from problems.base import as_array
from problems.certify import prove_clearance
from problems.limits import Clearance, StepLimit, reachable_pairs
from problems.motions import Samples

LEAST_SHARE = {1.0: 0.9999, 5.0 / 3.0: 0.96, 3.0: 0.89, 10.0: 0.78}  # of the distance, by the ratio of the semi-axes


def segments(ellipse: Ellipse, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    phase = rng.uniform(0.0, 2.0 * np.pi, count)
    start = np.column_stack([np.cos(phase), np.sin(phase)]) * ellipse.semi_axes * rng.uniform(0.8, 2.5, (count, 1))
    turn = np.array([[np.cos(ellipse.angle), np.sin(ellipse.angle)], [-np.sin(ellipse.angle), np.cos(ellipse.angle)]])
    start = ellipse.center + start @ turn
    return start, start + rng.normal(size=(count, 2)) * rng.choice([0.0, 0.3, 2.0], (count, 1))


@pytest.mark.parametrize(("ratio", "share"), slow_except(LEAST_SHARE.items(), 1))
def test_the_bound_is_below_the_distance_by_no_more_than_is_said(ratio: float, share: float) -> None:
    ellipse = Ellipse((0.3, -0.2), (1.0, 1.0 / ratio), 0.6)
    start, end = segments(ellipse, 120, 1)
    clearance, bound = (
        as_array(measure(ca.DM(start), ca.DM(end))).ravel()
        for measure in (ellipse.segment_clearance, ellipse.segment_distance)
    )
    assert ((bound > 0.0) == (clearance > 0.0)).all()
    assert (bound[clearance <= 0.0] == clearance[clearance <= 0.0]).all()
    boundary = ellipse.outline(6000)
    for row in np.flatnonzero(clearance > 0.01):
        distance = to_segment(boundary, start[row], end[row]).min()
        assert clearance[row] - 1e-9 <= bound[row] <= distance
        assert bound[row] >= share * (distance - 1e-5)
        assert ellipse.distance_of(tuple(start[row]), tuple(end[row])) == pytest.approx(distance, abs=2e-5)


def test_by_hand_a_circle_is_exact_and_what_enters_is_not_positive() -> None:
    disc = Ellipse((0.0, 0.0), (0.5, 0.5))
    for start, end, expected in (
        ((-2.0, 1.0), (2.0, 1.0), 0.5),
        ((1.0, 1.0), (3.0, 1.0), np.sqrt(2.0) - 0.5),
        ((0.0, 2.0), (0.0, 2.0), 1.5),
        ((-1.0, 0.0), (1.0, 0.0), -0.5),
        ((0.0, 0.0), (0.0, 0.0), -0.5),
    ):
        assert float(disc.segment_distance(ca.DM([start]), ca.DM([end]))) == pytest.approx(expected, abs=1e-12)
        assert clearance_of(disc, start, end) == pytest.approx(expected, abs=1e-12)
        assert disc.distance_of(start, end) == pytest.approx(expected, abs=1e-6)
    oval = Ellipse((0.0, 0.0), (0.5, 1.0))
    assert clearance_of(oval, (-3.0, 2.0), (3.0, 2.0)) == pytest.approx(0.5)  # 1 in truth: a lower bound
    assert disc.contains((0.5, 0.0))
    assert not disc.contains((0.5, 1e-6))


def test_gradients_are_finite_everywhere() -> None:
    ends = ca.SX.sym("ends", 2, 2)
    oval = Ellipse((0.0, 0.0), (0.5, 1.0))
    for measure in (oval.segment_clearance, oval.segment_distance):
        value = oval.smooth(measure(ends[0, :], ends[1, :]))
        slopes = ca.Function("d", [ends], [ca.gradient(value, ca.vec(ends)), ca.hessian(value, ca.vec(ends))[0]])
        for corners in ([[0, 0], [0, 0]], [[0, 0], [1, 0]], [[-1, 0], [1, 0]], [[2, 1], [2, 1]], [[0.5, -3], [0.5, 3]]):
            assert all(np.isfinite(as_array(part)).all() for part in slopes(ca.DM(corners)))


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_the_outline_lies_on_the_ellipse_and_fills_its_box(angle: float) -> None:
    ellipse = Ellipse((0.8, -0.3), (0.15, 0.25), angle)
    outline = ellipse.outline(4000)
    assert outline.shape == (4000, 2)
    u, v = (as_array(part) for part in ellipse.to_unit_circle(ca.DM(outline)))
    np.testing.assert_allclose(u**2 + v**2, 1.0, atol=1e-12)
    lower, upper = ellipse.bounding_box()
    np.testing.assert_allclose(outline.min(axis=0), lower, atol=1e-5)
    np.testing.assert_allclose(outline.max(axis=0), upper, atol=1e-5)
    x, y = outline.T
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0.0  # counter-clockwise


coordinate = st.floats(-2.0, 2.0)
point = st.tuples(coordinate, coordinate)
ARM = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3)


def clearance_of(ellipse: Ellipse, start: tuple[float, float], end: tuple[float, float]) -> float:
    return float(ellipse.segment_clearance(ca.DM([start]), ca.DM([end])))


def clearance_limit(*obstacles: Ellipse) -> Clearance:
    return Clearance(ARM, reachable_pairs(ARM, obstacles))


@settings(max_examples=40, deadline=None)
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


def test_links_that_cannot_reach_are_left_out() -> None:
    far = Ellipse((1.6, 0.0), (0.1, 0.1))
    assert [str(pair) for pair in reachable_pairs(ARM, [far])] == ["link 3, obstacle 1"]
    assert reachable_pairs(ARM, [Ellipse((5.0, 0.0), (0.1, 0.1))]) == ()
    assert Clearance.for_robot(ARM, [Ellipse((5.0, 0.0), (0.1, 0.1))]) is None
    still = Trajectory(np.array([0.0, 1.0]), np.zeros((1, 1, 3)))
    assert prove_clearance(clearance_limit(Ellipse((9.0, 0.0), (1.0, 1.0))), still) is None  # nothing to prove


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
