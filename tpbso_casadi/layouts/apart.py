"""Distances between things that stand on the floor, seen from above."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from problems import Obstacle
from problems.base import FloatArray
from problems.robots import SpatialArm, Transform
from problems.scene import Solid
from tpbso_casadi.scenario import Scenario

AROUND = 16  # corners of a polygon around a ball
ROUND = 1e-12  # m: an outline narrower than this is a line


@dataclass(frozen=True, eq=False)
class Outline:
    """A convex outline seen from above.

    Attributes:
        corners: counter-clockwise, (n, 2), m.
    """

    corners: FloatArray

    @classmethod
    def of(cls, solid: Solid) -> Outline:
        """The outline of a solid: exactly of what has corners, of others by that of their drawing."""
        return cls.around(solid.outline()[:, :2])

    @classmethod
    def around(cls, points: FloatArray) -> Outline:
        """The outline of points (n, 2), m."""
        try:
            return cls(points[ConvexHull(points).vertices])
        except QhullError:  # it is a line, or a point
            return cls(points)

    def distance(self, other: Outline) -> float:
        """The distance from another outline, m; less than 0 by how much they overlap."""
        edges = np.concatenate([_normals(self.corners), _normals(other.corners)])
        between = [_gap(self.corners @ normal, other.corners @ normal) for normal in edges]
        apart = max(between, default=-np.inf)
        if apart > 0.0 or not between:
            apart = min(_from_corners(self.corners, other.corners), _from_corners(other.corners, self.corners))
        return float(apart)


def _normals(corners: FloatArray) -> FloatArray:
    """Unit vectors across the edges of an outline, (n, 2); none of a point."""
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(edges, axis=1)
    kept = lengths > ROUND
    return np.asarray((edges[kept] / lengths[kept, None]) @ np.array([[0.0, -1.0], [1.0, 0.0]]))


def _gap(one: FloatArray, other: FloatArray) -> float:
    """The distance of two ranges of numbers; less than 0 by how much they overlap."""
    return float(max(one.min() - other.max(), other.min() - one.max()))


def _from_corners(corners: FloatArray, outline: FloatArray) -> float:
    """The distance of corners from the edges of an outline, m."""
    start, edge = outline, np.roll(outline, -1, axis=0) - outline
    away = corners[:, None] - start
    squares = (edge**2).sum(axis=1)
    share = np.divide((away * edge).sum(axis=2), squares, out=np.zeros(away.shape[:2]), where=squares > ROUND**2)
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * edge
    return float(np.linalg.norm(corners[:, None] - foot, axis=2).min())


def outlines_named(name: str, obstacles: Sequence[tuple[str, Obstacle]]) -> list[Outline]:
    """The outlines of obstacles of a name, or in a frame of it; ``*`` stands for anything.

    Args:
        name: of obstacles, or of their frame.
        obstacles: each with the name of its frame, empty where it is stated in the world.
    """
    return [
        Outline.of(obstacle)
        for frame, obstacle in obstacles
        if isinstance(obstacle, Solid) and (fnmatchcase(obstacle.name, name) or (frame and fnmatchcase(frame, name)))
    ]


def outline_of_base(arm: SpatialArm, base: Transform) -> Outline:
    """The convex outline of the balls that hold the links which no joint moves.

    Args:
        arm: that has them, wherever it stands.
        base: where it is to stand.
    """
    turned, shift = np.array(base.rotation, dtype=np.float64), np.array(base.translation, dtype=np.float64)
    balls = [sphere for sphere in arm.spheres if sphere.link == 0]
    centers = np.array([ball.center for ball in balls]).reshape(-1, 3) @ turned.T + shift
    radii = np.array([float(ball.radius) for ball in balls]) / np.cos(np.pi / AROUND)
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    points = centers[:, None, :2] + radii[:, None, None] * circle
    return Outline.around(points.reshape(-1, 2) if balls else shift[None, :2])


def distance_between(one: Sequence[Outline], other: Sequence[Outline]) -> float:
    """The least distance between outlines of two things, m; infinite where there is nothing."""
    return min((first.distance(second) for first in one for second in other), default=np.inf)


def outlines_around(placed: Scenario, world: Scenario) -> list[tuple[str, FloatArray]]:
    """The outlines of all solids of a layout, seen from above, each with the name of its frame, or its own.

    Args:
        placed: the layout with its frames.
        world: the same in the world.

    Returns:
        Names, empty where there is none, and corners, (n, 2) each, m.
    """
    frames = [obstacle.frame for obstacle in placed.obstacles]
    parts = [(frame, part) for frame, table in zip(frames, world.obstacles, strict=True) for part in table.built(1)]
    solids = [(frame, part) for frame, part in parts if isinstance(part, Solid) and np.isfinite(part.width).all()]
    return [(frame or part.name, Outline.of(part).corners) for frame, part in solids]
