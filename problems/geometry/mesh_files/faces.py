"""Polygons of mesh files, cut into triangles that lose nothing of them.

A fan of triangles from a corner of a plane polygon holds everything that the polygon goes around: the winding number of
a point is the sum of the signed triangles' around it. It holds no more where no triangle of the fan folds back; where
one does, ears are cut off, which holds all by the same argument.

Corners that lie in no plane do not say which surface they mean. Of few corners, all triangles of three of them are
taken: whatever triangles were meant are among these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem

MOST_TRIANGLES = 2_000_000  # of a file
FLAT = 1e-6  # of a polygon's size: corners so near to a plane lie in it
SINGLE = 2.0**-22  # of the largest coordinate: as near as numbers of single precision are to what they round
ROUNDED = 1e-4  # of the size, as FLAT, for polygons of more corners than MOST_FREE: places are rounded in the file
MOST_FREE = 8  # corners of a polygon that need not lie in a plane: 56 triangles
MOST_CUT = 200  # corners of a polygon whose ears are cut off; larger ones are fans

Numbers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles of one colour in a file.

    Attributes:
        corners: (n, 3, 3), in the unit of the file or m.
        further: other triangles that polygons may mean whose corners lie in no plane, (m, 3, 3).
        colour: as #rrggbb; empty where the file states none.
    """

    corners: FloatArray
    further: FloatArray
    colour: str = ""


@dataclass(frozen=True, eq=False)
class Content:
    """Surfaces that a mesh file states, and notes on what was left out.

    Attributes:
        parts: its triangles.
        notes: what was left out or converted, a line each.
        up: the axis that the file calls up, X, Y or Z; its coordinates are not turned.
    """

    parts: tuple[Part, ...]
    notes: tuple[str, ...] = ()
    up: str = "Z"


def refused(reason: str) -> InvalidProblem:
    """The error about a mesh that is not read, for a reason in one line."""
    return InvalidProblem("mesh", reason)


def part_of(
    places: FloatArray, corners: Numbers, counts: Numbers, name: Callable[[int], str], colour: str = ""
) -> Part:
    """The triangles into which polygons are cut.

    Args:
        places: of vertices, (v, 3).
        corners: numbers of vertices from 0, those of one polygon after those of another, (k,).
        counts: of corners of each polygon, three at least, (n,).
        name: of a polygon, by its number from 0.
        colour: of all.

    Raises:
        InvalidProblem: ``mesh`` has a corner that is no vertex or not finite, or a polygon of more corners than
            :data:`MOST_FREE` that lies in no plane.
    """
    starts = np.cumsum(counts) - counts
    bad = np.flatnonzero((corners < 0) | (corners >= len(places)))
    if len(bad):
        polygon = int(np.searchsorted(starts, bad[0], side="right")) - 1
        raise refused(f"{name(polygon)}: a corner is none of the {len(places)} vertices")
    if not np.isfinite(places[corners]).all():
        raise refused("a coordinate is no finite number")
    surfaces, others = [np.empty((0, 3), dtype=np.int64)], [np.empty((0, 3), dtype=np.int64)]
    for count in np.unique(counts).tolist():
        same = np.flatnonzero(counts == count)
        polygons = corners[starts[same, None] + np.arange(count)]
        faces, loose = _cut(places[polygons])
        if count > MOST_FREE and len(loose):
            raise refused(f"{name(int(same[loose[0]]))}: its {count} corners lie in no plane: export it in triangles")
        surfaces += [polygons[chosen][:, order].reshape(-1, 3) for chosen, order in faces]
        others.append(polygons[loose][:, _others(count)].reshape(-1, 3))
    return Part(places[np.concatenate(surfaces)], places[np.concatenate(others)], colour)


def _fan(count: int) -> Numbers:
    after = np.arange(1, count - 1)
    return np.column_stack([np.zeros_like(after), after, after + 1])


def _others(count: int) -> Numbers:
    """Three corners each, of all triangles that are not in a fan from the first; none where there are too many."""
    fan = set(map(tuple, _fan(count).tolist()))
    rest = [] if count > MOST_FREE else [three for three in combinations(range(count), 3) if three not in fan]
    return np.array(rest, dtype=np.int64).reshape(-1, 3)


def _cut(polygons: FloatArray) -> tuple[list[tuple[Numbers, Numbers]], Numbers]:
    """Corners of the triangles into which polygons (n, k, 3) are cut.

    Returns:
        Numbers of polygons with the corners (m, 3) of their triangles, and numbers of those that lie in no plane.
    """
    count = polygons.shape[1]
    fan, everyone = _fan(count), np.arange(len(polygons))
    if count == 3:
        return [(everyone, fan)], everyone[:0]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        middle = polygons - polygons.mean(axis=1, keepdims=True)
        size = np.sqrt((middle**2).sum(axis=2)).max(axis=1)
        normals = np.cross(middle, np.roll(middle, -1, axis=1)).sum(axis=1)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        away = np.abs(np.einsum("nki,ni->nk", middle, normals)).max(axis=1)
        near = (FLAT if count <= MOST_FREE else ROUNDED) * size
        rounding = np.minimum(SINGLE * np.abs(polygons).max(axis=(1, 2)), ROUNDED * size)
        flat = away <= np.maximum(near, rounding)
        sides = polygons[:, 1:] - polygons[:, :1]
        areas = np.einsum("nki,ni->nk", np.cross(sides[:, :-1], sides[:, 1:]), normals)
        folded = flat & (areas < -FLAT * size[:, None] ** 2).any(axis=1)
    faces = [(everyone[~folded], fan)]
    for number in np.flatnonzero(folded):
        order = _clipped(_in_plane(middle[number], normals[number])) if count <= MOST_CUT else fan
        faces.append((everyone[number : number + 1], order))
    return faces, np.flatnonzero(~flat)


def _in_plane(corners: FloatArray, normal: FloatArray) -> FloatArray:
    """Corners (k, 3) along two axes across a normal, counter-clockwise about it, (k, 2)."""
    one = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    return np.asarray(corners @ np.column_stack([one, np.cross(normal, one)]) / np.linalg.norm(one))


def _clipped(points: FloatArray) -> Numbers:
    """Corners of triangles (k - 2, 3) into which a polygon (k, 2), counter-clockwise, is cut: ear by ear."""
    left, triangles = list(range(len(points))), []
    while len(left) > 3:
        place = next((place for place in range(len(left)) if _is_ear(points, left, place)), 1)
        triangles.append([left[place - 1], left[place], left[(place + 1) % len(left)]])
        del left[place]
    return np.array([*triangles, left], dtype=np.int64)


def _is_ear(points: FloatArray, left: list[int], place: int) -> bool:
    """Whether a corner sticks out and no other is inside the triangle that it makes with its neighbours."""
    three = points[[left[place - 1], left[place], left[(place + 1) % len(left)]]]
    sides = np.roll(three, -1, axis=0) - three
    if sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0] <= 0.0:
        return False
    others = points[left][:, None] - three
    inside = sides[:, 0] * others[..., 1] - sides[:, 1] * others[..., 0] > 0.0
    return not bool(inside.all(axis=1).any())
