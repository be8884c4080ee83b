"""A path with jerk limits, section by section: between kinks, at which the joints stop without acceleration."""

from __future__ import annotations

from math import factorial

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.robots.rigid.rigid_chain import RigidChain
from problems.robots.robot import JointLimits
from problems.timing.motors.path_torques import PathTorques
from problems.timing.prepared import SAME, PreparedPath
from problems.timing.rest_to_rest import SAME_TIME, rest_to_rest
from problems.timing.smooth.smooth_timing import smooth_timing
from problems.timing.speed_profile import SpeedProfile

BISECTIONS = 60
LINE_SAMPLES = 2_000  # of a move along a line, to judge its torques by


def timed_by_section(
    prepared: PreparedPath,
    limits: JointLimits,
    refined: bool = True,
    chain: RigidChain | None = None,
    ceiling: SpeedProfile | None = None,
) -> Trajectory:
    """The motion along all sections, each as fast as was found.

    Args:
        prepared: the path.
        limits: with a jerk.
        refined: whether to go on from the first motion that keeps the limits.
        chain: whose torques are limited; None where they do not count.
        ceiling: as of :func:`smooth_timing`.

    Raises:
        InvalidProblem: as :func:`smooth_timing`.
    """
    parts: list[Trajectory] = []
    begun = 0.0
    for section in prepared.sections():
        below = None if ceiling is None else ceiling.seen_from(begun)
        begun += float(section.path.breakpoints[-1])
        motors = PathTorques.of(section.path, limits, chain)
        if _is_line(section) and not section.moves_at_an_end and below is None:
            move = _along_line(section.path, limits)
            if motors is None or _line_time_scale(motors, move) <= 1.0:
                parts.append(move)
                continue
        parts.append(smooth_timing(section, limits, refined, motors, below))
    return _joined(parts)


def _line_time_scale(motors: PathTorques, move: Trajectory) -> float:
    """How many times slower a move along a line has to be run for its torques, at samples."""
    (start, way), times = motors.path.coefficients[::-1, 0], move.times(LINE_SAMPLES)
    u, rate, change = ((move.at(times, order) - (order == 0) * start) @ way / (way @ way) for order in range(3))
    return motors.time_scale(np.clip(u, *motors.path.breakpoints[[0, -1]]), rate, change)


def _is_line(section: PreparedPath) -> bool:
    """Whether q' is the same all along."""
    path = section.path
    extents = np.diff(path.breakpoints)[:, None]
    bends = [np.abs(path.coefficients[-1 - n] * extents**n).max() for n in range(2, len(path.coefficients))]
    return bool(max(bends, default=0.0) <= SAME * np.abs(path.coefficients[-2] * extents).max())


def _along_line(path: JointPath, limits: JointLimits) -> Trajectory:
    """A line from rest to rest is the move of one joint, under what is left of each limit along it."""
    slope, length = np.abs(path.coefficients[-2, 0]), float(path.breakpoints[-1])
    with np.errstate(divide="ignore"):
        speed, acceleration, jerk = (
            (float((np.array(limit) / slope).min()),) for limit in (limits.speed, limits.acceleration, limits.jerk)
        )
    one = JointLimits(speed=speed, acceleration=acceleration, jerk=jerk)
    move = _broken(rest_to_rest(np.zeros(1), np.array([length]), one), path.breakpoints[1:-1])
    coefficients = move.coefficients * path.coefficients[-2, 0]
    coefficients[-1] += path.coefficients[-1, 0]
    return Trajectory(move.breakpoints, coefficients)


def _broken(move: Trajectory, passed: FloatArray) -> Trajectory:
    """The move of one joint, from 0 on without turning back, with a breakpoint wherever it passes one of the angles."""
    low, high = np.zeros(passed.size), np.full(passed.size, move.duration)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        late = move.at(middle)[:, 0] >= passed
        low, high = np.where(late, low, middle), np.where(late, middle, high)
    apart = np.abs(high[:, None] - move.breakpoints).min(axis=1) > SAME_TIME * move.duration
    times = np.union1d(move.breakpoints, high[apart])
    orders = range(len(move.coefficients) - 1, -1, -1)
    return Trajectory(times, np.stack([move.at(times[:-1], order) / factorial(order) for order in orders]))


def _joined(parts: list[Trajectory]) -> Trajectory:
    """One motion after the other."""
    order = max(len(part.coefficients) for part in parts)
    padded = [np.pad(part.coefficients, ((order - len(part.coefficients), 0), (0, 0), (0, 0))) for part in parts]
    starts = np.cumsum([0.0, *(part.duration for part in parts)])
    times = [part.breakpoints[:-1] + start for part, start in zip(parts, starts[:-1], strict=True)]
    return Trajectory(np.concatenate([*times, starts[-1:]]), np.concatenate(padded, axis=1))
