"""The least time along a given path, proven for all t."""

from __future__ import annotations

import numpy as np

from problems.base.errors import InvalidProblem
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits
from problems.timing.fastest_profile import fastest_profile
from problems.timing.prepared import prepared
from problems.timing.sections import timed_by_section
from problems.timing.stretch import minimum_time_scale

END_TOLERANCE = 1e-9  # of a speed limit; allows for rounding only


def retime(
    path: JointPath, limits: JointLimits, rates: tuple[float, float] = (0.0, 0.0), refined: bool = True
) -> Trajectory:
    """Run a path as fast as the limits of its joints allow, between grid points as at them.

    Without jerk limits accelerations jump, at the ends too; corners of the path are stops. With them accelerations are
    continuous, zero at ends at rest, at moving ends the least that the path's curvature allows; the joints also stop
    where the curvature jumps, q''. Without them the motion is the optimum, but for the grid; with them the best found
    near it.

    Args:
        path: of k joints.
        limits: on speed, acceleration and, where given, jerk of the k joints.
        rates: du/dt at the start and at the end, not negative: joint velocities there are q'(u) du/dt, exactly. At an
            end where q' is zero the joints are at rest whatever it is.
        refined: whether, with jerk limits, the best motion is looked for; else the first that keeps them will do.

    Raises:
        InvalidProblem: the path stands still or jumps, or its limits are of another number of joints, or allow no
            motion with these velocities at the ends (with jerk limits: none was found).
    """
    ready = prepared(path, rates)
    _check_ends(path, limits, rates)
    if limits.jerk is not None:
        return timed_by_section(ready, limits, refined)
    profile, intervals = fastest_profile(ready, limits)
    trajectory = profile.trajectory(intervals)
    return trajectory if ready.moves_at_an_end else trajectory.time_scaled(minimum_time_scale(trajectory, limits))


def _check_ends(path: JointPath, limits: JointLimits, rates: tuple[float, float]) -> None:
    joints = path.coefficients.shape[2]
    if len(limits.speed) != joints:
        raise InvalidProblem("path", f"{joints} joints for limits of {len(limits.speed)}")
    velocities = path.at(path.breakpoints[[0, -1]], 1) * np.array(rates)[:, None]
    for name, velocity in zip(("start", "goal"), velocities, strict=True):
        for joint, (value, most) in enumerate(zip(np.abs(velocity), limits.speed, strict=True), start=1):
            if value > most * (1.0 + END_TOLERANCE):
                raise InvalidProblem("rates", f"{name}: joint {joint} at {value:g} rad/s may not exceed {most:g} rad/s")
