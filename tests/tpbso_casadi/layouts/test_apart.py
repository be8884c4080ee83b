"""Distances seen from above: by hand, and against dense points of the outlines."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems.base import FloatArray
from problems.robots import Transform, built_in
from problems.scene import Ball, Box
from tpbso_casadi.layouts.apart import Outline, distance_between, outline_of_base, outlines_named

HALF_TURN = (0.0, 0.0, 0.3826834323650898, 0.9238795325112867)  # 45 degrees about z


def box(x: float, y: float, size: float = 0.2, quaternion: tuple[float, ...] | None = None, name: str = "") -> Box:
    return Box(center=(x, y, 0.1), size=(size, size, 0.2), quaternion=quaternion, name=name)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("other", "distance"),
    [
        (box(0.5, 0.0), 0.3),
        (box(0.5, 0.6), 0.5),  # from corner to corner: 0.3 and 0.4
        (box(0.15, 0.0), -0.05),
        (box(0.0, 0.0), -0.2),
        (box(0.5, 0.0, quaternion=HALF_TURN), 0.4 - 0.1 * np.sqrt(2.0)),
        (Box(center=(0.5, 0.0, 5.0), size=(0.2, 0.2, 0.2)), 0.3),  # the height does not count
    ],
)
def test_distances_by_hand(other: Box, distance: float) -> None:
    assert Outline.of(box(0.0, 0.0)).distance(Outline.of(other)) == pytest.approx(distance)
    assert Outline.of(other).distance(Outline.of(box(0.0, 0.0))) == pytest.approx(distance)


def edge_points(outline: Outline, count: int = 80) -> FloatArray:
    corners = outline.corners
    shares = np.linspace(0.0, 1.0, count)[:, None]
    return np.concatenate([a + shares * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)])


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31))
def test_what_is_apart_is_as_far_as_its_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, other = (Outline.around(rng.normal(size=(rng.integers(3, 9), 2)) + shift) for shift in (0.0, [3.0, 1.0]))
    found = one.distance(other)
    points = np.linalg.norm(edge_points(one)[:, None] - edge_points(other), axis=2).min()
    assert found <= points + 1e-12
    if found > 0.0:
        assert found == pytest.approx(points, abs=0.05)


def test_lines_and_points_have_outlines() -> None:
    line = Outline.around(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 0.0]]))
    assert line.distance(Outline.around(np.array([[0.5, 0.3]]))) == pytest.approx(0.3)
    assert Outline.around(np.zeros((1, 2))).distance(Outline.around(np.array([[0.3, 0.4]]))) == pytest.approx(0.5)


def test_obstacles_are_named_by_themselves_or_by_their_frame() -> None:
    around = [
        ("bin", box(0.0, 0.0, name="left wall")),
        ("", box(1.0, 0.0, name="post")),
        ("", Ball(center=(2.0, 0.0, 0.0), radius=0.1, name="wall")),
    ]
    assert len(outlines_named("bin", around)) == 1
    assert len(outlines_named("*wall", around)) == 2
    assert outlines_named("nothing", around) == []
    assert distance_between(outlines_named("bin", around), outlines_named("post", around)) == pytest.approx(0.8)
    assert distance_between(outlines_named("bin", around), []) == np.inf


def test_the_outline_of_a_base_moves_with_it() -> None:
    arm = built_in("ur5e", None).arm()
    post = [Outline.of(box(0.6, 0.0))]
    here = outline_of_base(arm, Transform(np.eye(3).tolist(), (0.0, 0.0, 0.0)))  # type: ignore[arg-type]
    there = outline_of_base(arm, Transform(Rotation.from_euler("z", 0.7).as_matrix().tolist(), (-0.2, 0.0, 0.3)))  # type: ignore[arg-type]
    assert 0.35 < distance_between([here], post) < 0.45  # the base has a radius of about 0.1 m
    assert distance_between([there], post) - distance_between([here], post) == pytest.approx(0.2, abs=0.01)
