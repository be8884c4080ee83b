"""Convex hulls: distances against triangles looked at one by one, hulls with fewer faces, boxes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems import InvalidProblem
from problems.geometry import Hull, enclosing
from problems.geometry.hull import COARSENESS, ON_FACE

CUBE = np.array(list(product((0.0, 1.0), repeat=3)))


def to_triangles(hull: Hull, points: np.ndarray) -> np.ndarray:
    """Distances from the surface, by another library."""
    surface = trimesh.Trimesh(hull.corners, hull.triangles, process=False)
    assert surface.is_watertight and surface.volume > 0.0
    return np.asarray(trimesh.proximity.closest_point_naive(surface, points)[1])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(4, 40))
def test_distances_are_those_from_the_surface(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    hull, points = Hull.of(rng.normal(size=(count, 3))), 3.0 * rng.normal(size=(200, 3))
    found, outside = hull.distances(points), hull.beyond(points).max(axis=1) > 0.0
    expected = np.where(outside, 1.0, -1.0) * to_triangles(hull, points)
    np.testing.assert_allclose(found, expected, atol=2.0 * ON_FACE)
    assert (found <= expected + 1e-12).all()


def test_flat_points_have_no_hull() -> None:
    for points in (CUBE[CUBE[:, 0] == 0.0], CUBE[:1], np.tile(CUBE[:1], (5, 1))):
        with pytest.raises(InvalidProblem, match="in one plane"):
            Hull.of(points)


def test_a_hull_of_too_many_corners() -> None:
    points = np.random.default_rng(0).normal(size=(12_000, 3))
    with pytest.raises(InvalidProblem, match="12000 corners of their hull, of at most 10000"):
        Hull.of(points / np.linalg.norm(points, axis=1, keepdims=True))


def test_faces_of_triangles_in_one_plane_are_one() -> None:
    hull = Hull.of(CUBE)
    assert (len(hull.normals), len(hull.triangles), len(hull.edges[0])) == (6, 12, 12)


@pytest.mark.parametrize("most", [8, 24, 100])
def test_a_hull_around_another(most: int) -> None:
    ball = Hull.of(trimesh.creation.icosphere(3, 0.1).vertices)
    around = enclosing(ball, most)
    assert len(around.normals) <= most
    assert (around.beyond(ball.corners) <= 0.0).all()
    assert ball.distances(around.corners).max() < {8: 0.08, 24: 0.03, 100: 0.01}[most]


def test_few_faces_are_enough_for_what_is_almost_a_box() -> None:
    rounded = Hull.of(np.concatenate([CUBE, CUBE + 0.4 * COARSENESS * np.array([1.0, -1.0, 1.0])]))
    around = enclosing(rounded, 11)
    assert len(around.normals) == 6 and rounded.distances(around.corners).max() <= COARSENESS
    assert enclosing(Hull.of(CUBE), 6).normals.shape == (6, 3)


def test_a_hull_grown() -> None:
    grown = Hull.of(CUBE).grown(0.25)
    np.testing.assert_allclose(np.sort(grown.corners, axis=0), np.sort(1.5 * CUBE - 0.25, axis=0), atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31))
def test_a_box_is_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sides, turn, shift = rng.uniform(0.05, 1.0, 3), Rotation.random(random_state=seed).as_matrix(), rng.normal(size=3)
    box = Hull.of((CUBE - 0.5) * sides @ turn.T + shift).box
    assert box is not None
    center, axes, size = box
    np.testing.assert_allclose(center, shift, atol=1e-6)
    np.testing.assert_allclose(np.sort(size), np.sort(sides), atol=1e-6)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    corners = center + (CUBE - 0.5) * size @ axes.T
    assert Hull.of(corners).distances((CUBE - 0.5) * sides @ turn.T + shift) == pytest.approx(0.0, abs=1e-6)


def test_what_is_no_box() -> None:
    sheared = CUBE @ np.array([[1.0, 0.0, 0.0], [0.3, 1.0, 0.0], [0.0, 0.0, 1.0]])
    octahedron = np.concatenate([np.eye(3), -np.eye(3)])
    assert Hull.of(sheared).box is None and Hull.of(octahedron).box is None


@pytest.mark.parametrize("seed", range(20))
def test_a_box_that_is_not_quite_one_is_in_the_box_found(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sheared = CUBE @ (np.eye(3) + 4e-7 * rng.uniform(-1.0, 1.0, (3, 3)))
    points = sheared @ Rotation.random(random_state=seed).as_matrix().T + rng.uniform(-500.0, 500.0, 3)
    box = Hull.of(points).box
    assert box is not None
    center, axes, size = box
    np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-14)
    assert (np.abs((points - center) @ axes) <= size / 2.0 + 1e-9).all()
