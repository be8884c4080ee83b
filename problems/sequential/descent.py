"""The descent: one linear program after another."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import minimizer
from problems.robots import JointLimits
from problems.sequential.kept_limits import KeptLimits, LinearLimits
from problems.sequential.nearness import Nearness, NearPairs
from problems.sequential.path_speed import DELAY_COST, RESTING, Clock, Freedom, Grid, MotionSpace, PathSpeed, TimeShift

TOUCHING = 100.0  # s/m: what a program pays for clearance that is missing
FIRST_SHARE = 0.3  # of what can be used up in a step: clearance rows with less room are in a program from the start
NEWLY_BROKEN = 1e-4  # m
MOST_PROGRAMS = 5  # for one step
MOST_CHANGE = 0.8  # of a speed, in one step
SPEED_CHANGE = 0.25 / 0.06  # share of a speed that may change, for each rad of the path
SPEED_SHARE = 0.25  # share of a speed that may change where the path stays
SLOWEST = 0.2  # of a constant speed, where times matter: to stand still between two samples is to look away
NONE = 1e-9  # slopes that are none


@dataclass(frozen=True)
class ClearanceRows:
    """Clearances to first order.

    Attributes:
        room: by how much each may fall, (m,), m.
        reach: by how much each changes in a step at most, (m,), m.
        gradients: with respect to the joints, (m, k).
        basis: of the path at their samples, (m, N).
        by_timing: slopes with respect to the speeds, (m, M); where an obstacle moves also to the delay, (m, M + 1).
    """

    room: FloatArray
    reach: FloatArray
    gradients: FloatArray
    basis: FloatArray
    by_timing: FloatArray

    def slopes(self, chosen: NDArray[np.intp], moves: FloatArray) -> FloatArray:
        """Of some with respect to moves (N k, free) of the control points, and to the timing."""
        outer = self.basis[chosen, :, None] * self.gradients[chosen, None, :]
        by_path = outer.reshape(chosen.size, moves.shape[0]) @ moves
        return np.concatenate([by_path, self.by_timing[chosen]], axis=1)

    def left(self, change: FloatArray, timing: FloatArray) -> FloatArray:
        """The room that a change (N, k) of the control points, and one of the timing, leaves."""
        by_path = ((self.basis @ change) * self.gradients).sum(axis=1)
        return np.asarray(self.room + by_path + self.by_timing @ timing)


@dataclass(frozen=True)
class Step:
    """A motion that a linear program leads to, and how much time it promises to save, s."""

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
) -> Step | None:
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
        slowest = SLOWEST / (motion.duration - motion.delay)
        lower[free:] = np.maximum(lower[free:], np.minimum(slowest - motion.speeds, 0.0))
        lower, upper = np.append(lower, -min(motion.delay, shift.most)), np.append(upper, shift.most)
    box = np.stack([lower, upper], axis=1)
    active = clear.room < FIRST_SHARE * clear.reach
    found, change = None, np.zeros_like(motion.controls)
    for _ in range(MOST_PROGRAMS):
        chosen = np.flatnonzero(active)
        own = np.cumsum(clear.room[chosen] < 0.0) * (clear.room[chosen] < 0.0)  # 0 is what all others share
        slack = np.zeros((chosen.size, own.max(initial=0) + 1))
        slack[np.arange(chosen.size), own] = -1.0
        touching = [-clear.slopes(chosen, moves), slack]
        matrix = np.concatenate([np.pad(rows, ((0, 0), (0, slack.shape[1]))), np.concatenate(touching, axis=1)])
        paid = np.full(slack.shape[1], TOUCHING)
        solution = minimizer(
            np.append(costs, paid),
            scipy.sparse.csr_array(matrix),
            np.concatenate([bounds, clear.room[chosen]]),
            np.concatenate([box, np.stack([0.0 * paid, np.inf * paid], axis=1)]),
        )
        if solution is None:
            break
        found, change = solution, (moves @ solution[:free]).reshape(motion.controls.shape)
        left = clear.left(change, solution[free : costs.size])
        broken = ~active & (left < -solution[costs.size] - NEWLY_BROKEN)
        if not broken.any():
            break
        active |= broken
    if found is None:
        return None
    last = free + motion.speeds.size
    delay = motion.delay + float(found[last : costs.size].sum())
    moved = PathSpeed(motion.space, motion.controls + change, motion.speeds + found[free:last], delay)
    return Step(moved, float(-costs[free:] @ found[free : costs.size]))


def at_best_speed(motion: PathSpeed, limits: KeptLimits, linear: LinearLimits, grid: Grid) -> PathSpeed:
    """The same path as fast as its limits allow on a grid: evenly, or at a speed that a linear program makes of it."""
    even = motion.time_scaled(limits.time_scale(motion, grid))
    width = SPEED_SHARE * motion.speeds
    rows, bounds = useful_rows(linear.values, linear.by_speeds, width)
    found = minimizer(motion.duration_slopes, scipy.sparse.csr_array(rows), bounds, np.stack([-width, width], axis=1))
    if found is None:
        return even
    other = replace(motion, speeds=motion.speeds + found)
    other = other.time_scaled(limits.time_scale(other, grid))
    return min(even, other, key=lambda each: each.duration)


def useful_rows(values: FloatArray, slopes: FloatArray, width: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rows and bounds that keep shares within -1 and 1, of those that can become active within a box."""
    reach = np.abs(slopes) @ width
    bounds = np.concatenate([1.0 - values, 1.0 + values])
    kept = (bounds < np.tile(reach, 2)) & np.tile(reach > NONE, 2)
    return np.concatenate([slopes, -slopes])[kept], bounds[kept]


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
CLEARANCE_SAMPLES, CLEARANCE_ROWS = 8, 2  # likewise; rows are also where something is extreme
ITERATIONS = 40
WAIT_SAMPLES = 24  # of the clearance while it stands still at its start
SHIFT = 1.0  # s/rad: by how much times may change in a step, of the trust region
FIRST_TRUST, LEAST_TRUST, LARGEST_TRUST = 0.1, 2e-3, 0.25  # rad, how far a control point may move
MOVING_TRUST, LARGEST_MOVING = 0.04, 0.1  # rad, the first and the largest where obstacles move
GROWS, SHRINKS, FAILS = 1.6, 0.5, 0.3  # the trust region
GOOD, POOR = 0.5, 0.1  # shares of the promised gain
HOPELESS = 1.5  # of a duration to beat
LEAST_GAIN, PATIENCE = 2e-4, 3  # of the duration; and how many iterations may gain less
SLACK = 1e-4  # m, more than bodies come too near at the ends
ENOUGH, AT_ENDS = 0.5, 0.8  # of the spare clearance, and of that of the ends
LOOKED_AT = 1.0  # m/rad: pairs are looked at that come no farther than that beyond what is kept, of the trust region;
# and by no more than that an obstacle may be elsewhere after a step, because the motion passes it at another time
SPEED_TRUST = 0.06  # rad: speeds alone may change as much as in a trust region of this size


