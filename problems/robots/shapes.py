"""Shapes of a link's collision geometry: boxes, cylinders, spheres, capsules and meshes, where a file states them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.geometry import box_corners, capsule_corners, cylinder_corners, facing_out
from problems.robots.chain import UNTURNED
from problems.robots.spheres import Ball, cover_box, cover_cylinder, covered_capsule
from problems.robots.transform import Matrix3, Point3, Transform

NO_TRIANGLES = np.empty((0, 3, 3))


@dataclass(frozen=True)
class Shape(ABC):
    """A part of a link.

    Attributes:
        translation: of its own frame in the link's, m.
        rotation: the same.
    """

    translation: Point3 = (0.0, 0.0, 0.0)
    rotation: Matrix3 = UNTURNED

    @property
    def pose(self) -> Transform:
        """From its own frame to the link's."""
        return Transform(self.rotation, self.translation)

    @abstractmethod
    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """Those that hold it, by a formula, in its own frame; none of a mesh.

        Args:
            overhang: how far they may leave it, m; by default as few as are usual for the shape. A shape with
                triangles needs no more than these.
        """

    @property
    def triangles(self) -> FloatArray:
        """Corners of triangles around it, in its own frame, (n, 3, 3), m; none where balls say all by default."""
        return NO_TRIANGLES

    @property
    def surface(self) -> FloatArray:
        """Corners of triangles to be looked at, in its own frame, (n, 3, 3), m; none of a mesh."""
        return facing_out(self.triangles)

    @property
    def mesh(self) -> MeshShape | None:
        """Itself, where a file has it; None by default."""
        return None

    def placed(self, corners: FloatArray) -> FloatArray:
        """Corners (n, 3, 3) of its own frame in the link's."""
        return np.asarray(corners @ np.array(self.rotation).T + np.array(self.translation))


@dataclass(frozen=True, kw_only=True)
class SphereShape(Shape):
    """A sphere about its origin; radius in m."""

    radius: float

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """Itself."""
        return (Ball((0.0, 0.0, 0.0), self.radius, self.radius),)

    @property
    def surface(self) -> FloatArray:
        """Of a polyhedron in it."""
        return capsule_corners(self.radius, 0.0)


@dataclass(frozen=True, kw_only=True)
class CapsuleShape(Shape):
    """Half spheres around the ends of a cylinder about its origin along z; m, the length without the ends."""

    radius: float
    length: float

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """Some in a row."""
        half = self.length / 2.0
        return covered_capsule((0.0, 0.0, -half), (0.0, 0.0, half), self.radius, overhang)

    @property
    def surface(self) -> FloatArray:
        """Of a polyhedron in it."""
        return capsule_corners(self.radius, self.length)


@dataclass(frozen=True, kw_only=True)
class CylinderShape(Shape):
    """A cylinder about its origin along z; m."""

    radius: float
    length: float

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """Some in a row."""
        return cover_cylinder(self.radius, self.length)

    @property
    def triangles(self) -> FloatArray:
        """Of a prism around it."""
        return cylinder_corners(self.radius, self.length)


@dataclass(frozen=True, kw_only=True)
class BoxShape(Shape):
    """A box about its origin; full sizes along x, y, z, m."""

    sizes: Point3

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """One for each of its cells."""
        return cover_box(self.sizes)

    @property
    def triangles(self) -> FloatArray:
        """Its sides."""
        return box_corners(self.sizes)


@dataclass(frozen=True, kw_only=True)
class MeshShape(Shape):
    """A mesh in a file.

    Attributes:
        file: as it is named: a path or a URL, as ``package://arm_description/meshes/link1.stl``.
        scale: of its coordinates.
    """

    file: str
    scale: Point3 = (1.0, 1.0, 1.0)

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """None: its triangles are not known here."""
        return ()

    @property
    def mesh(self) -> MeshShape:
        """Itself."""
        return self
