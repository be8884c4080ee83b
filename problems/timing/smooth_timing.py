"""The least time with jerk limits: sequential linear programs over a smooth parametrisation.

Each program linearises speed, acceleration, jerk and torques at samples around the last law. What it finds is judged at
denser samples where the motion can be slowed: by the duration that all limits need, and exact peaks, between samples
too, slow it in the end. Else it is judged by the duration and by how far exact peaks break a limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray, InvalidProblem
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits
from problems.timing.law_program import LawProgram
from problems.timing.parametrisation import (
    DEGREE,
    ORDERS,
    Basis,
    Parametrisation,
    ParametrisationEnds,
    averaged_knots,
    graded_knots,
    in_time,
    joint_limits,
    joint_shares,
    torque_limits,
)
from problems.timing.prepared import PathTorques, PreparedPath, minimum_time_scale
from problems.timing.speed_profile import SpeedProfile, fastest_profile

SAMPLES = 4  # of each interval between knots
JUDGED = 8  # of each interval, to judge a law by
BESIDE = 1e-7  # of the duration: as far before and after a change of the path's piece are samples too
ITERATIONS = 25
MOST_FAILURES = 5  # in a row
EVEN = 1e-7  # the share of an even law in every law, so that none stands still
FIRST_TRUST, LARGEST_TRUST = 0.3, 2.0  # how far a control point may move, of the distance to its neighbours
LEAST_GAIN = 3e-4  # of the merit
ALLOWED = 1e-9  # of a limit; rounding
BROKEN_LIMIT = 20.0  # per cent of the duration that one per cent of a limit is worth
MARGIN_GROWS = 0.1  # of the duration: as long do margins grow from nothing next to an end that is given


@dataclass(frozen=True)
class Candidate:
    """A time law, its duration in s, and the scale of time with which it would keep its limits."""

    law: Parametrisation
    duration: float
    scale: float

    @property
    def merit(self) -> float:
        """In s; lower is better, and what keeps its limits always is."""
        kept = self.scale <= 1.0 + ALLOWED
        return self.duration * (1.0 if kept else 2.0 + BROKEN_LIMIT * (self.scale - 1.0))


@dataclass(frozen=True)
class ParametrisationSearch:
    """The search for the fastest time law.

    Args:
        path: without kinks.
        limits: with a jerk.
        ends: of the law.
        knots: of the law.
        margin: share of the limits that is kept free at the samples.
        motors: what torques the path takes; None where they do not count.
    """

    path: JointPath
    limits: JointLimits
    ends: ParametrisationEnds
    knots: FloatArray
    margin: float = 0.0
    motors: PathTorques | None = None

    def candidate(self, controls: FloatArray, duration: float) -> Candidate:
        """A law from its control points: as fast as it may be, or in the given duration where an end is moving."""
        controls = np.maximum.accumulate(np.minimum(controls, controls[-1]))  # an interpolated law may turn back
        even = controls[0] + (controls[-1] - controls[0]) * averaged_knots(self.knots)
        law = Parametrisation(self.knots, self.ends.placed(self.knots, controls + EVEN * (even - controls), duration))
        if self.ends.moving:
            return Candidate(law, duration, self._exact_scale(law, duration))
        at_samples = self._judged.at(law.controls)
        shares = np.abs(joint_shares(self.path, self.limits, at_samples, duration))
        scale = max(self.limits.time_scale(shares.max(axis=(1, 2))), self._torque_scale(at_samples, duration))
        return Candidate(law, duration * scale, 1.0)

    def proven(self, candidate: Candidate) -> Trajectory | None:
        """The motion, slowed by what its exact peaks ask for; None where it cannot be slowed and they do."""
        scale = self._exact_scale(candidate.law, candidate.duration)
        if scale == np.inf or (self.ends.moving and scale > 1.0 + ALLOWED):
            return None
        return candidate.law.trajectory(self.path, candidate.duration * (1.0 if self.ends.moving else scale))

    def _exact_scale(self, law: Parametrisation, duration: float) -> float:
        """How many times slower a law has to be run, by peaks over all t, and by torques at samples."""
        motion = law.trajectory(self.path, duration)
        if motion is None:
            return np.inf
        scale = minimum_time_scale(motion, self.limits)
        return max(scale, self._torque_scale(self._judged.at(law.controls), duration))

    def _torque_scale(self, at_samples: FloatArray, duration: float) -> float:
        """What torques ask for, of a law (4, n)."""
        if self.motors is None:
            return 0.0
        return self.motors.time_scale(*in_time(self.path, at_samples, duration))

    @cached_property
    def _judged(self) -> Basis:
        return Basis.of(self.knots, _samples(self.knots, JUDGED), ORDERS + 1)

    def improved(self, best: Candidate) -> Candidate:
        """The best law that a trust region around the last one leads to."""
        tau = _samples(self.knots, SAMPLES)
        basis = Basis.of(self.knots, tau, ORDERS + 1)
        trust, failures = FIRST_TRUST, 0
        for _ in range(ITERATIONS):
            step = self._step(best, tau, basis, trust)
            if step is None:
                break
            new = self.candidate(best.law.controls + step[0], best.duration * (1.0 + step[1]))
            gain = 1.0 - new.merit / best.merit
            failures, trust = (0, min(2.0 * trust, LARGEST_TRUST)) if gain > 0.0 else (failures + 1, trust / 4.0)
            best = new if gain > 0.0 else best
            if failures == MOST_FAILURES or abs(gain) < LEAST_GAIN:
                break
        return best

    def _growing(self, tau: FloatArray) -> FloatArray:
        """The share of the margin at each tau, (n,): less where a velocity is given that may be at its limit."""
        near = np.ones_like(tau)
        for given, distance in ((self.ends.start, tau), (self.ends.goal, 1.0 - tau)):
            if any(given):
                near = np.minimum(near, distance / MARGIN_GROWS)
        return np.asarray(near**2)

    def _step(self, around: Candidate, tau: FloatArray, basis: Basis, trust: float) -> tuple[FloatArray, float] | None:
        """Changes of the control points, and of the duration as a share of it; None where there are none."""
        controls, duration = around.law.controls, around.duration
        crossed = around.law.reaching(self.path.breakpoints[1:-1])
        beside = np.concatenate([crossed - BESIDE, crossed + BESIDE])
        basis = basis.joined(Basis.of(self.knots, beside, ORDERS + 1))
        law = basis.at(controls)
        rows = joint_limits(self.path, self.limits, law, duration)
        if self.motors is not None:
            rows = rows.joined(torque_limits(self.motors, law, duration))
        free = self.ends.free(controls.size)
        padded = np.pad(controls, 2, mode="edge")
        width = np.zeros_like(controls)
        width[free] = trust * (padded[4:] - padded[:-4])[free] / 4.0
        return LawProgram(
            rows=rows,
            basis=basis,
            controls=controls,
            width=width,
            by_duration=self.ends.slopes(self.knots, duration),
            room=1.0 - self.margin * self._growing(np.concatenate([tau, beside])),
            elastic=self.ends.moving,
        ).solved()


def _samples(knots: FloatArray, count: int) -> FloatArray:
    """Of each interval between knots so many, the end of the last one just before it."""
    distinct = np.unique(knots)
    inner = distinct[:-1, None] + np.diff(distinct)[:, None] * np.arange(count) / count
    return np.append(inner.ravel(), np.nextafter(1.0, 0.0))


INTERVALS = 24  # between knots, for each piece of a path
FEWEST, MOST = 200, 1500  # intervals of a law
IN_PIECE = 8  # of them in a piece of the path, if there are not too many
FAR = 1.1  # times a profile's duration: a law that takes longer is improved with fewer intervals first
COARSER = 4  # times fewer
SWINGS = (1.0, 2.0, 4.0)  # times that accelerations need, of averages
FOLLOWING_SWINGS = (1.0, 2.0, 3.0, 5.0)  # of those that follow a profile with little slowing
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
    profile, _ = fastest_profile(prepared, limits, motors, ceiling, rough=ceiling is None)
    ends, breakpoints = ParametrisationEnds.of(prepared), prepared.path.breakpoints
    swings = SWINGS if ceiling is None else FOLLOWING_SWINGS
    count = max(FEWEST, min(INTERVALS * (breakpoints.size - 1), MOST))
    passed = profile.times[np.searchsorted(profile.nodes, breakpoints)] / profile.times[-1]

    def on_grid(passed: FloatArray, coarser: int) -> ParametrisationSearch:
        knots = graded_knots(passed, count // coarser, IN_PIECE / coarser, MOST // coarser)
        return ParametrisationSearch(prepared.path, limits, ends, knots, motors=motors)

    def begun(search: ParametrisationSearch) -> Candidate:
        starts = _smoothed(profile, limits, ends, search.knots, swings)
        return min((search.candidate(*start) for start in starts), key=lambda candidate: candidate.merit)

    search = on_grid(passed, 1)
    best = begun(search)
    if refined and (any(prepared.resting) or best.merit > FAR * profile.times[-1]):
        coarse = on_grid(passed, COARSER)
        found = coarse.improved(begun(coarse))
        search = on_grid(np.concatenate([[0.0], found.law.reaching(breakpoints[1:-1]), [1.0]]), 1)
        best = _refined(found, search)
    motion = None if refined else search.proven(best)
    for margin in MARGINS if ends.moving else (0.0,):
        if motion is not None:
            return motion
        best = replace(search, margin=margin).improved(best)
        motion = search.proven(best)
    if motion is None:
        raise InvalidProblem(
            "rates", "no motion was found that keeps the jerk limits with these velocities at its ends"
        )
    return motion


def _refined(coarse: Candidate, fine: ParametrisationSearch) -> Candidate:
    """About the same law with other knots: an interpolation may overshoot where a law hardly moves, a law may not."""
    tau = averaged_knots(fine.knots)
    controls = np.asarray(scipy.interpolate.make_interp_spline(tau, coarse.law.at(tau), DEGREE, t=fine.knots).c)
    return fine.candidate(np.maximum.accumulate(np.clip(controls, *controls[[0, -1]])), coarse.duration)


def _smoothed(
    profile: SpeedProfile, limits: JointLimits, ends: ParametrisationEnds, knots: FloatArray, swings: tuple[float, ...]
) -> Iterator[tuple[FloatArray, float]]:
    """Control points and durations: moving averages of a profile, over times accelerations need and over all.

    Beyond an end the profile goes on at the end's velocity; an end at rest takes half of the averaged time longer.
    """
    total = float(profile.times[-1])
    before, after = (given[0] if any(given) else 0.0 for given in (ends.start, ends.goal))
    sums = _extended(profile, before, after).antiderivative()
    _, acceleration, jerk = limits.by_order
    swing = float((acceleration / jerk).max())
    for width in sorted({*(min(times * swing, total) for times in swings), total}):
        delay, tail = (0.0 if rate > 0.0 else width / 2.0 for rate in (before, after))
        duration = delay + total + tail
        times = averaged_knots(knots) * duration - delay
        means = (sums(times + width / 2.0) - sums(times - width / 2.0)) / width
        controls = np.clip(means, *profile.nodes[[0, -1]])
        controls[[0, -1]] = profile.nodes[[0, -1]]
        yield controls, duration


def _extended(profile: SpeedProfile, before: float, after: float) -> scipy.interpolate.PPoly:
    """The parameter as a function of the time, as long before the start and after the end at these rates."""
    times, speeds = profile.times, np.sqrt(profile.squares)
    total = times[-1]
    linear = np.concatenate([[before], speeds[:-1], [after]])
    quadratic = np.concatenate([[0.0], np.diff(speeds) / (2.0 * np.diff(times)), [0.0]])
    values = np.concatenate([[profile.nodes[0] - before * total], profile.nodes])
    return scipy.interpolate.PPoly(
        np.stack([quadratic, linear, values]), np.concatenate([[-total], times, [2.0 * total]])
    )
