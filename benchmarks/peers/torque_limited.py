"""What others do about torque limits: Ruckig's moves run more slowly until they hold, and TOPP-RA with them."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
import toppra
from toppra.algorithm import TOPPRA

from benchmarks.peers.report import CHECKED_TIMES
from benchmarks.peers.toppra_limits import speed_and_acceleration, torque
from benchmarks.peers.waypoint_paths import Geometry
from problems import Robot
from problems.base import FloatArray, as_array
from problems.limits import TorqueLimit
from problems.motions import JointPath, Samples
from problems.robots import JointLimits

Motion = Callable[[FloatArray, int], FloatArray]  # joint angles, or derivatives of them, (n, k) at times (n,)


@dataclass(frozen=True)
class Timed:
    """A motion of another planner: derivatives at times, its duration in s, and CPU seconds."""

    at: Motion
    duration: float
    seconds: float


def by_ruckig(ends: FloatArray, limits: JointLimits) -> Timed:
    """Ruckig's move from rest to rest between two postures (2, k), rad."""
    import ruckig  # noqa: PLC0415 (an extra)

    k = len(limits.speed)
    question, answer = ruckig.InputParameter(k), ruckig.Trajectory(k)
    question.current_position, question.target_position = ends.tolist()
    question.max_velocity, question.max_acceleration, question.max_jerk = (
        list(bound or ()) for bound in (limits.speed, limits.acceleration, limits.jerk)
    )
    began = time.process_time()
    ruckig.Ruckig(k).calculate(question, answer)
    seconds = time.process_time() - began

    def at(times: FloatArray, order: int) -> FloatArray:
        return np.array([answer.at_time(t)[order] for t in times])

    return Timed(at, float(answer.duration), seconds)


def slowed(motion: Timed, robot: Robot) -> Timed:
    """The same move, slower until its torques hold at very many times; the factor is known in closed form at each."""
    began = time.process_time()
    times = np.linspace(0.0, motion.duration, CHECKED_TIMES)
    derivatives = tuple(ca.DM(motion.at(times, order)) for order in range(3))
    limit = TorqueLimit(robot)
    samples = Samples(robot=robot, derivatives=derivatives, duration=ca.DM(motion.duration), times=ca.DM(times))
    peaks = as_array(limit.magnitudes(samples)).max(axis=0)
    factor = max(1.0, float(limit.time_scale(ca.DM(peaks).T)))
    seconds = motion.seconds + time.process_time() - began
    return Timed(lambda t, order: motion.at(t / factor, order) / factor**order, motion.duration * factor, seconds)


def by_toppra(path: JointPath, robot: Robot, intervals: int) -> Timed | None:
    """TOPP-RA with speed, acceleration and torque limits on so many intervals; None where it fails."""
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    toppra.setup_logging("CRITICAL")
    began = time.process_time()
    grid = np.linspace(*path.breakpoints[[0, -1]], intervals + 1)
    constraints = [*speed_and_acceleration(robot.limits), torque(robot)]
    solver = TOPPRA(constraints, Geometry(path), gridpoints=grid, parametrizer="ParametrizeConstAccel")
    trajectory = solver.compute_trajectory(0.0, 0.0)
    seconds = time.process_time() - began
    return None if trajectory is None else Timed(trajectory, float(trajectory.duration), seconds)