@dataclass(frozen=True)
class Reached:
    """A motion that keeps the limits of its joints, and how near it comes.

    Attributes:
        motion: as fast as it may be.
        near: its pairs.
        spares: what each of all pairs has to keep at samples on top of the margin, m.
        missing: the sum of the clearances that are missing to the one that is kept, m; 0 where none is.
    """

    motion: PathSpeed
    near: NearPairs
    spares: FloatArray
    missing: float

    def better_than(self, other: Reached) -> bool:
        """Nearer to being clear; if both are, faster."""
        return (self.missing, self.motion.cost) < (other.missing, other.motion.cost)


@dataclass(frozen=True)
class Descent:
    """Sequential linear programs.

    Args:
        space: of motions.
        limits: of the joints.
        freedom: of the ends.
        nearness: of what has to keep a distance.
        kept: that distance, m.
        spare: to keep on top of it at samples, m, where the ends keep more; half of it is enough.
        clearance_samples: in each piece of the speed.
    """

    space: MotionSpace
    limits: KeptLimits
    freedom: Freedom
    nearness: Nearness
    kept: float
    spare: float
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
        """Which pairs are with an obstacle that moves, (pairs,)."""
        return np.array([pair.is_time_dependent for pair in self.nearness.pairs], dtype=bool)

    def samples_of(self, motion: PathSpeed) -> tuple[FloatArray, FloatArray]:
        """Where clearances are looked at: postures (n, k), rad, and times (n,), s."""
        return self._clearance_basis @ motion.controls, self._clock.times(motion)

    def __call__(self, start: PathSpeed, to_beat: float = np.inf) -> Reached:
        """The best motion that steps from a start lead to.

        Args:
            start: of the descent.
            to_beat: the duration in s of a motion that is known: what becomes much slower is given up.
        """
        trust, largest = (
            (MOVING_TRUST, LARGEST_MOVING) if self.nearness.is_time_dependent else (FIRST_TRUST, LARGEST_TRUST)
        )
        best, idle = self.begun(start), 0
        for _ in range(ITERATIONS):
            step = self._step(best, self.freedom.moves(best.motion.controls), trust)
            if step is None:
                break
            new = self._reached(replace(step.motion, controls=self.freedom.placed(step.motion.controls)), GROWS * trust)
            saved = best.motion.cost - new.motion.cost
            if not new.better_than(best):
                trust *= FAILS
            else:
                share = 1.0 if new.missing < best.missing else saved / max(step.promised, saved, 1e-9)
                trust = min(trust * (GROWS if share > GOOD else SHRINKS if share < POOR else 1.0), largest)
                idle = idle + 1 if new.missing == best.missing and saved < LEAST_GAIN * best.motion.duration else 0
                best = new
            if idle == PATIENCE or trust < LEAST_TRUST or best.motion.duration > HOPELESS * to_beat:
                break
        return best

    def begun(self, start: PathSpeed) -> Reached:
        """Where a descent begins."""
        return self._reached(replace(start, controls=self.freedom.placed(start.controls)), FIRST_TRUST)

    def _reached(self, motion: PathSpeed, trust: float) -> Reached:
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

    def _step(self, around: Reached, moves: FloatArray, trust: float) -> Step | None:
        """The best one of some moves within a trust region."""
        motion, linear = around.motion, self._linear(around.motion)
        if not self.nearness.is_time_dependent:
            none = np.zeros((self._clock.u.size, motion.speeds.size))
            return best_step(motion, self.limits.joints, linear, self._clearances(around, none, trust), moves, trust)
        passing = self._clock.slopes(motion)
        shift = TimeShift(passing[:: self.clearance_samples], SHIFT * trust)
        clear = self._clearances(around, passing, trust)
        return best_step(motion, self.limits.joints, linear, clear, moves, trust, shift)

    def measured(self, motion: PathSpeed, trust: float) -> Reached:
        """How near a motion comes that keeps its limits."""
        theta, times = self.samples_of(motion)
        looked_at = LOOKED_AT * trust * (2.0 if self.nearness.is_time_dependent else 1.0)
        near = self.nearness.near(theta, times, self.kept + self.spare + looked_at)
        spares = self._spares(near)
        enough = np.where(spares > 0.0, ENOUGH, 1.0) * spares
        missing = np.maximum(self.kept + enough[near.pairs] - near.clearances, 0.0)
        return Reached(motion, near, spares, float(missing.sum()))

    def _spares(self, near: NearPairs) -> FloatArray:
        """The spare clearance of each pair, (pairs,): no more than most of what it has at the ends, which are given.

        When the goal is reached is not given. Of a robot with covers, which decide what is clear, bodies that are
        thicker may come as near as they are there.
        """
        spares = self.spare * self.nearness.spare_shares
        last = (near.samples == len(self._clearance_basis) - 1) & ~self._moving[near.pairs]
        ends = (near.samples == 0) | last
        room = near.clearances[ends] - self.kept
        short = room - SLACK if self.nearness.robot.is_covered else 0.0
        np.minimum.at(spares, near.pairs[ends], np.where(room > 0.0, AT_ENDS * room, short))
        return spares

    def _clearances(self, around: Reached, passing: FloatArray, trust: float) -> ClearanceRows:
        """Those that may become too small in a step: at the samples of rows, and where a pair is nearest.

        Args:
            around: the motion.
            passing: how the times of its samples change with its timing, (samples, M) or (samples, M + 1).
            trust: how far a control point may move, rad.
        """
        near = around.near.thinned(CLEARANCE_ROWS)
        theta, times = self.samples_of(around.motion)
        gradients, by_time = self.nearness.gradients(theta, times, near)
        room = near.clearances - self.kept - around.spares[near.pairs]
        reach = np.abs(gradients).sum(axis=1) * trust
        if self.nearness.is_time_dependent:
            reach += np.abs(by_time) * SHIFT * trust
        some = room < reach
        samples = near.samples[some]
        by_timing = by_time[some, None] * passing[samples]
        return ClearanceRows(room[some], reach[some], gradients[some], self._clearance_basis[samples], by_timing)
