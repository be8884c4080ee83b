"""Meshes from files: triangles, and what is wrong with them; and those around a box, a cylinder and a capsule."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import PurePosixPath

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray
from problems.geometry.mesh_files import MOST_TRIANGLES, Content, Part, read_dae, read_obj, read_stl, refused

READERS: dict[str, Callable[[bytes], Content]] = {"stl": read_stl, "obj": read_obj, "dae": read_dae}
LARGEST = 10.0  # m: a larger body was stated in other units
SIDES = 64  # of the prism around a cylinder
ROUND = 24  # sides of what only looks like a ball


@dataclass(frozen=True, eq=False)
class Mesh:
    """The triangles of a mesh file, and what is unusual about them.

    Attributes:
        corners: (n, 3, 3), m; of a polygon whose corners lie in no plane, all triangles that it may mean.
        reading: what of the file was left out or converted, a line each.
        flaws: what is unusual about its surface, a line each.
        up: the axis that the file calls up, X, Y or Z; its coordinates are not turned.
    """

    corners: FloatArray
    reading: tuple[str, ...] = ()
    flaws: tuple[str, ...] = ()
    up: str = "Z"


def read_mesh(name: str, content: bytes, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Mesh:
    """The triangles of a mesh.

    Args:
        name: of its file, whose ending says of which kind it is.
        content: of the file.
        scale: of its coordinates along each axis.

    Raises:
        InvalidProblem: ``mesh`` is of no kind that is read, broken, without triangles, or too large, or has an element
            that is not read.
    """
    file = _content_of(name, content)
    surface = _scaled([part.corners for part in file.parts], scale)
    corners = _scaled([surface, *(part.further * np.array(scale) for part in file.parts)])
    closed, volume = _closed_volume(surface)
    flaws: tuple[str, ...] = ()
    if not closed:
        flaws = ("is not watertight: what no way from outside leads to counts as solid",)
    elif volume < 0.0:
        flaws = ("is inside out, which changes nothing",)
    return Mesh(corners, file.notes, flaws, file.up)


def read_parts(name: str, content: bytes, scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> list[Part]:
    """Parts of a mesh file by their colours, in m, as they are shown.

    Raises:
        InvalidProblem: as there.
    """
    parts = _content_of(name, content).parts
    _scaled([part.corners for part in parts], scale)
    return [Part(part.corners * np.array(scale), part.further * np.array(scale), part.colour) for part in parts]


def _content_of(name: str, content: bytes) -> Content:
    kind = PurePosixPath(name).suffix[1:].lower()
    if kind not in READERS:
        raise refused(f"it ends with {kind!r}; {', '.join(READERS)} are read")
    return READERS[kind](content)


def _scaled(parts: list[FloatArray], scale: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> FloatArray:
    """Corners (n, 3, 3) of all parts in m.

    Raises:
        InvalidProblem: ``mesh`` has none, too many, or is too large.
    """
    count = sum(map(len, parts))
    if not count:
        raise refused("it has no triangles")
    if count > MOST_TRIANGLES:
        raise refused(f"{count} triangles, of at most {MOST_TRIANGLES}")
    with np.errstate(over="ignore"):
        corners = np.concatenate(parts) * np.array(scale)
    if not np.isfinite(corners).all():
        raise refused("a coordinate is no finite number")
    sizes = np.ptp(corners, axis=(0, 1))
    if sizes.max() > LARGEST:
        shown = " x ".join(f"{size:.4g}" for size in sizes)
        raise refused(f"it is {shown} m, of at most {LARGEST:g}: is it in mm, and scale is missing?")
    return np.asarray(corners)


def _closed_volume(corners: FloatArray) -> tuple[bool, float]:
    """Whether triangles (n, 3, 3) are a closed surface, and the volume that they enclose in that case, m^3."""
    import trimesh  # noqa: PLC0415 (half a second, for robots with meshes alone)

    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3), process=False)
    mesh.merge_vertices()
    return bool(mesh.is_watertight), float(np.linalg.det(corners - corners.mean(axis=(0, 1))).sum()) / 6.0


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
