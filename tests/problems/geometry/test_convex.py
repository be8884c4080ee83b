"""Convex parts of meshes: pieces, hulls, what CoACD divides, and the proof that they hold all triangles."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh.transformations import translation_matrix

from problems import InvalidProblem
from problems.base import cache
from problems.geometry import Hull, convex, convex_parts
from problems.geometry.convex import sticking_out

BLOCK = trimesh.creation.box([1.0, 0.6, 0.2])
RING = trimesh.creation.annulus(0.1, 0.2, 0.05, sections=24)


def corners(*meshes: trimesh.Trimesh) -> np.ndarray:
    return np.concatenate([np.asarray(mesh.triangles) for mesh in meshes])


def leg(x: float, y: float) -> trimesh.Trimesh:
    return trimesh.creation.box([0.05, 0.05, 0.7], translation_matrix([x, y, -0.45]))


TABLE = (BLOCK, *(leg(x, y) for x in (-0.4, 0.4) for y in (-0.2, 0.2)))


def inside(parts: Sequence[Hull], points: np.ndarray) -> np.ndarray:
    return np.min([part.beyond(points).max(axis=1) for part in parts], axis=0) <= 1e-9


def sampled(mesh: trimesh.Trimesh, count: int = 20_000) -> np.ndarray:
    return np.asarray(trimesh.sample.sample_surface(mesh, count, seed=0)[0])


def test_a_convex_mesh_is_its_hull() -> None:
    for mesh in (BLOCK, trimesh.creation.cylinder(0.1, 0.5, sections=20), trimesh.creation.icosphere(2, 0.3)):
        (part,) = convex_parts(corners(mesh))
        assert inside([part], sampled(mesh)).all()
        assert Hull.of(np.asarray(mesh.vertices)).distances(part.corners).max() < 0.005


def test_separate_pieces_are_parts() -> None:
    parts = convex_parts(corners(*TABLE))
    assert sorted(len(part.normals) for part in parts) == [6] * 5
    between = np.array([[0.0, 0.0, -0.4]])
    assert not inside(parts, between) and inside(convex_parts(corners(*TABLE), hull=True), between)


def test_a_flat_piece_gets_a_thickness() -> None:
    top = corners(BLOCK)[(corners(BLOCK)[:, :, 2] == 0.1).all(axis=1)]
    (part,) = convex_parts(top)
    assert part.box is not None and sorted(part.box[2])[0] == pytest.approx(2e-4, rel=1e-3)
    assert inside([part], top.reshape(-1, 3)).all()


@pytest.mark.parametrize("size", [0.002, 0.05, 0.3])
def test_a_small_flat_piece_needs_no_library(size: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(convex, "find_spec", lambda name: None)
    triangle = size * np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    (part,) = convex_parts(triangle)
    assert inside([part], triangle.reshape(-1, 3)).all()
    corner = size * np.array([[[1.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.0, 0.0, 0.0]], [[0, 0, 0], [0, 1, 0], [0.2, 1, 0]]])
    with pytest.raises(InvalidProblem, match="not convex"):
        convex_parts(corner)


def test_an_open_bowl_is_not_convex(monkeypatch: pytest.MonkeyPatch) -> None:
    ball = corners(trimesh.creation.icosphere(2, 0.3))
    bowl = ball[ball[:, :, 2].max(axis=1) < 0.1]
    monkeypatch.setattr(convex, "find_spec", lambda name: None)
    with pytest.raises(InvalidProblem, match=r"not convex; pip install 'tpbso-casadi\[meshes\]' .* hull = true"):
        convex_parts(bowl)
    assert len(convex_parts(bowl, hull=True)) == 1


@pytest.mark.slow
def test_coacd_divides_and_the_parts_hold_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("coacd")
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    parts = convex_parts(corners(RING))
    assert len(parts) > 2 and inside(parts, sampled(RING)).all()
    assert not inside(parts, np.zeros((1, 3))).any()  # the hole stays open
    assert sticking_out(corners(RING), parts[1:]) > 0
    monkeypatch.setitem(sys.modules, "coacd", None)  # the second time from the cache
    again = convex_parts(corners(RING))
    assert all(np.array_equal(one.corners, two.corners) for one, two in zip(parts, again, strict=True))


def test_parts_that_coacd_makes_too_small_are_grown_or_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    halves = [RING.vertices[RING.vertices[:, 0] >= -0.01], RING.vertices[RING.vertices[:, 0] <= 0.01]]
    monkeypatch.setattr(convex, "_coacd", lambda mesh: [half * (1.0 - 5e-5) for half in halves])
    assert inside(convex_parts(corners(RING)), sampled(RING)).all()
    monkeypatch.setattr(convex, "_coacd", lambda mesh: [half * 0.99 for half in halves])
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "other"))
    with pytest.raises(InvalidProblem, match="do not hold it"):
        convex_parts(corners(RING))


def test_what_sticks_out_of_a_union_is_found() -> None:
    left, right = (Hull.of(BLOCK.vertices * [0.5, 1.0, 1.0] + [x, 0.0, 0.0]) for x in (-0.25, 0.25))
    assert sticking_out(corners(BLOCK), [left, right]) == 0
    along = np.array([[[-0.4, 0.0, 0.0], [0.4, 0.0, 0.0], [0.0, 0.0, 0.0]]])  # without an area
    assert sticking_out(along, [left, right]) == 0
    assert sticking_out(along, [left]) == sticking_out(along * [2.0, 1.0, 1.0], [left, right]) == 1
    apart = Hull.of(BLOCK.vertices * [0.499, 1.0, 1.0] + [0.2505, 0.0, 0.0])
    assert sticking_out(corners(BLOCK), [left, apart]) > 0  # a gap of a millimetre in between


def test_too_many_pieces() -> None:
    many = corners(*(trimesh.creation.box([0.01] * 3, translation_matrix([0.02 * k, 0.0, 0.0])) for k in range(65)))
    with pytest.raises(InvalidProblem, match="65 separate pieces, of at most 64; hull = true"):
        convex_parts(many)
    assert len(convex_parts(many, hull=True)) == 1


@pytest.mark.parametrize("end", [(0.0, 0.0, 0.0), (1e-9, 0.0, 0.0), (0.3, 0.2, 0.1)])
def test_a_speck_or_a_line_is_a_part_of_its_own(end: tuple[float, float, float]) -> None:
    thin = np.array([[(0.0, 0.0, 0.0), np.array(end) / 3.0, end]]) + np.array([0.0, 0.0, 1.0])
    parts = convex_parts(np.concatenate([corners(BLOCK), thin]))
    assert len(parts) == 2 and inside(parts, thin.reshape(-1, 3)).all()


@pytest.mark.slow
def test_a_mirrored_mesh_is_divided_as_well(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("coacd")
    monkeypatch.setenv(cache.VARIABLE, str(tmp_path / "cache"))
    ring = trimesh.creation.annulus(0.1, 0.2, 0.05, sections=8)
    mirrored = corners(ring) * [-1.0, 1.0, 1.0]
    parts = convex_parts(mirrored)
    assert len(parts) == len(convex_parts(mirrored[:, ::-1]))
    assert inside(parts, sampled(ring) * [-1.0, 1.0, 1.0]).all()
