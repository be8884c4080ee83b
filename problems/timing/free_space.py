"""The fastest moves in free space, from rest to rest or with moving ends, in closed form.

Each joint alone needs the duration T_i of a double-S: jerk, acceleration and speed go to their limits, in this order,
as far as the distance allows. The slowest joint determines T; the others run their own q_i(t T_i / T), which only
lowers what they reach. Without a jerk limit the double-S is a trapezoid of speed.

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

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray, InvalidProblem
from problems.motions import Trajectory
from problems.robots import JointLimits

TIME_ROUNDING = 1e-13  # of the duration: breakpoints of several joints that are one
TRAPEZOID = np.array([1.0, 0.0, -1.0])  # signs of the highest derivative in the phases
DOUBLE_S = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])
SERIES = np.array([1.0, 1.0, 0.5, 1.0 / 6.0])  # q, q', q''/2, q'''/6


def least_durations(distances: FloatArray, limits: JointLimits) -> FloatArray:
    """The least duration of each joint's own move from rest to rest.

    Args:
        distances: how far each joint turns, either way, (..., k), rad.
        limits: of the k joints; their position limits are not examined.

    Returns:
        (..., k), s; 0 where a joint does not move.
    """
    return np.asarray(_phases(np.abs(np.asarray(distances, dtype=np.float64)), limits).sum(axis=-1))


def switch_shares(distances: FloatArray, limits: JointLimits) -> FloatArray:
    """When the phases of each joint's own move end, as shares of its duration, (k, 3 or 7); 1 where it does not move.

    Args:
        distances: how far each joint turns, either way, (k,), rad.
        limits: of the k joints.
    """
    ends = np.cumsum(_phases(np.abs(distances), limits), axis=1)
    return np.asarray(ends / np.where(ends[:, -1:] > 0.0, ends[:, -1:], 1.0) + (ends[:, -1:] == 0.0))


@dataclass(frozen=True, eq=False)
class Phasing:
    """How joints use the time that the slowest one leaves them: each runs its own motion slower, or waits.

    Attributes:
        stretches: shares of that time by which the motions are slower, (k,), from 0 to 1.
        waits: shares of what is then left that pass before the motions begin, (k,), from 0 to 1.
    """

    stretches: FloatArray
    waits: FloatArray


def rest_to_rest(
    start: FloatArray, goal: FloatArray, limits: JointLimits, phasing: Phasing | None = None
) -> Trajectory:
    """The fastest motion from one posture at rest to another.

    Speed and acceleration are continuous where the limits have a jerk; else the acceleration jumps.

    Args:
        start: (k,), rad.
        goal: (k,), rad.
        limits: of the k joints; a move between postures within their position limits stays within them.
        phasing: what joints do that have time; all move from the first moment to the last where None.

    Raises:
        InvalidProblem: start and goal are the same posture, or are not k finite numbers each.
    """
    start, goal = (_posture(name, values, limits.dof) for name, values in (("start", start), ("goal", goal)))
    phases = _phases(np.abs(goal - start), limits)
    durations = phases.sum(axis=-1)
    total = float(durations.max())
    if not total > 0.0:
        raise InvalidProblem("goal", "the same posture as the start: there is nothing to time")
    moving = np.where(durations > 0.0, durations, total)
    if phasing is None:
        scaled = phases * (total / moving)[:, None]
    else:
        taken = moving + phasing.stretches * (total - moving)
        before = phasing.waits * (total - taken)
        scaled = np.column_stack([before, phases * (taken / moving)[:, None], total - taken - before])
    times = _merged(np.cumsum(scaled, axis=1), total)
    return Trajectory(times, _pieces(start, goal - start, scaled, times))


def _posture(name: str, values: FloatArray, dof: int) -> FloatArray:
    posture = np.asarray(values, dtype=np.float64)
    if posture.shape != (dof,):
        raise InvalidProblem(name, f"{posture.size} joint angles for {dof} joints")
    if not np.isfinite(posture).all():
        raise InvalidProblem(name, "a joint angle is not a number")
    return posture


def _phases(distances: FloatArray, limits: JointLimits) -> FloatArray:
    """Durations of the phases of each joint's own fastest move, (..., k, 3 or 7), s; distances (..., k) >= 0."""
    speed, acceleration, *jerks = limits.by_order
    if not jerks:
        ramp = np.minimum(speed / acceleration, np.sqrt(distances / acceleration))
        cruise = np.maximum(distances / speed - speed / acceleration, 0.0)
        return np.stack([ramp, cruise, ramp], axis=-1)
    jerk = jerks[0]
    swing = np.minimum(acceleration / jerk, np.sqrt(speed / jerk))  # until the acceleration is at its largest
    ramp = swing + speed / (jerk * swing)  # until the speed is
    cruise = distances / speed - ramp
    short = cruise < 0.0  # the largest speed is not reached
    long_swing = distances >= 2.0 * acceleration**3 / jerk**2  # but the largest acceleration is
    short_swing = np.where(long_swing, acceleration / jerk, np.cbrt(distances / (2.0 * jerk)))
    with_plateau = (short_swing + np.sqrt(short_swing**2 + 4.0 * distances / acceleration)) / 2.0
    swing = np.where(short, short_swing, swing)
    ramp = np.where(short, np.where(long_swing, with_plateau, 2.0 * short_swing), ramp)
    plateau, cruise = np.maximum(ramp - 2.0 * swing, 0.0), np.maximum(cruise, 0.0)
    return np.stack([swing, plateau, swing, cruise, swing, plateau, swing], axis=-1)


