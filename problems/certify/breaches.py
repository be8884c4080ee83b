"""Times at which a limit is broken: the first, and spans.

A limit of a derivative of the joint angles is broken from a crossing of its bound on, which is found exactly. Any other
limit is evaluated at many times, more densely around that of its verdict, and the change from kept to broken is
narrowed down: a breach between two such times may stay unseen, so that "first" is the first seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import singledispatch

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array, bernstein, real_roots
from problems.certify.core_clearance import clearances_in_core
from problems.certify.settings import DEFAULT_BREACHES, BreachSettings
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.certify.verification import TORQUE_ORDER, limit_verdicts
from problems.limits import Constraint, Limit, TorqueLimit
from problems.motions import Trajectory

Mask = NDArray[np.bool_]


def verdicts_with_first_times(
    limits: Iterable[Limit], trajectory: Trajectory, end_accelerations: FloatArray | None = None
) -> list[Verdict]:
    """:func:`limit_verdicts` with the time at which each violated limit is first broken."""
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
    limit: Limit,
    outcome: Verdict,
    trajectory: Trajectory,
    end_accelerations: FloatArray | None = None,
    settings: BreachSettings = DEFAULT_BREACHES,
) -> float | None:
    """The first time at which a limit is broken, s; None where none is found, as for limits not on single times.

    Args:
        limit: that is violated.
        outcome: its verdict.
        trajectory: the motion.
        end_accelerations: as of :func:`limit_verdicts`.
        settings: of the search.
    """
    jumps = None if limit_order(limit) is None else trajectory.jumps_below(limit_order(limit) or 0, end_accelerations)
    times = [] if jumps is None else [float(jumps[1].min())]
    if limit.order is not None:
        times += [start for start, _ in crossing_spans(limit, limit.order, trajectory)][:1]
    else:
        times += _first_seen(limit, outcome, trajectory, settings)
    return min(times, default=None)


def limit_order(limit: Limit) -> int | None:
    """The highest derivative that a limit depends on; None where that is not known of its kind."""
    return TORQUE_ORDER if isinstance(limit, TorqueLimit) else limit.order


def broken_spans(
    limits: Iterable[Limit],
    verdicts: Iterable[Verdict],
    trajectory: Trajectory,
    settings: BreachSettings = DEFAULT_BREACHES,
) -> dict[str, list[tuple[float, float]]]:
    """Spans of time in s over which limits are broken, by the names of violated verdicts; moments have no length.

    Spans that follow each other within a small share of the motion are one.

    Args:
        limits: that were judged.
        verdicts: on them.
        trajectory: the motion.
        settings: of the search.
    """
    violated = {outcome.name: outcome for outcome in verdicts if outcome.status is CertificateStatus.VIOLATED}
    by_name: dict[str, list[tuple[float, float]]] = {}
    for limit in limits:
        if limit.name in violated and trajectory.is_finite:
            spans = sorted(_spans_of(limit, violated[limit.name], trajectory, settings))
            by_name[limit.name] = _joined(spans, settings.same_span * trajectory.duration)
    return by_name


def _joined(spans: list[tuple[float, float]], gap: float) -> list[tuple[float, float]]:
    """Spans in their order, those no farther apart than a gap in one."""
    joined: list[tuple[float, float]] = []
    for start, end in spans:
        if joined and start <= joined[-1][1] + gap:
            joined[-1] = joined[-1][0], max(end, joined[-1][1])
        else:
            joined.append((start, end))
    return joined


def _spans_of(
    limit: Limit, outcome: Verdict, trajectory: Trajectory, settings: BreachSettings
) -> list[tuple[float, float]]:
    order = limit_order(limit)
    jumps = None if order is None else trajectory.jumps_below(order)
    moments = [] if jumps is None else [(time, time) for time in np.sort(jumps[1]).tolist()]
    if limit.order is not None:
        return moments + crossing_spans(limit, limit.order, trajectory)
    times = _examined_times(outcome, trajectory, settings)
    return moments + _spans(times, broken_at(limit, trajectory, times))


def _spans(times: FloatArray, broken: Mask) -> list[tuple[float, float]]:
    """The runs of times (n,) at which something is broken."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], broken, [False]])))
    return [(float(times[a]), float(times[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def crossing_spans(limit: Limit, order: int, trajectory: Trajectory) -> list[tuple[float, float]]:
    """Spans of time in s over which any joint breaks a limit of a derivative, in their order, exact to rounding."""
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


def _examined_times(outcome: Verdict, trajectory: Trajectory, settings: BreachSettings) -> FloatArray:
    """Times at which a limit is evaluated, (n,), s: over all of the motion, and around the worst that is known."""
    times = [trajectory.times(settings.times)]
    if outcome.time is not None:
        around = settings.around * trajectory.duration * np.linspace(-1.0, 1.0, settings.times_around)
        times.append(np.clip(outcome.time + around, 0.0, trajectory.duration))
    return np.unique(np.concatenate(times))


def _first_seen(limit: Limit, outcome: Verdict, trajectory: Trajectory, settings: BreachSettings) -> list[float]:
    """The first time, s, at which a limit is seen to be broken; none where it is at no examined time."""
    times = _examined_times(outcome, trajectory, settings)
    broken = broken_at(limit, trajectory, times)
    if not broken.any():
        return []
    first = int(np.argmax(broken))
    if first == 0:
        return [float(times[0])]
    return [_narrowed(lambda inner: broken_at(limit, trajectory, inner), times[first - 1], times[first], settings)]


def _narrowed(is_broken: Callable[[FloatArray], Mask], kept: float, broken: float, settings: BreachSettings) -> float:
    """The time of the change between one at which a limit is kept and a later one at which it is broken, s."""
    for _ in range(settings.rounds):
        times = np.linspace(kept, broken, settings.parts + 1)
        first = int(np.argmax([*is_broken(times[1:-1]), True])) + 1
        kept, broken = float(times[first - 1]), float(times[first])
    return broken


@singledispatch
def broken_at(limit: Limit, trajectory: Trajectory, times: FloatArray) -> Mask:
    """Mask of the times (n,) in s at which a limit is broken; register a function for a kind with a quicker way."""
    clearances = clearances_in_core(limit, trajectory, times)
    if clearances is not None:
        return np.asarray(clearances < 0.0)
    broken = np.zeros(times.size, dtype=bool)
    for constraint in limit.constraints_at(trajectory.samples(times, limit.robot_or_none)):
        if constraint.rows == times.size:
            broken |= _outside(constraint)
    return broken


def _outside(constraint: Constraint) -> Mask:
    """Mask of the rows in which a value is outside its bounds, or no number."""
    values, (lower, upper) = as_array(constraint.expression), constraint.bounds
    slack = TOLERANCE * constraint.scales
    return np.asarray(~((values >= lower - slack) & (values <= upper + slack)).all(axis=1))
