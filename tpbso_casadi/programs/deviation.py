"""Distances of what a controller makes of rows from a motion, bounded for all t; as few rows as an accuracy needs.

Between two rows motion and interpolation are polynomials. The Bernstein coefficients of their difference bound it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from problems import Trajectory
from problems.base import FloatArray, bernstein, peak

TERMS = 200  # roundings in a coefficient: two sums of at most 10 products each, for degrees up to 9


def control_points(motion: Trajectory, edges: FloatArray) -> tuple[Trajectory, FloatArray]:
    """A motion with pieces between edges and breakpoints, and their Bernstein coefficients (n + 1, p, k)."""
    cut = motion.cut(np.union1d(edges, motion.breakpoints))
    return cut, bernstein(cut.coefficients, np.diff(cut.breakpoints))


def rounding(motion: Trajectory) -> FloatArray:
    """How far Bernstein coefficients of each joint may be off, (k,): every term is no larger than these sums."""
    powers = np.diff(motion.breakpoints) ** np.arange(len(motion.coefficients))[::-1, None]
    largest = (np.abs(motion.coefficients) * powers[:, :, None]).sum(axis=0).max(axis=0)
    return np.asarray(TERMS * np.finfo(np.float64).eps * largest)


def deviations(motion: Trajectory, times: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The largest distances of joints from a motion, where each row is held until the next, and joined by lines.

    Args:
        motion: of k joints.
        times: of the rows, (n,), s, from 0 to its end.
        rows: as they are sent, (n, k).

    Returns:
        Both (k,), for all t.
    """
    cut, points = control_points(motion, times)
    starts, ends = cut.breakpoints[:-1], cut.breakpoints[1:]
    row = np.clip(np.searchsorted(times, (starts + ends) / 2.0, side="right") - 1, 0, len(times) - 2)
    shares = np.linspace(0.0, 1.0, len(points))[:, None]
    along = (starts + shares * (ends - starts) - times[row]) / (times[row + 1] - times[row])
    lines = rows[row] + along[:, :, None] * (rows[row + 1] - rows[row])
    held, joined = (_peaks(points - of) + rounding(motion) for of in (rows[row], lines))
    return held, joined


def _peaks(curves: FloatArray) -> FloatArray:
    """The largest absolute values of curves in Bernstein form (n + 1, p, k), (k,)."""
    return np.array([peak(curves[:, :, joint]) for joint in range(curves.shape[2])])


def from_line(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """How far joints of a path are at most from the line between two postures, whatever the times: (k,).

    Each point of the path is compared with the one of the line that is nearest to it, and so every point of the line
    is compared with one of the path.

    Args:
        points: Bernstein coefficients (n + 1, p, k) of the path.
        start: of the line, (k,).
        end: likewise.
    """
    way, away = end - start, points - start
    length = float(way @ way)
    share = away @ way / length if length > 0.0 else np.zeros(away.shape[:-1])
    beyond = max(0.0, -float(share.min()), float(share.max()) - 1.0)
    return np.asarray(np.abs(away - share[..., None] * way).max(axis=(0, 1)) + beyond * np.abs(way))


def fewest(count: int, fits: Callable[[int, int], bool]) -> list[int]:
    """Places from 0 to ``count - 1``, each as far behind the one before as fits, or the next one.

    Args:
        count: of the places that there are.
        fits: whether what lies between two places may be left out; true of what lies within a span of which it is true.
    """
    chosen = [0]
    while chosen[-1] < count - 1:
        here = chosen[-1]
        good, step = here + 1, 2
        while here + step < count and fits(here, here + step):
            good, step = here + step, 2 * step
        bad = min(here + step, count)
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if fits(here, middle) else (good, middle)
        chosen.append(good)
    return chosen
