"""The descent over path and speed by sequential linear programs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import TrustRegion, minimizer
from problems.robots import JointLimits
from problems.sequential.limit_rows import LinearLimits, MotionLimits
from problems.sequential.pair_clearances import NearPairs, PairClearances
from problems.sequential.path_speed import DELAY_COST, RESTING, Clock, Freedom, Grid, MotionSpace, PathSpeed, TimeShift

CLEARANCE_PRICE = 100.0  # s/m, what a program pays for missing clearance
FIRST_SHARE = 0.3  # of the reach of a step: clearance rows with less slack are in a program from the start
BROKEN_CLEARANCE = 1e-4  # m: a row that a program breaks by more joins it
MOST_PROGRAMS = 5  # for one step
MOST_CHANGE = 0.8  # of a speed, in one step
SPEED_CHANGE = 0.25 / 0.06  # share of a speed that may change, for each rad of the path
SPEED_SHARE = 0.25  # share of a speed that may change where the path stays
SLOWEST_SHARE = 0.2  # of a constant speed, where times matter: standing still between samples is not examined
SLOPE_ROUNDING = 1e-9


@dataclass(frozen=True)
class ClearanceRows:
    """Clearances to first order.

    Attributes:
        slack: by how much each may fall, (m,), m.
        reach: by how much each changes in a step at most, (m,), m.
        gradients: with respect to the joints, (m, k).
        basis: of the path at their samples, (m, N).
        by_timing: slopes with respect to the speeds, (m, M); where an obstacle moves also to the delay, (m, M + 1).
    """

    slack: FloatArray
    reach: FloatArray
    gradients: FloatArray
    basis: FloatArray
    by_timing: FloatArray

    def slopes(self, chosen: NDArray[np.intp], moves: FloatArray) -> FloatArray:
        """Slopes of chosen clearances by moves (N k, free) of the control points, and by the timing."""
        outer = self.basis[chosen, :, None] * self.gradients[chosen, None, :]
        by_path = outer.reshape(chosen.size, moves.shape[0]) @ moves
        return np.concatenate([by_path, self.by_timing[chosen]], axis=1)

    def left(self, change: FloatArray, timing: FloatArray) -> FloatArray:
        """The slack that a change (N, k) of the control points, and one of the timing, leaves."""
        by_path = ((self.basis @ change) * self.gradients).sum(axis=1)
        return np.asarray(self.slack + by_path + self.by_timing @ timing)


@dataclass(frozen=True)
class ProgramStep:
    """The motion that a linear program leads to, and how much time it promises to save, s."""

    motion: PathSpeed
    promised: float


def best_step(
    motion: PathSpeed,
    limits: JointLimits,
    linear: LinearLimits,
    clear: ClearanceRows,
    moves: FloatArray,
    trust: float,
    shift: TimeShift | None = None,
) -> ProgramStep | None:
    """The best change within a trust region; None where no program can be solved.

    Clearance rows join the program when a solution without them breaks them.

    Args:
        motion: around which everything is linear.
        limits: of the joints; their ranges are kept by the control points.
        linear: its limits.
        clear: its clearances.
        moves: changes of the control points that keep its ends, (N k, free); where there are none, the path stays.
        trust: how far a control point may move, rad.
        shift: by how much times may change, where obstacles move: then the delay may change too.
    """
    lower, upper = _box(motion, limits, moves.shape[1], trust)
    free, width = moves.shape[1], np.maximum(-lower, upper)
    rows, bounds = useful_rows(linear.values, linear.slopes(moves), width)
    costs = np.concatenate([np.zeros(free), motion.duration_slopes])
    if shift is not None:
        at_times, most = shift.rows(free)
        rows, bounds = np.concatenate([np.pad(rows, ((0, 0), (0, 1))), at_times]), np.append(bounds, most)
        costs = np.append(costs, DELAY_COST)
        slowest = SLOWEST_SHARE / (motion.duration - motion.delay)
        lower[free:] = np.maximum(lower[free:], np.minimum(slowest - motion.speeds, 0.0))
        lower, upper = np.append(lower, -min(motion.delay, shift.most)), np.append(upper, shift.most)
    box = np.stack([lower, upper], axis=1)
    active = clear.slack < FIRST_SHARE * clear.reach
    best, change = None, np.zeros_like(motion.controls)
    for _ in range(MOST_PROGRAMS):
        chosen = np.flatnonzero(active)
        broken = clear.slack[chosen] < 0.0
        own = np.cumsum(broken) * broken  # 0 is what all others share
        slack = np.zeros((chosen.size, own.max(initial=0) + 1))
        slack[np.arange(chosen.size), own] = -1.0
        touching = [-clear.slopes(chosen, moves), slack]
        matrix = np.concatenate([np.pad(rows, ((0, 0), (0, slack.shape[1]))), np.concatenate(touching, axis=1)])
        paid = np.full(slack.shape[1], CLEARANCE_PRICE)
        solution = minimizer(
            np.append(costs, paid),
            scipy.sparse.csr_array(matrix),
            np.concatenate([bounds, clear.slack[chosen]]),
            np.concatenate([box, np.stack([0.0 * paid, np.inf * paid], axis=1)]),
        )
        if solution is None:
            break
        best, change = solution, (moves @ solution[:free]).reshape(motion.controls.shape)
        left = clear.left(change, solution[free : costs.size])
        broken = ~active & (left < -solution[costs.size] - BROKEN_CLEARANCE)
        if not broken.any():
            break
        active |= broken
    if best is None:
        return None
    last = free + motion.speeds.size
    delay = motion.delay + float(best[last : costs.size].sum())
    moved = PathSpeed(motion.space, motion.controls + change, motion.speeds + best[free:last], delay)
    return ProgramStep(moved, float(-costs[free:] @ best[free : costs.size]))


def at_best_speed(motion: PathSpeed, limits: MotionLimits, linear: LinearLimits, grid: Grid) -> PathSpeed:
    """A path as fast as its limits allow on a grid: evenly, or at the speed that a linear program finds."""
    even = motion.time_scaled(limits.time_scale(motion, grid))
    width = SPEED_SHARE * motion.speeds
    rows, bounds = useful_rows(linear.values, linear.by_speeds, width)
    change = minimizer(motion.duration_slopes, scipy.sparse.csr_array(rows), bounds, np.stack([-width, width], axis=1))
    if change is None:
        return even
    other = replace(motion, speeds=motion.speeds + change)
    other = other.time_scaled(limits.time_scale(other, grid))
    return min(even, other, key=lambda each: each.duration)


def useful_rows(values: FloatArray, slopes: FloatArray, width: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rows and bounds that keep shares within -1 and 1, of those that can become active within a box."""
    reach = np.abs(slopes) @ width
    bounds = np.concatenate([1.0 - values, 1.0 + values])
    useful = (bounds < np.tile(reach, 2)) & np.tile(reach > SLOPE_ROUNDING, 2)
    return np.concatenate([slopes, -slopes])[useful], bounds[useful]


