"""Surfaces of obstacles as plane faces, and what a painter has to know of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from problems.base.matrix import FloatArray
from problems.scene.obstacle import Obstacle

SHARP = float(np.cos(np.radians(30.0)))  # of the angle between two faces whose common edge is drawn
TOUCHING = 1e-9  # m: what lies on a face is outside


@dataclass(frozen=True)
class Edge:
    """An edge between two vertices.

    Attributes:
        ends: their numbers.
        faces: the numbers of those that meet in it, one or two.
        sharp: whether it is drawn wherever it is seen from.
    """

    ends: tuple[int, int]
    faces: tuple[int, ...]
    sharp: bool


@dataclass(frozen=True)
class Polyhedron:
    """The surface of something convex.

    Attributes:
        vertices: (n, 3), m.
        faces: their corners, counter-clockwise from outside.
    """

    vertices: FloatArray
    faces: tuple[tuple[int, ...], ...]

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals of the faces, outwards, (faces, 3)."""
        sums, counts = np.empty((len(self.faces), 3)), np.array([len(face) for face in self.faces])
        for count in np.unique(counts):
            numbers = np.flatnonzero(counts == count)
            rings = self.vertices[np.array([self.faces[number] for number in numbers])]
            sums[numbers] = np.cross(rings, np.roll(rings, -1, axis=1)).sum(axis=1)
        return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(float).tiny))

    @cached_property
    def offsets(self) -> FloatArray:
        """Of the faces' planes from the origin along the normals, (faces,), m."""
        middles = np.array([self.vertices[list(face)].mean(axis=0) for face in self.faces])
        return np.asarray(np.sum(middles * self.normals, axis=1))

    @cached_property
    def center(self) -> FloatArray:
        """The mean of its vertices, (3,), m."""
        return np.asarray(self.vertices.mean(axis=0))

    def beyond(self, points: FloatArray) -> FloatArray:
        """How far points (..., 3) are outside of each face, (..., faces), m."""
        return np.asarray(points @ self.normals.T - self.offsets)

    def hides(self, points: FloatArray, eye: FloatArray) -> np.ndarray:
        """Whether it is between points (n, 3) and an eye (3,): (n,)."""
        near, far = self.beyond(points), self.beyond(eye)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = near / (near - far)  # of the way to the eye
        enters = np.where(near > 0.0, np.where(far > 0.0, np.inf, crossing), 0.0).max(axis=1)
        leaves = np.where((near <= 0.0) & (far > 0.0), crossing, 1.0).min(axis=1)
        return np.asarray(enters < leaves)

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """Each once."""
        meeting: dict[tuple[int, int], list[int]] = {}
        for number, face in enumerate(self.faces):
            for one, two in zip(face, (*face[1:], face[0]), strict=True):
                meeting.setdefault((min(one, two), max(one, two)), []).append(number)
        return tuple(
            Edge(ends, tuple(faces), len(faces) == 1 or float(self.normals[faces[0]] @ self.normals[faces[1]]) < SHARP)
            for ends, faces in meeting.items()
        )


def polyhedron_of(obstacle: Obstacle) -> Polyhedron:
    """The surface of an obstacle in space."""
    vertices, faces = obstacle.surface()
    return Polyhedron(vertices, tuple(tuple(face) for face in faces))


def separating_planes(
    solids: Sequence[Polyhedron], pairs: Iterable[tuple[int, int]] | None = None
) -> dict[tuple[int, int], int]:
    """For pairs (a, b) the face of a outside of whose plane b lies; pairs are left out where there is none.

    Args:
        solids: all of them.
        pairs: that are looked at; all where None.
    """
    found = {}
    for pair in combinations(range(len(solids)), 2) if pairs is None else pairs:
        for a, b in (pair, pair[::-1]):
            outside = solids[a].beyond(solids[b].vertices).min(axis=0)
            if outside.max() >= -TOUCHING:
                found[a, b] = int(outside.argmax())
    return found
