"""Time scales: how much slower a shape has to be run, or how much faster it may be, for limits to hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import casadi as ca

from problems.base.matrix import Matrix
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.motions.trajectory import SAMPLED_ORDERS

UNREACHED_TIME_SCALE = 1e12  # a factor that no motion needs
LARGEST_SLOWDOWN = 1e3  # by limits without a bound of what they take: a search tells no longer durations apart


def scaling(limits: Iterable[Limit]) -> list[Limit]:
    """The limits that every shape satisfies if it is run slowly enough."""
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
        The factor; 0 without limits, ``LARGEST_SLOWDOWN`` times as much where no bound is known of what some take,
        ``UNREACHED_TIME_SCALE`` where none is known of any.
    """
    known = [limit for limit in limits if limit.order in peaks]
    if not known:
        return UNREACHED_TIME_SCALE if limits else 0.0
    scale = float(minimum_time_scale(known, [peaks[limit.order or 0] for limit in known]))
    return scale if len(known) == len(limits) else LARGEST_SLOWDOWN * scale


def holds_time(limits: Iterable[Limit]) -> bool:
    """Whether a limit depends on how fast a motion is run, and is not restored by running it slower."""
    return any(not limit.scales_with_time and _depends_on_time(limit) for limit in limits)


def _depends_on_time(limit: Limit) -> bool:
    robot = limit.robot_or_none
    if robot is None:
        return True
    now = Samples.symbolic(robot, SAMPLED_ORDERS)
    expressions = [ca.vec(constraint.expression) for constraint in limit.at(now)]
    if not expressions:
        return False
    timed = (*now.derivatives[1:], now.duration, now.times, now.weights)
    symbols = ca.vertcat(*(ca.vec(matrix) for matrix in timed if matrix is not None))
    return any(ca.which_depends(ca.vertcat(*expressions), symbols, 1, False))
