"""Motions of segments between places, and the numbers by which the core finds the one of least time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray


@dataclass(frozen=True, eq=False)
class Stops:
    """Places that a motion passes, and the limits that it keeps.

    Attributes:
        places: both ends included, (segments + 1, k), rad.
        middles: of the joints' ranges, (k,), rad.
        limits: half the ranges, then limits of the derivatives, (degree + 1, k); infinite where there is none.
        ends: derivatives at both ends, from the first on, (2, degree - 1, k).
        price: shares of the duration that a common excess over limits costs, for each limit's worth of it.
        range_share: of half the ranges that angles keep; more next to places that are beyond it.
    """

    places: FloatArray
    middles: FloatArray
    limits: FloatArray
    ends: FloatArray
    price: float
    range_share: float


@dataclass(frozen=True, eq=False)
class SegmentCells:
    """Splines of segments, each in as many cells, and where their limits are kept.

    Attributes:
        count: of cells in a segment.
        orders: of the derivative of each row, the same rows in all segments, (m,).
        first: number of the first control point of each, (m,).
        weights: of the control points, (segments, m, degree + 1).
        bends: control points of smooth splines with one derivative at one end, (segments, 2, degree - 1, points).
    """

    count: int
    orders: NDArray[np.intp]
    first: NDArray[np.intp]
    weights: FloatArray
    bends: FloatArray


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
