"""Shapes of random scenes around the origin of their frame: how a scenario states them, and how far things are away.

Written in NumPy apart from the obstacles that are judged with it. In the plane the room of a segment is positive
exactly where the two do not meet; in space it is the signed distance of a point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from problems.base import FloatArray


class Shape(ABC):
    """A shape in its own frame."""

    @property
    @abstractmethod
    def toml(self) -> str:
        """Its lines in a scenario, without its place."""

    @abstractmethod
    def room(self, points: FloatArray) -> FloatArray:
        """Of the segments between m + 1 consecutive points, (n, m + 1, 2): (n, m); of m points (n, m, 3): (n, m); m."""

    def stated_at(self, place: FloatArray) -> str:
        """Its place in a scenario, of one that does not turn."""
        return f"center = {place.tolist()}"


class Solid(Shape):
    """A shape in space."""

    @property
    @abstractmethod
    def in_coal(self) -> tuple[str, tuple[float, ...]]:
        """Its class in the library coal, and the arguments."""


@dataclass(frozen=True)
class PlanarEllipse(Shape):
    """Semi-axes along x and y, m."""

    semi_axes: tuple[float, float]

    @property
    def toml(self) -> str:
        """Shape and sizes."""
        return f"semi_axes = {list(self.semi_axes)}"

    def room(self, points: FloatArray) -> FloatArray:
        """Where the ellipse is the unit circle, times the smaller semi-axis."""
        scaled = points / np.array(self.semi_axes)
        start, way = scaled[:, :-1], np.diff(scaled, axis=1)
        along = np.clip(-(start * way).sum(axis=2) / (way**2).sum(axis=2), 0.0, 1.0)
        nearest = np.linalg.norm(start + along[..., None] * way, axis=2)
        return np.asarray((nearest - 1.0) * min(self.semi_axes))


@dataclass(frozen=True)
class PlanarPolygon(Shape):
    """Convex parts, corners counter-clockwise (c, 2), m, and the outline of their union."""

    outline: tuple[tuple[float, float], ...]
    parts: tuple[tuple[tuple[float, float], ...], ...]

    @property
    def toml(self) -> str:
        """Shape and sizes."""
        return 'shape = "polygon"'

    def stated_at(self, place: FloatArray) -> str:
        """Where its corners are."""
        return f"points = {(np.array(self.outline) + place).tolist()}"

    def room(self, points: FloatArray) -> FloatArray:
        """The largest gap along a normal of a side or of the segment, of the part where it is least."""
        return np.asarray(np.min([_gap(np.array(part), points) for part in self.parts], axis=0))


@dataclass(frozen=True)
class PlanarBox(Shape):
    """Width and height, m."""

    size: tuple[float, float]

    @property
    def toml(self) -> str:
        """Shape and sizes."""
        return f'shape = "box"\nsize = {list(self.size)}'

    def room(self, points: FloatArray) -> FloatArray:
        """Exact outside."""
        corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * np.array(self.size) / 2.0
        return _gap(corners, points)


def _gap(corners: FloatArray, points: FloatArray) -> FloatArray:
    """How far segments are apart from a convex polygon along the best of all normals, (n, m), m."""
    start, end = points[:, :-1], points[:, 1:]
    best = np.full(start.shape[:2], -np.inf)
    for a, b in pairwise([*corners, corners[0]]):
        outward = np.array([b[1] - a[1], a[0] - b[0]]) / np.hypot(*(b - a))
        best = np.maximum(best, np.minimum((start - a) @ outward, (end - a) @ outward))
    way = end - start
    across = np.stack([-way[..., 1], way[..., 0]], axis=2) / np.linalg.norm(way, axis=2, keepdims=True)
    shadows = np.stack([((corner - start) * across).sum(axis=2) for corner in corners])
    return np.asarray(np.maximum(best, np.maximum(shadows.min(axis=0), -shadows.max(axis=0))))


@dataclass(frozen=True)
class Sphere(Solid):
    """A radius, m."""

    radius: float

    @property
    def toml(self) -> str:
        """Shape and sizes."""
        return f'shape = "sphere"\nradius = {self.radius}'

    @property
    def in_coal(self) -> tuple[str, tuple[float, ...]]:
        """A sphere."""
        return "Sphere", (self.radius,)

    def room(self, points: FloatArray) -> FloatArray:
        """Exact outside."""
        return np.asarray(np.linalg.norm(points, axis=2) - self.radius)


@dataclass(frozen=True)
class SolidBox(Solid):
    """Sizes along x, y and z, m."""

    size: tuple[float, float, float]

    @property
    def toml(self) -> str:
        """Shape and sizes."""
        return f'shape = "box"\nsize = {list(self.size)}'

    @property
    def in_coal(self) -> tuple[str, tuple[float, ...]]:
        """A box."""
        return "Box", self.size

    def room(self, points: FloatArray) -> FloatArray:
        """Exact outside."""
        beyond = np.abs(points) - np.array(self.size) / 2.0
        return np.asarray(np.linalg.norm(np.maximum(beyond, 0.0), axis=2) + np.minimum(beyond.max(axis=2), 0.0))


@dataclass(frozen=True)
class Rod(Solid):
    """A radius and a length along z, m: a capsule with the length between the centres of its ends, or a cylinder."""

    radius: float
    length: float
    is_rounded: bool

    @property
    def toml(self) -> str:
        """Shape and sizes."""
        return (
            f'shape = "{"capsule" if self.is_rounded else "cylinder"}"\nradius = {self.radius}\nlength = {self.length}'
        )

    @property
    def in_coal(self) -> tuple[str, tuple[float, ...]]:
        """Either; the length is along z in both."""
        return "Capsule" if self.is_rounded else "Cylinder", (self.radius, self.length)

    def room(self, points: FloatArray) -> FloatArray:
        """Exact outside."""
        across = np.hypot(points[..., 0], points[..., 1])
        beyond = np.abs(points[..., 2]) - self.length / 2.0
        if self.is_rounded:
            return np.asarray(np.hypot(across, np.maximum(beyond, 0.0)) - self.radius)
        out = np.stack([across - self.radius, beyond])
        return np.asarray(np.linalg.norm(np.maximum(out, 0.0), axis=0) + np.minimum(out.max(axis=0), 0.0))


def random_planar(rng: np.random.Generator) -> Shape:
    """An ellipse, a box, a pentagon or an L, about 0.1 to 0.4 m across."""
    kind = int(rng.integers(4))
    a, b = (float(size) for size in rng.uniform(0.06, 0.2, 2))
    if kind == 0:
        return PlanarEllipse((a, b))
    if kind == 1:
        return PlanarBox((2.0 * a, 2.0 * b))
    if kind == 2:
        angles = 2.0 * np.pi * (np.arange(5) + rng.uniform(-0.15, 0.15, 5)) / 5.0
        corners = tuple((float(a * np.cos(angle)), float(b * np.sin(angle))) for angle in angles)
        return PlanarPolygon(corners, (corners,))
    outline = ((-a, -b), (a, -b), (a, 0.0), (0.0, 0.0), (0.0, b), (-a, b))
    return PlanarPolygon(outline, (((-a, -b), (a, -b), (a, 0.0), (-a, 0.0)), ((-a, -b), (0.0, -b), (0.0, b), (-a, b))))


def random_solid(rng: np.random.Generator) -> Shape:
    """A sphere, a box, a capsule or a cylinder, about 0.1 to 0.4 m across."""
    kind = int(rng.integers(4))
    a, b, c = (float(size) for size in rng.uniform(0.05, 0.13, 3))
    if kind == 0:
        return Sphere(a)
    return SolidBox((2.0 * a, 2.0 * b, 2.0 * c)) if kind == 1 else Rod(a, 3.0 * b, is_rounded=kind == 2)
