"""Paths through random waypoints: our timing and TOPP-RA's on the same spline; and what a jerk limit costs.

Ruckig's free version has no waypoints. TOPP-RA has no jerk limits.
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass

import numpy as np
import toppra
from toppra.algorithm import TOPPRA
from toppra.interpolator import AbstractGeometricPath

from benchmarks.peers.report import Report, Size, certified, excess, in_parallel, spread
from benchmarks.peers.toppra_limits import speed_and_acceleration
from problems.base import FloatArray
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import retime

JERK = 50.0  # times the acceleration limit, 1/s
FINE_GRID = 100  # points for each waypoint: TOPP-RA close to the optimum
METHODS = ("ours", "TOPP-RA, its own grid", f"TOPP-RA, {FINE_GRID} points a waypoint", f"ours, jerk {JERK:g} a")


class Geometry(AbstractGeometricPath):  # type: ignore[misc]
    """A joint path as TOPP-RA wants it."""

    waypoints = None

    def __init__(self, path: JointPath) -> None:
        self.path = path

    @property
    def dof(self) -> int:
        """The number of joints."""
        return int(self.path.coefficients.shape[2])

    @property
    def path_interval(self) -> FloatArray:
        """Its first and last parameter."""
        return self.path.breakpoints[[0, -1]]

    def __call__(self, u: FloatArray, order: int = 0) -> FloatArray:
        """Angles or derivatives of them, (n, k)."""
        return np.asarray(self.path.curve(u, order))


@dataclass(frozen=True)
class Timing:
    """One method on one path; a duration that is no number where it failed."""

    duration: float
    seconds: float
    excess: float
    certified: bool = False


def ours(path: JointPath, limits: JointLimits) -> Timing:
    began = time.process_time()
    trajectory = retime(path, limits)
    seconds = time.process_time() - began
    too_much = excess(trajectory.at, trajectory.duration, limits)
    return Timing(trajectory.duration, seconds, too_much, certified(trajectory, limits))


def by_toppra(path: JointPath, limits: JointLimits, grid: FloatArray | None) -> Timing:
    """TOPP-RA, with the parametrisation that stays on the path."""
    constraints = speed_and_acceleration(limits)
    began = time.process_time()
    solver = TOPPRA(constraints, Geometry(path), gridpoints=grid, parametrizer="ParametrizeConstAccel")
    trajectory = solver.compute_trajectory(0.0, 0.0)
    seconds = time.process_time() - began
    if trajectory is None:
        return Timing(float("nan"), seconds, float("nan"))
    return Timing(float(trajectory.duration), seconds, excess(trajectory, float(trajectory.duration), limits))


def timings(seed: int) -> list[Timing]:
    """Of one random path, one for each of ``METHODS``."""
    logging.getLogger("toppra").setLevel(logging.ERROR)
    toppra.setup_logging("ERROR")
    rng = np.random.default_rng(seed)
    count, k = int(rng.integers(5, 51)), int(rng.integers(2, 8))
    path = JointPath.through(rng.uniform(-2.0, 2.0, (count, k)))
    speed, acceleration = rng.uniform(1.0, 4.0, k), rng.uniform(4.0, 20.0, k)
    limits = JointLimits(speed=tuple(speed), acceleration=tuple(acceleration))
    smooth = JointLimits(speed=limits.speed, acceleration=limits.acceleration, jerk=tuple(JERK * acceleration))
    grid = np.linspace(*path.breakpoints[[0, -1]], FINE_GRID * count + 1)
    return [ours(path, limits), by_toppra(path, limits, None), by_toppra(path, limits, grid), ours(path, smooth)]


def waypoint_paths(size: Size) -> Report:
    every = in_parallel(timings, size.paths, size.workers)
    rows = []
    for method, results in zip(METHODS, zip(*every, strict=True), strict=True):
        solved = [
            (one, path[2].duration) for one, path in zip(results, every, strict=True) if np.isfinite(one.duration)
        ]
        proven = [one for one, _ in solved if one.certified]
        rows.append(
            [
                method,
                f"{len(solved)} of {len(every)}",
                spread((one.duration / reference for one, reference in solved), 4),
                spread((100.0 * one.excess for one, _ in solved), 2),
                spread((one.seconds for one, _ in solved), 2),
                f"{len(proven)}, {sum(one.excess > 0.0 for one in proven)}" if proven else "-",
            ]
        )
    header = ["method", "solved", f"duration / {METHODS[2]}", "excess, %", "CPU seconds", "certified, falsely"]
    return Report("Random waypoints, 5 to 50, 2 to 7 joints (median / worst)", header, rows)
