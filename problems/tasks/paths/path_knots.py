"""Knots along a path: near enough to each other for a spline in joint space to stay near the path between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.robots.spatial.orientations import Orientations
from problems.tasks.paths.path import Path

SPACING_RADIUS = 0.2  # of the reach: the radius of curvature that a joint-space curve between two knots may have
MOST_SPACING = 0.06  # of the reach
MOST_KNOTS = 400  # that are inserted; given points are knots anyway
CORNER_ANGLE = np.pi / 3.0  # from this change of direction on a stop costs less than the way round it
OVERSHOOT = 0.15  # of the distance of knots times the angle: by how much a spline overshoots a bend, about
MOST_TURN = 0.2  # rad, by which the tool turns from one knot to the next


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
    spacing = min(np.sqrt(2.0 * accuracy * SPACING_RADIUS * reach), MOST_SPACING * reach)
    counts = np.ceil(lengths / max(spacing, lengths.sum() / MOST_KNOTS)).astype(int)
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
    """Knots on each line, so that the tool turns little from one to the next."""
    spacing = min(np.sqrt(2.0 * accuracy * SPACING_RADIUS), MOST_TURN)
    return np.asarray(np.ceil(angles / max(spacing, angles.sum() / MOST_KNOTS)), dtype=np.intp)


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
    overshoot = OVERSHOOT * np.maximum(spacings[1:], spacings[:-1]) * change
    return np.flatnonzero(overshoot > accuracy / 2.0) + 1


def _sharp(vertices: FloatArray, spacings: FloatArray, accuracy: float) -> NDArray[np.intp]:
    """The inner vertices where a spline would overshoot by half of the accuracy, or that turn by ``CORNER_ANGLE``."""
    steps = np.diff(vertices, axis=0)
    unit = steps / np.hypot.reduce(steps, axis=1)[:, None]
    angles = np.arccos(np.clip(np.einsum("nd,nd->n", unit[1:], unit[:-1]), -1.0, 1.0))
    overshoot = OVERSHOOT * np.maximum(spacings[1:], spacings[:-1]) * angles
    return np.flatnonzero((angles >= CORNER_ANGLE) | (overshoot > accuracy / 2.0)) + 1
