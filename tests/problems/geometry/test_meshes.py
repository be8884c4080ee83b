"""Meshes from files: what is read, what is refused, what is said of them; those around boxes and cylinders."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from problems.base import InvalidProblem
from problems.geometry import box_corners, cylinder_corners, read_mesh

SIZES = (0.1, 0.2, 0.3)


def exported(kind: str, mesh: trimesh.Trimesh | None = None) -> bytes:
    content = (trimesh.creation.box(SIZES) if mesh is None else mesh).export(file_type=kind)
    return content if isinstance(content, bytes) else content.encode()


@pytest.mark.parametrize("name", ["a.stl", "a.STL", "a.obj", "a.dae"])
def test_every_kind_of_file_is_read(name: str) -> None:
    mesh = read_mesh(name, exported(name[-3:].lower()), (2.0, 1.0, 0.5))
    assert mesh.corners.shape == (12, 3, 3)
    np.testing.assert_allclose(np.ptp(mesh.corners, axis=(0, 1)), (0.2, 0.2, 0.15), atol=1e-7)
    assert mesh.flaws == ()


def test_what_is_unusual_is_said() -> None:
    box = trimesh.creation.box(SIZES)
    inside_out = trimesh.Trimesh(box.vertices, box.faces[:, ::-1], process=False)
    open_box = trimesh.Trimesh(box.vertices, box.faces[1:], process=False)
    assert read_mesh("a.stl", exported("stl", inside_out)).flaws == ("is inside out, which changes nothing",)
    assert read_mesh("a.stl", exported("stl", inside_out), (-1.0, 1.0, 1.0)).flaws == ()  # a mirror turns it again
    assert read_mesh("a.stl", exported("stl", open_box)).flaws[0].startswith("is not watertight")


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("a.ply", b"", "it ends with 'ply'; stl, obj, dae are read"),
        ("stl", b"", "it ends with ''"),
        ("a.stl", b"", "it has no triangles"),
        ("a.obj", b"", "it has no triangles"),
        ("a.dae", b"", "it cannot be read: no XML"),
        ("a.dae", b"<x/>", "it cannot be read: its root is <x>"),
        ("a.dae", b"<!DOCTYPE a [<!ENTITY b 'c'>]><COLLADA/>", "a document type"),
        ("a.dae", "<!DOCTYPE a><COLLADA/>".encode("utf-16"), "a document type"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n", "a coordinate is no finite number"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 1e300 1 0\nv 0 1e300 0\nf 1 2 3 4\n", "it is 1e[+]300 x 1e[+]300 x 0 m"),
    ],
)
def test_what_is_no_mesh_is_refused_in_one_line(name: str, content: bytes, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=f"mesh: ({reason})") as error:
        read_mesh(name, content)
    assert "\n" not in str(error.value)


def test_what_is_huge_is_said_with_its_size() -> None:
    with pytest.raises(InvalidProblem, match=r"mesh: it is 100 x 200 x 300 m, of at most 10: is it in mm, and scale "):
        read_mesh("a.stl", exported("stl"), (1e3, 1e3, 1e3))


def test_triangles_around_a_box_and_a_cylinder_hold_them() -> None:
    assert box_corners(SIZES).shape == (12, 3, 3)
    np.testing.assert_allclose(np.ptp(box_corners(SIZES), axis=(0, 1)), SIZES)
    prism = cylinder_corners(0.05, 0.2)
    normals = np.cross(prism[:, 1] - prism[:, 0], prism[:, 2] - prism[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    away = np.abs(np.einsum("ni,ni->n", normals, prism[:, 0]))  # of the planes, from the middle
    side = np.abs(normals[:, 2]) < 0.5
    np.testing.assert_allclose(away[side], 0.05)
    np.testing.assert_allclose(away[~side], 0.1)
    assert np.hypot(*prism[..., :2].T).max() < 0.05 * 1.0013
