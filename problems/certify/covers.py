"""Covers proven to keep clear for all t: trees of balls in cells of time.

In the middle m of a cell of time of length h, joint j is within |dq_j/dt(m)| h/2 + max |d2q_j/dt2| h^2/8 of any of its
angles in the cell; no centre of a node of a link's tree moves farther than the sum over the joints of these turns times
its levers, and of two links only the joints between them count. What is farther apart in the middle than that is clear
all through. What is not is looked at more closely: a large node is opened, else the cell is cut in halves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base import FloatArray
from problems.certify.clearance import ClearanceProof, ClosestApproach, Travel, halves
from problems.limits import CoverClearance, CoverLimit, Items, Postures
from problems.motions import Trajectory

INITIAL_CELLS = 100
MOST_ITEMS = 20_000_000  # that are looked at
AT_ONCE = 400_000  # items
ROUNDING = 1e-9  # m, of places


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of time of a motion.

    Attributes:
        travel: of the motion.
        edges: start and end of each, within one piece, (n, 2), s.
    """

    travel: Travel
    edges: FloatArray

    @cached_property
    def middles(self) -> FloatArray:
        """(n,), s."""
        return np.asarray(self.edges.mean(axis=1))

    @cached_property
    def postures(self) -> Postures:
        """In the middles."""
        return Postures.of(self.travel.robot, self.travel.trajectory.at(self.middles), self.middles)  # type: ignore[arg-type]

    @cached_property
    def turns(self) -> FloatArray:
        """How far each joint turns from there, (n, dof), rad or m."""
        return self.travel.turns(self.edges)


def prove_covers(limit: CoverLimit, trajectory: Trajectory) -> ClearanceProof:
    """Bound the clearance of covers for all t."""
    margin, travel = limit.margin, Travel(limit.robot, trajectory)
    edges = np.union1d(trajectory.times(INITIAL_CELLS), trajectory.breakpoints)
    cells = Cells(travel, np.column_stack([edges[:-1], edges[1:]]))
    times = trajectory.times(limit.looks)
    start = limit.nearest(trajectory.at(times), times, each=False)
    found = _Least(limit, float(start.clearance[0]), float(times[start.items.row[0]]), start.items)
    waiting, looked = [(cells, limit.roots(len(cells.edges)))], 0
    while waiting:
        if found.clearance < margin or looked > MOST_ITEMS:
            return found.failed(margin, *waiting[-1])
        cells, items = waiting.pop()
        if len(items.row) > AT_ONCE:
            waiting += [(cells, items.taken(part)) for part in np.array_split(np.arange(len(items.row)), 2)]
            continue
        looked += len(items.row)
        gaps, sizes = limit.gaps(items, cells.postures), limit.sizes(items)
        found = found.improved(gaps, sizes, items, cells)
        moved = limit.travel(items, cells.turns, cells.edges) + ROUNDING
        left = gaps - moved < found.proven(margin)
        opened = left & (sizes > moved)
        if opened.any():
            waiting.append((cells, limit.opened(items.taken(opened))))
        cut = left & ~opened
        if cut.any():
            waiting.append(_halved(cells, items.taken(cut)))
    return found.succeeded(margin)


def _halved(cells: Cells, items: Items) -> tuple[Cells, Items]:
    """The cells of items cut in halves, and the items in both."""
    used, rows = np.unique(items.row, return_inverse=True)
    both = [Items(rows + side * len(used), items.node, items.other) for side in (0, 1)]
    return Cells(cells.travel, halves(cells.edges[used])), Items.joined(both)


@dataclass(frozen=True, eq=False)
class _Least:
    """The smallest clearance that was seen.

    Attributes:
        limit: of what.
        clearance: m.
        time: of that, s.
        item: which balls that are.
    """

    limit: CoverLimit
    clearance: float
    time: float
    item: Items

    def proven(self, margin: float) -> float:
        """What is to be proven, m."""
        return margin + (self.clearance - margin) * (1.0 - self.limit.proof_gap)

    def improved(self, gaps: FloatArray, sizes: FloatArray, items: Items, cells: Cells) -> _Least:
        """With what is nearer, of balls themselves."""
        ends = np.flatnonzero(sizes == 0.0)
        nearest = ends[np.argmin(gaps[ends])] if ends.size else None
        if nearest is None or not gaps[nearest] < self.clearance:
            return self
        time = float(cells.middles[items.row[nearest]])
        return _Least(self.limit, float(gaps[nearest]), time, items.taken(np.array([nearest])))

    def succeeded(self, margin: float) -> ClearanceProof:
        """Everything was settled."""
        where = self.limit.described(self.item)
        return ClearanceProof(self.proven(margin), self.clearance, self.time, where, broken=False)

    def failed(self, margin: float, cells: Cells, items: Items) -> ClearanceProof:
        """It was not; broken where a link is too near for certain, not only a ball of its cover.

        Args:
            margin: that is to be kept, m.
            cells: that are left.
            items: that are left in them.
        """
        where, broken = self.limit.described(self.item), self.clearance + self.limit.overhang(self.item) < margin
        start, end = cells.edges[items.row[0]].tolist()
        cell = (start, end) if self.clearance >= margin else None
        return ClearanceProof(-np.inf, self.clearance, self.time, where, broken, cell)


TIMES = 400  # at least, at which all covers are looked at
ZOOMS, ZOOM_POINTS = 3, 33


def closest_cover(limit: CoverClearance, trajectory: Trajectory) -> ClosestApproach:
    """The closest approach of covers, found at many times and followed from there; no proof."""
    limit, times = limit.without_growth(), trajectory.times(TIMES)
    step = trajectory.duration / TIMES
    for _ in range(1 + ZOOMS):
        nearest = limit.nearest(trajectory.at(times), times, each=False)
        time, seen = float(times[nearest.items.row[0]]), (float(nearest.clearance[0]), limit.described(nearest.items))
        times = np.clip(np.linspace(time - step, time + step, ZOOM_POINTS), 0.0, trajectory.duration)
        step = 2.0 * step / (ZOOM_POINTS - 1)
    return ClosestApproach(seen[0], time, seen[1])
