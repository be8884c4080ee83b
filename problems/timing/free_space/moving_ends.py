"""The fastest move between two states of motion, without obstacles and joint ranges: exact, and the optimum.

At both ends joints may move; where jerk is limited their accelerations are zero there. For one joint and a given
duration everything is convex: the weighted mean of two motions within the limits is within the limits. So the
displacements that a duration allows are an interval, and each of them belongs to a weighted mean of two motions, those
of the largest and of the smallest displacement. The first changes its velocity to the highest peak from which it can
still change to the last one in time; the second is its mirror image.

With the duration the largest displacement grows at the rate of that peak, which itself grows: it is convex. Durations
in which it is too small are therefore one open interval, and so are those in which the smallest is too large (a joint
that must not stop cannot waste time). The least duration is the first outside the intervals of all joints.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
from scipy.optimize import brentq

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits
from problems.timing.free_space.acceleration_pieces import AccelerationPieces, breakpoints, side_by_side

ALLOWANCE = 1e-10  # share of the limits that is left, so that rounding breaks none of them


@dataclass(frozen=True, kw_only=True)
class JointMove:
    """One joint's part.

    Attributes:
        way: displacement, rad.
        first: velocity at the start, rad/s.
        last: velocity at the goal, rad/s.
        speed: limit, no smaller than either of them, rad/s.
        acceleration: limit, rad/s^2.
        jerk: limit, rad/s^3; infinite where there is none.
    """

    way: float
    first: float
    last: float
    speed: float
    acceleration: float
    jerk: float

    @property
    def mirrored(self) -> JointMove:
        """The same in the other direction."""
        return replace(self, way=-self.way, first=-self.first, last=-self.last)

    def change_time(self, change: float) -> float:
        """The least time in s for a change of velocity in rad/s, from acceleration zero to acceleration zero."""
        ramp = self.acceleration / self.jerk
        if abs(change) >= self.acceleration * ramp:
            return abs(change) / self.acceleration + ramp
        return 2.0 * sqrt(abs(change) / self.jerk)

    def change_pieces(self, change: float) -> list[tuple[float, float, float]]:
        """That change: duration, acceleration at first and jerk of each piece."""
        sign, ramp = (1.0 if change > 0.0 else -1.0), self.acceleration / self.jerk
        peak, level = sign * self.acceleration, abs(change) / self.acceleration - ramp
        if level < 0.0:
            ramp, level = sqrt(abs(change) / self.jerk), 0.0
            peak = sign * self.jerk * ramp
        pieces = [(ramp, 0.0, sign * self.jerk), (level, peak, 0.0), (ramp, peak, -sign * self.jerk)]
        return [piece for piece in pieces if piece[0] > 0.0]

    def duration(self, peak: float) -> float:
        """The duration in s of the changes to a peak velocity in rad/s and from there to the last one."""
        return self.change_time(peak - self.first) + self.change_time(self.last - peak)

    def displacement(self, peak: float) -> float:
        """Their displacement, rad."""
        up, down = self.change_time(peak - self.first), self.change_time(self.last - peak)
        return (self.first + peak) / 2.0 * up + (peak + self.last) / 2.0 * down

    def too_short(self) -> tuple[float, float] | None:
        """The open interval of durations in s in which even the largest displacement is too small; None if empty."""
        base = max(self.first, self.last)
        turning = max(base, 0.0)

        def missing(peak: float) -> float:
            return self.way - self.displacement(peak)

        if missing(turning) <= 0.0:
            return None
        least = self.duration(_root(missing, base, turning)) if missing(base) < 0.0 else -inf
        if missing(self.speed) > 0.0:
            return least, self.duration(self.speed) + missing(self.speed) / self.speed
        return least, self.duration(_root(missing, turning, self.speed))

    def highest_peak(self, duration: float) -> float:
        """The highest velocity, in rad/s, that a duration in s has time to change to and from."""
        base = max(self.first, self.last)
        if self.duration(self.speed) <= duration:
            return self.speed
        if self.duration(base) >= duration:
            return base
        peak = _root(lambda peak: self.duration(peak) - duration, base, self.speed)
        step = np.spacing(self.speed)
        while self.duration(peak) > duration:  # by rounding, which next to the base matters
            peak, step = max(base, peak - step), 2.0 * step
        return peak

    def highest(self, duration: float) -> tuple[AccelerationPieces, float]:
        """The accelerations of the largest displacement in a duration in s, and that displacement in rad."""
        peak = self.highest_peak(duration)
        up, down = self.change_pieces(peak - self.first), self.change_pieces(self.last - peak)
        cruise = max(0.0, duration - self.duration(peak))
        pieces = np.array([*up, *([(cruise, 0.0, 0.0)] if cruise > 0.0 else []), *down])
        times, accelerations, jerks = pieces.T[:, :, None]
        return AccelerationPieces(times.ravel(), accelerations, jerks), self.displacement(peak) + cruise * peak


def least_time_move(
    start: FloatArray,
    goal: FloatArray,
    start_velocity: FloatArray,
    goal_velocity: FloatArray,
    limits: JointLimits,
) -> Trajectory:
    """The fastest motion from one posture to another, with given velocities at both.

    Speed and acceleration are continuous, and the acceleration is zero at both ends, where the limits have a jerk; else
    the acceleration jumps.

    Args:
        start: (k,), rad.
        goal: (k,), rad.
        start_velocity: (k,), rad/s, within the limits of speed.
        goal_velocity: likewise.
        limits: of the k joints; their position limits are not looked at.

    Raises:
        InvalidProblem: start and goal are the same, velocities included; a velocity is beyond its limit; or one of the
            four is not k finite numbers.
    """
    states = _states(limits, start=start, goal=goal, start_velocity=start_velocity, goal_velocity=goal_velocity)
    moves = [_joint_move(limits, joint, *state) for joint, state in enumerate(states.T)]
    duration = least_duration(moves)
    if not duration > 0.0:
        raise InvalidProblem("goal", "the same posture at the same velocity as the start: there is nothing to time")
    return side_by_side([_between(move, duration) for move in moves], duration).trajectory(states[0], states[2])


def _states(limits: JointLimits, **values: FloatArray) -> FloatArray:
    """Start, goal and both velocities, (4, k); all are within what they may be."""
    dof = len(limits.speed)
    arrays = {name: np.asarray(value, dtype=np.float64) for name, value in values.items()}
    for name, array in arrays.items():
        if array.shape != (dof,) or not np.isfinite(array).all():
            raise InvalidProblem(name, f"{dof} finite numbers are needed, not {array.tolist()}")
        for joint in np.flatnonzero(np.abs(array) > limits.speed) if name.endswith("velocity") else ():
            raise InvalidProblem(name, f"joint {joint + 1}: {array[joint]:g} is beyond {limits.speed[joint]:g} rad/s")
    return np.array([arrays[name] for name in ("start", "goal", "start_velocity", "goal_velocity")])


def _joint_move(limits: JointLimits, joint: int, start: float, goal: float, first: float, last: float) -> JointMove:
    used = 1.0 - ALLOWANCE
    return JointMove(
        way=float(goal - start),
        first=float(first),
        last=float(last),
        speed=max(used * limits.speed[joint], abs(float(first)), abs(float(last))),
        acceleration=used * limits.acceleration[joint],
        jerk=inf if limits.jerk is None else used * limits.jerk[joint],
    )


def _between(move: JointMove, duration: float) -> AccelerationPieces:
    """The weighted mean, of the motions of largest and smallest displacement, that has the move's own."""
    highest, most = move.highest(duration)
    mirrored, least = move.mirrored.highest(duration)
    share = min(1.0, max(0.0, (move.way + least) / (most + least))) if most + least > 0.0 else 1.0
    times = breakpoints([highest, mirrored], duration)
    high, low = highest.split_at(times), mirrored.split_at(times)
    accelerations = share * high.accelerations - (1.0 - share) * low.accelerations
    return AccelerationPieces(np.diff(times), accelerations, share * high.jerks - (1.0 - share) * low.jerks)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function that changes its sign between two numbers is zero."""
    rounding = 4.0 * np.finfo(float).eps
    return float(brentq(function, low, high, xtol=rounding * max(abs(low), abs(high)), rtol=rounding))


def least_duration(joints: Iterable[JointMove]) -> float:
    """The least duration in s in which all joints can do their parts."""
    moves = list(joints)
    blocked = [move.too_short() for each in moves for move in (each, each.mirrored)]
    duration = max(move.change_time(move.last - move.first) for move in moves)
    for low, high in sorted(interval for interval in blocked if interval is not None):
        if low < duration < high:
            duration = high
    return duration
