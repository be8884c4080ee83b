"""Every point of a shape is in a ball, and no ball sticks out far."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.robots import Transform
from problems.robots.spheres import MOST_BALLS, Ball, cover_box, cover_cylinder, covered_capsule

SIZES = st.floats(0.001, 2.0)
POINTS = 2_000


def depth(balls: tuple[Ball, ...], points: np.ndarray) -> float:
    """How far the point that is held worst is from the nearest ball's surface, m; positive outside of all."""
    centers, radii = np.array([ball.center for ball in balls]), np.array([ball.radius for ball in balls])
    gaps = np.linalg.norm(points[:, None] - centers, axis=2) - radii
    return float(gaps.min(axis=1).max())


def directions(count: int) -> np.ndarray:
    vectors = np.random.default_rng(0).normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


@settings(deadline=None, max_examples=25)
@given(sizes=st.tuples(SIZES, SIZES, SIZES))
def test_boxes(sizes: tuple[float, float, float]) -> None:
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (POINTS, 3))
    points[: POINTS // 2] = np.sign(points[: POINTS // 2]) * 0.5  # the corners too
    balls = cover_box(sizes)
    assert depth(balls, points * sizes) <= 1e-12
    assert len(balls) <= MOST_BALLS


@settings(deadline=None, max_examples=25)
@given(radius=SIZES, length=SIZES)
def test_cylinders(radius: float, length: float) -> None:
    rng = np.random.default_rng(0)
    turn, height = rng.uniform(0.0, 2.0 * np.pi, POINTS), rng.choice([-0.5, 0.5, 0.1], POINTS)
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height * length])
    assert depth(cover_cylinder(radius, length), points) <= 1e-12


@settings(deadline=None, max_examples=25)
@given(radius=SIZES, end=st.tuples(SIZES, SIZES, SIZES))
def test_capsules(radius: float, end: tuple[float, float, float]) -> None:
    along = np.random.default_rng(1).uniform(0.0, 1.0, (POINTS, 1))
    points = along * np.array(end) + radius * directions(POINTS)
    assert depth(covered_capsule((0.0, 0.0, 0.0), end, radius), points) <= 1e-12


def test_usual_shapes_are_held_tightly() -> None:
    assert all(ball.radius < 1.11 * 0.05 for ball in cover_cylinder(0.05, 0.4))
    assert all(ball.radius < 1.11 * 0.05 for ball in covered_capsule((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), 0.05))
    assert len(covered_capsule((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.05)) == 1
    box = cover_box((0.1, 0.1, 0.2))
    reach = max(np.abs(np.array(ball.center)[2]) + ball.radius for ball in box)
    assert reach - 0.1 == pytest.approx(0.015, abs=0.01)


def test_balls_are_seen_from_another_frame() -> None:
    quarter = Transform(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (1.0, 0.0, 0.0))
    assert Ball((0.5, 0.0, 0.2), 0.1).seen_from(quarter) == Ball((1.0, 0.5, 0.2), 0.1)
