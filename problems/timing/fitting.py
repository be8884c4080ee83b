"""A smooth path near the rows of a recording, proven to be near the lines between them all."""

from __future__ import annotations

from contextlib import suppress
from itertools import pairwise

import numpy as np

from problems.base import BSpline, FloatArray, InvalidProblem, taylor_coefficients
from problems.motions import JointPath
from problems.timing.following import deviation

SAME_ROW = 1e-9  # of the whole length: rows that are no farther apart are one
ROW_SHARE = 0.5  # of the tolerance, that the path may be from rows; the rest is for what is between them
SPLINE_DEGREE = 5
LEAST_ROWS = 8  # between two knots, of a spline in the least squares
LEAST_SHARE = 1e-3  # of it, below which no more rows are tried


def distinct_rows(rows: FloatArray) -> FloatArray:
    """Rows (n, k) without those that are where the last one that is kept is; the first and the last are kept."""
    least = SAME_ROW * float(np.linalg.norm(np.diff(rows, axis=0), axis=1).sum())
    kept = [0]
    for number in range(1, len(rows)):
        if np.linalg.norm(rows[number] - rows[kept[-1]]) > least:
            kept.append(number)
    if len(kept) > 1 and not np.array_equal(rows[kept[-1]], rows[-1]):
        kept[-1] = len(rows) - 1
    return rows[kept]


def fitted_path(rows: FloatArray, tolerance: float) -> JointPath:
    """A spline of degree 5, proven to be within a tolerance of the lines between all rows; it begins and ends on them.

    It is the nearest in the least squares, which evens out noise, with as few knots as do; where none is near enough,
    it runs through some of the rows. Its parameter is the length along the lines.

    Args:
        rows: (n, k), rad, each elsewhere than the one before.
        tolerance: how far any joint may be from the lines, rad.

    Raises:
        InvalidProblem: even the spline through all rows is farther away somewhere between them.
    """
    if not 0.0 < tolerance < np.inf:
        raise InvalidProblem("tolerance", f"{tolerance:g} is not a positive number, in rad")
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rows, axis=0), axis=1))])
    line = JointPath.through(rows[[0, -1]], lengths[[0, -1]])
    if deviation(line, rows) <= tolerance:
        return line
    with suppress(np.linalg.LinAlgError):  # rows too near each other to say anything between two knots
        even = _evened(rows, lengths, tolerance)
        if even is not None:
            return even
    return _through_some(rows, lengths, tolerance)


def _evened(rows: FloatArray, lengths: FloatArray, tolerance: float) -> JointPath | None:
    """The spline in the least squares, whose intervals are halved where it is far away; None where none is near."""
    chosen = np.array([0, len(rows) - 1])
    while (np.diff(chosen) >= LEAST_ROWS).all():
        knots = lengths[chosen]
        spline = BSpline.near(np.pad(knots, SPLINE_DEGREE, mode="edge"), lengths, rows, SPLINE_DEGREE)
        path = JointPath(knots, taylor_coefficients(spline, knots[:-1], SPLINE_DEGREE))
        far = np.flatnonzero(np.abs(path.at(lengths) - rows).max(axis=1) > ROW_SHARE * tolerance)
        if not far.size:
            return path if deviation(path, rows) <= tolerance else None
        intervals = np.unique(np.clip(np.searchsorted(chosen, far, side="right") - 1, 0, len(chosen) - 2))
        chosen = np.union1d(chosen, (chosen[intervals] + chosen[intervals + 1]) // 2)
    return None


def _through_some(rows: FloatArray, lengths: FloatArray, tolerance: float) -> JointPath:
    """The spline through rows, of which those where it is farthest away are added until it is near all of them."""
    chosen, share = np.array([0, len(rows) - 1]), ROW_SHARE
    while True:
        path = JointPath.through(rows[chosen], lengths[chosen])
        away = np.abs(path.at(lengths) - rows).max(axis=1)
        added = [
            first + 1 + int(np.argmax(away[first + 1 : last]))
            for first, last in pairwise(chosen)
            if last > first + 1 and away[first + 1 : last].max() > share * tolerance
        ]
        if added:
            chosen = np.union1d(chosen, added)
            continue
        farthest = deviation(path, rows)
        if farthest <= tolerance:
            return path
        share /= 2.0
        if len(chosen) == len(rows) or share < LEAST_SHARE:
            reason = f"a smooth path through the rows leaves the lines between them by {farthest:.3g} rad"
            raise InvalidProblem("tolerance", reason)
