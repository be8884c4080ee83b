"""Meshes from files: triangles, and what is wrong with them; and those around a box and a cylinder."""

from __future__ import annotations

import io
from dataclasses import dataclass
from itertools import product
from pathlib import PurePosixPath

import numpy as np
from scipy.spatial import ConvexHull

from problems.base import FloatArray, InvalidProblem

KINDS = ("stl", "obj", "dae")
MOST_TRIANGLES = 2_000_000
LARGEST = 10.0  # m: a larger body was stated in other units
SIDES = 64  # of the prism around a cylinder


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of a file.

    Attributes:
        corners: (n, 3, 3), m.
        notes: what is unusual, a line each.
    """

    corners: FloatArray
    notes: tuple[str, ...] = ()


def read_mesh(name: str, content: bytes, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    """The triangles of a mesh.

    Args:
        name: of its file, whose ending says of which kind it is.
        content: of the file.
        scale: of its coordinates along each axis.

    Raises:
        InvalidProblem: ``mesh`` is of no kind that is read, broken, without triangles, or too large.
    """
    kind = PurePosixPath(name).suffix[1:].lower()
    if kind not in KINDS:
        raise _refused(f"it ends with {kind!r}; {', '.join(KINDS)} are read")
    corners, closed, volume = _loaded(kind, content)
    if not len(corners):
        raise _refused("it has no triangles")
    if len(corners) > MOST_TRIANGLES:
        raise _refused(f"{len(corners)} triangles, of at most {MOST_TRIANGLES}")
    corners = corners * np.array(scale)
    if not np.isfinite(corners).all():
        raise _refused("a coordinate is no finite number")
    sizes = np.ptp(corners, axis=(0, 1))
    if sizes.max() > LARGEST:
        shown = " x ".join(f"{size:.4g}" for size in sizes)
        raise _refused(f"it is {shown} m, of at most {LARGEST:g}: is it in mm, and scale is missing?")
    notes = []
    if not closed:
        notes.append("is not watertight: what no way from outside leads to counts as solid")
    elif volume * float(np.prod(scale)) < 0.0:
        notes.append("is inside out, which changes nothing")
    return Mesh(corners, tuple(notes))


def _loaded(kind: str, content: bytes) -> tuple[FloatArray, bool, float]:
    """Corners of the triangles, whether they are closed, and the volume that they then enclose."""
    import trimesh  # noqa: PLC0415 (half a second, for robots with meshes alone)

    if kind == "dae" and b"<!DOCTYPE" in content:
        raise _refused("a document type (DOCTYPE) is not read")
    try:
        loaded = trimesh.load(io.BytesIO(content), file_type=kind, force="mesh", process=False, skip_materials=True)
        corners = np.asarray(loaded.vertices, dtype=np.float64)[np.asarray(loaded.faces)].reshape(-1, 3, 3)
    except Exception as error:
        raise _refused(f"it cannot be read: {type(error).__name__}: {' '.join(str(error).split())[:120]}") from error
    if not len(corners) or not np.isfinite(corners).all():
        return corners, True, 0.0
    loaded.merge_vertices(merge_tex=True, merge_norm=True)
    closed = bool(loaded.is_watertight)
    return corners, closed, float(loaded.volume) if closed else 0.0


def _refused(reason: str) -> InvalidProblem:
    return InvalidProblem("mesh", reason)


def box_corners(sizes: tuple[float, float, float]) -> FloatArray:
    """Triangles of a box about the origin, (12, 3, 3), m."""
    return _hull_corners(np.array(list(product((-0.5, 0.5), repeat=3))) * np.array(sizes))


def cylinder_corners(radius: float, length: float) -> FloatArray:
    """Triangles of a prism around a cylinder about the origin along z, (n, 3, 3), m; 0.12 % wider than it."""
    phase = 2.0 * np.pi * np.arange(SIDES) / SIDES
    ring = radius / np.cos(np.pi / SIDES) * np.column_stack([np.cos(phase), np.sin(phase)])
    ends = [np.column_stack([ring, np.full(SIDES, end)]) for end in (-length / 2.0, length / 2.0)]
    return _hull_corners(np.concatenate(ends))


def ball_corners() -> FloatArray:
    """Corners of a polyhedron around the ball of radius 1 about the origin, (n, 3)."""
    import trimesh  # noqa: PLC0415 (half a second)

    ball = trimesh.creation.icosphere(3)
    inside = np.einsum("ni,ni->n", ball.face_normals, ball.triangles[:, 0]).min()
    return np.asarray(ball.vertices / inside)


def _hull_corners(points: FloatArray) -> FloatArray:
    return np.asarray(points[ConvexHull(points).simplices], dtype=np.float64)
