"""The fastest motions through given postures without a stop.

Each segment between two postures is a clamped spline of a duration of its own. Speeds and accelerations at the
postures, durations and control points are found at once, by the core's interior-point method, from a motion that stops
everywhere; then cells are halved where the highest derivative changes most, and it goes on. What limits of a motion
from rest to rest leave is taken exactly, by its duration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from problems.base import FloatArray
from problems.core import Guards, SegmentMotion, Stops, found_core
from problems.motions import Trajectory
from problems.robots import JointLimits
from problems.timing.free_space import least_durations
from problems.timing.segment_grid import SegmentGrid
from problems.timing.settings import DEFAULT_THROUGH, ThroughSettings

TIME_ROUNDING = 1e-9  # of a share of a limit
AT_THE_END = 1e-12  # of half a range
ANGLE_ROUNDING = 1e-10  # rad, of all joints together


def peak_shares(trajectory: Trajectory, limits: JointLimits) -> list[float]:
    """The exact peaks of speed, acceleration and jerk of a motion of cubics, as shares of their limits."""
    cubic, square, linear, _ = trajectory.coefficients
    h = np.diff(trajectory.breakpoints)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        turning = np.clip(np.nan_to_num(-square / (3.0 * cubic)), 0.0, h)
    speeds = [linear + t * (2.0 * square + 3.0 * cubic * t) for t in (0.0, turning, h)]
    peaks = [speeds, [2.0 * square, 2.0 * square + 6.0 * cubic * h], [6.0 * cubic]]
    bounds = zip(peaks, limits.by_order, strict=False)
    return [float((np.abs(values) / bound).max()) for values, bound in bounds]


def fastest_through(
    postures: FloatArray,
    limits: JointLimits,
    rates: FloatArray | None = None,
    settings: ThroughSettings = DEFAULT_THROUGH,
) -> Trajectory | None:
    """The fastest motion through postures, in their order and within the limits; None where none is found.

    A posture that is the same as the one before it, to rounding, is passed once.

    Args:
        postures: both ends included, (n, k), rad.
        limits: of the joints; their ranges are kept too.
        rates: velocities and accelerations at both ends, (2 ends, 2, k), rad/s and rad/s^2; at rest where None.
            Without a limit of jerk accelerations may jump there, to any.
        settings: of the method.
    """
    distinct = apart(postures)
    if found_core() is None or not 2 <= len(distinct) <= settings.most_postures:
        return None
    passing = Passing.of(postures[distinct], limits, rates, settings)
    found = passing.motion()
    if found is not None and _range_share(found, limits) > 1.0 + TIME_ROUNDING:
        found = replace(passing, range_share=1.0).motion()
    return found


def apart(postures: FloatArray) -> list[int]:
    """The numbers of the first posture, of those that differ from the one before them, and of the last."""
    numbers = [0]
    for number in range(1, len(postures)):
        if np.linalg.norm(postures[number] - postures[numbers[-1]]) > ANGLE_ROUNDING:
            numbers.append(number)
    return numbers if len(numbers) == 1 else [*numbers[:-1], len(postures) - 1]


def _range_share(trajectory: Trajectory, limits: JointLimits) -> float:
    """How far joints go from the middles of their ranges, as a share of half these."""
    if limits.position is None:
        return 0.0
    low, high = np.array(limits.position).T
    theta = trajectory.at(trajectory.extreme_times(0))
    return float((np.abs(theta - (low + high) / 2.0) / ((high - low) / 2.0)).max())


@dataclass(frozen=True, eq=False)
class Passing:
    """The search for the fastest motion through postures.

    Args:
        postures: no two in a row are the same, (n, k), rad.
        limits: of the joints.
        ends: derivatives by time at both ends, (2, degree - 1, k).
        settings: of the method.
        limit_share: of the limits that programs keep.
        range_share: of half the ranges that programs keep; None where ranges do not matter.
    """

    postures: FloatArray
    limits: JointLimits
    ends: FloatArray
    settings: ThroughSettings
    limit_share: float = 1.0
    range_share: float | None = None

    @classmethod
    def of(
        cls, postures: FloatArray, limits: JointLimits, rates: FloatArray | None, settings: ThroughSettings
    ) -> Passing:
        """The search between ends that are at rest, or have rates as of :func:`fastest_through`."""
        continuous = 1 if limits.jerk is None else 2
        ends = np.zeros((2, continuous, limits.dof)) if rates is None else rates[:, :continuous]
        return cls(postures, limits, ends, settings)

    @property
    def degree(self) -> int:
        """The degree of the splines."""
        return int(self.ends.shape[1]) + 1

    @property
    def segments(self) -> int:
        """The number of segments."""
        return len(self.postures) - 1

    @property
    def at_rest(self) -> bool:
        """Whether joints stand still at both ends."""
        return not self.ends.any()

    def motion(self) -> Trajectory | None:
        """The motion on the finest grid that keeps all limits; with ends in motion, or ranges, by keeping a reserve."""
        settings, grid, start = self.settings, *self._begun()
        start, is_solved = self._solved(grid, start)
        for _ in range(1, settings.levels):
            if self.segments * (grid.cells + settings.halved_cells) > settings.most_cells:
                break
            finer, begun = self._finer(grid, start)
            found, was_solved = self._solved(finer, begun)
            if is_solved and not was_solved:
                break
            gain = 1.0 - float(found.durations.sum() / start.durations.sum())
            if was_solved or gain > 0.0:
                grid, start, is_solved = finer, found, was_solved
            if gain < settings.worthwhile:
                break
        passing = self
        for _ in range(settings.corrections):
            trajectory = passing._trajectory(grid, start)
            ranges = 0.0 if self.range_share is None else _range_share(trajectory, self.limits)
            excess = max(peak_shares(trajectory, self.limits)), ranges
            if not is_solved and trajectory.duration > self._stopping_time:
                break
            if max(excess) <= 1.0 + TIME_ROUNDING:
                return trajectory
            if not is_solved:
                break
            passing = passing._with_reserve(*excess)
            start, is_solved = passing._solved(grid, start)
        return None

    def _with_reserve(self, excess: float, range_excess: float) -> Passing:
        """The search that keeps more of the limits, and of ranges, by what a motion is over them."""
        share, ranges = (1.0 / self._reserved(each) for each in (excess, range_excess))
        within = None if self.range_share is None else self.range_share * ranges
        return replace(self, limit_share=self.limit_share * share, range_share=within)

    def _reserved(self, excess: float) -> float:
        settings = self.settings
        return 1.0 if excess <= 1.0 else 1.0 + max(settings.reserve * (excess - 1.0), settings.least_reserve)

    @property
    def _stopping_time(self) -> float:
        """The least time of a motion that stops at every posture, s."""
        return float(least_durations(np.diff(self.postures, axis=0), self.limits).max(axis=1).sum())

    @property
    def _stops(self) -> Stops:
        limits = self.limit_share * np.array(self.limits.by_order[: self.degree])
        price, (middles, half) = self.settings.price if self.at_rest else self.settings.moving_price, self._ranges
        beside = self.postures - middles
        turns = np.where(np.abs(beside) >= (1.0 - AT_THE_END) * half, np.sign(beside), 0.0)
        return Stops(self.postures, limits, self.ends, turns, price)

    @property
    def _ranges(self) -> FloatArray:
        """The middles of the joints' ranges, and half of these, infinite where they do not matter, (2, k), rad."""
        if self.limits.position is None or self.range_share is None:
            return np.stack([np.zeros(self.limits.dof), np.full(self.limits.dof, np.inf)])
        low, high = np.array(self.limits.position).T
        return np.stack([(low + high) / 2.0, (high - low) / 2.0])

    def angle_ranges(self, grid: SegmentGrid) -> FloatArray:
        """The middles and halves of the ranges that angles keep in the rows of a grid, (segments, rows, 2, k), rad.

        It is a share of the joints' ranges. Next to places beyond it the rest is less, as a joint leaves them at rest.
        """
        (middles, half), share, rises = self._ranges, self.range_share or 1.0, self.settings.reserve_rises
        beyond, (weights, first) = np.abs(self.postures - middles) >= share * half, grid.at_angles()
        point = (first + weights @ np.arange(self.degree + 1)) / (grid.points - 1)
        kept = np.ones((*point.shape, self.limits.dof))
        for there, passed in ((beyond[:-1], point), (beyond[1:], 1.0 - point)):
            kept = np.minimum(kept, np.where(there[:, None], (passed[:, :, None] / rises) ** 2, 1.0))
        kept_half = (1.0 - (1.0 - share) * kept) * half
        return np.stack([np.broadcast_to(middles, kept_half.shape), kept_half], axis=2)

    def _begun(self) -> tuple[SegmentGrid, SegmentMotion]:
        """A motion that stops at every posture, somewhat slower than it might be, on the first grid."""
        settings, d = self.settings, self.degree
        grid = SegmentGrid.even(self.segments, settings.first_cells, d)
        share = np.zeros((1, grid.points, 1))
        share[:, -d:] = 1.0
        share = SegmentGrid.even(1, settings.first_cells, d).smoothed(share)
        distances = np.diff(self.postures, axis=0)
        cells, duration = grid.limited(settings.speed_shares), np.zeros(self.segments)
        values = np.einsum("ma,ma->m", cells.weights[0], share[0, cells.first[:, None] + np.arange(d + 1), 0])
        for order, limit in enumerate(self.limits.by_order[:d], start=1):
            most = np.abs(values[cells.orders == order]).max()
            duration = np.maximum(duration, ((np.abs(distances) / limit).max(axis=1) * most) ** (1.0 / order))
        inner = share[:, d:-d] * distances[:, None]
        rates = np.zeros((self.segments - 1, d - 1, distances.shape[1]))
        return grid, SegmentMotion(rates, inner, settings.slower * duration)

    def _solved(self, grid: SegmentGrid, start: SegmentMotion) -> tuple[SegmentMotion, bool]:
        core = found_core()
        assert core is not None
        cells = grid.limited(self.settings.speed_shares, None if self.range_share is None else self.angle_ranges(grid))
        return core.pass_through(self._stops, cells, Guards.none(self.degree, self.limits.dof), start)

    def points(self, grid: SegmentGrid, motion: SegmentMotion) -> FloatArray:
        """The control points of a motion, from the first posture of each segment, (segments, points, k), rad."""
        d, rates = self.degree, np.concatenate([self.ends[:1], motion.rates, self.ends[1:]])
        powers = motion.durations[:, None, None] ** np.arange(1, d)[:, None]
        by_ends = np.stack([rates[:-1] * powers, rates[1:] * powers], axis=1)
        found = np.einsum("seop,seok->spk", grid.bends, by_ends)
        found[:, -d:] += np.diff(self.postures, axis=0)[:, None]
        found[:, d:-d] = motion.inner
        return np.asarray(found)

    def _finer(self, grid: SegmentGrid, motion: SegmentMotion) -> tuple[SegmentGrid, SegmentMotion]:
        """The motion on a grid with more cells, a little slower, so that a program begins inside its limits."""
        points, d, slower = self.points(grid, motion), self.degree, self.settings.slower_again
        units = self.limits.by_order[d - 1] * motion.durations[:, None] ** d
        fine, matrix = grid.refined(grid.halved(points, units, self.settings.halved_cells))
        rates = motion.rates / slower ** np.arange(1, d)[:, None]
        return fine, SegmentMotion(rates, (matrix @ points)[:, d:-d], slower * motion.durations)

    def _trajectory(self, grid: SegmentGrid, motion: SegmentMotion) -> Trajectory:
        """The motion, from rest to rest as fast as limits allow."""
        found = grid.trajectory(self.postures[:-1], self.points(grid, motion), motion.durations)
        return found.time_scaled(self.limits.time_scale(peak_shares(found, self.limits))) if self.at_rest else found
