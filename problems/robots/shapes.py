"""Shapes of a link's collision geometry: boxes, cylinders, spheres, capsules and meshes, where a file states them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.geometry import Hull, box_corners, capsule_corners, cover_of, cylinder_corners, facing_out
from problems.robots.spheres import STICK_OUT, Ball, cover_box, cover_cylinder, covered_capsule
from problems.robots.transform import UNMOVED, FixedFrame, Point3, as_point

NO_TRIANGLES = np.empty((0, 3, 3))


@dataclass(frozen=True, eq=False)
class Bulk:
    """The volume of a body and its second moments.

    Attributes:
        volume: m^3.
        center: of it, (3,), m.
        second: the mean of r r^T over it, about the origin, (3, 3), m^2.
    """

    volume: float
    center: FloatArray
    second: FloatArray

    @property
    def spread(self) -> FloatArray:
        """The mean of r r^T about its centre, (3, 3), m^2."""
        return np.asarray(self.second - np.outer(self.center, self.center))

    @classmethod
    def about_its_origin(cls, volume: float, *variances: float) -> Bulk:
        """The bulk of a body symmetric about its origin, with the mean squares of x, y and z, m^2."""
        return cls(volume, np.zeros(3), np.diag(variances))


@dataclass(frozen=True)
class Shape(ABC):
    """A geometric part of a link.

    Attributes:
        pose: of its own frame in the link's.
    """

    pose: FixedFrame = UNMOVED

    @abstractmethod
    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        """Balls that hold it, by a formula, in its own frame; none of a mesh.

        Args:
            overhang: how far they may leave it, m, as far as a limited number allows; by default as few as are usual
                for the shape.
        """

    @property
    def triangles(self) -> FloatArray:
        """Corners of triangles around it, in its own frame, (n, 3, 3), m; by default none, as balls say all."""
        return NO_TRIANGLES

    @property
    def surface(self) -> FloatArray:
        """Corners of triangles for drawing, in its own frame, (n, 3, 3), m; none of a mesh."""
        return facing_out(self.triangles)

    @property
    def mesh(self) -> MeshShape | None:
        """The shape itself, where it is a mesh in a file; None by default."""
        return None

    @property
    @abstractmethod
    def bulk(self) -> Bulk:
        """The volume and its moments, in its own frame.

        Raises:
            NotImplementedError: of a mesh, which is not known here.
        """

    def placed(self, corners: FloatArray) -> FloatArray:
        """Corners (n, 3, 3) of its own frame in the link's."""
        return np.asarray(corners @ np.array(self.pose.rotation).T + np.array(self.pose.translation))


@dataclass(frozen=True, kw_only=True)
class SphereShape(Shape):
    """A sphere about its origin; radius in m."""

    radius: float

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        return (Ball((0.0, 0.0, 0.0), self.radius, self.radius),)

    @property
    def bulk(self) -> Bulk:
        return Bulk.about_its_origin(4.0 / 3.0 * np.pi * self.radius**3, *(self.radius**2 / 5.0,) * 3)

    @property
    def surface(self) -> FloatArray:
        return capsule_corners(self.radius, 0.0)


@dataclass(frozen=True, kw_only=True)
class CapsuleShape(Shape):
    """Half spheres around the ends of a cylinder about its origin along z; m, the length without the ends."""

    radius: float
    length: float

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        half = self.length / 2.0
        return covered_capsule((0.0, 0.0, -half), (0.0, 0.0, half), self.radius, overhang)

    @property
    def bulk(self) -> Bulk:
        """The bulk of a cylinder and two half balls, whose centres are 3/8 of the radius from the discs."""
        r, h = self.radius, self.length / 2.0
        middle, ends = 2.0 * np.pi * r**2 * h, 4.0 / 3.0 * np.pi * r**3
        across = (middle * r**2 / 4.0 + ends * r**2 / 5.0) / (middle + ends)
        along = (middle * h**2 / 3.0 + ends * (r**2 / 5.0 + 0.75 * r * h + h**2)) / (middle + ends)
        return Bulk.about_its_origin(middle + ends, across, across, along)

    @property
    def surface(self) -> FloatArray:
        return capsule_corners(self.radius, self.length)


@dataclass(frozen=True, kw_only=True)
class CylinderShape(Shape):
    """A cylinder about its origin along z; m."""

    radius: float
    length: float

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        return cover_cylinder(self.radius, self.length)

    @property
    def triangles(self) -> FloatArray:
        return cylinder_corners(self.radius, self.length)

    @property
    def bulk(self) -> Bulk:
        across = self.radius**2 / 4.0
        return Bulk.about_its_origin(np.pi * self.radius**2 * self.length, across, across, self.length**2 / 12.0)


@dataclass(frozen=True, kw_only=True)
class BoxShape(Shape):
    """A box about its origin; full sizes along x, y, z, m."""

    sizes: Point3

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        return cover_box(self.sizes, overhang)

    @property
    def triangles(self) -> FloatArray:
        return box_corners(self.sizes)

    @property
    def bulk(self) -> Bulk:
        return Bulk.about_its_origin(float(np.prod(self.sizes)), *(side**2 / 12.0 for side in self.sizes))


@dataclass(frozen=True, kw_only=True)
class HullShape(Shape):
    """The convex hull of points, (x, y, z), m."""

    points: tuple[Point3, ...]

    @property
    def triangles(self) -> FloatArray:
        return Hull.of(np.array(self.points)).faces

    def balls(self, overhang: float | None = None) -> tuple[Ball, ...]:
        balls = cover_of(self.triangles, STICK_OUT if overhang is None else overhang).balls
        each = zip(balls.centers, balls.radii.tolist(), strict=True)
        return tuple(Ball(as_point(center), radius) for center, radius in each)

    @property
    def bulk(self) -> Bulk:
        corners = self.triangles
        volumes = np.linalg.det(corners) / 6.0
        total, sums = float(volumes.sum()), corners.sum(axis=1)
        products = np.einsum("nki,nkj->nij", corners, corners) + np.einsum("ni,nj->nij", sums, sums)
        return Bulk(total, volumes @ sums / (4.0 * total), np.einsum("n,nij->ij", volumes, products) / (20.0 * total))


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
        return ()

    @property
    def bulk(self) -> Bulk:
        raise NotImplementedError

    @property
    def mesh(self) -> MeshShape:
        return self
