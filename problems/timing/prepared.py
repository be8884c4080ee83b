"""A path prepared for timing: polynomials between breaks, and the least time scale of a given timing.

The joints have to stop where the path's derivative changes its direction. Where it only changes its length, the
parametrisation jumps, not the path: the pieces after it get another length in the parameter.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import comb

import numpy as np

from problems.base import FloatArray, InvalidProblem, bernstein
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits

STANDS_STILL = 1e-12  # of the path's extent: how far a piece turns that is left out
LARGEST_GAP = 1e-9  # of the path's extent: between pieces that join
SAME_WAY = 1e-6  # of unit vectors: directions that may be one; SAME decides
SAME = 1e-10  # of what a piece turns: a smaller difference of derivatives is none


@dataclass(frozen=True, kw_only=True)
class PreparedPath:
    """A path in which every piece turns a joint and q' is continuous but for corners.

    Attributes:
        path: with parameters of its own, from 0.
        corners: whether q' jumps at a breakpoint, (p + 1,); not at the ends.
        kinks: whether q' or q'' jumps at a breakpoint, (p + 1,); not at the ends.
        resting: whether q' is zero at the start, and at the end.
        rates: du/dt at the start, and at the end.
    """

    path: JointPath
    corners: FloatArray
    kinks: FloatArray
    resting: tuple[bool, bool]
    rates: tuple[float, float]

    def sections(self) -> list[PreparedPath]:
        """The parts between kinks; where they meet the joints are at rest."""
        bounds = [0, *np.flatnonzero(self.kinks).tolist(), self.path.breakpoints.size - 1]
        return [self._section(first, last) for first, last in pairwise(bounds)]

    def _section(self, first: int, last: int) -> PreparedPath:
        breakpoints = self.path.breakpoints[first : last + 1]
        path = JointPath(breakpoints - breakpoints[0], self.path.coefficients[:, first:last])
        none = np.zeros(breakpoints.size, dtype=bool)
        start = self.rates[0] if first == 0 else 0.0
        end = self.rates[1] if last == self.path.breakpoints.size - 1 else 0.0
        return PreparedPath(path=path, corners=none, kinks=none, resting=_resting(path), rates=(start, end))

    @property
    def moves_at_an_end(self) -> bool:
        """Whether joints have a velocity at an end, so that nothing can be slowed afterwards."""
        return any(rate > 0.0 and not resting for rate, resting in zip(self.rates, self.resting, strict=True))


def prepared(path: JointPath, rates: tuple[float, float] = (0.0, 0.0)) -> PreparedPath:
    """Prepare a path.

    Args:
        path: to time.
        rates: du/dt at its start and at its end.

    Raises:
        InvalidProblem: it stands still, or jumps, or has a number that is none.
    """
    lengths, coefficients = np.diff(path.breakpoints), np.asarray(path.coefficients, dtype=np.float64)
    if not (np.isfinite(coefficients).all() and np.isfinite(lengths).all() and (lengths > 0.0).all()):
        raise InvalidProblem("path", "a coefficient is not a number, or the parameter does not increase")
    if not (np.isfinite(rates).all() and min(rates) >= 0.0):
        raise InvalidProblem("rates", "du/dt at an end is negative or not a number")
    unit = coefficients * (lengths ** np.arange(len(coefficients))[::-1, None])[..., None]  # each piece over [0, 1]
    turned = np.abs(unit[:-1]).sum(axis=0).max(axis=-1, initial=0.0)
    extent = float(np.ptp(unit[-1], axis=0).max() + turned.max())
    turning = turned > STANDS_STILL * extent
    if not turning.any():
        raise InvalidProblem("path", "it stands still: there is nothing to time")
    _check_joined(unit, path.breakpoints, extent)
    return _joined(unit[:, turning], lengths[turning], turned[turning], rates)


def _check_joined(unit: FloatArray, breakpoints: FloatArray, extent: float) -> None:
    gaps = np.abs(unit[-1, 1:] - unit[:, :-1].sum(axis=0))
    if gaps.max(initial=0.0) > LARGEST_GAP * extent:
        piece, joint = np.unravel_index(np.argmax(gaps), gaps.shape)
        at = breakpoints[piece + 1]
        raise InvalidProblem("path", f"joint {joint + 1} jumps by {gaps.max():.3g} rad where the parameter is {at:g}")


def _joined(unit: FloatArray, lengths: FloatArray, turned: FloatArray, rates: tuple[float, float]) -> PreparedPath:
    """Choose the lengths of pieces (order, p, k) over [0, 1] so that q' is continuous where its direction is."""
    starts, ends = _end_derivatives(unit)
    corners, kinks = np.zeros((2, lengths.size + 1), dtype=bool)
    chosen = lengths.copy()
    for i in range(1, lengths.size):
        chosen[i] = chosen[i - 1] * lengths[i] / lengths[i - 1]
        (before, before2), (after, after2) = ends[:, i - 1], starts[:, i]
        least = SAME * max(turned[i - 1] / chosen[i - 1], turned[i] / chosen[i])
        fast, slow = np.linalg.norm(before) / chosen[i - 1], np.linalg.norm(after) / chosen[i]
        if fast > least and slow > least and np.abs(before / chosen[i - 1] - after / chosen[i]).max() > least:
            same_way = np.abs(before / (chosen[i - 1] * fast) - after / (chosen[i] * slow)).max() <= SAME_WAY
            chosen[i] = chosen[i] * slow / fast if same_way else lengths[i]  # beyond a corner nothing has to fit
        corners[i] = np.abs(before / chosen[i - 1] - after / chosen[i]).max() > least
        least2 = SAME * max(turned[i - 1] / chosen[i - 1] ** 2, turned[i] / chosen[i] ** 2)
        kinks[i] = corners[i] or np.abs(before2 / chosen[i - 1] ** 2 - after2 / chosen[i] ** 2).max() > least2
    powers = np.arange(len(unit))[::-1, None]
    path = JointPath(np.concatenate([[0.0], np.cumsum(chosen)]), unit / (chosen**powers)[..., None])
    return PreparedPath(
        path=path,
        corners=corners,
        kinks=kinks,
        resting=_resting(path),
        rates=(rates[0], rates[1] * float(chosen[-1] / lengths[-1])),
    )


