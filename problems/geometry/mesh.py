"""Meshes from files: triangles, and what is wrong with them; and those around a box, a cylinder and a capsule."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import PurePosixPath
from typing import Any

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray, InvalidProblem

KINDS = ("stl", "obj", "dae")
MOST_TRIANGLES = 2_000_000
LARGEST = 10.0  # m: a larger body was stated in other units
SIDES = 64  # of the prism around a cylinder
ROUND = 24  # sides of what only looks like a ball


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
    corners, closed, volume = _loaded(_kind_of(name), content)
    corners = _scaled(corners, scale)
    notes = []
    if not closed:
        notes.append("is not watertight: what no way from outside leads to counts as solid")
    elif volume * float(np.prod(scale)) < 0.0:
        notes.append("is inside out, which changes nothing")
    return Mesh(corners, tuple(notes))


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles of one colour.

    Attributes:
        corners: (n, 3, 3), m.
        colour: as #rrggbb; empty where the file states none.
    """

    corners: FloatArray
    colour: str


def read_parts(name: str, content: bytes, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> list[Part]:
    """The same triangles by the parts of the file, with the colours that a DAE states.

    Raises:
        InvalidProblem: as there.
    """
    kind = _kind_of(name)
    with _failures_named():
        scene = _load(kind, content, force="scene")
        parts = [(_corners_of(mesh), _colour_of(mesh) if kind == "dae" else "") for mesh in scene.dump()]
    _scaled(np.concatenate([np.empty((0, 3, 3)), *(corners for corners, _ in parts)]), scale)
    return [Part(corners * np.array(scale), colour) for corners, colour in parts]


def _kind_of(name: str) -> str:
    kind = PurePosixPath(name).suffix[1:].lower()
    if kind not in KINDS:
        raise _refused(f"it ends with {kind!r}; {', '.join(KINDS)} are read")
    return kind


def _scaled(corners: FloatArray, scale: tuple[float, float, float]) -> FloatArray:
    """Corners in m.

    Raises:
        InvalidProblem: ``mesh`` has none, too many, or is too large.
    """
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
    return corners


def _load(kind: str, content: bytes, **options: Any) -> Any:
    """What trimesh reads."""
    import trimesh  # noqa: PLC0415 (half a second, for robots with meshes alone)

    if kind == "dae" and b"<!DOCTYPE" in content:
        raise _refused("a document type (DOCTYPE) is not read")
    return trimesh.load(io.BytesIO(content), file_type=kind, process=False, **options)


@contextmanager
def _failures_named() -> Iterator[None]:
    try:
        yield
    except InvalidProblem:
        raise
    except Exception as error:
        raise _refused(f"it cannot be read: {type(error).__name__}: {' '.join(str(error).split())[:120]}") from error


def _corners_of(loaded: Any) -> FloatArray:
    return np.asarray(np.asarray(loaded.vertices, dtype=np.float64)[np.asarray(loaded.faces)].reshape(-1, 3, 3))


def _colour_of(loaded: Any) -> str:
    red, green, blue, *_ = (int(part) for part in loaded.visual.material.main_color)
    return f"#{red:02x}{green:02x}{blue:02x}"


def _loaded(kind: str, content: bytes) -> tuple[FloatArray, bool, float]:
    """Corners of the triangles, whether they are closed, and the volume that they then enclose."""
    with _failures_named():
        loaded = _load(kind, content, force="mesh", skip_materials=True)
        corners = _corners_of(loaded)
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


def capsule_corners(radius: float, length: float) -> FloatArray:
    """Triangles in a capsule about the origin along z, in a ball where its length is 0: (n, 3, 3), m."""
    turn = 2.0 * np.pi * np.arange(ROUND) / ROUND
    across, along = np.meshgrid(turn, np.linspace(-np.pi / 2.0, np.pi / 2.0, ROUND // 2 + 1))
    ball = radius * np.stack([np.cos(along) * np.cos(across), np.cos(along) * np.sin(across), np.sin(along)], axis=-1)
    shift = np.where(along[..., None] < 0.0, -0.5, 0.5) * np.array([0.0, 0.0, length])
    return facing_out(_hull_corners((ball + shift).reshape(-1, 3)))


def facing_out(corners: FloatArray) -> FloatArray:
    """Triangles (n, 3, 3) around something convex, each counter-clockwise from outside."""
    middle = corners.mean(axis=(0, 1)) if len(corners) else np.zeros(3)
    inward = np.linalg.det(corners - middle) < 0.0
    return np.where(inward[:, None, None], corners[:, ::-1], corners)


def _hull_corners(points: FloatArray) -> FloatArray:
    return np.asarray(points[scipy.spatial.ConvexHull(points).simplices], dtype=np.float64)
