"""Proof of clearance margins for all t of a motion whose joints are polynomials of time.

Cells and bounds are those of the compiled core: :file:`problems/core/cpp/proof.hpp` says why they hold. All cells are
looked at together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from problems.base import FloatArray
from problems.core.interface import MovingSolids, ProofResult
from problems.core.reference.clearance import reached_from
from problems.core.reference.model import Model, Numbers
from problems.core.reference.postures import A_LITTLE_MORE, Items, Postures, Side, concatenated

OF_SUMS = 1e-14  # rounding of a polynomial, of the sum of the sizes of its terms
ITEMS_AT_ONCE = 100_000  # items


class Cells(NamedTuple):
    """Cells of time within pieces.

    Attributes:
        piece: number of the polynomials, (n,).
        start: (n,), s since the piece began.
        end: likewise.
    """

    piece: Numbers
    start: FloatArray
    end: FloatArray

    @property
    def middles(self) -> FloatArray:
        """The middles of the cells, (n,), s since the piece began."""
        return self.start + (self.end - self.start) / 2.0

    def taken(self, chosen: Numbers) -> Cells:
        """The chosen ones of the cells."""
        return Cells(self.piece[chosen], self.start[chosen], self.end[chosen])


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of polynomials of time.

    Attributes:
        breaks: where they begin and end, (pieces + 1,), s.
        coefficients: the highest power first, of the time since the piece began, (order, pieces, dof).
        tracking: how far joints may be off, as of :class:`ProofRequest`; None of exact ones.
    """

    breaks: FloatArray
    coefficients: FloatArray
    tracking: FloatArray | None = None

    def cells(self, least: int) -> Cells:
        """Cells of equal length in each piece, so many or more, none longer than its share of the motion."""
        lengths, total = np.diff(self.breaks), self.breaks[-1] - self.breaks[0]
        parts = np.maximum(1, np.ceil(least * lengths / total)).astype(np.intp)
        piece = np.repeat(np.arange(len(parts)), parts)
        part = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
        start = lengths[piece] * part / parts[piece]
        end = np.where(part + 1 < parts[piece], lengths[piece] * (part + 1) / parts[piece], lengths[piece])
        return Cells(piece, start, end)

    def around(self, cells: Cells) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]:
        """Postures in the middles of cells, (n, dof); how far each joint turns from there; half lengths, s; errors.

        Where joints may be off by more elsewhere in a cell, that is part of how far they turn.
        """
        middle = cells.middles
        half = np.maximum(cells.end - middle, middle - cells.start) * A_LITTLE_MORE
        powers = self.coefficients[::-1, cells.piece].copy()  # (order, n, dof), the lowest first
        given = powers.copy()
        order, at, h = len(powers), middle[:, None], half[:, None]
        sizes = np.zeros(powers.shape[1:])  # of all terms: what rounding is relative to
        for d in range(order - 1, -1, -1):
            sizes = sizes * (at + h) + np.abs(powers[d])
        for d in range(order):  # Horner's scheme again and again: the expansion around the middle
            for i in range(order - 2, d - 1, -1):
                powers[i] += at * powers[i + 1]
        turns = np.zeros(sizes.shape)
        for d in range(order - 1, 0, -1):
            turns = (turns + np.abs(powers[d])) * h
        turns = turns * A_LITTLE_MORE + OF_SUMS * sizes
        if self.tracking is None:
            return powers[0], turns, half, None
        errors, more = self._off(self.tracking, powers, given, h, at + h)
        return powers[0], turns + more, half, errors

    @staticmethod
    def _off(
        tracking: FloatArray, powers: FloatArray, given: FloatArray, half: FloatArray, end: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Errors of joints in the middles of cells, and their increase anywhere in them, (n, dof) each.

        Args:
            tracking: as above.
            powers: coefficients around the middles, the lowest first, (order, n, dof).
            given: those of the pieces.
            half: lengths, (n, 1), s.
            end: of the cells, since their pieces began, (n, 1), s.
        """
        constant, by_speed, by_acceleration = tracking
        zero, order = np.zeros(powers.shape[1:]), len(powers)
        speed = np.abs(powers[1]) if order > 1 else zero
        acceleration = 2.0 * np.abs(powers[2]) if order > 2 else zero
        numbers = range(1, order)
        faster = sum((d * np.abs(powers[d]) * half ** (d - 1) for d in numbers if d > 1), zero)
        sharper = sum((d * (d - 1) * np.abs(powers[d]) * half ** (d - 2) for d in numbers if d > 2), zero)
        speeds = sum((d * np.abs(given[d]) * end ** (d - 1) for d in numbers), zero)
        accelerations = sum((d * (d - 1) * np.abs(given[d]) * end ** (d - 2) for d in numbers if d > 1), zero)
        errors = constant + by_speed * speed + by_acceleration * acceleration
        more = by_speed * (faster + OF_SUMS * speeds) + by_acceleration * (sharper + OF_SUMS * accelerations)
        return errors * A_LITTLE_MORE, more * A_LITTLE_MORE


class Middles:
    """A motion in the middles of cells.

    Args:
        model: that moves.
        motion: of its joints.
        cells: of time.
        drifts: of the solids, as of :class:`Moving`; None where they stand still.
    """

    def __init__(self, model: Model, motion: Motion, cells: Cells, drifts: FloatArray | None) -> None:
        theta, turns, self.halves, errors = motion.around(cells)
        self.times, self.turns = motion.breaks[cells.piece] + cells.middles, turns.T
        self.postures = Postures(model, theta, None if drifts is None else MovingSolids(drifts, self.times), errors)

    def travel(self, items: Items, standing: Numbers) -> FloatArray:
        """The motions of centres of nodes within the cells as seen from other bodies, (m,), m, at most."""
        return self.postures.moved(self.turns, items.one, items.row, standing)


class Smallest(NamedTuple):
    """The smallest margin that was seen, and where.

    Attributes:
        margin: m; infinite where nothing was.
        time: of that, s.
        one: node of that; negative where there is none.
        two: solid or node.
        kind: 0 from a solid, 1 from each other.
    """

    margin: float = np.inf
    time: float = 0.0
    one: int = -1
    two: int = -1
    kind: int = 0


class Prover:
    """A proof of one motion.

    Args:
        model: that moves.
        motion: of its joints.
        sides: what has to keep a distance.
        drifts: how solids move; None where they stand still.
        rounding: how much farther than by the model's own a distance may be off then, m.
    """

    def __init__(
        self, model: Model, motion: Motion, sides: Sequence[Side], drifts: FloatArray | None, rounding: float
    ) -> None:
        self._model, self._motion, self._sides, self._drifts = model, motion, sides, drifts
        self._rounding = model.rounding + rounding
        self._smallest, self._looked = Smallest(), 0

    def __call__(self, gap: float, least: int, most: int) -> ProofResult:
        """Bound the clearance margin for all t.

        Args:
            gap: by which share of the smallest room seen the proven one may be smaller.
            least: cells at the beginning.
            most: items that are looked at.
        """
        cells = self._motion.cells(least)
        everything = self._middles(cells)
        for side in self._sides:
            self._see(side, everything)
        waiting = [(cells, side, _all_of(side, len(cells.piece))) for side in self._sides]
        while waiting:
            cells, side, items = waiting.pop()
            if len(items.row) > ITEMS_AT_ONCE:
                parts = np.array_split(np.arange(len(items.row)), 2)
                waiting += [(cells, side, items.taken(part)) for part in parts]
                continue
            left = self._look(side, self._middles(cells), items, gap)
            if self._smallest.margin < 0.0:
                return ProofResult(0, -np.inf, *self._smallest)
            used, row = np.unique(left.row, return_inverse=True)
            halves = _halved(cells.taken(used))
            if len(used) and (self._looked > most or halves is None):
                return self._unknown(cells.taken(used))
            if self._looked > most and waiting:
                return self._unknown(waiting[-1][0].taken(waiting[-1][2].row))
            if halves is not None and len(used):
                both = Items(np.concatenate([2 * row, 2 * row + 1]), *(np.tile(part, 2) for part in left[1:]))
                waiting.append((halves, side, both))
        return ProofResult(1, self._target(gap) if self._smallest.margin < np.inf else np.inf, *self._smallest)

    def _unknown(self, cells: Cells) -> ProofResult:
        begins = self._motion.breaks[cells.piece[0]]
        edges = float(begins + cells.start[0]), float(begins + cells.end[0])
        return ProofResult(-1, -np.inf, *self._smallest, *edges)

    def _middles(self, cells: Cells) -> Middles:
        return Middles(self._model, self._motion, cells, self._drifts)

    def _target(self, gap: float) -> float:
        return self._smallest.margin * (1.0 - gap)

    def _see(self, side: Side, middles: Middles) -> None:
        """Note the smallest margin in the middles, which says from the beginning what can be proven."""
        postures = middles.postures
        items, margins = side.first(postures, self._enough(postures))
        nearest = np.array([margins.argmin()] if len(margins) else [], dtype=np.intp)
        reached = reached_from(side, postures, items.taken(nearest), margins[nearest])
        self._note(side, middles, reached, side.margins(postures, reached, np.full(len(reached.row), np.inf)))
        while len(items.row):
            large = side.openings(items) > 0.0
            self._note(side, middles, items.taken(~large), margins[~large])
            nearer = large & (margins - self._rounding < self._smallest.margin)
            items, margins = side.smaller(postures, items.taken(nearer), self._enough(postures))

    def _enough(self, postures: Postures) -> FloatArray:
        return np.full(postures.count, self._smallest.margin + self._rounding)

    def _look(self, side: Side, middles: Middles, items: Items, gap: float) -> Items:
        """The items that are not settled in their cells and are too small to be opened."""
        left = [items.taken(slice(0))]
        while len(items.row):
            self._looked += len(items.row)
            margins = side.margins(middles.postures, items, np.full(len(items.row), np.inf))
            sizes = side.openings(items)
            ends = np.flatnonzero(sizes == 0.0)
            self._note(side, middles, items.taken(ends), margins[ends])
            moved = middles.travel(items, side.standing(items)) + self._rounding
            if self._drifts is not None:
                moved += side.paces(items, self._drifts) * middles.halves[items.row] * A_LITTLE_MORE
            unsettled = ~(margins - moved >= self._target(gap))
            large = unsettled & (sizes > moved)
            left.append(items.taken(unsettled & ~large))
            items = side.opened(items.taken(large))
        return concatenated(left)

    def _note(self, side: Side, middles: Middles, balls: Items, margins: FloatArray) -> None:
        """Note the balls that are nearer than all before."""
        if not len(margins):
            return
        nearest = int(margins.argmin())
        margin = float(margins[nearest]) - self._rounding
        if margin < self._smallest.margin:
            time = float(middles.times[balls.row[nearest]])
            self._smallest = Smallest(margin, time, int(balls.one[nearest]), int(balls.two[nearest]), side.kind)


def _all_of(side: Side, cells: int) -> Items:
    """All pairs of first nodes in so many cells."""
    one, two = side.tops
    top = np.arange(len(one))
    return Items(np.repeat(np.arange(cells), len(one)), *(np.tile(part, cells) for part in (top, one, two)))


def _halved(cells: Cells) -> Cells | None:
    """Two halves of each cell, one after the other; None where one is too short to be halved."""
    middle = cells.middles
    if not ((cells.start < middle) & (middle < cells.end)).all():
        return None
    start, end = np.stack([cells.start, middle], axis=1).ravel(), np.stack([middle, cells.end], axis=1).ravel()
    return Cells(np.repeat(cells.piece, 2), start, end)
