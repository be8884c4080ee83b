"""Surfaces of solids, for drawing."""

from __future__ import annotations

from itertools import pairwise
from typing import TypeAlias

import numpy as np

from problems.base import FloatArray

Surface: TypeAlias = tuple[FloatArray, list[list[int]]]  # vertices (n, 3), m; polygons, counter-clockwise from outside

SIDES = 24  # of the polygon in the place of a circle
BANDS = 6  # from the equator of a ball to its pole


def revolved(profile: FloatArray) -> Surface:
    """What a curve draws around the z axis.

    Args:
        profile: (radius, z) from bottom to top, (m, 2), m; where it does not end on the axis, a disc closes it.
    """
    phase = 2.0 * np.pi * np.arange(SIDES) / SIDES
    circle = np.column_stack([np.cos(phase), np.sin(phase)])
    vertices: list[FloatArray] = []
    rings: list[list[int]] = []
    for radius, z in profile:
        points = radius * circle if radius > 0.0 else np.zeros((1, 2))
        first = sum(map(len, vertices))
        rings.append((first + np.arange(len(points))).tolist() * (SIDES // len(points)))
        vertices.append(np.column_stack([points, np.full(len(points), z)]))
    polygons = [_band_side(below, above, side) for below, above in pairwise(rings) for side in range(SIDES)]
    discs = [ring for ring in (rings[0][::-1], rings[-1]) if len(set(ring)) == SIDES]
    return np.concatenate(vertices), [*polygons, *discs]


def _band_side(below: list[int], above: list[int], side: int) -> list[int]:
    """The corners of one side between two rings, each once: a triangle where one of the rings is a point."""
    ahead = (side + 1) % SIDES
    return list(dict.fromkeys([below[side], below[ahead], above[ahead], above[side]]))


def quarter_circle() -> FloatArray:
    """(radius, z) on the unit circle from the equator to the pole, (BANDS + 1, 2)."""
    angle = 0.5 * np.pi * np.arange(BANDS + 1) / BANDS
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    points[-1] = 0.0, 1.0
    return points


def rounded(radius: float, half_length: float) -> FloatArray:
    """The profile of a capsule along z, or of a ball where its half length is 0; (radius, z) from bottom to top, m."""
    cap = radius * quarter_circle()
    top = cap + np.array([0.0, half_length])
    bottom = top[::-1] * np.array([1.0, -1.0])
    return np.concatenate([bottom, top if half_length > 0.0 else top[1:]])