def _merged(switches: FloatArray, total: float) -> FloatArray:
    """Increasing times from 0 to the total, those of the switches (k, phases) together that differ by rounding."""
    inner = np.unique(switches)
    inner = inner[(inner > TIME_ROUNDING * total) & (inner < (1.0 - TIME_ROUNDING) * total)]
    apart = np.diff(inner, prepend=0.0) > TIME_ROUNDING * total
    return np.concatenate([[0.0], inner[apart], [total]])


def _pieces(start: FloatArray, distances: FloatArray, phases: FloatArray, times: FloatArray) -> FloatArray:
    """Coefficients (4, p, k) of the joints between the times: those of their phases, expanded around each time.

    The highest derivative is what covers the distance exactly in the given phases.
    """
    count = phases.shape[1]
    order, signs = (2, TRAPEZOID) if count <= TRAPEZOID.size + 2 else (3, DOUBLE_S)
    signs = np.pad(signs, (count - signs.size) // 2)  # joints that wait stand still
    states = np.zeros((count + 1, start.size, SERIES.size))  # at the switches, for a unit of the highest derivative
    states[:-1, :, order] = signs[:, None]
    for phase in range(count):
        states[phase + 1, :, :order] = _advanced(states[phase], phases[:, phase])[:, :order]
    covered = states[-1, :, 0]
    states *= (distances / np.where(covered > 0.0, covered, 1.0))[:, None]
    switches = np.insert(np.cumsum(phases, axis=1), 0, 0.0, axis=1)
    middles = (times[:-1] + times[1:]) / 2.0
    chosen = np.array([np.searchsorted(own[1:-1], middles) for own in switches])  # (k, p), the phase of each piece
    joints = np.arange(start.size)[:, None]
    expanded = _advanced(states[chosen, joints], times[:-1] - switches[joints, chosen])
    expanded[..., 0] += start[:, None]
    return np.asarray((expanded * SERIES).transpose(2, 1, 0)[::-1])


def _advanced(states: FloatArray, times: FloatArray) -> FloatArray:
    """The states (..., 4) of q and its derivatives after times (...) in which the last of them is constant."""
    q, speed, acceleration, jerk = np.moveaxis(states, -1, 0)
    after = [
        q + times * (speed + times * (acceleration / 2.0 + times * jerk / 6.0)),
        speed + times * (acceleration + times * jerk / 2.0),
        acceleration + times * jerk,
        jerk,
    ]
    return np.stack(after, axis=-1)


BREAKPOINT_ROUNDING = 4e-15  # of the duration: breakpoints that are one


@dataclass(frozen=True)
class AccelerationPieces:
    """Joint accelerations that are linear in time within each piece.

    Args:
        durations: of the p pieces, positive, (p,), s.
        accelerations: at the start of each piece, (p, k), rad/s^2.
        jerks: of each piece, (p, k), rad/s^3.
    """

    durations: FloatArray
    accelerations: FloatArray
    jerks: FloatArray

    def trajectory(self, theta: FloatArray, velocity: FloatArray) -> Trajectory:
        """The motion that starts at angles (k,) in rad with velocities (k,) in rad/s."""
        h = self.durations[:, None]
        gains = h * self.accelerations + h**2 * self.jerks / 2.0
        speeds = velocity + np.cumsum(gains, axis=0) - gains
        steps = h * speeds + h**2 * self.accelerations / 2.0 + h**3 * self.jerks / 6.0
        angles = theta + np.cumsum(steps, axis=0) - steps
        coefficients = np.stack([self.jerks / 6.0, self.accelerations / 2.0, speeds, angles])
        return Trajectory(np.concatenate([[0.0], np.cumsum(self.durations)]), coefficients)

    def split_at(self, times: FloatArray) -> AccelerationPieces:
        """The accelerations in pieces between increasing times (n,) in s, all breakpoints among them."""
        ends = np.cumsum(self.durations)
        piece = np.minimum(np.searchsorted(ends, (times[:-1] + times[1:]) / 2.0), ends.size - 1)
        since = times[:-1] - (ends - self.durations)[piece]
        accelerations = self.accelerations[piece] + since[:, None] * self.jerks[piece]
        return AccelerationPieces(np.diff(times), accelerations, self.jerks[piece])


def side_by_side(motions: Sequence[AccelerationPieces], duration: float) -> AccelerationPieces:
    """The motions of several joints, each of which takes the duration in s, as one."""
    times = breakpoints(motions, duration)
    parts = [motion.split_at(times) for motion in motions]
    accelerations, jerks = (np.hstack([getattr(part, name) for part in parts]) for name in ("accelerations", "jerks"))
    return AccelerationPieces(np.diff(times), accelerations, jerks)


def breakpoints(motions: Sequence[AccelerationPieces], duration: float) -> FloatArray:
    """All times in s at which one of the motions has a breakpoint, those that are one merged."""
    times = np.unique(np.concatenate([np.cumsum(motion.durations)[:-1] for motion in motions]))
    times = times[(times > BREAKPOINT_ROUNDING * duration) & (times < (1.0 - BREAKPOINT_ROUNDING) * duration)]
    apart = np.diff(times, prepend=-inf) > BREAKPOINT_ROUNDING * duration
    return np.concatenate([[0.0], times[apart], [duration]])


ALLOWANCE = 1e-10  # share of the limits that is left, so that rounding breaks none of them


@dataclass(frozen=True, kw_only=True)
class JointMove:
    """The part of one joint in a move.

    Attributes:
        distance: displacement from start to goal, rad.
        first: velocity at the start, rad/s.
        last: velocity at the goal, rad/s.
        speed: limit, no smaller than either of them, rad/s.
        acceleration: limit, rad/s^2.
        jerk: limit, rad/s^3; infinite where there is none.
    """

    distance: float
    first: float
    last: float
    speed: float
    acceleration: float
    jerk: float

    @property
    def mirrored(self) -> JointMove:
        """The move in the other direction."""
        return replace(self, distance=-self.distance, first=-self.first, last=-self.last)

    def change_time(self, change: float) -> float:
        """The least time in s for a change of velocity in rad/s, from acceleration zero to acceleration zero."""
        ramp = self.acceleration / self.jerk
        if abs(change) >= self.acceleration * ramp:
            return abs(change) / self.acceleration + ramp
        return 2.0 * sqrt(abs(change) / self.jerk)

    def change_pieces(self, change: float) -> list[tuple[float, float, float]]:
        """Pieces of a change of velocity in rad/s: duration, acceleration at first and jerk of each."""
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
        """The displacement of the changes to a peak velocity in rad/s and back, rad."""
        up, down = self.change_time(peak - self.first), self.change_time(self.last - peak)
        return (self.first + peak) / 2.0 * up + (peak + self.last) / 2.0 * down

    def too_short(self) -> tuple[float, float] | None:
        """The open interval of durations in s in which even the largest displacement is too small; None if empty."""
        base = max(self.first, self.last)
        turning = max(base, 0.0)

        def missing(peak: float) -> float:
            return self.distance - self.displacement(peak)

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
        goal_velocity: (k,), rad/s, within the limits of speed.
        limits: of the k joints; their position limits are not examined.

    Raises:
        InvalidProblem: start and goal are the same, velocities included; a velocity is beyond its limit; or one of the
            four is not k finite numbers.
    """
    states = _states(limits, start=start, goal=goal, start_velocity=start_velocity, goal_velocity=goal_velocity)
    moves = [_joint_move(limits, joint, *state) for joint, state in enumerate(states.T)]
    duration = common_duration(moves)
    if not duration > 0.0:
        raise InvalidProblem("goal", "the same posture at the same velocity as the start: there is nothing to time")
    return side_by_side([_between(move, duration) for move in moves], duration).trajectory(states[0], states[2])


def _states(limits: JointLimits, **values: FloatArray) -> FloatArray:
    """Start, goal and both velocities, (4, k); all are within what they may be."""
    dof = limits.dof
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
        distance=float(goal - start),
        first=float(first),
        last=float(last),
        speed=max(used * limits.speed[joint], abs(float(first)), abs(float(last))),
        acceleration=used * limits.acceleration[joint],
        jerk=inf if limits.jerk is None else used * limits.jerk[joint],
    )


def _between(move: JointMove, duration: float) -> AccelerationPieces:
    """The weighted mean, of the motions of largest and smallest displacement, that has the move's own one."""
    highest, most = move.highest(duration)
    mirrored, least = move.mirrored.highest(duration)
    share = min(1.0, max(0.0, (move.distance + least) / (most + least))) if most + least > 0.0 else 1.0
    times = breakpoints([highest, mirrored], duration)
    high, low = highest.split_at(times), mirrored.split_at(times)
    accelerations = share * high.accelerations - (1.0 - share) * low.accelerations
    return AccelerationPieces(np.diff(times), accelerations, share * high.jerks - (1.0 - share) * low.jerks)


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    """The zero of a function that changes its sign between two numbers."""
    rounding = 4.0 * np.finfo(float).eps
    return float(scipy.optimize.brentq(function, low, high, xtol=rounding * max(abs(low), abs(high)), rtol=rounding))


def common_duration(joints: Iterable[JointMove]) -> float:
    """The least duration in s in which all joints can do their parts."""
    moves = list(joints)
    blocked = [move.too_short() for each in moves for move in (each, each.mirrored)]
    duration = max(move.change_time(move.last - move.first) for move in moves)
    for low, high in sorted(interval for interval in blocked if interval is not None):
        if low < duration < high:
            duration = high
    return duration