def _resting(path: JointPath) -> tuple[bool, bool]:
    """Whether q' is zero at the start, and at the end."""
    start, end = np.abs(path.at(path.breakpoints[[0, -1]], 1)).max(axis=1)
    lengths, order = np.diff(path.breakpoints), len(path.coefficients)
    turned = np.abs(path.coefficients[:-1] * (lengths ** np.arange(order - 1, 0, -1)[:, None])[..., None]).sum(axis=0)
    mean = turned.max(axis=1) / lengths
    return bool(start <= SAME * mean[0]), bool(end <= SAME * mean[-1])


def _end_derivatives(unit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and second derivatives of pieces (order, p, k) over [0, 1], at their starts and ends, (2, p, k) each."""
    n = np.arange(len(unit))[::-1, None, None]
    padded = np.concatenate([np.zeros((3, *unit.shape[1:])), unit])
    starts = np.stack([padded[-2], 2.0 * padded[-3]])
    return starts, np.stack([(n * unit).sum(axis=0), (n * (n - 1) * unit).sum(axis=0)])


MAX_HALVINGS = 40  # of a piece
RESOLUTION = 1e-11  # relative, to which a peak is found; it is never found too small


def minimum_time_scale(trajectory: Trajectory, limits: JointLimits) -> float:
    """The least factor, 1e-11 too large at most; below 1 where time can be saved."""
    return limits.time_scale(peak_ratios(trajectory, limits))


def peak_ratios(trajectory: Trajectory, limits: JointLimits) -> list[float]:
    """Bounds of the peak of each limited derivative over all t, as shares of its limits."""
    durations = np.diff(trajectory.breakpoints)
    ratios = []
    for order, bound in enumerate(limits.by_order, start=1):
        curves = bernstein(np.asarray(trajectory.derivative(order).c), durations)
        ratios.append(_peak((curves / bound).reshape(len(curves), -1)))
    return ratios


def _peak(curves: FloatArray) -> float:
    """An upper bound of the largest absolute value of curves in Bernstein form, (n + 1, m), by halving them."""
    n = len(curves) - 1
    half = np.array([[comb(i, j) / 2**i if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)])
    reached = 0.0
    for _ in range(MAX_HALVINGS):
        reached = max(reached, float(np.abs(curves[[0, -1]]).max()))
        undecided = np.abs(curves).max(axis=0) > reached * (1.0 + RESOLUTION)
        if not undecided.any():
            return reached * (1.0 + RESOLUTION)
        curves = curves[:, undecided]
        curves = np.concatenate([half @ curves, (half @ curves[::-1])[::-1]], axis=1)
    return float(np.abs(curves).max())
