"""Triangles to be looked at: few that resemble many, and as a text.

All vertices in one cell of a lattice become one: the point that is nearest to the planes of the triangles around it,
so that edges stay sharp and what is round keeps its width.

Source: P. Lindstrom, Out-of-core simplification of large polygonal models (2000), 3.
"""

from __future__ import annotations

import zlib
from base64 import b64decode, b64encode
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem

QUANTUM = 2.0**-13  # m: stored places are whole multiples


@dataclass(frozen=True, kw_only=True)
class SimplificationSettings:
    """Settings of the simplification of triangles for drawing.

    Values are chosen.

    Attributes:
        finest_cell: share of the body's size: the smallest cells of the lattice.
        halvings: halvings of the cells between that and the body's size.
        flat: share of the largest eigenvalue: along directions of smaller ones planes do not place a point.
        thick: volume over area to the power 1.5 of a body that has an inside; 0.094 for a ball.
    """

    finest_cell: float = 2.0**-10
    halvings: int = 12
    flat: float = 0.05
    thick: float = 0.003


SETTINGS = SimplificationSettings()


MOST_STORED = 100_000  # vertices, and triangles, of a text

Faces = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Triangles:
    """Vertices, and the faces that three of them make each.

    Attributes:
        vertices: (n, 3), m.
        faces: numbers of vertices, counter-clockwise from outside where that is known, (m, 3).
    """

    vertices: FloatArray
    faces: Faces

    @classmethod
    def of(cls, corners: FloatArray) -> Triangles:
        """Vertices and faces of triangles (m, 3, 3), m: equal corners are one vertex, flat faces are dropped."""
        vertices, numbers = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        return cls(vertices, _with_area(numbers.reshape(-1, 3)))

    @property
    def corners(self) -> FloatArray:
        """The corners of each triangle, (m, 3, 3), m."""
        return np.asarray(self.vertices[self.faces])

    @property
    def area(self) -> float:
        """The total area of the triangles, m^2."""
        return float(np.linalg.norm(self._doubled_normals, axis=1).sum()) / 2.0

    @property
    def _doubled_normals(self) -> FloatArray:
        """Normals whose lengths are twice the triangles' areas, (m, 3), m^2."""
        one, two, three = self.corners.swapaxes(0, 1)
        return np.cross(two - one, three - one)

    @property
    def outward(self) -> Triangles:
        """The triangles, turned over where the volume that they enclose is clearly negative."""
        from_middle = self.corners - self.vertices.mean(axis=0) if len(self.faces) else self.corners
        inside_out = float(np.linalg.det(from_middle).sum()) / 6.0 < -SETTINGS.thick * self.area**1.5
        return Triangles(self.vertices, self.faces[:, ::-1]) if inside_out else self

    def placed(self, rotation: FloatArray, translation: FloatArray) -> Triangles:
        """The triangles as seen from the frame in which their own has this pose."""
        return Triangles(np.asarray(self.vertices @ rotation.T + translation), self.faces)

    @property
    def text(self) -> str:
        """The triangles in letters and digits, to be stored; places are rounded to ``QUANTUM``."""
        order = np.lexsort(np.rint(self.vertices / QUANTUM).T)
        places = np.diff(np.rint(self.vertices[order] / QUANTUM), axis=0, prepend=0.0)
        faces = np.argsort(order)[self.faces]
        first = faces[:, :1]
        numbers = np.column_stack([first, faces[:, 1:] - first])[np.argsort(first[:, 0], kind="stable")]
        numbers[:, 0] = np.diff(numbers[:, 0], prepend=0)
        head = np.array([len(places), len(numbers)], dtype="<i4").tobytes()
        return b64encode(head + zlib.compress(_planes(places) + _planes(numbers), 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> Triangles:
        """The triangles that a text states.

        Raises:
            InvalidProblem: ``triangles`` are none.
        """
        try:
            content = b64decode(text.encode(), validate=True)
            counts = np.frombuffer(content[:8], "<i4")
            if len(counts) != 2 or not all(0 < count <= MOST_STORED for count in counts.tolist()):
                raise ValueError("too few or too many")
            unpacker = zlib.decompressobj()
            columns = np.frombuffer(unpacker.decompress(content[8:], 12 * int(counts.sum())), np.uint8)
            places, numbers = (_from_planes(part) for part in np.split(columns, [12 * int(counts[0])]))
        except (ValueError, zlib.error) as error:
            raise InvalidProblem("triangles", f"they are none: {error}") from error
        first = np.cumsum(numbers[:, :1], axis=0)
        faces = np.column_stack([first, first + numbers[:, 1:]])
        whole = len(places) == counts[0] and len(faces) == counts[1] and unpacker.eof
        if not whole or faces.min() < 0 or faces.max() >= len(places):
            raise InvalidProblem("triangles", "they are none, or not whole")
        return cls(np.cumsum(places, axis=0).astype(np.float64) * QUANTUM, faces)


def _planes(numbers: NDArray[np.generic]) -> bytes:
    """Bytes of columns of small whole numbers, lowest bytes first, which compress well."""
    return np.ascontiguousarray(numbers.T.astype("<i4")).view(np.uint8).reshape(-1, 4).T.tobytes()


def _from_planes(content: NDArray[np.uint8]) -> Faces:
    columns = np.ascontiguousarray(content.reshape(4, -1).T).view("<i4").reshape(3, -1)
    return np.asarray(columns.T.astype(np.int64))


def simplified(triangles: Triangles, most: int) -> Triangles:
    """Fewer triangles that resemble others, so many at most; the given ones where they are no more.

    Args:
        triangles: to be resembled.
        most: triangles, 12 at least: those of a box.
    """
    if len(triangles.faces) <= most:
        return triangles
    low, high = triangles.vertices.min(axis=0), triangles.vertices.max(axis=0)
    size = float((high - low).max())
    fine, coarse = SETTINGS.finest_cell * size, size
    for _ in range(SETTINGS.halvings):
        cell = float(np.sqrt(fine * coarse))
        numbers = _cells_of(triangles.vertices - low, cell)
        fine, coarse = (fine, cell) if len(_with_area(numbers[triangles.faces])) <= most else (cell, coarse)
    numbers = _cells_of(triangles.vertices - low, coarse)
    return Triangles(_representatives(triangles, numbers, coarse), _with_area(numbers[triangles.faces]))


def _cells_of(places: FloatArray, cell: float) -> Faces:
    """The number 0, 1, ... of the lattice's cell in which each place (n, 3) is: (n,); the origin is amid one."""
    lattice = np.floor(places / cell + 0.5).astype(np.int64)
    sizes = lattice.max(axis=0) + 1
    keys = (lattice[:, 0] * sizes[1] + lattice[:, 1]) * sizes[2] + lattice[:, 2]
    return np.asarray(np.unique(keys, return_inverse=True)[1])


def _with_area(faces: Faces) -> Faces:
    """The faces with three different vertices, each once; with the opposite orientation it is another face."""
    apart = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    kept = faces[apart]
    turns = (np.argmin(kept, axis=1)[:, None] + np.arange(3)) % 3
    return np.asarray(np.unique(np.take_along_axis(kept, turns, axis=1), axis=0))


def _representatives(triangles: Triangles, numbers: Faces, cell: float) -> FloatArray:
    """The point of each cell nearest to the planes of its triangles, at most a cell's side from their middle.

    Args:
        triangles: whose vertices lie in cells.
        numbers: of the cells, (n,).
        cell: side of the cells, m.
    """
    normals = triangles._doubled_normals
    areas = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(areas, np.finfo(float).tiny)[:, None]
    owners, weights = numbers[triangles.faces].ravel(), np.repeat(areas, 3) + np.finfo(float).tiny
    planes, points = np.repeat(normals, 3, axis=0), triangles.corners.reshape(-1, 3)
    count = int(numbers.max()) + 1

    def summed(values: FloatArray) -> FloatArray:
        return np.bincount(owners, weights * values, count).astype(np.float64)

    total = np.maximum(summed(np.ones(len(owners))), np.finfo(float).tiny)
    middles = np.column_stack([summed(column) / total for column in points.T])
    away = np.einsum("ij,ij->i", planes, points - middles[owners])
    matrix = np.array([[summed(planes[:, i] * planes[:, j]) for j in range(3)] for i in range(3)]).transpose(2, 0, 1)
    right = np.column_stack([summed(planes[:, i] * away) for i in range(3)])
    values, vectors = np.linalg.eigh(matrix)
    known = values > SETTINGS.flat * values[:, -1:]
    along = np.einsum("nij,ni->nj", vectors, right) * known / np.where(known, values, 1.0)
    shift = np.einsum("nij,nj->ni", vectors, along)
    length = np.linalg.norm(shift, axis=1, keepdims=True)
    return np.asarray(middles + shift * np.minimum(1.0, cell / np.maximum(length, np.finfo(float).tiny)))
