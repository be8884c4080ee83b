"""The fastest move between two postures at rest, without obstacles: a closed form, and the optimum.

Each joint alone needs the duration T_i of a double-S: jerk, acceleration and speed go to their limits, in this order,
as far as the distance allows. The slowest joint determines T; the others run their own q_i(t T_i / T), which only
lowers what they reach. Without a jerk limit the double-S is a trapezoid of speed.
"""

from __future__ import annotations

import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits

SAME_TIME = 1e-13  # of the duration: breakpoints of several joints that are one
SERIES = np.array([1.0, 1.0, 0.5, 1.0 / 6.0])  # q, q', q''/2, q'''/6


def least_durations(distances: FloatArray, limits: JointLimits) -> FloatArray:
    """The least duration of each joint's own move from rest to rest.

    Args:
        distances: how far each joint turns, either way, (..., k), rad.
        limits: of the k joints; their position limits are not looked at.

    Returns:
        (..., k), s; 0 where a joint does not move.
    """
    return np.asarray(_phases(np.abs(np.asarray(distances, dtype=np.float64)), limits).sum(axis=-1))


def rest_to_rest(start: FloatArray, goal: FloatArray, limits: JointLimits) -> Trajectory:
    """The fastest motion from one posture at rest to another.

    Speed and acceleration are continuous where the limits have a jerk; else the acceleration jumps.

    Args:
        start: (k,), rad.
        goal: (k,), rad.
        limits: of the k joints; a move between postures within their position limits stays within them.

    Raises:
        InvalidProblem: start and goal are the same posture, or are not k finite numbers each.
    """
    start, goal = (_posture(name, values, len(limits.speed)) for name, values in (("start", start), ("goal", goal)))
    phases = _phases(np.abs(goal - start), limits)
    durations = phases.sum(axis=-1)
    total = float(durations.max())
    if not total > 0.0:
        raise InvalidProblem("goal", "the same posture as the start: there is nothing to time")
    slowed = phases * (total / np.where(durations > 0.0, durations, total))[:, None]
    times = _merged(np.cumsum(slowed, axis=1), total)
    return Trajectory(times, _pieces(start, goal - start, slowed, _signs(limits), times))


def _posture(name: str, values: FloatArray, dof: int) -> FloatArray:
    posture = np.asarray(values, dtype=np.float64)
    if posture.shape != (dof,):
        raise InvalidProblem(name, f"{posture.size} joint angles for {dof} joints")
    if not np.isfinite(posture).all():
        raise InvalidProblem(name, "a joint angle is not a number")
    return posture


def _signs(limits: JointLimits) -> FloatArray:
    """Signs of the highest derivative in the phases, which are symmetric."""
    return np.array([1.0, 0.0, -1.0] if limits.jerk is None else [1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


def _phases(distances: FloatArray, limits: JointLimits) -> FloatArray:
    """Durations of the phases of each joint's own fastest move, (..., k, 3 or 7), s; distances (..., k) >= 0."""
    speed, acceleration = np.array(limits.speed), np.array(limits.acceleration)
    if limits.jerk is None:
        ramp = np.minimum(speed / acceleration, np.sqrt(distances / acceleration))
        cruise = np.maximum(distances / speed - speed / acceleration, 0.0)
        return np.stack([ramp, cruise, ramp], axis=-1)
    jerk = np.array(limits.jerk)
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
    inner = inner[(inner > SAME_TIME * total) & (inner < (1.0 - SAME_TIME) * total)]
    apart = np.diff(inner, prepend=0.0) > SAME_TIME * total
    return np.concatenate([[0.0], inner[apart], [total]])


def _pieces(
    start: FloatArray, distances: FloatArray, phases: FloatArray, signs: FloatArray, times: FloatArray
) -> FloatArray:
    """Coefficients (4, p, k) of the joints between the times: those of their phases, expanded around each time.

    The highest derivative is what covers the distance exactly in the given phases.
    """
    count, order = signs.size, 2 if signs.size == 3 else 3
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
