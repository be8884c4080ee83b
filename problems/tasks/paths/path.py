"""Paths that the tip has to follow: ordered points, with corners that must not be rounded off.

A path is what the paper stores: "we sampled 50 points of each and stored the point set by order". Its points are
passed at equal intervals of time, so point i of n belongs to the path parameter u = i / (n - 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.base.ranges import COORDINATES, check_within

CORNER_ANGLE = pi / 4.0  # a change of direction of at least this is a corner
MAX_POINTS = 2000  # of a path; more take minutes to build
FINE_POLYGON_POINTS = 4000  # of the polygon from which a smooth shape is resampled


@dataclass(frozen=True)
class Path:
    """Ordered points in the plane.

    Args:
        points: n >= 2 positions (x, y), m; for a closed path the last repeats the first.
        corners: indices of the inner points that are corners.

    Raises:
        InvalidProblem: fewer than two points, one that is not finite, or two consecutive ones that are the same.
    """

    points: tuple[tuple[float, float], ...]
    corners: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise InvalidProblem("points", f"a path has at least 2 points, not {len(self.points)}")
        for index, point in enumerate(self.points):
            check_within("points", point, COORDINATES, "m", f"points[{index}]: ")
            if index > 0 and point == self.points[index - 1]:
                raise InvalidProblem("points", f"points[{index - 1}] and points[{index}] are the same, {point}")

    @classmethod
    def through(cls, points: ArrayLike, closed: bool = False) -> Path:
        """The path through points (n, 2) in m, with corners where the direction changes by 45 degrees or more.

        Args:
            points: in order.
            closed: whether to go back to the first point, unless the path ends there already.
        """
        listed = [(float(x), float(y)) for x, y in np.asarray(points, dtype=np.float64).reshape(-1, 2)]
        if closed and len(listed) > 1 and listed[0] != listed[-1]:
            listed.append(listed[0])
        return cls(tuple(listed), _corners(np.array(listed)))

    @cached_property
    def array(self) -> FloatArray:
        """The points, (n, 2), m."""
        return np.array(self.points)

    def resampled(self, count: int) -> Path:
        """The same way with ``count`` points: both ends, every corner, and the rest spread evenly in between.

        Raises:
            InvalidProblem: fewer points than ends and corners.
        """
        check_count("count", count)
        fixed_points = [0, *self.corners, len(self.points) - 1]
        if count < len(fixed_points):
            raise InvalidProblem("count", f"{count} points cannot hold both ends and {len(fixed_points) - 2} corners")
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.array, axis=0).T))])
        stretches = _shares(np.diff(along[fixed_points]), count - 1)
        places = [
            np.linspace(along[start], along[end], pieces, endpoint=False)
            for start, end, pieces in zip(fixed_points[:-1], fixed_points[1:], stretches, strict=True)
        ]
        at = np.append(np.concatenate(places), along[-1])
        x, y = (np.interp(at, along, coordinate) for coordinate in self.array.T)
        corners = np.cumsum(stretches)[:-1].tolist()
        return Path(tuple(zip(x.tolist(), y.tolist(), strict=True)), tuple(corners))


def check_count(field: str, count: int) -> None:
    """There are no more points than a path may have."""
    if count > MAX_POINTS:
        raise InvalidProblem(field, f"more than {MAX_POINTS} points")


def _corners(points: FloatArray) -> tuple[int, ...]:
    if len(points) < 3:
        return ()
    steps = np.diff(points, axis=0)
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = (np.diff(directions) + pi) % (2.0 * pi) - pi
    return tuple((np.flatnonzero(np.abs(turns) >= CORNER_ANGLE) + 1).tolist())


def _shares(lengths: FloatArray, total: int) -> list[int]:
    """``total`` intervals, at least one each, shared so that the longest interval becomes as short as can be."""
    shares = np.ones(len(lengths), dtype=int)
    for _ in range(total - len(lengths)):
        shares[np.argmax(lengths / shares)] += 1
    return shares.tolist()


def pentagram(center: tuple[float, float], radius: float, angle: float = pi / 2.0, count: int = 50) -> Path:
    """The five-pointed star drawn in one stroke.

    Args:
        center: of its circumscribed circle, m.
        radius: of that circle, m.
        angle: direction of the first corner, rad.
        count: number of points.
    """
    directions = angle + np.arange(6) * (4.0 * pi / 5.0)
    corners = np.array(center) + radius * np.column_stack([np.cos(directions), np.sin(directions)])
    corners[-1] = corners[0]
    return Path.through(corners).resampled(count)


def closed_curve(
    center: tuple[float, float], radius: float, angle: float, waves: int, depth: float, count: int
) -> Path:
    """A smooth closed curve with waves: rho(phi) = radius (1 + depth cos(waves (phi - angle))).

    Args:
        center: m.
        radius: mean distance from the center, m.
        angle: direction in which the curve starts, rad.
        waves: number of crests.
        depth: height of a crest over the radius, in (-1, 1); negative starts in a trough.
        count: number of points, equally spaced along the curve.
    """
    phi = angle + np.linspace(0.0, 2.0 * pi, FINE_POLYGON_POINTS + 1)
    rho = radius * (1.0 + depth * np.cos(waves * (phi - angle)))
    fine = np.array(center) + np.column_stack([rho * np.cos(phi), rho * np.sin(phi)])
    fine[-1] = fine[0]
    return Path.through(fine).resampled(count)
