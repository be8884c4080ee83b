"""When a limit is broken: first, and over which spans of time.

What bounds a derivative of the joint angles is broken from a crossing of its bound on, which is found exactly. What
bounds anything else is looked at at many times, around that of its verdict more closely, and the change from kept to
broken is narrowed down: a breach between two such times may stay unseen, so that "first" is the first seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array, bernstein, real_roots
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.certify.verification import TORQUE_ORDER, limit_verdicts
from problems.certify.worlds import rooms_in_core
from problems.limits import Constraint, CoverLimit, Limit, TorqueLimit
from problems.motions import Trajectory

LOOKS = 2001  # times at least at which a limit is looked at
SAME_SPAN = 2e-3  # of the duration
NEAR_WORST, AROUND = 65, 1e-3  # more of them around the worst time, within so much of the duration
ROUNDS, PARTS = 4, 64  # in which the change from kept to broken is narrowed down

Mask = NDArray[np.bool_]


def verdicts_with_first_times(
    limits: Iterable[Limit], trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> list[Verdict]:
    """:func:`limit_verdicts`; of what is violated they also say when it is first broken."""
    return [
        _with_first_time(limit, outcome, trajectory, end_accelerations)
        for limit in limits
        for outcome in limit_verdicts([limit], trajectory, end_accelerations)
    ]


def _with_first_time(
    limit: Limit, outcome: Verdict, trajectory: Trajectory, end_accelerations: FloatArray | None
) -> Verdict:
    if outcome.status is not CertificateStatus.VIOLATED or not trajectory.is_finite:
        return outcome
    first = first_broken(limit, outcome, trajectory, end_accelerations)
    return outcome if first is None else replace(outcome, where=f"{outcome.where}; first at {first:.4g} s")


def first_broken(
    limit: Limit, outcome: Verdict, trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> float | None:
    """When a limit is first broken, s; None where no time is found, as of what is not about single times.

    Args:
        limit: that is violated.
        outcome: its verdict.
        trajectory: the motion.
        end_accelerations: as of :func:`limit_verdicts`.
    """
    jumps = None if limit_order(limit) is None else trajectory.jumps_below(limit_order(limit) or 0, end_accelerations)
    times = [] if jumps is None else [float(jumps[1].min())]
    if limit.order is not None:
        times += [start for start, _ in crossing_spans(limit, limit.order, trajectory)][:1]
    else:
        times += _first_seen(limit, outcome, trajectory)
    return min(times, default=None)


def limit_order(limit: Limit) -> int | None:
    """The highest derivative that a limit depends on; None where that is not known of its kind."""
    return TORQUE_ORDER if isinstance(limit, TorqueLimit) else limit.order


def broken_spans(
    limits: Iterable[Limit], verdicts: Iterable[Verdict], trajectory: Trajectory
) -> dict[str, list[tuple[float, float]]]:
    """By the names of violated verdicts, from when to when their limits are broken, s; moments have no length.

    Spans that follow each other within a share ``SAME_SPAN`` of the motion are one.

    Args:
        limits: that were judged.
        verdicts: on them.
        trajectory: the motion.
    """
    violated = {outcome.name: outcome for outcome in verdicts if outcome.status is CertificateStatus.VIOLATED}
    found: dict[str, list[tuple[float, float]]] = {}
    for limit in limits:
        if limit.name in violated and trajectory.is_finite:
            spans = sorted(_spans_of(limit, violated[limit.name], trajectory))
            found[limit.name] = _joined(spans, SAME_SPAN * trajectory.duration)
    return found


def _joined(spans: list[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Spans in their order, those no farther apart than a gap in one."""
    joined: list[tuple[float, float]] = []
    for start, end in spans:
        if joined and start <= joined[-1][1] + gap:
            joined[-1] = joined[-1][0], max(end, joined[-1][1])
        else:
            joined.append((start, end))
    return joined


def _spans_of(limit: Limit, outcome: Verdict, trajectory: Trajectory) -> list[tuple[float, float]]:
    order = limit_order(limit)
    jumps = None if order is None else trajectory.jumps_below(order)
    moments = [] if jumps is None else [(time, time) for time in np.sort(jumps[1]).tolist()]
    if limit.order is not None:
        return moments + crossing_spans(limit, limit.order, trajectory)
    times = _looks(outcome, trajectory)
    return moments + _spans(times, broken_at(limit, trajectory, times))


