"""The least time along a given path, section by section, proven between grid points."""

from __future__ import annotations

import numpy as np

from problems.base import FloatArray, InvalidProblem, taylor_coefficients
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits, RigidChain
from problems.timing.free_space import TIME_ROUNDING, rest_to_rest
from problems.timing.prepared import DERIVATIVE_ROUNDING, PathTorques, PreparedPath, peak_ratios, prepared
from problems.timing.settings import DEFAULT_RETIMING, RetimingSettings
from problems.timing.smooth_timing import smooth_timing
from problems.timing.speed_profile import SpeedProfile, fastest_profile, profile_time_scale

BISECTIONS = 60


def _by_section(
    prepared: PreparedPath,
    limits: JointLimits,
    refined: bool = True,
    chain: RigidChain | None = None,
    ceiling: SpeedProfile | None = None,
    settings: RetimingSettings = DEFAULT_RETIMING,
) -> Trajectory:
    """The motion along all sections, each as fast as the search finds.

    Args:
        prepared: the path.
        limits: with a jerk.
        refined: whether to go on from the first motion that keeps the limits.
        chain: whose torques are limited; None where they do not count.
        ceiling: as of :func:`smooth_timing`.
        settings: of the search.

    Raises:
        InvalidProblem: as :func:`smooth_timing`.
    """
    parts: list[Trajectory] = []
    begun = 0.0
    for section in prepared.sections():
        below = None if ceiling is None else ceiling.seen_from(begun)
        begun += float(section.path.breakpoints[-1])
        motors = PathTorques.of(section.path, limits, chain, settings.torques)
        if _is_line(section) and not section.moves_at_an_end and below is None:
            move = _along_line(section.path, limits)
            if motors is None or _line_time_scale(motors, move, settings.line_samples) <= 1.0:
                parts.append(move)
                continue
        parts.append(smooth_timing(section, limits, refined, motors, below, settings))
    return _joined(parts)


def _line_time_scale(motors: PathTorques, move: Trajectory, samples: int) -> float:
    """How many times slower a move along a line has to be run for its torques, at samples."""
    start, line = motors.path.coefficients[-1, 0], motors.path.coefficients[-2, 0]  # higher orders are all but zero
    times, joints = move.times(samples), line.size
    u, rate, change = (
        (move.at(times, order)[:, :joints] - (order == 0) * start) @ line / (line @ line) for order in range(3)
    )
    return motors.time_scale(np.clip(u, *motors.path.breakpoints[[0, -1]]), rate, change)


def _is_line(section: PreparedPath) -> bool:
    """Whether q' is the same all along."""
    path = section.path
    extents = np.diff(path.breakpoints)[:, None]
    bends = [np.abs(path.coefficients[-1 - n] * extents**n).max() for n in range(2, len(path.coefficients))]
    return bool(max(bends, default=0.0) <= DERIVATIVE_ROUNDING * np.abs(path.coefficients[-2] * extents).max())


def _along_line(path: JointPath, limits: JointLimits) -> Trajectory:
    """A line from rest to rest is the move of one joint, under the limits along it."""
    slope, length = np.abs(path.coefficients[-2, 0]), float(path.breakpoints[-1])
    with np.errstate(divide="ignore"):
        speed, acceleration, jerk = ((float((bound / slope).min()),) for bound in limits.by_order)
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
    apart = np.abs(high[:, None] - move.breakpoints).min(axis=1) > TIME_ROUNDING * move.duration
    times = np.union1d(move.breakpoints, high[apart])
    return Trajectory(times, taylor_coefficients(move.at, times[:-1], len(move.coefficients) - 1))


def _joined(parts: list[Trajectory]) -> Trajectory:
    """One motion after the other."""
    order = max(len(part.coefficients) for part in parts)
    padded = [np.pad(part.coefficients, ((order - len(part.coefficients), 0), (0, 0), (0, 0))) for part in parts]
    starts = np.cumsum([0.0, *(part.duration for part in parts)])
    times = [part.breakpoints[:-1] + start for part, start in zip(parts, starts[:-1], strict=True)]
    return Trajectory(np.concatenate([*times, starts[-1:]]), np.concatenate(padded, axis=1))


END_TOLERANCE = 1e-9  # of a speed limit; allows for rounding only


def retime(
    path: JointPath,
    limits: JointLimits,
    rates: tuple[float, float] = (0.0, 0.0),
    refined: bool = True,
    chain: RigidChain | None = None,
    ceiling: SpeedProfile | None = None,
    settings: RetimingSettings = DEFAULT_RETIMING,
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
        refined: whether, with jerk limits, the best motion is searched; else the first that keeps them is returned.
        chain: whose torques are limited; None where they do not count.
        ceiling: (du/dt)^2 that is not exceeded, so that postures are passed at their times; none where None. With jerk
            limits the motion follows it more slowly, as far as they need.
        settings: of the search.

    Raises:
        InvalidProblem: the path stands still or jumps, or its limits are of another number of joints, or allow no
            motion with these velocities at the ends (with jerk limits: none was found); or the motors cannot hold the
            chain somewhere on the path.
    """
    ready = prepared(path, rates)
    _check_ends(path, limits, rates)
    motors = PathTorques.of(ready.path, limits, chain, settings.torques)
    if ceiling is not None and not np.array_equal(ready.path.breakpoints, path.breakpoints):
        raise InvalidProblem("path", "it stands still in places, which a given profile does not allow for")
    if limits.jerk is not None:
        return _by_section(ready, limits, refined and ceiling is None, chain, ceiling, settings)
    profile, intervals = fastest_profile(ready, limits, motors, ceiling, settings=settings.profile)
    trajectory = profile.trajectory(intervals)
    if ready.moves_at_an_end:
        return trajectory
    scale = max(limits.time_scale(peak_ratios(trajectory, limits)), 0.0 if ceiling is None else 1.0)
    return trajectory.time_scaled(scale if motors is None else max(scale, profile_time_scale(motors, profile)))


def _check_ends(path: JointPath, limits: JointLimits, rates: tuple[float, float]) -> None:
    joints = path.coefficients.shape[2]
    if limits.dof != joints:
        raise InvalidProblem("path", f"{joints} joints for limits of {limits.dof}")
    velocities = path.at(path.breakpoints[[0, -1]], 1) * np.array(rates)[:, None]
    for name, velocity in zip(("start", "goal"), velocities, strict=True):
        for joint, (value, most) in enumerate(zip(np.abs(velocity), limits.speed, strict=True), start=1):
            if value > most * (1.0 + END_TOLERANCE):
                raise InvalidProblem("rates", f"{name}: joint {joint} at {value:g} rad/s may not exceed {most:g} rad/s")
