"""Convex parts that hold a mesh: its pieces where they are convex, else what CoACD makes of them; proven.

A triangle is held where all of it lies in parts. What sticks out of one part is cut off along its planes, and has to be
held by the others.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from hashlib import sha256
from importlib import import_module
from importlib.util import find_spec

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem, cache, cached_text
from problems.geometry.hull import SAME_PLANE, Hull, enclosing

VERSION = "2"  # of how parts are made: another finds none of those kept before
MOST_PARTS, MOST_FACES = 64, 256
SEEN_AS_ONE = 1e-6  # relative: corners of triangles
WHOLE = 0.999  # of the area of a hull: a mesh that lies on it and has so much of it is convex
SHEET = 0.0001  # m: half the thickness that a flat piece is given
GROWTHS = (2e-5, 1e-4, 5e-4)  # m, of the parts of what is not convex, until they hold it
DISTANCES_AT_ONCE = 10_000_000  # distances from faces
LEAST_AREA = 1e-18  # m^2: an area that is none
LEAST_LENGTH = 1e-9  # m: a length that is none
EXTRA = "tpbso-casadi[meshes]"


def convex_parts(corners: FloatArray, hull: bool = False) -> list[Hull]:
    """Convex parts that are proven to hold a mesh.

    Args:
        corners: of its triangles, (n, 3, 3), m.
        hull: whether one part around all of it will do.

    Raises:
        InvalidProblem: ``mesh`` is not convex, and the library that divides it is not installed or fails.
    """
    pieces = [corners] if hull else list(_pieces(corners))
    if len(pieces) > MOST_PARTS:
        raise InvalidProblem("mesh", f"{len(pieces)} separate pieces, of at most {MOST_PARTS}; hull = true joins them")
    parts = []
    for piece in pieces:
        points = piece.reshape(-1, 3)
        around, flat = Hull.of(_thickened(points)), _flat_axes(points)
        one = hull or len(flat) > 1 or _is_on(piece, around, flat)
        parts += [_held(piece, around)] if one else _divided(piece)
    if len(parts) > MOST_PARTS:
        raise InvalidProblem("mesh", f"{len(parts)} convex parts, of at most {MOST_PARTS}; hull = true takes its hull")
    return parts


def _pieces(corners: FloatArray) -> Iterator[FloatArray]:
    """The connected pieces of a mesh, each with its triangles."""
    places = corners.reshape(-1, 3)
    unit = SEEN_AS_ONE * max(float(np.ptp(places, axis=0).max()), np.finfo(float).tiny)
    numbers = np.unique(np.round(places / unit), axis=0, return_inverse=True)[1].reshape(-1, 3)
    one, two = np.concatenate([numbers[:, :2], numbers[:, 1:]]).T
    graph = scipy.sparse.coo_array((np.ones(len(one)), (one, two)), shape=(numbers.max() + 1,) * 2)
    labels = scipy.sparse.csgraph.connected_components(graph, directed=False)[1][numbers[:, 0]]
    return (corners[labels == label] for label in range(labels.max() + 1))


def _thickened(points: FloatArray) -> FloatArray:
    """Points (n, 3), m; of a flat piece those on both sides of it."""
    for axis in _flat_axes(points):
        points = np.concatenate([points - SHEET * axis, points + SHEET * axis])
    return points


def _flat_axes(points: FloatArray) -> list[FloatArray]:
    """Axes along which a piece is thin: one of a sheet, two of a line, three of a speck."""
    away = points - points.mean(axis=0)
    sizes, axes = np.linalg.svd(away, full_matrices=False)[1:]
    return [axis for size, axis in zip(sizes, axes, strict=True) if size <= SHEET * np.sqrt(len(points))]


def _is_on(corners: FloatArray, hull: Hull, flat: Sequence[FloatArray]) -> bool:
    """Whether a mesh is the closed surface of its hull; or all of its middle, where it is flat."""
    whole = areas(_flattened(hull.faces, flat[0])).sum() / 2.0 if flat else areas(hull.faces).sum()
    if areas(corners).sum() < WHOLE * whole:
        return False
    deepest = -10.0 * SAME_PLANE * float(np.ptp(hull.corners, axis=0).max()) - (SHEET if flat else 0.0)
    points = np.concatenate([np.unique(corners.reshape(-1, 3), axis=0), corners.mean(axis=1)])
    blocks = np.array_split(points, 1 + len(points) * len(hull.normals) // DISTANCES_AT_ONCE)
    return all(bool((hull.beyond(block).max(axis=1) >= deepest).all()) for block in blocks)


def _flattened(corners: FloatArray, normal: FloatArray) -> FloatArray:
    """Corners (n, 3, 3), moved along a normal into one plane."""
    return np.asarray(corners - (corners @ normal)[..., None] * normal)


def areas(corners: FloatArray) -> FloatArray:
    """The areas of triangles (n, 3, 3), m: (n,), m^2."""
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(np.linalg.norm(crossed, axis=1) / 2.0)


def _held(corners: FloatArray, hull: Hull) -> Hull:
    """The hull of a mesh with few faces."""
    part = enclosing(hull, MOST_FACES)
    if sticking_out(corners, [part]):
        raise InvalidProblem("mesh", "rounding keeps its hull from holding it: is it tiny?")
    return part


def _divided(corners: FloatArray) -> list[Hull]:
    """The parts that CoACD makes of a mesh, grown until they hold it; cached."""
    key = cache.key_of("parts", VERSION, sha256(np.ascontiguousarray(corners).tobytes()).hexdigest())
    return [Hull.of(np.array(points)) for points in json.loads(cached_text(key, "cover", lambda: _parts_text(corners)))]


def _parts_text(corners: FloatArray) -> str:
    parts = _grown(corners, [Hull.of(_thickened(points)) for points in _coacd(corners)])
    return json.dumps([part.corners.tolist() for part in parts])


def _grown(corners: FloatArray, hulls: Sequence[Hull]) -> list[Hull]:
    for growth in GROWTHS:
        parts = [enclosing(hull.grown(growth), MOST_FACES) for hull in hulls]
        if not sticking_out(corners, parts):
            return parts
    raise InvalidProblem("mesh", "CoACD's parts do not hold it; hull = true takes its convex hull")


def _coacd(corners: FloatArray) -> list[FloatArray]:
    if find_spec("coacd") is None:
        raise InvalidProblem(
            "mesh", f"it is not convex; pip install '{EXTRA}' divides it, hull = true takes its convex hull"
        )
    import trimesh  # noqa: PLC0415 (half a second)

    coacd = import_module("coacd")
    coacd.set_log_level("off")
    mesh = trimesh.Trimesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    mode = "off" if mesh.is_watertight else "on"
    if mesh.is_watertight and mesh.volume < 0.0:  # inside out, as a mirrored one is
        mesh.invert()
    try:
        parts = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces), preprocess_mode=mode, seed=0)
    except Exception as error:
        raise InvalidProblem("mesh", f"CoACD fails: {error}; hull = true takes its convex hull") from error
    return [np.asarray(points, dtype=np.float64) for points, _ in parts]


def sticking_out(corners: FloatArray, parts: Sequence[Hull]) -> int:
    """The number of triangles (n, 3, 3), m, that do not lie in the union of convex parts."""
    left = corners[~np.any([_held_whole(corners, part) for part in parts], axis=0)]
    return sum(_sticks_out(triangle, parts) for triangle in left)


def _held_whole(corners: FloatArray, part: Hull) -> NDArray[np.bool_]:
    """Whether each of the triangles (n, 3, 3), m, lies in one part, (n,)."""
    blocks = np.array_split(corners, 1 + 3 * len(corners) * len(part.normals) // DISTANCES_AT_ONCE)
    return np.concatenate(
        [(part.beyond(b.reshape(-1, 3)) <= 0.0).all(axis=1).reshape(-1, 3).all(axis=1) for b in blocks]
    )


def _sticks_out(triangle: FloatArray, parts: Sequence[Hull]) -> bool:
    """Whether anything is left of a triangle when what lies in the parts is cut away."""
    polygons, is_line = [triangle], _area(triangle) <= LEAST_AREA
    for part in parts:
        polygons = [piece for polygon in polygons for piece in _cut(polygon, part, is_line)]
    return bool(polygons)


def _cut(polygon: FloatArray, part: Hull, is_line: bool) -> Iterator[FloatArray]:
    """Pieces of a convex polygon (n, 3), m, outside a part that have an area, or a length if it is a line."""
    if (part.beyond(polygon) <= 0.0).all():
        return
    for normal, offset in zip(part.normals, part.offsets, strict=True):
        heights = polygon @ normal - offset
        if not (heights > 0.0).any():
            continue
        outside, polygon = _side(polygon, heights), _side(polygon, -heights)
        if (np.ptp(outside, axis=0).max() > LEAST_LENGTH) if is_line else (_area(outside) > LEAST_AREA):
            yield outside
        if len(polygon) < 3:
            return


def _side(polygon: FloatArray, heights: FloatArray) -> FloatArray:
    """The part of a convex polygon in which heights are not negative."""
    ahead = np.roll(np.arange(len(polygon)), -1)
    points = []
    for k, n in enumerate(ahead):
        if heights[k] >= 0.0:
            points.append(polygon[k])
        if heights[k] * heights[n] < 0.0:
            share = heights[k] / (heights[k] - heights[n])
            points.append(polygon[k] + share * (polygon[n] - polygon[k]))
    return np.array(points).reshape(-1, 3)


def _area(polygon: FloatArray) -> float:
    if len(polygon) < 3:
        return 0.0
    fan = np.stack([np.broadcast_to(polygon[0], (len(polygon) - 2, 3)), polygon[1:-1], polygon[2:]], axis=1)
    return float(areas(fan).sum())
