"""Paths of the tool: points, corners, knots.

A path is what the paper stores: "we sampled 50 points of each and stored the point set by order". Its points are
passed at equal intervals of time, so point i of n belongs to the path parameter u = i / (n - 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from problems.base import (
    COORDINATES,
    Angle,
    Coordinate,
    FloatArray,
    InvalidProblem,
    Length,
    check_fields,
    check_within,
    conformed,
)
from problems.robots import Orientations, unit_quaternions

CORNER_ANGLE = pi / 4.0  # a change of direction of at least this is a corner
MAX_POINTS = 2000  # of a path; more take minutes to build
FINE_POLYGON_POINTS = 4000  # of the polygon from which a smooth shape is resampled
PLANAR, SPATIAL, POSE = 2, 3, 7  # numbers of a point in the plane or in space, and of a pose


@dataclass(frozen=True)
class Path:
    """A path of ordered points in the plane or in space; in space with orientations of the tool or without.

    Between two points the path is straight, and the orientation turns about one axis, evenly over the distance.

    Args:
        points: n >= 2 positions (x, y) or (x, y, z), m; for a closed path the last repeats the first.
        corners: indices of the inner points that are corners.
        quaternions: of the tool at each point, (x, y, z, w), of length 1; empty where its orientation is free.

    Raises:
        InvalidProblem: fewer than two points, one that is not finite, or two consecutive ones that are the same;
            a quaternion that is not of length 1, or turns by half a turn against the one before.
    """

    points: tuple[tuple[float, ...], ...]
    corners: tuple[int, ...] = ()
    quaternions: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        if len(self.points) < 2:
            raise InvalidProblem("points", f"a path has at least 2 points, not {len(self.points)}")
        for index, point in enumerate(self.points):
            check_within("points", point, COORDINATES, "m", f"points[{index}]: ")
            if index > 0 and point == self.points[index - 1]:
                raise InvalidProblem("points", f"points[{index - 1}] and points[{index}] are the same, {point}")
        if self.quaternions:
            unit_quaternions(self.quaternions)

    @classmethod
    def through(cls, points: ArrayLike, closed: bool = False) -> Path:
        """The path through points in m, with corners where the direction changes by 45 degrees or more.

        Args:
            points: in order; positions (n, 2) or (n, 3), or poses (n, 7): positions and quaternions (x, y, z, w).
            closed: whether to go back to the first point, unless the path ends there already.
        """
        given = np.asarray(points, dtype=np.float64)
        given = given if given.ndim == 2 and given.shape[1] in (SPATIAL, POSE) else given.reshape(-1, PLANAR)
        listed = given[:, :SPATIAL]
        if closed and len(listed) > 1 and listed[0].tolist() != listed[-1].tolist():
            listed, given = (np.vstack([rows, rows[:1]]) for rows in (listed, given))
        turned = given[:, SPATIAL:]
        quaternions = _tuples(unit_quaternions(turned)) if turned.shape[1] else ()
        return cls(_tuples(listed), _corners(listed), quaternions)

    @cached_property
    def array(self) -> FloatArray:
        """The points, (n, dim), m."""
        return np.array(self.points)

    @cached_property
    def orientations(self) -> Orientations | None:
        """The orientations of the tool along the path; None where they are free."""
        return Orientations(np.array(self.quaternions)) if self.quaternions else None

    def resampled(self, count: int) -> Path:
        """The path with ``count`` points: both ends, every corner, and the rest evenly spread in between.

        Raises:
            InvalidProblem: fewer points than ends and corners.
        """
        check_count("count", count)
        fixed_points = [0, *self.corners, len(self.points) - 1]
        if count < len(fixed_points):
            raise InvalidProblem("count", f"{count} points cannot hold both ends and {len(fixed_points) - 2} corners")
        along = np.concatenate([[0.0], np.cumsum(np.hypot.reduce(np.diff(self.array, axis=0), axis=1))])
        stretches = _shares(np.diff(along[fixed_points]), count - 1)
        places = [
            np.linspace(along[start], along[end], pieces, endpoint=False)
            for start, end, pieces in zip(fixed_points[:-1], fixed_points[1:], stretches, strict=True)
        ]
        at = np.append(np.concatenate(places), along[-1])
        points = np.column_stack([np.interp(at, along, coordinate) for coordinate in self.array.T])
        quaternions = () if self.orientations is None else _tuples(self.orientations.between(along, at))
        corners = np.cumsum(stretches)[:-1].tolist()
        return Path(_tuples(points), tuple(corners), quaternions)


def _tuples(rows: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in rows.tolist())


def check_count(field: str, count: int) -> None:
    """Check that there are no more points than a path may have."""
    if count > MAX_POINTS:
        raise InvalidProblem(field, f"more than {MAX_POINTS} points")


def _corners(points: FloatArray) -> tuple[int, ...]:
    if len(points) < 3:
        return ()
    steps = np.diff(points, axis=0)
    turns = _turns(steps) if points.shape[1] == PLANAR else _turns_in_space(steps)
    return tuple((np.flatnonzero(np.abs(turns) >= CORNER_ANGLE) + 1).tolist())


def _turns(steps: FloatArray) -> FloatArray:
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    return np.asarray((np.diff(directions) + pi) % (2.0 * pi) - pi)


def _turns_in_space(steps: FloatArray) -> FloatArray:
    across = np.linalg.norm(np.cross(steps[:-1], steps[1:]), axis=1)
    return np.asarray(np.arctan2(across, np.einsum("nd,nd->n", steps[:-1], steps[1:])))


def _shares(lengths: FloatArray, total: int) -> list[int]:
    """Numbers of intervals, ``total`` in all, one at least each, so that the longest interval is shortest."""
    shares = np.ones(len(lengths), dtype=int)
    for _ in range(total - len(lengths)):
        shares[np.argmax(lengths / shares)] += 1
    return shares.tolist()


def _check_curve(center: Any, radius: Any, **angles: Any) -> tuple[tuple[float, float], float]:
    """Centre and radius of a curve, m, as numbers; its angles and the like must be numbers too."""
    for name, value in angles.items():
        conformed(name, value, Angle)
    return conformed("center", center, tuple[Coordinate, Coordinate]), conformed("radius", radius, Length)


def pentagram(center: tuple[float, float], radius: float, angle: float = pi / 2.0, count: int = 50) -> Path:
    """The five-pointed star drawn in one stroke.

    Args:
        center: of its circumscribed circle, m.
        radius: of that circle, m.
        angle: direction of the first corner, rad.
        count: number of points.

    Raises:
        InvalidProblem: a number is none, or out of range.
    """
    center, radius = _check_curve(center, radius, angle=angle)
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

    Raises:
        InvalidProblem: a number is none, or out of range.
    """
    center, radius = _check_curve(center, radius, angle=angle, waves=waves, depth=depth)
    phi = angle + np.linspace(0.0, 2.0 * pi, FINE_POLYGON_POINTS + 1)
    rho = radius * (1.0 + depth * np.cos(waves * (phi - angle)))
    fine = np.array(center) + np.column_stack([rho * np.cos(phi), rho * np.sin(phi)])
    fine[-1] = fine[0]
    return Path.through(fine).resampled(count)


