"""How much slower, or faster, a finished motion has to be run so that its limits just hold for all t."""

from __future__ import annotations

from collections.abc import Iterable
from functools import singledispatch

import numpy as np

from problems.certify.dynamics.slowing import torque_time_scale
from problems.limits.limit import SAMPLING_MARGIN, Limit
from problems.limits.time_scale import minimum_time_scale, peaks_of, scaling
from problems.limits.torque import TorqueLimit
from problems.motions.trajectory import Trajectory

DENSE_SAMPLES = 401  # of a finished motion, for a limit whose peaks have no closed form
ROUNDING_ALLOWANCE = 1e-12  # relative: keeps a time-scaled motion under its limits in floating point


def exact_time_scale(limits: Iterable[Limit], trajectory: Trajectory) -> float:
    """The time scale for all t of a finished motion; 0 without limits that scale with time.

    Of a derivative it is exact; of torques the least that is proven, 1e-7 above it at most; of any other limit it comes
    from many samples, and is a little more.
    """
    return float(np.fmax.reduce([time_scale(limit, trajectory) for limit in scaling(limits)], initial=0.0))


@singledispatch
def time_scale(limit: Limit, trajectory: Trajectory) -> float:
    """That of one limit that scales with time; register a function for a kind of limit whose peaks have no samples."""
    if limit.order is not None:
        peaks = peaks_of(limit, trajectory.samples(trajectory.extreme_times(limit.order)))
    else:
        samples = trajectory.samples(trajectory.times(DENSE_SAMPLES), limit.robot_or_none)
        peaks = peaks_of(limit, samples) * (1.0 + SAMPLING_MARGIN)
    return float(minimum_time_scale([limit], [peaks]))


@time_scale.register
def _(limit: TorqueLimit, trajectory: Trajectory) -> float:
    return torque_time_scale(limit, trajectory)


def safe_time_scale(limits: Iterable[Limit], trajectory: Trajectory) -> float:
    """:func:`exact_time_scale` and a little more, so that rounding breaks no limit."""
    return exact_time_scale(limits, trajectory) * (1.0 + ROUNDING_ALLOWANCE)