def _box(motion: PathSpeed, limits: JointLimits, free: int, trust: float) -> tuple[FloatArray, FloatArray]:
    """Bounds (free + M,) of the variables."""
    lower, upper = np.full(free, -trust), np.full(free, trust)
    if free and limits.position is not None:
        inner = motion.controls[RESTING:-RESTING]
        down, up = ((np.array(bound) - inner).ravel() for bound in zip(*limits.position, strict=True))
        lower[: inner.size] = np.clip(down, -trust, np.maximum(np.minimum(up, 0.0), -trust))
        upper[: inner.size] = np.clip(up, np.minimum(np.maximum(down, 0.0), trust), trust)
    change = np.minimum(SPEED_CHANGE * trust, MOST_CHANGE) * motion.speeds
    return np.concatenate([lower, -change]), np.concatenate([upper, change])


LIMIT_SAMPLES, LIMIT_ROWS = 16, 4  # in each piece of the speed, a sample and, of every so many, rows of a program
CLEARANCE_SAMPLES, CLEARANCE_ROWS = 8, 2  # samples and rows of clearances; rows are also at their minima
MOST_STEPS = 40
WAIT_SAMPLES = 24  # of the clearance while it stands still at its start
TIME_SHIFT = 1.0  # s/rad: by how much times may change in a step for each rad of the trust region
STANDING_REGION = TrustRegion(
    first=0.1, least=2e-3, largest=0.25, growth=1.6, shrinkage=0.5, rejection=0.3, good=0.5, poor=0.1
)  # rad, how far a control point may move
MOVING_REGION = replace(STANDING_REGION, first=0.04, largest=0.1)  # where obstacles move
HOPELESS = 1.5  # times a duration to beat
LEAST_GAIN, PATIENCE = 2e-4, 3  # share of the duration; how many steps may gain less
END_SLACK = 1e-4  # m, more than bodies come too near at the ends
ENOUGH_SHARE, SHARE_AT_ENDS = 0.5, 0.8  # of the proof margin that is enough; of the clearance of the ends
APPROACH = 1.0  # m/rad: how much nearer pairs come at most for each rad of the trust region; twice that where obstacles
# move, which may be elsewhere after a step, because the motion passes them at another time
SPEED_TRUST = 0.06  # rad: speeds alone may change as much as in a trust region of this size