@dataclass(frozen=True, kw_only=True)
class KnotSettings:
    """Settings of the choice of knots along a path.

    Values are chosen.

    Attributes:
        spacing_radius: share of the reach: radius of curvature of a joint-space curve between two knots.
        most_spacing: share of the reach: largest distance of two knots.
        most_knots: knots that are inserted; given points are knots anyway.
        stopping_angle: change of direction, rad, from which on a stop costs less than the path around it.
        overshoot: share of knot distance times angle by which a spline overshoots a bend, approximately.
        most_turn: angle, rad, by which the tool turns from one knot to the next.
    """

    spacing_radius: float = 0.2
    most_spacing: float = 0.06
    most_knots: int = 400
    stopping_angle: float = np.pi / 3.0
    overshoot: float = 0.15
    most_turn: float = 0.2


SETTINGS = KnotSettings()


@dataclass(frozen=True, kw_only=True)
class PathKnots:
    """The knots of a path: its points, and others on the lines between them.

    Attributes:
        u: path parameters, by distance along the path, from 0 to 1, (M,).
        points: (M, dim), m.
        segments: of each knot but the last, the number of the line on which the interval after it lies, (M - 1,).
        vertices: indices of the knots that are given points, (n,).
        corners: indices of the inner knots at which the path turns too sharply for a spline.
        rotations: of the tool, (M, 3, 3); None where its orientation is free.
    """

    u: FloatArray
    points: FloatArray
    segments: NDArray[np.intp]
    vertices: NDArray[np.intp]
    corners: tuple[int, ...]
    rotations: FloatArray | None = None


