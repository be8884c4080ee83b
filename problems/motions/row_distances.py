"""Distances of what is made of rows from a motion, bounded for all t; as few rows as an accuracy needs.

Between two rows a motion and what joins them are polynomials. The Bernstein coefficients of their difference bound it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from problems.base import FloatArray, bernstein, peak
from problems.motions.rows import PIECES
from problems.motions.trajectory import Trajectory


def control_points(motion: Trajectory, edges: FloatArray) -> tuple[Trajectory, FloatArray]:
    """A motion with pieces between edges and breakpoints, and their Bernstein coefficients (n + 1, p, k)."""
    cut = motion.cut(np.union1d(edges, motion.breakpoints))
    return cut, bernstein(cut.coefficients, np.diff(cut.breakpoints))


def rounding(motion: Trajectory) -> FloatArray:
    """The most by which rounding moves a Bernstein coefficient of each joint, (k,), rad or m.

    A coefficient is a sum of sums of n + 1 products of up to n + 2 factors, none larger than the sum of their sizes.
    """
    n = len(motion.coefficients)
    powers = np.diff(motion.breakpoints) ** np.arange(n)[::-1, None]
    largest = (np.abs(motion.coefficients) * powers[:, :, None]).sum(axis=0).max(axis=0)
    return np.asarray(6.0 * (n + 2) * np.finfo(np.float64).eps * largest)


def apart(one: Trajectory, other: Trajectory) -> FloatArray:
    """The largest distances of the joints of two motions at the same time, as long as both last, (k,), rad or m."""
    end = min(one.duration, other.duration)
    edges = np.union1d(one.breakpoints, other.breakpoints)
    edges = edges[edges <= end]
    pieces = _difference(one.cut(edges).coefficients, other.cut(edges).coefficients)
    return _peaks(bernstein(pieces, np.diff(edges))) + rounding(one) + rounding(other)


def _difference(one: FloatArray, other: FloatArray) -> FloatArray:
    """The difference of pieces (n, p, k) and (m, p, k), highest power first."""
    longer = max(len(one), len(other))
    first, second = (np.pad(each, ((longer - len(each), 0), (0, 0), (0, 0))) for each in (one, other))
    return np.asarray(first - second)


def held_and_joined(motion: Trajectory, times: FloatArray, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
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
    """The largest distances of joints of a path from the line between two postures, whatever the times: (k,).

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


@dataclass(frozen=True, eq=False)
class RowChoice:
    """Rows of a motion to be joined by polynomials, chosen among candidates.

    Args:
        motion: of k joints.
        candidates: times that rows may have, (n,), s, from 0 to its end.
        states: values that a row states: 2 for positions and velocities, joined by cubics; 3 with accelerations, by
            quintics.
        most: bounds of the rates by order, (k,) each, which what joins rows keeps.
        accuracy: how far it may be from the motion, rad or m.
    """

    motion: Trajectory
    candidates: FloatArray
    states: int
    most: Sequence[FloatArray]
    accuracy: float

    @cached_property
    def _cut(self) -> Trajectory:
        return self.motion.cut(np.union1d(self.candidates, self.motion.breakpoints))

    @cached_property
    def _rows(self) -> list[FloatArray]:
        return [self.motion.at(self.candidates, order) for order in range(self.states)]

    def fits(self, first: int, last: int) -> bool:
        """Whether what joins two candidates is near enough to the motion, and no faster than rates may be."""
        joined = self._joined(first, last)
        for order, bound in enumerate(self.most, start=1):
            rate = bernstein(np.asarray(joined.derivative(order).c), joined.breakpoints[1:])
            if (np.abs(rate).max(axis=(0, 1)) > bound).any():
                return False
        return self._off(joined, first, last) <= self.accuracy

    def off(self, chosen: FloatArray) -> float:
        """How far what joins chosen candidates is from the motion at most, rad or m."""
        places = np.searchsorted(self.candidates, chosen).tolist()
        return max(self._off(self._joined(*pair), *pair) for pair in pairwise(places))

    def _joined(self, first: int, last: int) -> Trajectory:
        """The polynomial that joins two candidates."""
        length = self.candidates[last] - self.candidates[first]
        ends = [(rows[first : first + 1], rows[last : last + 1]) for rows in self._rows]
        piece = PIECES[self.states - 1](np.array([[length]]), *ends)[::-1]
        return Trajectory(np.array([0.0, length]), piece)

    def _off(self, joined: Trajectory, first: int, last: int) -> float:
        """How far what joins two candidates is from the motion at most, rad or m."""
        begin, end = np.searchsorted(self._cut.breakpoints, self.candidates[[first, last]]).tolist()
        edges = self._cut.breakpoints[begin : end + 1]
        other = joined.cut(edges - edges[0]).coefficients
        return float(np.abs(bernstein(_difference(self._cut.coefficients[:, begin:end], other), np.diff(edges))).max())

    def fewest(self, kept: FloatArray) -> FloatArray:
        """The fewest candidates that fit, with the first, the last and those nearest to kept times (m,), s."""
        nearest = np.abs(self.candidates - kept[:, None]).argmin(axis=1)
        places = np.union1d(nearest, [0, len(self.candidates) - 1])
        chosen = [0]
        for begin, end in pairwise(places.tolist()):
            own = fewest(end - begin + 1, lambda first, last, at=begin: self.fits(at + first, at + last))  # type: ignore[misc]
            chosen += [begin + place for place in own[1:]]
        return np.asarray(self.candidates[chosen])
