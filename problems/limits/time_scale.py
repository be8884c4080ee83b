"""The least time that limits allow a shape: how much slower, or faster, it may be run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import casadi as ca

from problems.base.matrix import Matrix
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory

ENDLESS = 1e12  # a factor that no motion needs
ROUNDING = 1e-12  # relative: keeps a time-scaled motion under its limits in floating point


def scaling(limits: Iterable[Limit]) -> list[Limit]:
    """Those that every shape keeps if only it is run slowly enough."""
    return [limit for limit in limits if limit.scales_with_time]


def peaks_of(limit: Limit, samples: Samples) -> Matrix:
    """The largest magnitudes of each column over the samples, (1, m)."""
    magnitudes = limit.magnitudes(samples)
    peaks: Matrix = magnitudes[0, :]
    for row in range(1, magnitudes.shape[0]):
        peaks = ca.fmax(peaks, magnitudes[row, :])
    return peaks


def minimum_time_scale(limits: Sequence[Limit], peaks: Sequence[Matrix]) -> Matrix:
    """The smallest factor by which time must be multiplied for all limits to hold, given the peaks of each."""
    factors = [limit.time_scale(values) for limit, values in zip(limits, peaks, strict=True)]
    scale = factors[0]
    for factor in factors[1:]:
        scale = ca.fmax(scale, factor)
    return scale


def longest_time_scale(limits: Sequence[Limit], peaks: Mapping[int, Matrix]) -> float:
    """The largest :func:`minimum_time_scale` of motions whose derivatives are bounded.

    Args:
        limits: that scale with time.
        peaks: by order, bounds of the derivative, (1, dof).

    Returns:
        The factor; 0 without limits, endless where one is about something of which no bound is known.
    """
    if any(limit.order not in peaks for limit in limits):
        return ENDLESS
    return float(minimum_time_scale(limits, [peaks[limit.order or 0] for limit in limits])) if limits else 0.0


def exact_time_scale(limits: Iterable[Limit], trajectory: Trajectory) -> float:
    """The same for all t: of limits on derivatives, from the exact extremes of a finished motion; 0 without any."""
    chosen = [(limit, limit.order) for limit in scaling(limits) if limit.order is not None]
    if not chosen:
        return 0.0
    peaks = [peaks_of(limit, trajectory.samples(trajectory.extreme_times(order))) for limit, order in chosen]
    return float(minimum_time_scale([limit for limit, _ in chosen], peaks))


def safe_time_scale(limits: Iterable[Limit], trajectory: Trajectory) -> float:
    """:func:`exact_time_scale` and a little more, so that rounding breaks no limit."""
    return exact_time_scale(limits, trajectory) * (1.0 + ROUNDING)
