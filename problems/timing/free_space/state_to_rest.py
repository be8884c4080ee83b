"""The least time from any state of the joints to rest, without obstacles and joint ranges: by Ruckig.

Berscheid and Kroeger, "Jerk-limited Real-time Trajectory Generation with Arbitrary Target States", RSS 2021.
"""

from __future__ import annotations

import numpy as np
import ruckig

from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits


def least_time_to_rest(
    start: FloatArray, velocity: FloatArray, acceleration: FloatArray, goal: FloatArray, limits: JointLimits
) -> float:
    """The least duration in s; no motion within the limits takes less.

    Args:
        start: joint angles, (k,), rad.
        velocity: rad/s. What is beyond its limit by rounding counts as the limit, as of the acceleration.
        acceleration: rad/s^2; it may jump where jerk is not limited.
        goal: joint angles, rad.
        limits: of the k joints; their position limits are not looked at.
    """
    stated = ruckig.InputParameter(start.size)
    speed, most = np.array(limits.speed), np.array(limits.acceleration)
    stated.current_position, stated.target_position = start.tolist(), goal.tolist()
    stated.current_velocity = np.clip(velocity, -speed, speed).tolist()
    stated.current_acceleration = np.clip(acceleration, -most, most).tolist()
    stated.max_velocity, stated.max_acceleration = list(limits.speed), list(limits.acceleration)
    if limits.jerk is not None:
        stated.max_jerk = list(limits.jerk)
    found = ruckig.Trajectory(start.size)
    ruckig.Ruckig(start.size).calculate(stated, found)
    return float(found.duration)
