"""The least time along a path under a jerk limit too, with continuous accelerations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.interpolate import make_interp_spline

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits
from problems.timing.fastest_profile import fastest_profile
from problems.timing.motors.path_torques import PathTorques
from problems.timing.prepared import PreparedPath
from problems.timing.smooth.law_ends import LawEnds
from problems.timing.smooth.law_knots import graded_knots
from problems.timing.smooth.law_search import Candidate, LawSearch
from problems.timing.smooth.time_law import DEGREE, averaged_knots
from problems.timing.speed_profile import SpeedProfile

INTERVALS = 16  # between knots, for each piece of a path
FEWEST, MOST = 120, 600  # intervals of a law
IN_PIECE = 8  # of them in a piece of the path, if there are not too many
COARSER = 4  # times fewer, at first
SMOOTHING_SAMPLES = 33
SWINGS = (2.0, 3.0, 5.0)  # times that accelerations need, of averages that follow a profile with little slowing
MARGINS = (1e-3, 4e-3, 1.6e-2, 6.4e-2)  # at the samples, for what lies between them, where nothing can be slowed


def smooth_timing(
    prepared: PreparedPath,
    limits: JointLimits,
    refined: bool = True,
    motors: PathTorques | None = None,
    ceiling: SpeedProfile | None = None,
) -> Trajectory:
    """The fastest motion found.

    Args:
        prepared: a path without kinks.
        limits: with a jerk.
        refined: whether to go on from the first motion that keeps the limits.
        motors: what torques the path takes; None where they do not count.
        ceiling: of the profile from which the first motion is made.

    Raises:
        InvalidProblem: no motion was found that keeps the limits with the velocities of its ends.
    """
    profile, _ = fastest_profile(prepared, limits, motors, ceiling)
    ends, breakpoints = LawEnds.of(prepared), prepared.path.breakpoints
    count = max(FEWEST, min(INTERVALS * (breakpoints.size - 1), MOST))
    passed = profile.times[np.searchsorted(profile.nodes, breakpoints)] / profile.times[-1]
    coarser = COARSER if ceiling is None else 1  # what follows a profile is not improved afterwards
    knots = graded_knots(passed, count // coarser, IN_PIECE / coarser, MOST // coarser)
    coarse = LawSearch(prepared.path, limits, ends, knots, motors=motors)
    swings = (1.0,) if ceiling is None else SWINGS
    starts = [coarse.candidate(*start) for start in _smoothed(profile, limits, ends, coarse.knots, swings)]
    best = min(starts, key=lambda candidate: candidate.merit)
    if best.keeps_limits and not refined:
        return best.law.trajectory(prepared.path, best.duration)
    best = coarse.improved(best)
    passed = np.concatenate([[0.0], best.law.reaching(breakpoints[1:-1]), [1.0]])
    fine = replace(coarse, knots=graded_knots(passed, count, IN_PIECE, MOST))
    best = _refined(best, fine)
    for margin in MARGINS if ends.moving else (0.0,):
        best = replace(fine, margin=margin).improved(best)
        if best.keeps_limits:
            return best.law.trajectory(prepared.path, best.duration)
    raise InvalidProblem("rates", "no motion was found that keeps the jerk limits with these velocities at its ends")


def _refined(coarse: Candidate, fine: LawSearch) -> Candidate:
    """About the same law with other knots: an interpolation may overshoot where a law hardly moves, a law may not."""
    tau = averaged_knots(fine.knots)
    controls = np.asarray(make_interp_spline(tau, coarse.law.at(tau), DEGREE, t=fine.knots).c)
    return fine.candidate(np.maximum.accumulate(np.clip(controls, *controls[[0, -1]])), coarse.duration)


def _smoothed(
    profile: SpeedProfile, limits: JointLimits, ends: LawEnds, knots: FloatArray, swings: tuple[float, ...]
) -> Iterator[tuple[FloatArray, float]]:
    """Control points and durations: moving averages of a profile, over times accelerations need and over all.

    Beyond an end the profile goes on at the end's velocity; an end at rest takes half of the averaged time longer.
    """
    total = float(profile.times[-1])
    before, after = (given[0] if any(given) else 0.0 for given in (ends.start, ends.goal))
    swing = float((np.array(limits.acceleration) / np.array(limits.jerk)).max())
    for width in sorted({*(min(times * swing, total) for times in swings), total}):
        delay, tail = (0.0 if rate > 0.0 else width / 2.0 for rate in (before, after))
        duration = delay + total + tail
        shifts = width * ((np.arange(SMOOTHING_SAMPLES) + 0.5) / SMOOTHING_SAMPLES - 0.5)
        times = (averaged_knots(knots)[:, None] * duration - delay + shifts).ravel()
        parameters = profile.parameters(np.clip(times, 0.0, total))
        parameters += before * np.minimum(times, 0.0) + after * np.maximum(times - total, 0.0)
        controls = np.clip(parameters.reshape(-1, shifts.size).mean(axis=1), *profile.nodes[[0, -1]])
        controls[[0, -1]] = profile.nodes[[0, -1]]
        yield controls, duration
