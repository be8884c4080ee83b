"""Cells of time within the pieces of a motion: its joints in each as Taylor models, and its values at any time."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, perm

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.certify.dynamics.taylor import DEGREE, ENTRIES, ROUNDING
from problems.motions.trajectory import Trajectory

ORDERS = 3  # angles, speeds, accelerations: what torques depend on


@dataclass(frozen=True, eq=False)
class TimeCells:
    """Cells, none of which crosses a breakpoint, so that derivatives may jump there.

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
        """At least so many, equally long in each piece, over the whole motion."""
        durations = np.diff(trajectory.breakpoints)
        each = int(np.ceil(at_least / durations.size))
        lengths = np.repeat(durations / each, each)
        pieces = np.repeat(np.arange(durations.size), each)
        return cls(trajectory, pieces, (np.tile(np.arange(each), durations.size) + 0.5) * lengths, lengths / 2.0)

    def __len__(self) -> int:
        return int(self.pieces.size)

    def halved(self, chosen: NDArray[np.bool_]) -> TimeCells:
        """Some of them, (n,), each cut in two."""
        pieces, middles, halves = self.pieces[chosen], self.middles[chosen], self.halves[chosen] / 2.0
        both = np.concatenate([middles - halves, middles + halves])
        return TimeCells(self.trajectory, np.tile(pieces, 2), both, np.tile(halves, 2))

    def moments(self, shares: FloatArray) -> Moments:
        """A time in each cell, (n,): -1 at its start, 1 at its end."""
        return Moments(self.trajectory, self.pieces, self.middles + shares * self.halves)

    def models(self) -> FloatArray:
        """Angles, speeds and accelerations of all k joints as Taylor models, (3 k ENTRIES, n), joint by joint."""
        coefficients = self.trajectory.coefficients[::-1]
        local, ends = coefficients[:, self.pieces], self.middles + self.halves
        around = shifted(local, self.middles)
        sizes = shifted(np.abs(local), ends)
        found = [self._modelled(around, sizes, order) for order in range(ORDERS)]
        return np.concatenate(found).reshape(-1, len(self))

    def _modelled(self, around: FloatArray, sizes: FloatArray, order: int) -> FloatArray:
        """One derivative, (k, ENTRIES, n)."""
        degree, _, joints = around.shape
        models = np.zeros((joints, ENTRIES, len(self)))
        for power in range(degree - order):
            term = (perm(power + order, order) * around[power + order] * self.halves[:, None] ** power).T
            if power <= DEGREE:
                models[:, power] = term
            else:
                models[:, -1] += np.abs(term)
        if order < degree:
            models[:, -1] += ROUNDING * (perm(order, order) * sizes[order]).T
        return models


@dataclass(frozen=True, eq=False)
class Moments:
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
    def at(cls, trajectory: Trajectory, times: FloatArray) -> Moments:
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
        """In s, (n,)."""
        return np.asarray(self.trajectory.breakpoints[self.pieces] + self.offsets)

    def chosen(self, some: NDArray[np.intp]) -> Moments:
        """Some of them, by their numbers."""
        return Moments(self.trajectory, self.pieces[some], self.offsets[some])

    def together(self, other: Moments) -> Moments:
        """These and others of the same motion."""
        pieces = np.concatenate([self.pieces, other.pieces])
        return Moments(self.trajectory, pieces, np.concatenate([self.offsets, other.offsets]))

    def derivatives(self) -> FloatArray:
        """Angles, speeds and accelerations of all k joints, (3 k, n)."""
        around = shifted(self.trajectory.coefficients[::-1][:, self.pieces], self.offsets, ORDERS)
        parts = [perm(n, n) * around[n].T if n < len(around) else np.zeros_like(around[0].T) for n in range(ORDERS)]
        return np.concatenate(parts)


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
    found = [sum(comb(j, i) * coefficients[j] * powers[j - i] for j in range(i, m)) for i in range(min(m, count or m))]
    return np.array(found)