def knots_of(path: Path, accuracy: float, reach: float, angular_accuracy: float = np.inf) -> PathKnots:
    """Knots so dense that a spline through them, stopped at corners, leaves the path by much less than the accuracy.

    Args:
        path: whose points.
        accuracy: m.
        reach: of the robot, m.
        angular_accuracy: rad, where the tool is turned as the path says.
    """
    vertices, orientations = path.array, path.orientations
    lengths = np.hypot.reduce(np.diff(vertices, axis=0), axis=1)
    spacing = min(np.sqrt(2.0 * accuracy * SETTINGS.spacing_radius * reach), SETTINGS.most_spacing * reach)
    counts = np.ceil(lengths / max(spacing, lengths.sum() / SETTINGS.most_knots)).astype(int)
    if orientations is not None:
        counts = np.maximum(counts, _counts_by_turn(orientations.angles, angular_accuracy))
    segments = np.repeat(np.arange(len(lengths)), counts)
    shares = np.concatenate([np.arange(count) / count for count in counts])
    points = vertices[segments] + shares[:, None] * np.diff(vertices, axis=0)[segments]
    along = np.append(0.0, np.cumsum(lengths))
    distances = along[segments] + shares * lengths[segments]
    first = np.append(0, np.cumsum(counts))  # the knot at each vertex
    sharp = set(_sharp(vertices, lengths / counts, accuracy).tolist())
    if orientations is not None:
        sharp |= set(_sharply_turning(orientations, lengths, counts, angular_accuracy).tolist())
    return PathKnots(
        u=np.append(distances, along[-1]) / along[-1],
        points=np.vstack([points, vertices[-1:]]),
        segments=segments,
        vertices=first,
        corners=tuple(int(first[i]) for i in sorted(sharp)),
        rotations=None if orientations is None else _rotations(orientations, segments, shares),
    )


def _counts_by_turn(angles: FloatArray, accuracy: float) -> NDArray[np.intp]:
    """Numbers of knots on each line, so that the tool turns little from one to the next."""
    spacing = min(np.sqrt(2.0 * accuracy * SETTINGS.spacing_radius), SETTINGS.most_turn)
    return np.asarray(np.ceil(angles / max(spacing, angles.sum() / SETTINGS.most_knots)), dtype=np.intp)


def _rotations(orientations: Orientations, segments: NDArray[np.intp], shares: FloatArray) -> FloatArray:
    last = orientations.matrices[-1:]
    return np.concatenate([orientations.along(segments, shares), last])


def _sharply_turning(
    orientations: Orientations, lengths: FloatArray, counts: NDArray[np.intp], accuracy: float
) -> NDArray[np.intp]:
    """The inner vertices at which the turn of the tool changes so much that a spline would overshoot it.

    Turns are compared in the tool's axes at the vertex, over the same distance along the path.
    """
    rates = orientations.turns / lengths[:, None]
    change = np.linalg.norm(np.diff(rates, axis=0), axis=1)
    spacings = lengths / counts
    overshoot = SETTINGS.overshoot * np.maximum(spacings[1:], spacings[:-1]) * change
    return np.flatnonzero(overshoot > accuracy / 2.0) + 1


def _sharp(vertices: FloatArray, spacings: FloatArray, accuracy: float) -> NDArray[np.intp]:
    """The inner vertices where a spline would overshoot by half of the accuracy, or that turn by ``CORNER_ANGLE``."""
    steps = np.diff(vertices, axis=0)
    unit = steps / np.hypot.reduce(steps, axis=1)[:, None]
    angles = np.arccos(np.clip(np.einsum("nd,nd->n", unit[1:], unit[:-1]), -1.0, 1.0))
    overshoot = SETTINGS.overshoot * np.maximum(spacings[1:], spacings[:-1]) * angles
    return np.flatnonzero((angles >= SETTINGS.stopping_angle) | (overshoot > accuracy / 2.0)) + 1
