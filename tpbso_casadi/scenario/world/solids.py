"""The [[obstacles]] tables of solids in space."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from problems import InvalidProblem
from problems.scene.solids.ball import Ball
from problems.scene.solids.box import Box
from problems.scene.solids.capsule import Capsule
from problems.scene.solids.cylinder import Cylinder
from problems.scene.solids.ellipsoid import Ellipsoid
from problems.scene.solids.half_space import HalfSpace
from tpbso_casadi.scenario.section import Number, Positive
from tpbso_casadi.scenario.world.shape import ObstacleSection

SpatialPoint: TypeAlias = tuple[Number, Number, Number]
Quaternion: TypeAlias = tuple[float, float, float, float]


class SolidSection(ObstacleSection):
    """What all solids have in common: a place, m, and a quaternion (x, y, z, w)."""

    center: SpatialPoint
    quaternion: tuple[Number, Number, Number, Number] | None = None


class SpatialBoxSection(SolidSection):
    """A box in space, m."""

    shape: Literal["box"]
    size: tuple[Positive, Positive, Positive]

    def build(self) -> Box:
        """The obstacle itself."""
        return Box(center=self.center, quaternion=self.quaternion, size=self.size)


class SphereSection(ObstacleSection):
    """A sphere, m."""

    shape: Literal["sphere"]
    center: SpatialPoint
    radius: Positive

    def build(self) -> Ball:
        """The obstacle itself."""
        return Ball(center=self.center, radius=self.radius)


class CapsuleSection(SolidSection):
    """A capsule around a line along its z axis, m."""

    shape: Literal["capsule"]
    radius: Positive
    length: Positive

    def build(self) -> Capsule:
        """The obstacle itself."""
        return Capsule(center=self.center, quaternion=self.quaternion, radius=self.radius, length=self.length)


class CylinderSection(SolidSection):
    """A cylinder along its z axis, m."""

    shape: Literal["cylinder"]
    radius: Positive
    length: Positive

    def build(self) -> Cylinder:
        """The obstacle itself."""
        return Cylinder(center=self.center, quaternion=self.quaternion, radius=self.radius, length=self.length)


class EllipsoidSection(SolidSection):
    """An ellipsoid, m."""

    shape: Literal["ellipsoid"]
    semi_axes: tuple[Positive, Positive, Positive]

    def build(self) -> Ellipsoid:
        """The obstacle itself."""
        return Ellipsoid(center=self.center, quaternion=self.quaternion, semi_axes=self.semi_axes)


class HalfSpaceSection(SolidSection):
    """All that is below a plane through its centre, across its normal; up where neither normal nor quaternion is."""

    shape: Literal["half-space"]
    normal: SpatialPoint | None = None

    def build(self) -> HalfSpace:
        """The obstacle itself."""
        if self.normal is None:
            return HalfSpace(center=self.center, quaternion=self.quaternion)
        if self.quaternion is not None:
            raise InvalidProblem("normal", "the quaternion says already how the half-space is turned")
        return HalfSpace(center=self.center, quaternion=_turned_up_to(self.normal))


def _turned_up_to(normal: SpatialPoint) -> Quaternion | None:
    """The shortest turn from the z axis to a normal of any length; None where there is nothing to turn."""
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise InvalidProblem("normal", "a vector of no length has no direction")
    x, y, z = (part / length for part in normal)
    if x == y == 0.0:
        return None if z > 0.0 else (1.0, 0.0, 0.0, 0.0)
    w = float(np.sqrt((1.0 + z) / 2.0)) if z > 0.0 else float(np.hypot(x, y) / np.sqrt(2.0 * (1.0 - z)))
    return -y / (2.0 * w), x / (2.0 * w), 0.0, w
