"""Views of space: orthogonal, along an axis; or in perspective, from an eye."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray

EYE = 3.2  # how far it is away, in radii of what it looks at
AZIMUTH, ELEVATION = -50.0, 24.0  # degrees; where it is


@dataclass(frozen=True)
class View:
    """Where a picture is seen from.

    Attributes:
        axes: to the right, up, and toward the eye: unit vectors in rows, (3, 3).
        center: what it looks at, (3,), m.
        distance: of the eye from there, m; None where all lines of sight are parallel.
    """

    axes: FloatArray
    center: FloatArray
    distance: float | None = None

    def project(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in the picture, (..., 2): in m at the centre's depth."""
        if self.distance is None:
            return np.asarray(points @ self.axes[:2].T)
        return np.asarray((points - self.center) @ self.axes[:2].T * self.magnification(points)[..., None])

    def magnification(self, points: FloatArray) -> FloatArray:
        """How much larger than at the centre something looks at points (..., 3)."""
        if self.distance is None:
            return np.ones(points.shape[:-1])
        return np.asarray(self.distance / np.maximum(self.distance - self.depth(points), self.distance / 100.0))

    def depth(self, points: FloatArray) -> FloatArray:
        """How far points (..., 3) are from the centre toward the eye, m."""
        return np.asarray((points - self.center) @ self.axes[2])

    def sees(self, normals: FloatArray, offsets: FloatArray) -> np.ndarray:
        """Whether the eye is outside of planes: normals (n, 3), offsets (n,) in m."""
        if self.distance is None:
            return np.asarray(normals @ self.axes[2] > 0.0)
        return np.asarray(normals @ self.eye > offsets)

    @property
    def eye(self) -> FloatArray:
        """Where the eye of a view in perspective is, (3,), m."""
        return np.asarray(self.center + (self.distance or 0.0) * self.axes[2])


def orthogonal(right: int, up: int, toward: tuple[float, float, float]) -> View:
    """The view in which two coordinates are to the right and up."""
    return View(np.array([np.eye(3)[right], np.eye(3)[up], toward]), np.zeros(3))


TOP, FRONT, SIDE = orthogonal(0, 1, (0, 0, 1)), orthogonal(0, 2, (0, -1, 0)), orthogonal(1, 2, (1, 0, 0))


def perspective(center: FloatArray, radius: float, azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> View:
    """What lies in a ball seen by an eye at so many degrees."""
    a, e = np.radians([azimuth, elevation])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return View(np.array([right, np.cross(toward, right), toward]), center, EYE * radius)
