"""Few triangles for many: how near they are to what they resemble, by hand and against trimesh; and as a text."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from problems.base import InvalidProblem
from problems.geometry import Triangles, box_corners, capsule_corners, facing_out, simplified
from problems.geometry.triangles import QUANTUM

BOX = Triangles.of(facing_out(box_corners((0.2, 0.3, 0.4))))


def oracle(triangles: Triangles) -> trimesh.Trimesh:
    return trimesh.Trimesh(triangles.vertices, triangles.faces, process=False)


def test_a_box_has_eight_vertices_and_faces_outward() -> None:
    assert (BOX.vertices.shape, BOX.faces.shape) == ((8, 3), (12, 3))
    assert BOX.area == pytest.approx(2.0 * (0.06 + 0.08 + 0.12))
    assert oracle(BOX).volume == pytest.approx(0.024)


def test_what_has_no_area_and_what_is_there_twice_is_left_out() -> None:
    one = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    triangles = Triangles.of(np.array([one, one[[1, 2, 0]], one[::-1], one[[0, 1, 1]]]))
    assert len(triangles.faces) == 2  # both sides


def test_a_finely_cut_box_becomes_a_box_again() -> None:
    fine = oracle(BOX).subdivide().subdivide().subdivide().subdivide()
    few = simplified(Triangles.of(np.asarray(fine.triangles)), 100)
    assert len(few.faces) <= 100 < len(fine.faces)
    np.testing.assert_allclose(np.ptp(few.vertices, axis=0), [0.2, 0.3, 0.4], atol=1e-9)
    assert oracle(few).volume == pytest.approx(0.024, rel=1e-9)
    assert oracle(few).is_watertight


@pytest.mark.parametrize("most", [12, 100, 400, 2000])
def test_a_ball_stays_round_and_as_large(most: int) -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    few = simplified(Triangles.of(np.asarray(ball.triangles)), most)
    assert 0.2 * most < len(few.faces) <= most
    if most >= 100:
        radii = np.linalg.norm(few.vertices, axis=1)
        assert radii.min() > 0.09 and radii.max() < 0.11
        assert oracle(few).volume == pytest.approx(ball.volume, rel=0.1)


def test_few_enough_stay_as_they_are() -> None:
    assert simplified(BOX, 12) is BOX


def test_what_is_inside_out_is_turned_over_and_nothing_else() -> None:
    inside_out = Triangles(BOX.vertices, BOX.faces[:, ::-1])
    assert oracle(inside_out.outward).volume == pytest.approx(0.024)
    assert BOX.outward is BOX
    sheet = Triangles(BOX.vertices * [1.0, 1.0, 1e-6], BOX.faces[:, ::-1])
    assert sheet.outward is sheet


@pytest.mark.parametrize("length", [0.0, 0.5])
def test_a_capsule_is_within_its_radius(length: float) -> None:
    capsule = oracle(Triangles.of(capsule_corners(0.1, length)))
    away = np.maximum(np.abs(capsule.vertices[:, 2]) - length / 2.0, 0.0)
    np.testing.assert_allclose(np.hypot(np.hypot(*capsule.vertices[:, :2].T), away), 0.1)
    assert 0.95 < capsule.volume / (np.pi * 0.01 * (length + 4.0 / 3.0 * 0.1)) < 1.0


def test_what_is_read_is_what_was_written() -> None:
    ball = Triangles.of(np.asarray(trimesh.creation.icosphere(subdivisions=3, radius=0.1).triangles))
    read = Triangles.from_text(ball.text)
    assert read.text == ball.text
    assert len(ball.text) < 6 * len(ball.faces)

    def ordered(triangles: Triangles) -> np.ndarray:
        corners = np.rint(triangles.corners / QUANTUM)
        return np.unique(corners.reshape(len(corners), 9), axis=0)

    spread = np.abs(ordered(read)[:, None] - ordered(ball)[None]).max(axis=2)
    assert (spread == 0).any(axis=0).mean() > 0.3  # the same corners, each triangle beginning with any of them
    assert oracle(read).volume == pytest.approx(oracle(ball).volume, rel=1e-2)


@pytest.mark.parametrize(
    "text", ["", "?", "AAAA", "AAAAAAAAAAAA", BOX.text[:-8], BOX.text.replace(BOX.text[4], "Z", 1)]
)
def test_anything_else_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(InvalidProblem, match=r"^triangles: they are none") as error:
        Triangles.from_text(text)
    assert "\n" not in str(error.value)
