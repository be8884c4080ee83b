"""The least time along a given path, proven for all t."""

from __future__ import annotations

import numpy as np

from problems.base.errors import InvalidProblem
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.robots.rigid.rigid_chain import RigidChain
from problems.robots.robot import JointLimits
from problems.timing.fastest_profile import fastest_profile
from problems.timing.motors.path_torques import PathTorques
from problems.timing.motors.torque_rows import profile_time_scale
from problems.timing.prepared import prepared
from problems.timing.sections import timed_by_section
from problems.timing.speed_profile import SpeedProfile
from problems.timing.stretch import minimum_time_scale

END_TOLERANCE = 1e-9  # of a speed limit; allows for rounding only


def retime(
    path: JointPath,
    limits: JointLimits,
    rates: tuple[float, float] = (0.0, 0.0),
    refined: bool = True,
    chain: RigidChain | None = None,
    ceiling: SpeedProfile | None = None,
) -> Trajectory:
    """Run a path as fast as the limits of its joints allow, between grid points as at them.

    Without jerk limits accelerations jump, at the ends too; corners of the path are stops. With them accelerations are
    continuous, zero at ends at rest, at moving ends the least that the path's curvature allows; the joints also stop
    where the curvature jumps, q''. Without them the motion is the optimum, but for the grid; with them the best found
    near it.

    Torque limits are kept, but for a margin of a ten-thousandth, at samples so dense that the certificate of torques
    has something to prove; the proof itself is the caller's.

    Args:
        path: of k joints.
        limits: on speed, acceleration and, where given, jerk of the k joints; on torque where there is a chain.
        rates: du/dt at the start and at the end, not negative: joint velocities there are q'(u) du/dt, exactly. At an
            end where q' is zero the joints are at rest whatever it is.
        refined: whether, with jerk limits, the best motion is looked for; else the first that keeps them will do.
        chain: whose torques are limited; None where they do not count.
        ceiling: (du/dt)^2 that is not exceeded, for what has to be somewhere at its time; none where None. With jerk
            limits the motion follows it more slowly, as far as they want.

    Raises:
        InvalidProblem: the path stands still or jumps, or its limits are of another number of joints, or allow no
            motion with these velocities at the ends (with jerk limits: none was found); or the motors cannot hold the
            chain somewhere on the path.
    """
    ready = prepared(path, rates)
    _check_ends(path, limits, rates)
    motors = PathTorques.of(ready.path, limits, chain)
    if ceiling is not None and not np.array_equal(ready.path.breakpoints, path.breakpoints):
        raise InvalidProblem("path", "it stands still in places, which a given profile does not allow for")
    if limits.jerk is not None:
        return timed_by_section(ready, limits, refined and ceiling is None, chain, ceiling)
    profile, intervals = fastest_profile(ready, limits, motors, ceiling)
    trajectory = profile.trajectory(intervals)
    if ready.moves_at_an_end:
        return trajectory
    scale = max(minimum_time_scale(trajectory, limits), 0.0 if ceiling is None else 1.0)
    return trajectory.time_scaled(scale if motors is None else max(scale, profile_time_scale(motors, profile)))


def _check_ends(path: JointPath, limits: JointLimits, rates: tuple[float, float]) -> None:
    joints = path.coefficients.shape[2]
    if len(limits.speed) != joints:
        raise InvalidProblem("path", f"{joints} joints for limits of {len(limits.speed)}")
    velocities = path.at(path.breakpoints[[0, -1]], 1) * np.array(rates)[:, None]
    for name, velocity in zip(("start", "goal"), velocities, strict=True):
        for joint, (value, most) in enumerate(zip(np.abs(velocity), limits.speed, strict=True), start=1):
            if value > most * (1.0 + END_TOLERANCE):
                raise InvalidProblem("rates", f"{name}: joint {joint} at {value:g} rad/s may not exceed {most:g} rad/s")
