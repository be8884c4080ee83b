"""Covers proven to keep clear for all t: trees of balls in cells of time.

In the middle m of a cell of time of length h, joint j is within |dq_j/dt(m)| h/2 + max |d2q_j/dt2| h^2/8 of any of its
angles in the cell; no centre of a node of a link's tree moves farther than the sum over the joints of these turns times
its levers, and of two links only the joints between them count. Nodes that are farther apart in the middle than that
are clear all through. Of the others, a large node is opened; else the cell is cut in halves.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base import FloatArray
from problems.certify.clearance import ClearanceProof, ClosestApproach, Travel, halves
from problems.certify.settings import DEFAULT_APPROACH, DEFAULT_COVER_PROOF, ApproachSettings, CoverProofSettings
from problems.limits import CoverClearance, CoverLimit, Items, Postures
from problems.motions import Trajectory

POSITION_ROUNDING = 1e-9  # m


@dataclass(frozen=True, eq=False)
class CoverCells:
    """Cells of time of a motion in which covers are proven to be clear.

    Attributes:
        travel: of the motion.
        edges: start and end of each, within one piece, (n, 2), s.
    """

    travel: Travel
    edges: FloatArray

    @cached_property
    def middles(self) -> FloatArray:
        """The middles of all cells of time, (n,), s."""
        return np.asarray(self.edges.mean(axis=1))

    @cached_property
    def postures(self) -> Postures:
        """The postures in the middles of the cells."""
        return Postures.of(self.travel.robot, self.travel.trajectory.at(self.middles), self.middles)  # type: ignore[arg-type]

    @cached_property
    def turns(self) -> FloatArray:
        """The most by which each joint turns from the middle of a cell, (n, dof), rad or m."""
        return self.travel.turns(self.edges)


def prove_covers(
    limit: CoverLimit, trajectory: Trajectory, settings: CoverProofSettings = DEFAULT_COVER_PROOF
) -> ClearanceProof:
    """Bound the clearance of covers for all t."""
    margin, travel = limit.margin, Travel(limit.robot, trajectory)
    edges = np.union1d(trajectory.times(settings.initial_cells), trajectory.breakpoints)
    cells = CoverCells(travel, np.column_stack([edges[:-1], edges[1:]]))
    times = trajectory.times(limit.sample_count)
    start = limit.nearest(trajectory.at(times), times, each=False)
    least = _LeastClearance(limit, float(start.clearance[0]), float(times[start.items.row[0]]), start.items)
    waiting, count = [(cells, limit.roots(len(cells.edges)))], 0
    while waiting:
        if least.clearance < margin or count > settings.most_items:
            return least.failed(margin, *waiting[-1])
        cells, items = waiting.pop()
        if len(items.row) > settings.items_at_once:
            waiting += [(cells, items.taken(part)) for part in np.array_split(np.arange(len(items.row)), 2)]
            continue
        count += len(items.row)
        gaps, sizes = limit.gaps(items, cells.postures), limit.sizes(items)
        least = least.improved(gaps, sizes, items, cells)
        moved = limit.travel(items, cells.turns, cells.edges) + POSITION_ROUNDING
        left = gaps - moved < least.proven(margin)
        opened = left & (sizes > moved)
        if opened.any():
            waiting.append((cells, limit.opened(items.taken(opened))))
        cut = left & ~opened
        if cut.any():
            waiting.append(_halved(cells, items.taken(cut)))
    return least.succeeded(margin)


def _halved(cells: CoverCells, items: Items) -> tuple[CoverCells, Items]:
    """The cells of items cut in halves, and the items in both."""
    used, rows = np.unique(items.row, return_inverse=True)
    both = [Items(rows + side * len(used), items.node, items.other) for side in (0, 1)]
    return CoverCells(cells.travel, halves(cells.edges[used])), Items.concatenated(both)


@dataclass(frozen=True, eq=False)
class _LeastClearance:
    """The smallest clearance that was evaluated.

    Attributes:
        limit: on it.
        clearance: m.
        time: at which it occurs, s.
        item: the balls between which it is.
    """

    limit: CoverLimit
    clearance: float
    time: float
    item: Items

    def proven(self, margin: float) -> float:
        """The clearance that is to be proven, m."""
        return margin + (self.clearance - margin) * (1.0 - self.limit.proof_gap)

    def improved(self, gaps: FloatArray, sizes: FloatArray, items: Items, cells: CoverCells) -> _LeastClearance:
        """The smallest of this clearance and those of balls themselves, among items."""
        ends = np.flatnonzero(sizes == 0.0)
        nearest = ends[np.argmin(gaps[ends])] if ends.size else None
        if nearest is None or not gaps[nearest] < self.clearance:
            return self
        time = float(cells.middles[items.row[nearest]])
        return _LeastClearance(self.limit, float(gaps[nearest]), time, items.taken(np.array([nearest])))

    def succeeded(self, margin: float) -> ClearanceProof:
        """The proof after all items have been settled."""
        where = self.limit.described(self.item)
        return ClearanceProof(self.proven(margin), self.clearance, self.time, where, broken=False)

    def failed(self, margin: float, cells: CoverCells, items: Items) -> ClearanceProof:
        """The failed proof; broken where a link is too near for certain, not only a ball of its cover.

        Args:
            margin: that is to be kept, m.
            cells: that are left.
            items: that are left in them.
        """
        where, broken = self.limit.described(self.item), self.clearance + self.limit.overhang(self.item) < margin
        start, end = cells.edges[items.row[0]].tolist()
        cell = (start, end) if self.clearance >= margin else None
        return ClearanceProof(-np.inf, self.clearance, self.time, where, broken, cell)


def closest_cover(
    limit: CoverClearance, trajectory: Trajectory, settings: ApproachSettings = DEFAULT_APPROACH
) -> ClosestApproach:
    """The closest approach of covers, found at many times and followed from there; no proof."""
    limit, times = limit.without_growth(), trajectory.times(settings.times)
    step = trajectory.duration / settings.times
    for _ in range(1 + settings.zooms):
        nearest = limit.nearest(trajectory.at(times), times, each=False)
        time, seen = float(times[nearest.items.row[0]]), (float(nearest.clearance[0]), limit.described(nearest.items))
        times = np.clip(np.linspace(time - step, time + step, settings.zoom_points), 0.0, trajectory.duration)
        step = 2.0 * step / (settings.zoom_points - 1)
    return ClosestApproach(seen[0], time, seen[1])
