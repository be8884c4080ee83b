"""Motions of segments between places, and the numbers by which the core finds the one of least time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray


@dataclass(frozen=True, eq=False)
class Stops:
    """Places that a motion passes, and the limits that it keeps.

    Attributes:
        places: both ends included, (segments + 1, k), rad.
        limits: of the derivatives, from the first on, (degree, k); infinite where there is none.
        ends: derivatives at both ends, from the first on, (2, degree - 1, k).
        turns: 1 where a joint is at the upper end of its range, -1 at the lower, else 0, (segments + 1, k).
        price: shares of the duration that a common excess over limits costs, for each limit's worth of it.
    """

    places: FloatArray
    limits: FloatArray
    ends: FloatArray
    turns: FloatArray
    price: float


@dataclass(frozen=True, eq=False)
class SegmentCells:
    """Splines of segments, each in as many cells, and where their limits are kept.

    Attributes:
        count: of cells in a segment.
        orders: of the derivative of each row, the same rows in all segments, those of angles last, (m,).
        first: number of the first control point of each, (m,).
        weights: of the control points, (segments, m, degree + 1).
        bends: control points of smooth splines with one derivative at one end, (segments, 2, degree - 1, points).
        ranges: the middles of angles in rows of these, and half their ranges, (segments, rows of angles, 2, k), rad.
    """

    count: int
    orders: NDArray[np.intp]
    first: NDArray[np.intp]
    weights: FloatArray
    bends: FloatArray
    ranges: FloatArray


@dataclass(frozen=True, eq=False)
class Guards:
    """Rows of all joints at once: h >= least, of an h that is linear in control points and in log T of a segment.

    Attributes:
        segments: of each, (n,).
        first: number of the first control point of each, (n,).
        slopes: of h by degree + 1 control points, from the segment's first place, (n, degree + 1, k).
        by_log_duration: slopes of h by log T, of which h is zero where the program begins, (n,).
        least: (n,).
    """

    segments: NDArray[np.intp]
    first: NDArray[np.intp]
    slopes: FloatArray
    by_log_duration: FloatArray
    least: FloatArray

    @classmethod
    def joined(cls, parts: Sequence[Guards]) -> Guards:
        """The rows of all parts as one."""
        names = [each.name for each in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    @classmethod
    def none(cls, degree: int, joints: int) -> Guards:
        """An empty set of rows, of splines of a degree and of so many joints."""
        empty = np.empty(0, dtype=np.intp)
        return cls(empty, empty, np.empty((0, degree + 1, joints)), np.empty(0), np.empty(0))


class SegmentMotion(NamedTuple):
    """A motion through places.

    Attributes:
        rates: derivatives by time at the places between, (segments - 1, degree - 1, k).
        inner: control points that no derivative at an end determines, from the segment's first place,
            (segments, points - 2 degree, k), rad.
        durations: of the segments, (segments,), s.
    """

    rates: FloatArray
    inner: FloatArray
    durations: FloatArray
