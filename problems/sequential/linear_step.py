"""One linear program: the best small change of a path and its speed that keeps limits and clearances to first order."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits
from problems.sequential.kept_limits import KeptLimits, LinearLimits
from problems.sequential.path_speed import DELAY_COST, RESTING, Grid, PathSpeed
from problems.sequential.time_shift import TimeShift
from problems.timing.linear_program import minimizer

TOUCHING = 100.0  # s/m: what a program pays for clearance that is missing
FIRST_SHARE = 0.3  # of what can be used up in a step: clearance rows with less room are in a program from the start
NEWLY_BROKEN = 1e-4  # m
MOST_PROGRAMS = 5  # for one step
MOST_CHANGE = 0.8  # of a speed, in one step
SPEED_CHANGE = 0.25 / 0.06  # share of a speed that may change, for each rad of the path
PACING = 0.25  # share of a speed that may change where the path stays
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
        by_pace: slopes with respect to the speeds, (m, M); where an obstacle moves also to the delay, (m, M + 1).
    """

    room: FloatArray
    reach: FloatArray
    gradients: FloatArray
    basis: FloatArray
    by_pace: FloatArray

    def slopes(self, chosen: NDArray[np.intp], moves: FloatArray) -> FloatArray:
        """Of some with respect to moves (N k, free) of the control points, and to the pace."""
        outer = self.basis[chosen, :, None] * self.gradients[chosen, None, :]
        by_path = outer.reshape(chosen.size, moves.shape[0]) @ moves
        return np.concatenate([by_path, self.by_pace[chosen]], axis=1)

    def left(self, change: FloatArray, pace: FloatArray) -> FloatArray:
        """The room that a change (N, k) of the control points, and one of the pace, leaves."""
        by_path = ((self.basis @ change) * self.gradients).sum(axis=1)
        return np.asarray(self.room + by_path + self.by_pace @ pace)


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
            csr_array(matrix),
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


def paced(motion: PathSpeed, limits: KeptLimits, linear: LinearLimits, grid: Grid) -> PathSpeed:
    """The same path as fast as its limits allow on a grid: evenly, or at a speed that a linear program makes of it."""
    even = motion.slowed(limits.stretch(motion, grid))
    width = PACING * motion.speeds
    rows, bounds = useful_rows(linear.values, linear.by_speeds, width)
    found = minimizer(motion.duration_slopes, csr_array(rows), bounds, np.stack([-width, width], axis=1))
    if found is None:
        return even
    other = replace(motion, speeds=motion.speeds + found)
    other = other.slowed(limits.stretch(other, grid))
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
