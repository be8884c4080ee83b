"""Cells of time, none of which crosses a breakpoint of the motion; moments, each seen from the piece that it is in."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, perm

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import MotionNumbers
from problems.motions import Trajectory

ORDERS = 3  # angles, speeds, accelerations


@dataclass(frozen=True, eq=False)
class TimeCells:
    """Cells of time, none of which crosses a breakpoint, so that derivatives may jump there.

    Args:
        trajectory: the motion.
        pieces: in which each lies, (n,).
        middles: from the start of the piece, (n,), s.
        halves: of their lengths, (n,), s.
    """

    trajectory: Trajectory
    pieces: NDArray[np.intp]
    middles: FloatArray
    halves: FloatArray

    @classmethod
    def over(cls, trajectory: Trajectory, at_least: int) -> TimeCells:
        """Cells over the whole motion, at least so many, equally long in each piece."""
        durations = np.diff(trajectory.breakpoints)
        each = int(np.ceil(at_least / durations.size))
        lengths = np.repeat(durations / each, each)
        pieces = np.repeat(np.arange(durations.size), each)
        return cls(trajectory, pieces, (np.tile(np.arange(each), durations.size) + 0.5) * lengths, lengths / 2.0)

    def __len__(self) -> int:
        return int(self.pieces.size)

    @property
    def first(self) -> tuple[float, float]:
        """Start and end of the first cell, s."""
        start, end = (float(self.moments(side * np.ones(len(self))).times[0]) for side in (-1.0, 1.0))
        return start, end

    def halved(self, chosen: NDArray[np.bool_]) -> TimeCells:
        """The halves of chosen cells, (n,) of them."""
        pieces, middles, halves = self.pieces[chosen], self.middles[chosen], self.halves[chosen] / 2.0
        both = np.concatenate([middles - halves, middles + halves])
        return TimeCells(self.trajectory, np.tile(pieces, 2), both, np.tile(halves, 2))

    def divided(self, most: int) -> list[TimeCells]:
        """The cells in parts of at most so many."""
        edges = np.arange(most, len(self), most)
        parts = (np.split(values, edges) for values in (self.pieces, self.middles, self.halves))
        return [TimeCells(self.trajectory, *part) for part in zip(*parts, strict=True)] if len(self) else []

    def moments(self, shares: FloatArray) -> PieceTimes:
        """A time in each cell, (n,): -1 at its start, 1 at its end."""
        return PieceTimes(self.trajectory, self.pieces, self.middles + shares * self.halves)


@dataclass(frozen=True, eq=False)
class PieceTimes:
    """Times of a motion, each seen from the piece that it is in.

    Args:
        trajectory: the motion.
        pieces: (n,).
        offsets: from the start of the piece, (n,), s.
    """

    trajectory: Trajectory
    pieces: NDArray[np.intp]
    offsets: FloatArray

    @classmethod
    def at(cls, trajectory: Trajectory, times: FloatArray) -> PieceTimes:
        """Times (n,) in s, and both sides of every breakpoint."""
        last = trajectory.breakpoints.size - 2
        pieces = np.clip(np.searchsorted(trajectory.breakpoints, times, side="right") - 1, 0, last)
        offsets = times - trajectory.breakpoints[pieces]
        every, durations = np.arange(last + 1), np.diff(trajectory.breakpoints)
        return cls(
            trajectory,
            np.concatenate([pieces, every, every]),
            np.concatenate([offsets, np.zeros(last + 1), durations]),
        )

    @property
    def times(self) -> FloatArray:
        """The times of all moments, (n,), s."""
        return np.asarray(self.trajectory.breakpoints[self.pieces] + self.offsets)

    def chosen(self, some: NDArray[np.intp]) -> PieceTimes:
        """Some of the moments, by their numbers."""
        return PieceTimes(self.trajectory, self.pieces[some], self.offsets[some])

    @property
    def numbers(self) -> MotionNumbers:
        """The motion and the moments as the core reads them."""
        return MotionNumbers.of(self.trajectory, self.pieces, self.offsets)

    def states(self) -> FloatArray:
        """Angles, speeds and accelerations of all k joints, (n, 3 k)."""
        around = shifted(self.trajectory.coefficients[::-1][:, self.pieces], self.offsets, ORDERS)
        parts = [perm(n, n) * around[n] if n < len(around) else np.zeros_like(around[0]) for n in range(ORDERS)]
        return np.concatenate(parts, axis=1)


def shifted(coefficients: FloatArray, offsets: FloatArray, count: int | None = None) -> FloatArray:
    """Polynomials around other times.

    Args:
        coefficients: (m, n, k), lowest power first.
        offsets: of the new middles, (n,).
        count: how many of the new coefficients; all where None.

    Returns:
        (count, n, k).
    """
    m = len(coefficients)
    powers = offsets[:, None] ** np.arange(m)[:, None, None]
    moved = [sum(comb(j, i) * coefficients[j] * powers[j - i] for j in range(i, m)) for i in range(min(m, count or m))]
    return np.array(moved)