@dataclass(frozen=True)
class PathIterate:
    """A motion of the descent, which keeps the limits of its joints, and how near bodies come in it.

    Attributes:
        motion: as fast as it may be.
        near: its pairs.
        proof_margins: distances that all pairs keep at samples on top of the margin, (pairs,), m.
        missing: the sum of the clearances that are missing to the one that is kept, m; 0 where none is.
    """

    motion: PathSpeed
    near: NearPairs
    proof_margins: FloatArray
    missing: float

    def better_than(self, other: PathIterate) -> bool:
        """Whether it is nearer to being clear than another; if both are, whether it is faster."""
        return (self.missing, self.motion.cost) < (other.missing, other.motion.cost)


@dataclass(frozen=True)
class PathSpeedDescent:
    """A descent by sequential linear programs over path and speed.

    Args:
        space: of motions.
        limits: of the joints.
        freedom: of the ends.
        nearness: of bodies that have to keep a distance.
        margin: that distance, m.
        proof_margin: on top of it at samples, m, where the ends keep more; half of it is enough.
        clearance_samples: in each piece of the speed.
    """

    space: MotionSpace
    limits: MotionLimits
    freedom: Freedom
    nearness: PairClearances
    margin: float
    proof_margin: float
    clearance_samples: int = CLEARANCE_SAMPLES

    @cached_property
    def _grid(self) -> Grid:
        return self.space.grid(self.space.even(LIMIT_SAMPLES))

    @cached_property
    def _clock(self) -> Clock:
        waits = WAIT_SAMPLES if self.nearness.is_time_dependent else 0
        even = self.space.even(self.clearance_samples)
        return Clock(self.space, np.concatenate([np.zeros(waits), even]), waits)

    @cached_property
    def _clearance_basis(self) -> FloatArray:
        return self.space.path.matrix(self._clock.u)

    @cached_property
    def _moving(self) -> NDArray[np.bool_]:
        """Mask of the pairs with an obstacle that moves, (pairs,)."""
        return np.array([pair.is_time_dependent for pair in self.nearness.pairs], dtype=bool)

    def samples_of(self, motion: PathSpeed) -> tuple[FloatArray, FloatArray]:
        """Samples at which clearances are examined: postures (n, k), rad, and times (n,), s."""
        return self._clearance_basis @ motion.controls, self._clock.times(motion)

    def __call__(self, start: PathSpeed, to_beat: float = np.inf) -> PathIterate:
        """The best motion that steps from a start lead to.

        Args:
            start: of the descent.
            to_beat: the duration in s of a motion that is known: what becomes much slower is given up.
        """
        region = MOVING_REGION if self.nearness.is_time_dependent else STANDING_REGION
        best, trust, idle = self.begun(start), region.first, 0
        for _ in range(MOST_STEPS):
            step = self._step(best, self.freedom.moves(best.motion.controls), trust)
            if step is None:
                break
            placed = replace(step.motion, controls=self.freedom.placed(step.motion.controls))
            new = self._iterate(placed, region.growth * trust)
            saved = best.motion.cost - new.motion.cost
            if not new.better_than(best):
                trust = region.rejected(trust)
            else:
                share = 1.0 if new.missing < best.missing else saved / max(step.promised, saved, 1e-9)
                trust = region.accepted(trust, share)
                idle = idle + 1 if new.missing == best.missing and saved < LEAST_GAIN * best.motion.duration else 0
                best = new
            if idle == PATIENCE or trust < region.least or best.motion.duration > HOPELESS * to_beat:
                break
        return best

    def begun(self, start: PathSpeed) -> PathIterate:
        """The iterate at which a descent begins."""
        return self._iterate(replace(start, controls=self.freedom.placed(start.controls)), STANDING_REGION.first)

    def _iterate(self, motion: PathSpeed, trust: float) -> PathIterate:
        """A motion that keeps its limits, and the pairs that may matter in a trust region around it.

        It is as fast as it may be, unless it matters at which times it passes: then it is no slower than it has to be,
        or as a linear program of its speeds alone makes it.
        """
        if not self.nearness.is_time_dependent:
            return self.measured(at_best_speed(motion, self.limits, self._linear(motion), self._grid), trust)
        even = self.measured(
            motion.time_scaled(max(1.0, self.limits.time_scale(motion, self._grid))), max(trust, SPEED_TRUST)
        )
        still = np.empty((motion.controls.size, 0))
        step = self._step(even, still, SPEED_TRUST)
        if step is None:
            return even
        scale = max(1.0, self.limits.time_scale(step.motion, self._grid))
        other = self.measured(step.motion.time_scaled(scale), trust)
        return other if other.better_than(even) else even

    def _linear(self, motion: PathSpeed) -> LinearLimits:
        return self.limits.linear(motion, self._grid, LIMIT_ROWS)

    def _step(self, around: PathIterate, moves: FloatArray, trust: float) -> ProgramStep | None:
        """The best one of some moves within a trust region."""
        motion, linear = around.motion, self._linear(around.motion)
        if not self.nearness.is_time_dependent:
            none = np.zeros((self._clock.u.size, motion.speeds.size))
            return best_step(motion, self.limits.joints, linear, self._clearances(around, none, trust), moves, trust)
        passing = self._clock.slopes(motion)
        shift = TimeShift(passing[:: self.clearance_samples], TIME_SHIFT * trust)
        clear = self._clearances(around, passing, trust)
        return best_step(motion, self.limits.joints, linear, clear, moves, trust, shift)

    def measured(self, motion: PathSpeed, trust: float) -> PathIterate:
        """The iterate of a motion that keeps its limits: how near bodies come in it."""
        theta, times = self.samples_of(motion)
        approach = APPROACH * trust * (2.0 if self.nearness.is_time_dependent else 1.0)
        near = self.nearness.near(theta, times, self.margin + self.proof_margin + approach)
        margins = self._proof_margins(near)
        enough = np.where(margins > 0.0, ENOUGH_SHARE, 1.0) * margins
        missing = np.maximum(self.margin + enough[near.pairs] - near.clearances, 0.0)
        return PathIterate(motion, near, margins, float(missing.sum()))

    def _proof_margins(self, near: NearPairs) -> FloatArray:
        """The proof margin of each pair, (pairs,): no more than most of its clearance at the ends, which are given.

        When the goal is reached is not given. Of a robot with covers, which decide what is clear, bodies that are
        thicker may come as near as they are there.
        """
        margins = self.proof_margin * self.nearness.margin_shares
        last = (near.samples == len(self._clearance_basis) - 1) & ~self._moving[near.pairs]
        ends = (near.samples == 0) | last
        left = near.clearances[ends] - self.margin
        short = left - END_SLACK if self.nearness.robot.cover is not None else 0.0
        np.minimum.at(margins, near.pairs[ends], np.where(left > 0.0, SHARE_AT_ENDS * left, short))
        return margins

    def _clearances(self, around: PathIterate, passing: FloatArray, trust: float) -> ClearanceRows:
        """Clearances that may become too small in a step: at the samples of rows, and where a pair is nearest.

        Args:
            around: the motion.
            passing: how the times of its samples change with its timing, (samples, M) or (samples, M + 1).
            trust: how far a control point may move, rad.
        """
        near = around.near.thinned(CLEARANCE_ROWS)
        theta, times = self.samples_of(around.motion)
        gradients, by_time = self.nearness.gradients(theta, times, near)
        slack = near.clearances - self.margin - around.proof_margins[near.pairs]
        reach = np.abs(gradients).sum(axis=1) * trust
        if self.nearness.is_time_dependent:
            reach += np.abs(by_time) * TIME_SHIFT * trust
        some = slack < reach
        samples = near.samples[some]
        by_timing = by_time[some, None] * passing[samples]
        return ClearanceRows(slack[some], reach[some], gradients[some], self._clearance_basis[samples], by_timing)
