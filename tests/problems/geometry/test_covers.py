"""Covers: every triangle is held, proven; a hole is found; how far they stick out; trees and texts of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import InvalidProblem
from problems.geometry import Balls, Cover, box_corners, cover_of, cylinder_corners, unheld
from problems.geometry.cover import QUANTUM, SETTINGS, new_cover_of

BOX = box_corners((0.06, 0.1, 0.16))
PIPE = cylinder_corners(0.03, 0.1)[: 2 * 64]  # without some of its ends: not watertight
SHEET = np.array([[[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.08, 0.0]]])
SLIVER = np.array([[[0.0, 0.0, 0.0], [0.3, 1e-7, 0.0], [0.15, 2e-7, 1e-9]]])
BODIES = {"box": BOX, "pipe": PIPE, "sheet": SHEET, "sliver": SLIVER}
OVERHANGS = (0.02, 0.004)


def points_on(corners: np.ndarray, count: int) -> np.ndarray:
    """Points all over triangles, with their corners."""
    rng = np.random.default_rng(3)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    which = corners[rng.choice(len(corners), count, p=areas / areas.sum())]
    shares = rng.dirichlet((1.0, 1.0, 1.0), count)
    return np.concatenate([np.einsum("nc,nci->ni", shares, which), corners.reshape(-1, 3)])


def depths(points: np.ndarray, balls: Balls) -> np.ndarray:
    """How deep points are in the ball that holds them best, one ball after the other."""
    best = np.full(len(points), -np.inf)
    for center, radius in zip(balls.centers, balls.radii, strict=True):
        np.maximum(best, radius - np.linalg.norm(points - center, axis=1), out=best)
    return best


def beyond_the_box(balls: Balls) -> np.ndarray:
    """Distances from the box, by a formula, of points all over balls that lie in no other."""
    directions = np.random.default_rng(0).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = (balls.centers[:, None] + balls.radii[:, None, None] * directions).reshape(-1, 3)
    points = points[depths(points, balls) < 1e-9]
    return np.asarray(np.linalg.norm(np.maximum(np.abs(points) - BOX.max(axis=(0, 1)), 0.0), axis=1))


@pytest.mark.parametrize("overhang", OVERHANGS)
@pytest.mark.parametrize("name", BODIES)
def test_every_point_of_a_surface_is_held_and_nothing_sticks_out(name: str, overhang: float) -> None:
    corners = BODIES[name]
    cover = cover_of(corners, overhang)
    assert depths(points_on(corners, 20_000), cover.balls).min() > 0.0
    assert not len(unheld(corners, cover.balls))
    assert cover.largest_overhang <= overhang + 1e-5  # beside what is missing of the pipe
    assert 0.0 < cover.usual_overhang <= cover.largest_overhang
    assert cover.volume_ratio > 1.0


def test_what_is_inside_counts_as_solid() -> None:
    """A fine cover of a box of sides of 6 cm and more fills it with large balls; it is hardly larger than the box."""
    cover = cover_of(BOX, 0.004)
    inside = np.random.default_rng(0).uniform(-0.5, 0.5, (5_000, 3)) * [0.06, 0.1, 0.16]
    assert (depths(inside, cover.balls) > 0.0).mean() > 0.99
    assert cover.volume_ratio < 1.25
    assert cover.balls.radii.max() > 0.03


def test_a_body_of_more_points_than_are_counted_for_each_ball_is_held() -> None:
    large = 1.5 * BOX
    cover = new_cover_of(large, 0.004)
    assert not len(unheld(large, cover.balls)) and len(cover.balls) < 600
    assert cover.largest_overhang <= 0.004 + QUANTUM


def test_a_hole_of_a_hundredth_of_a_millimetre_is_found() -> None:
    """Two balls that meet on a segment, then not any more."""
    line = np.array([[[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 1e-9, 0.0]]])
    centers = np.array([[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]])
    assert not len(unheld(line, Balls(centers, np.array([0.0501, 0.0501]))))
    bare = unheld(line, Balls(centers, np.array([0.0501, 0.04989])))
    assert len(bare) and np.abs(bare[:, 0]).max() < 0.1002


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_random_triangles_are_held_exactly_when_their_points_are(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-0.1, 0.1, (rng.integers(1, 6), 3, 3))
    balls = Balls(rng.uniform(-0.1, 0.1, (8, 3)), rng.uniform(0.05, 0.15, 8))
    deepest, bare = depths(points_on(corners, 2_000), balls).min(), unheld(corners, balls)
    assert len(bare) if deepest < -1e-4 else not (len(bare) and deepest > 1e-3)
    assert (depths(bare, balls) < 1e-4).all()


def test_overlaps_of_balls_are_those_of_each_with_the_deepest() -> None:
    rng = np.random.default_rng(2)
    one, two = (Balls(rng.normal(size=(count, 3)), rng.uniform(0.0, 0.4, count)) for count in (40, 70))
    assert one.overlaps(two) == pytest.approx(depths(two.centers, one) + two.radii, rel=1e-14)
    assert (one.overlaps(one) >= 2.0 * one.radii).all()


def test_the_same_body_has_the_same_cover_and_a_stored_one_is_it() -> None:
    one, other = new_cover_of(PIPE, 0.01), cover_of(PIPE, 0.01)
    stored = Cover.from_text(one.text)
    for cover in (other, stored):
        np.testing.assert_array_equal(cover.balls.centers, one.balls.centers)
        np.testing.assert_array_equal(cover.balls.radii, one.balls.radii)
        figures = (cover.usual_overhang, cover.largest_overhang, cover.volume_ratio)
        assert figures == (one.usual_overhang, one.largest_overhang, one.volume_ratio)


@pytest.mark.parametrize("text", ["", "?", "AAAA", "A" * 200, "é"])
def test_what_is_no_stored_cover_is_refused(text: str) -> None:
    with pytest.raises(InvalidProblem, match="cover: it is none"):
        Cover.from_text(text)


def test_a_body_of_more_voxels_than_there_may_be_has_larger_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("problems.geometry.cover.SETTINGS", replace(SETTINGS, most_voxels=3_000))
    cover = new_cover_of(BOX, 0.006)
    assert not len(unheld(BOX, cover.balls))
    assert beyond_the_box(cover.balls).max() <= 0.006 + QUANTUM


def test_balls_reach_farther_where_more_are_needed_than_a_cover_may_have(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("problems.geometry.cover.SETTINGS", replace(SETTINGS, most_balls=50))
    cover = new_cover_of(BOX, 0.004)
    assert len(cover.balls) <= 50 and not len(unheld(BOX, cover.balls))
    assert 0.004 < cover.largest_overhang < 0.02


def test_a_body_far_from_its_origin_is_refused() -> None:
    with pytest.raises(InvalidProblem, match="mesh: it is more than 1000 m from the origin of its link"):
        cover_of(BOX + 1e4, 0.02)


def test_overhangs_are_distances_from_the_body() -> None:
    cover = new_cover_of(BOX, 0.004)
    away = beyond_the_box(cover.balls)
    assert away.max() == pytest.approx(cover.largest_overhang, abs=2e-4)
    assert np.quantile(away, 0.95) == pytest.approx(cover.usual_overhang, abs=3e-4)
