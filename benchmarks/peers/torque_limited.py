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
from toppra.constraint import (
    DiscretizationType,
    JointAccelerationConstraint,
    JointTorqueConstraint,
    JointVelocityConstraint,
)

from benchmarks.peers.report import CHECKED_TIMES, TIMES_PER_CHUNK
from benchmarks.peers.waypoint_paths import Geometry
from problems import Robot
from problems.base.matrix import FloatArray, as_array
from problems.motions.joint_path import JointPath

Motion = Callable[[FloatArray, int], FloatArray]  # joint angles, or derivatives of them, (n, k) at times (n,)


@dataclass(frozen=True)
class Timed:
    """A motion of another planner: derivatives at times, its duration in s, and CPU seconds."""

    at: Motion
    duration: float
    seconds: float


def peak_torque(robot: Robot, at: Motion, duration: float, count: int = CHECKED_TIMES) -> float:
    """The largest torque at very many times, as a share of its limit; Coulomb friction as at each of them."""
    bound, worst = np.array(robot.limits.torque), 0.0
    for times in np.array_split(np.linspace(0.0, duration, count), max(count // TIMES_PER_CHUNK, 1)):
        torques = robot.inverse_dynamics(*(ca.DM(at(times, order)) for order in range(3)))
        worst = max(worst, float((np.abs(as_array(torques)) / bound).max()))
    return worst


def by_toppra(path: JointPath, robot: Robot, intervals: int) -> Timed | None:
    """TOPP-RA with speed, acceleration and torque limits on so many intervals; None where it fails."""
    logging.getLogger("toppra").setLevel(logging.ERROR)
    toppra.setup_logging("ERROR")
    limits = robot.limits
    state = [ca.SX.sym(name, 1, robot.dof) for name in ("q", "v", "a")]
    dynamics = ca.Function("torques", state, [robot.inverse_dynamics(*state)])
    constraints = [
        JointVelocityConstraint(np.multiply.outer(limits.speed, [-1.0, 1.0])),
        JointAccelerationConstraint(np.multiply.outer(limits.acceleration, [-1.0, 1.0])),
        JointTorqueConstraint(
            lambda q, v, a: dynamics(q, v, a).full()[0],
            np.multiply.outer(np.array(limits.torque), [-1.0, 1.0]),
            np.zeros(robot.dof),
            discretization_scheme=DiscretizationType.Interpolation,
        ),
    ]
    began = time.process_time()
    grid = np.linspace(*path.breakpoints[[0, -1]], intervals + 1)
    solver = TOPPRA(constraints, Geometry(path), gridpoints=grid, parametrizer="ParametrizeConstAccel")
    trajectory = solver.compute_trajectory(0.0, 0.0)
    seconds = time.process_time() - began
    return None if trajectory is None else Timed(trajectory, float(trajectory.duration), seconds)
