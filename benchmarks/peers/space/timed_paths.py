"""A motion from waypoints: a cubic spline that is free of collision, timed by TOPP-RA as exact polynomials."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import toppra
from scipy.interpolate import CubicSpline
from toppra.algorithm import TOPPRA
from toppra.interpolator import SplineInterpolator

from benchmarks.motion_bench_maker.planner_collision import PlannerCollision
from benchmarks.peers.toppra_limits import speed_and_acceleration, torque
from problems import Robot, Trajectory
from problems.base import FloatArray
from problems.robots import JointLimits

STEP = 0.005  # rad along a spline between postures that are checked
DIVISIONS = (1, 2, 3, 5, 8)  # of a straight line between waypoints: the spline follows it more and more closely
GRID_PER_PIECE, LEAST_GRID = 4, 300  # points of TOPP-RA's grid, which holds every knot
SAME, TINY = 1e-9, 1e-12  # rad between waypoints; speed along a path


@dataclass(frozen=True)
class TimedPath:
    """Waypoints (n, k), rad, of a spline, and the motion along it."""

    waypoints: FloatArray
    trajectory: Trajectory


def fastest(
    paths: tuple[FloatArray, ...], collision: PlannerCollision, limits: JointLimits, robot: Robot | None = None
) -> TimedPath | None:
    """The quickest of the timed splines; for each path the first one that is free as lines are divided ever more.

    Args:
        paths: waypoints (n, k), rad.
        collision: says what is free.
        limits: speed and acceleration; TOPP-RA knows no jerk.
        robot: whose torques are limited too.

    Returns:
        None where no spline is free, or TOPP-RA fails on all.
    """
    timed_paths = [one for path in paths if (one := _first_free(path, collision, limits, robot)) is not None]
    return min(timed_paths, key=lambda one: one.trajectory.duration, default=None)


def _first_free(
    path: FloatArray, collision: PlannerCollision, limits: JointLimits, robot: Robot | None
) -> TimedPath | None:
    for waypoints in _divided(path):
        spline = spline_through(waypoints)
        length = float(np.linalg.norm(np.diff(spline(np.linspace(*spline.x[[0, -1]], 200)), axis=0), axis=1).sum())
        if collision.all_free(spline(np.linspace(*spline.x[[0, -1]], int(length / STEP) + 2))):
            trajectory = timed(spline, limits, robot)
            return None if trajectory is None else TimedPath(waypoints, trajectory)
    return None


def _divided(path: FloatArray) -> Iterator[FloatArray]:
    distinct = path[np.append(True, np.linalg.norm(np.diff(path, axis=0), axis=1) > SAME)]
    whole = np.arange(len(distinct))
    for division in DIVISIONS:
        at = np.arange(division * whole[-1] + 1) / division
        yield np.stack([np.interp(at, whole, angles) for angles in distinct.T], axis=1)


def spline_through(waypoints: FloatArray) -> CubicSpline:
    """The cubic spline through waypoints over the length of their chords; a line through two."""
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1)))
    return CubicSpline(along, waypoints, bc_type=_ends(waypoints))


def _ends(waypoints: FloatArray) -> str:
    return "natural" if len(waypoints) == 2 else "not-a-knot"


def timed(spline: CubicSpline, limits: JointLimits, robot: Robot | None = None) -> Trajectory | None:
    """By TOPP-RA, with the parametrisation that stays on the path; None where it fails."""
    toppra.setup_logging("CRITICAL")
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    constraints = [*speed_and_acceleration(limits), *([] if robot is None else [torque(robot)])]
    pieces = max(GRID_PER_PIECE, -(-LEAST_GRID // (len(spline.x) - 1)))
    grid = np.unique(np.concatenate([np.linspace(a, b, pieces + 1) for a, b in itertools.pairwise(spline.x)]))
    path = SplineInterpolator(spline.x, spline(spline.x), bc_type=_ends(spline.x))
    solver = TOPPRA(constraints, path, gridpoints=grid)
    _, speeds, _ = solver.compute_parameterization(0.0, 0.0)
    return None if speeds is None or not np.isfinite(speeds).all() else _composed(spline, grid, np.maximum(speeds, 0.0))


def _composed(spline: CubicSpline, grid: FloatArray, speeds: FloatArray) -> Trajectory:
    """q(s(t)) where s(t) has constant acceleration from one grid point to the next, each within a piece of q."""
    durations = 2.0 * np.diff(grid) / np.maximum(speeds[1:] + speeds[:-1], TINY)
    pieces = np.clip(np.searchsorted(spline.x, grid[:-1], side="right") - 1, 0, len(spline.x) - 2)
    scaled = []
    for number, (piece, duration) in enumerate(zip(pieces, durations, strict=True)):
        acceleration = (speeds[number + 1] - speeds[number]) / duration
        law = np.array(
            [grid[number] - spline.x[piece], speeds[number] * duration, 0.5 * acceleration * duration**2]
        )  # lowest power of tau first
        result = np.zeros((7, spline.c.shape[2]))
        power = np.ones(1)
        for order in range(4):
            result[: len(power)] += np.outer(power, spline.c[3 - order, piece])
            power = np.convolve(power, law)
        scaled.append(result)
    return Trajectory.from_pieces(durations, scaled)