def _spans(times: FloatArray, broken: Mask) -> list[tuple[float, float]]:
    """The runs of times (n,) at which something is broken."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], broken, [False]])))
    return [(float(times[a]), float(times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def crossing_spans(limit: Limit, order: int, trajectory: Trajectory) -> list[tuple[float, float]]:
    """From when to when a limit of a derivative is broken by any joint, s, in their order, exact to rounding."""
    (constraint,) = limit.constraints_at(trajectory.samples(trajectory.breakpoints[:2]))
    (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
    curves, times = np.asarray(trajectory.derivative(order).c), trajectory.breakpoints
    form, crossings = bernstein(curves, np.diff(times)), [times]
    for bound in (lower - slack, upper + slack):
        piece, joint = np.nonzero((form.min(axis=0) <= bound) & (form.max(axis=0) >= bound))
        above = curves[:, piece, joint]
        above[-1] -= bound[joint]
        crossings.append(real_roots(above, times[piece], times[piece + 1]))
    times = np.unique(np.concatenate(crossings))
    values = trajectory.at((times[1:] + times[:-1]) / 2.0, order)
    broken = ((values < lower - slack) | (values > upper + slack)).any(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], broken, [False]])))
    return [(float(times[a]), float(times[b])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _looks(outcome: Verdict, trajectory: Trajectory) -> FloatArray:
    """Times at which a limit is looked at, (n,), s: over all of the motion, and around the worst that is known."""
    times = [trajectory.times(LOOKS)]
    if outcome.time is not None:
        around = AROUND * trajectory.duration * np.linspace(-1.0, 1.0, NEAR_WORST)
        times.append(np.clip(outcome.time + around, 0.0, trajectory.duration))
    return np.unique(np.concatenate(times))


def _first_seen(limit: Limit, outcome: Verdict, trajectory: Trajectory) -> list[float]:
    """The first time, s, at which it is seen to be broken; none where it is at no time that is looked at."""
    times = _looks(outcome, trajectory)
    broken = broken_at(limit, trajectory, times)
    if not broken.any():
        return []
    first = int(np.argmax(broken))
    if first == 0:
        return [float(times[0])]
    return [_narrowed(lambda inner: broken_at(limit, trajectory, inner), times[first - 1], times[first])]


def _narrowed(is_broken: Callable[[FloatArray], Mask], kept: float, broken: float) -> float:
    """The time of the change between one at which something is kept and a later one at which it is broken, s."""
    for _ in range(ROUNDS):
        times = np.linspace(kept, broken, PARTS + 1)
        first = int(np.argmax([*is_broken(times[1:-1]), True])) + 1
        kept, broken = float(times[first - 1]), float(times[first])
    return broken


@singledispatch
def broken_at(limit: Limit, trajectory: Trajectory, times: FloatArray) -> Mask:
    """At which of the times (n,) in s a limit is broken, (n,); register a function for a kind with a quicker way."""
    rooms = rooms_in_core(limit, trajectory, times)
    if rooms is not None:
        return np.asarray(rooms < 0.0)
    found = np.zeros(times.size, dtype=bool)
    for constraint in limit.constraints_at(trajectory.samples(times, limit.robot_or_none)):
        if constraint.rows == times.size:
            found |= _outside(constraint)
    return found


@broken_at.register
def _(limit: CoverLimit, trajectory: Trajectory, times: FloatArray) -> Mask:
    rooms = rooms_in_core(limit, trajectory, times)
    if rooms is not None:
        return np.asarray(rooms < 0.0)
    return np.asarray(limit.nearest(trajectory.at(times), times).clearance < limit.margin)


def _outside(constraint: Constraint) -> Mask:
    """In which rows a value is outside its bounds, or no number."""
    values, (lower, upper) = as_array(constraint.expression), constraint.bounds
    slack = TOLERANCE * constraint.scales
    return np.asarray(~((values >= lower - slack) & (values <= upper + slack)).all(axis=1))
