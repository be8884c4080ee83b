"""Moves with moving ends in free space against Ruckig, which is optimal there: durations, limits, ends, seconds.

Joints start and end at random velocities within random limits, with accelerations of zero.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.peers.report import Report, Size, certified, excess, in_parallel, milliseconds
from problems import Trajectory
from problems.base import FloatArray
from problems.robots import JointLimits
from problems.timing.free_space import least_time_move

JOINTS = (2, 7)
CHECKED_TIMES = 20_000


@dataclass(frozen=True)
class RandomMove:
    """Ends and limits of k joints: postures in rad, velocities in rad/s, each (k,)."""

    start: FloatArray
    goal: FloatArray
    start_velocity: FloatArray
    goal_velocity: FloatArray
    limits: JointLimits

    def planned(self) -> Trajectory:
        """Our motion."""
        return least_time_move(self.start, self.goal, self.start_velocity, self.goal_velocity, self.limits)


def random_move(rng: np.random.Generator) -> RandomMove:
    """Ways from a hundredth of a radian to three, with a jerk limit."""
    k = int(rng.integers(JOINTS[0], JOINTS[1] + 1))
    speed, acceleration, jerk = (tuple(rng.uniform(*range_, k)) for range_ in ((0.5, 4.0), (1.0, 20.0), (5.0, 200.0)))
    start, way = rng.uniform(-3.0, 3.0, (2, k))
    velocities = rng.uniform(-1.0, 1.0, (2, k)) * speed
    limits = JointLimits(speed=speed, acceleration=acceleration, jerk=jerk)
    return RandomMove(start, start + way * rng.choice([1.0, 0.1, 0.01]), *velocities, limits)


def ruckig_duration(move: RandomMove) -> float:
    """The duration of Ruckig's motion, s; NaN where it finds none."""
    import ruckig  # noqa: PLC0415 (an extra)

    k, limits = move.start.size, move.limits
    given, found = ruckig.InputParameter(k), ruckig.Trajectory(k)
    given.current_position, given.target_position = move.start.tolist(), move.goal.tolist()
    given.current_velocity, given.target_velocity = move.start_velocity.tolist(), move.goal_velocity.tolist()
    given.max_velocity, given.max_acceleration = list(limits.speed), list(limits.acceleration)
    given.max_jerk = [np.inf] * k if limits.jerk is None else list(limits.jerk)
    result = ruckig.Ruckig(k).calculate(given, found)
    return float(found.duration) if result == ruckig.Result.Working else float("nan")


def largest_excess(trajectory: Trajectory, limits: JointLimits, count: int = CHECKED_TIMES) -> float:
    """By what share a limit is broken at many times; 0 where none is."""
    times = np.linspace(0.0, trajectory.duration, count)
    bounds = {1: limits.speed, 2: limits.acceleration, 3: limits.jerk}
    shares = [np.abs(trajectory.at(times, order)) / bound for order, bound in bounds.items() if bound is not None]
    return max(0.0, float(np.max(shares)) - 1.0)


def end_error(trajectory: Trajectory, move: RandomMove) -> float:
    """How far postures and velocities at the ends are from what they have to be, rad and rad/s."""
    ends = trajectory.breakpoints[[0, -1]]
    missed = (
        trajectory.at(ends) - [move.start, move.goal],
        trajectory.at(ends, 1) - [move.start_velocity, move.goal_velocity],
    )
    return float(np.abs(missed).max())


@dataclass(frozen=True)
class Outcome:
    """One move: durations of both, our largest excess, the error at the ends, our seconds, the certificate."""

    ratio: float
    excess: float
    error: float
    seconds: float
    certified: bool


def outcome(seed: int, jerk: bool = True) -> Outcome:
    move = random_move(np.random.default_rng(seed))
    move = move if jerk else replace(move, limits=replace(move.limits, jerk=None))
    began = time.process_time()
    trajectory = move.planned()
    seconds = time.process_time() - began
    ratio = trajectory.duration / ruckig_duration(move)
    worst, proven = excess(trajectory.at, trajectory.duration, move.limits), certified(trajectory, move.limits)
    return Outcome(ratio, worst, end_error(trajectory, move), seconds, proven)


def moving_ends(size: Size) -> Report:
    """Joints start and end at random velocities within random limits, with accelerations of zero."""
    rows = []
    for name, jerk in (("jerk limited", True), ("no jerk limit", False)):
        outcomes = in_parallel(partial(outcome, jerk=jerk), size.moves, size.workers)
        ratios = np.array([one.ratio for one in outcomes])
        known = ratios[np.isfinite(ratios)]
        proven = [one for one in outcomes if one.certified]
        rows.append(
            [
                f"{len(outcomes)}, {name}",
                f"{np.median(known):.9f}",
                f"{known.min() - 1.0:+.1e}",
                f"{known.max() - 1.0:+.1e}",
                milliseconds(one.seconds for one in outcomes),
                f"{max(one.excess for one in outcomes):.1e}",
                f"{max(one.error for one in outcomes):.1e}",
                f"{len(proven)}, {sum(one.excess > 0.0 for one in proven)}",
                str(ratios.size - known.size),
            ]
        )
    header = [
        "moves with moving ends",
        "ours / Ruckig",
        "least",
        "most",
        "ours, CPU ms",
        "largest excess",
        "error at the ends",
        "certified, falsely",
        "Ruckig failed",
    ]
    return Report("Moves with moving ends in free space, against Ruckig", header, rows)
