"""Clamped splines of segments: their cells, rows of limits, and how they are made finer."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial
from typing import Self

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, basis_functions
from problems.core import SegmentCells
from problems.motions import Trajectory


@dataclass(frozen=True, eq=False)
class SegmentGrid:
    """The knots of segments' splines, as shares of their durations.

    Args:
        knots: both ends included, (segments, cells + 1).
        degree: 3 where jerks are limited; 2 where accelerations may jump.
    """

    knots: FloatArray
    degree: int

    @classmethod
    def even(cls, segments: int, cells: int, degree: int) -> Self:
        """Segments of equal cells."""
        return cls(np.tile(np.linspace(0.0, 1.0, cells + 1), (segments, 1)), degree)

    @property
    def segments(self) -> int:
        """The number of segments."""
        return len(self.knots)

    @property
    def cells(self) -> int:
        """The number of cells of a segment."""
        return int(self.knots.shape[1]) - 1

    @property
    def points(self) -> int:
        """The number of control points of a segment."""
        return self.cells + self.degree

    @property
    def widths(self) -> FloatArray:
        """The widths of the cells, (segments, cells)."""
        return np.diff(self.knots, axis=1)

    @cached_property
    def _all_knots(self) -> FloatArray:
        return np.pad(self.knots, ((0, 0), (self.degree, self.degree)), mode="edge")

    def weights(self, cells: NDArray[np.intp], u: FloatArray, order: int) -> FloatArray:
        """Weights of a cell's control points in a derivative by u at parameters, (segments, n, degree + 1).

        Args:
            cells: in which the parameters lie or at whose edge, (segments, n).
            u: parameters, (segments, n).
            order: of the derivative.
        """
        knots = self._all_knots
        last = np.arange(self.segments)[:, None] * knots.shape[1] + cells + self.degree
        found = basis_functions(knots.ravel(), u.ravel(), self.degree, last.ravel(), order)
        return found.T.reshape(*u.shape, self.degree + 1)

    def at_shares(self, share: float, order: int) -> FloatArray:
        """Weights of control points where a share of each cell is left behind, (segments, cells, degree + 1)."""
        cells = np.broadcast_to(np.arange(self.cells), self.widths.shape)
        return self.weights(cells, self.knots[:, :-1] + share * self.widths, order)

    def dense(self, weights: FloatArray, cells: NDArray[np.intp]) -> FloatArray:
        """Weights of all control points, (segments, n, points), by those of cells (segments, n)."""
        found = np.zeros((*cells.shape, self.points))
        np.put_along_axis(found, cells[..., None] + np.arange(self.degree + 1), weights, axis=2)
        return found

    @cached_property
    def _smooth(self) -> FloatArray:
        """The matrix from control points to the inner ones that make the highest derivative least.

        It is (segments, points - 2 degree, points). As many control points as the degree are kept at either end.
        """
        d, cells = self.degree, np.broadcast_to(np.arange(self.cells), self.widths.shape)
        top = np.sqrt(self.widths)[..., None] * self.dense(self.at_shares(0.5, d), cells)
        inner = top[:, :, d:-d]
        turned = inner.transpose(0, 2, 1)
        return -np.linalg.solve(
            turned @ inner, turned @ np.concatenate([top[..., :d], 0.0 * inner, top[..., -d:]], axis=2)
        )

    def smoothed(self, points: FloatArray) -> FloatArray:
        """Control points (segments, points, n), of which those between the ends are replaced by the smoothest."""
        d = self.degree
        return np.concatenate([points[:, :d], self._smooth @ points, points[:, -d:]], axis=1)

    @cached_property
    def bends(self) -> FloatArray:
        """Control points of smooth splines with one derivative at one end, (segments, 2, degree - 1, points)."""
        d = self.degree
        found = np.zeros((self.segments, self.points, 2, d - 1))
        for end, cell in enumerate((0, self.cells - 1)):
            cells, u = np.full((self.segments, 1), cell), np.full((self.segments, 1), float(end))
            rows = np.concatenate([self.weights(cells, u, order) for order in range(d)], axis=1)
            near, own = (slice(0, d), slice(0, d)) if end == 0 else (slice(-d, None), slice(1, None))
            found[:, near, end] = np.linalg.inv(rows[:, :, own])[:, :, 1:]
        flat = found.reshape(self.segments, self.points, -1)
        return np.ascontiguousarray(self.smoothed(flat).reshape(found.shape).transpose(0, 2, 3, 1))

    def cells_of(self, segment: NDArray[np.intp], u: FloatArray) -> NDArray[np.intp]:
        """The cells in which parameters (n,) of segments (n,) lie, (n,)."""
        return np.asarray((self.knots[segment, 1:-1] <= u[:, None]).sum(axis=1))

    def weights_at(self, segment: NDArray[np.intp], u: FloatArray, order: int) -> FloatArray:
        """Weights of a cell's control points in a derivative by u at parameters (n,) of segments, (n, degree + 1)."""
        last = segment * self._all_knots.shape[1] + self.cells_of(segment, u) + self.degree
        return np.asarray(basis_functions(self._all_knots.ravel(), u, self.degree, last, order).T)

    def at_angles(self) -> tuple[FloatArray, NDArray[np.intp]]:
        """Weights where angles are limited, (segments, rows, degree + 1), and first points: middles, ends of cells."""
        weights = [self.at_shares(0.5, 0), self.at_shares(0.0, 0)[:, 1:]]
        return np.concatenate(weights, axis=1), np.concatenate([np.arange(self.cells), np.arange(1, self.cells)])

    def limited(self, speed_shares: tuple[float, ...], ranges: FloatArray | None = None) -> SegmentCells:
        """The rows at which limits are kept.

        Args:
            speed_shares: shares of a cell where speeds are, besides the end of the last.
            ranges: middles of angles where these are examined, and half their ranges, (segments, rows, 2, k), rad, or
                the same for all, (2, k); None where angles are not limited.
        """
        d, n, every = self.degree, self.cells, np.arange(self.cells)
        sampled = [(d, 0.5, every), *((1, share, every) for share in speed_shares), (1, 1.0, every[-1:])]
        if d == 3:
            sampled += [(2, 0.0, every), (2, 1.0, every[-1:])]
        weights = [self.at_shares(share, order)[:, cells] for order, share, cells in sampled]
        orders = np.concatenate([np.full(cells.size, order) for order, _, cells in sampled])
        first = np.concatenate([cells for _, _, cells in sampled])
        if ranges is None:
            return SegmentCells(n, orders, first, np.concatenate(weights, axis=1), self.bends, np.empty(0))
        angles, own = self.at_angles()
        every_range = np.broadcast_to(ranges, (*angles.shape[:2], *ranges.shape[-2:]))
        return SegmentCells(
            n, np.append(orders, np.zeros_like(own)), np.append(first, own),
            np.concatenate([*weights, angles], axis=1), self.bends, every_range,
        )  # fmt: skip

    def refined(self, knots: FloatArray) -> tuple[SegmentGrid, FloatArray]:
        """The grid with more knots, (segments, cells + 1), and the matrix (segments, new points, points) to it."""
        fine, d = SegmentGrid(knots, self.degree), self.degree
        inner = fine._all_knots[:, 1:-1]
        places = np.lib.stride_tricks.sliding_window_view(inner, d, axis=1).mean(axis=2)
        return fine, np.asarray(np.linalg.solve(fine._values(places), self._values(places)))

    def _values(self, u: FloatArray) -> FloatArray:
        """Weights of all control points at parameters (segments, n), (segments, n, points)."""
        cells = (self.knots[:, None, 1:-1] <= u[:, :, None]).sum(axis=2)
        return self.dense(self.weights(cells, u, 0), cells)

    def halved(self, points: FloatArray, units: FloatArray, count: int) -> FloatArray:
        """Knots with so many cells of each segment halved: wide ones at which the highest derivative changes most.

        Args:
            points: control points, (segments, points, k).
            units: of the derivative by u, (segments, k).
            count: of cells, of each segment.
        """
        top = np.einsum("sca,scak->sck", self.at_shares(0.5, self.degree), self._of_cells(points)) / units[:, None]
        changes = np.abs(np.diff(np.pad(top, ((0, 0), (1, 1), (0, 0))), axis=1)).sum(axis=2)
        score = self.widths**2 * (changes[:, :-1] + changes[:, 1:])
        chosen = np.argsort(-score, axis=1, kind="stable")[:, :count]
        middles = np.take_along_axis((self.knots[:, :-1] + self.knots[:, 1:]) / 2.0, chosen, axis=1)
        return np.sort(np.concatenate([self.knots, middles], axis=1), axis=1)

    def fitted(self, points: FloatArray, u: FloatArray, values: FloatArray) -> FloatArray:
        """Control points (segments, points, k), of which those between the ends are replaced: nearest to values.

        Args:
            points: of which as many at either end are kept as the degree.
            u: parameters, (n,), more than there are control points.
            values: at these, (segments, n, k).
        """
        d, rows = self.degree, self._values(np.tile(u, (self.segments, 1)))
        rest = values - rows[..., :d] @ points[:, :d] - rows[..., -d:] @ points[:, -d:]
        inner = np.stack([np.linalg.lstsq(row[:, d:-d], own)[0] for row, own in zip(rows, rest, strict=True)])
        return np.concatenate([points[:, :d], inner, points[:, -d:]], axis=1)

    def _of_cells(self, points: FloatArray) -> FloatArray:
        """The control points of each cell, (segments, cells, degree + 1, k)."""
        return points[:, np.arange(self.cells)[:, None] + np.arange(self.degree + 1)]

    def trajectory(self, starts: FloatArray, points: FloatArray, durations: FloatArray) -> Trajectory:
        """The motion of segments, as cubics.

        Args:
            starts: where each begins, (segments, k), rad.
            points: control points from there, (segments, points, k), rad.
            durations: (segments,), s.
        """
        own, rows = self._of_cells(points), []
        for order in range(3, -1, -1):
            scale = factorial(order) * durations[:, None, None] ** order
            weights = (
                self.at_shares(0.0, order) if order <= self.degree else np.zeros((*own.shape[:2], self.degree + 1))
            )
            rows.append(np.einsum("sca,scak->sck", weights, own) / scale)
        rows[-1] += starts[:, None]
        seconds = (self.widths * durations[:, None]).ravel()
        return Trajectory(np.concatenate([[0.0], np.cumsum(seconds)]), np.stack(rows).reshape(4, -1, points.shape[2]))
