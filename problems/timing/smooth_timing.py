"""The least time with jerk limits: sequential linear programs over a smooth parametrisation.

Each program linearises speed, acceleration, jerk and torques at samples around the last law. Where a motion can be
slowed, a law is judged at denser samples by the duration that all limits need, and slowed in the end as far as its
exact peaks need. Else it is judged by the duration and by how far exact peaks break a limit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems.base import BSpline, FloatArray, InvalidProblem, PiecewisePolynomial
from problems.core import Step
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits
from problems.timing.bound import energy_profile
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
from problems.timing.prepared import PathTorques, PreparedPath, peak_ratios
from problems.timing.settings import DEFAULT_RETIMING, LawSettings, RetimingSettings
from problems.timing.speed_profile import SpeedProfile, fastest_profile, rises

BESIDE = 1e-7  # of the duration: samples as far before and after a change of the path's piece
LIMIT_ROUNDING = 1e-9  # of a limit


@dataclass(frozen=True)
class Candidate:
    """A time law with its duration.

    Attributes:
        law: the path's parameter over the share of the duration.
        duration: s.
        scale: of time, with which the law would keep its limits.
        excess_price: per cent of the duration that one per cent of excess of a limit counts.
    """

    law: Parametrisation
    duration: float
    scale: float
    excess_price: float

    @property
    def merit(self) -> float:
        """The merit in s, where lower is better, and lower for all laws that keep their limits."""
        keeps_limits = self.scale <= 1.0 + LIMIT_ROUNDING
        return self.duration * (1.0 if keeps_limits else 2.0 + self.excess_price * (self.scale - 1.0))


@dataclass(frozen=True)
class ParametrisationSearch:
    """The search for the fastest time law.

    Args:
        path: without kinks.
        limits: with a jerk.
        ends: of the law.
        knots: of the law.
        margin: share of the limits that is kept free at the samples.
        motors: torques along the path; None where they do not count.
        settings: of the search.
    """

    path: JointPath
    limits: JointLimits
    ends: ParametrisationEnds
    knots: FloatArray
    margin: float = 0.0
    motors: PathTorques | None = None
    settings: LawSettings = DEFAULT_RETIMING.law

    def candidate(self, controls: FloatArray, duration: float) -> Candidate:
        """A law from its control points: as fast as it may be, or in the given duration where an end is moving."""
        controls = np.maximum.accumulate(np.minimum(controls, controls[-1]))  # an interpolated law may turn back
        even = controls[0] + (controls[-1] - controls[0]) * averaged_knots(self.knots)
        mixed = controls + self.settings.even_share * (even - controls)
        law = Parametrisation(self.knots, self.ends.placed(self.knots, mixed, duration))
        if self.ends.moving:
            return Candidate(law, duration, self._exact_scale(law, duration), self.settings.excess_price)
        at_samples = self._judged.at(law.controls)
        shares = np.abs(joint_shares(self.path, self.limits, at_samples, duration))
        scale = max(self.limits.time_scale(shares.max(axis=(1, 2))), self._torque_scale(at_samples, duration))
        return Candidate(law, duration * scale, 1.0, self.settings.excess_price)

    def proven(self, candidate: Candidate) -> Trajectory | None:
        """The motion, slowed as far as its exact peaks need; None where it cannot be slowed and they exceed a limit."""
        scale = self._exact_scale(candidate.law, candidate.duration)
        if scale == np.inf or (self.ends.moving and scale > 1.0 + LIMIT_ROUNDING):
            return None
        return candidate.law.trajectory(self.path, candidate.duration * (1.0 if self.ends.moving else scale))

    def _exact_scale(self, law: Parametrisation, duration: float) -> float:
        """How many times slower a law has to be run, by peaks over all t, and by torques at samples."""
        motion = law.trajectory(self.path, duration)
        if motion is None:
            return np.inf
        scale = self.limits.time_scale(peak_ratios(motion, self.limits))
        return max(scale, self._torque_scale(self._judged.at(law.controls), duration))

    def _torque_scale(self, at_samples: FloatArray, duration: float) -> float:
        """The time scale that torques need for a law (4, n)."""
        if self.motors is None:
            return 0.0
        return self.motors.time_scale(*in_time(self.path, at_samples, duration))

    @cached_property
    def _judged(self) -> Basis:
        return Basis.of(self.knots, _samples(self.knots, self.settings.judging_samples), ORDERS + 1)

    def improved(self, best: Candidate) -> Candidate:
        """The best law that a trust region around the last one leads to."""
        return self.settings.region.descent(best, self.settings.programs, self._step)

    @cached_property
    def _sampled(self) -> tuple[FloatArray, Basis]:
        """The shares of the duration at which programs keep limits, and the basis there."""
        tau = _samples(self.knots, self.settings.samples)
        return tau, Basis.of(self.knots, tau, ORDERS + 1)

    def _growing(self, tau: FloatArray) -> FloatArray:
        """The share of the margin at each tau, (n,): less where a velocity is given that may be at its limit."""
        near = np.ones_like(tau)
        for given, distance in ((self.ends.start, tau), (self.ends.goal, 1.0 - tau)):
            if any(given):
                near = np.minimum(near, distance / self.settings.margin_growth)
        return np.asarray(near**2)

    def _step(self, around: Candidate, trust: float) -> Step[Candidate] | None:
        """The law to which the program around one leads; None where it has no solution."""
        (tau, basis), controls, duration = self._sampled, around.law.controls, around.duration
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
        solution = LawProgram(
            rows=rows,
            basis=basis,
            controls=controls,
            width=width,
            by_duration=self.ends.slopes(self.knots, duration),
            usable=1.0 - self.margin * self._growing(np.concatenate([tau, beside])),
            elastic=self.ends.moving,
            settings=self.settings,
        ).solved()
        if solution is None:
            return None
        change, longer = solution
        return Step(self.candidate(controls + change, duration * (1.0 + longer)), -longer * duration)


def _samples(knots: FloatArray, count: int) -> FloatArray:
    """Samples, so many in each interval between knots, the last of them just before the end."""
    distinct = np.unique(knots)
    inner = distinct[:-1, None] + np.diff(distinct)[:, None] * np.arange(count) / count
    return np.append(inner.ravel(), np.nextafter(1.0, 0.0))


def smooth_timing(
    prepared: PreparedPath,
    limits: JointLimits,
    refined: bool = True,
    motors: PathTorques | None = None,
    ceiling: SpeedProfile | None = None,
    settings: RetimingSettings = DEFAULT_RETIMING,
) -> Trajectory:
    """The fastest motion that the search finds.

    Args:
        prepared: a path without kinks.
        limits: with a jerk.
        refined: whether to go on from the first motion that keeps the limits.
        motors: torques along the path; None where they do not count.
        ceiling: of the profile from which the first motion is made.
        settings: of the profile and of the law.

    Raises:
        InvalidProblem: no motion was found that keeps the limits with the velocities of its ends.
    """
    law, breakpoints, path = settings.law, prepared.path.breakpoints, prepared.path
    ends, swings = ParametrisationEnds.of(prepared), law.swings if ceiling is None else law.following_swings

    def on_grid(passed: FloatArray, count: int, coarser: int) -> ParametrisationSearch:
        knots = graded_knots(passed, count // coarser, coarser, law)
        return ParametrisationSearch(path, limits, ends, knots, motors=motors, settings=law)

    def begun(search: ParametrisationSearch, profile: SpeedProfile) -> Candidate:
        starts = _smoothed(profile, limits, ends, search.knots, swings)
        return min((search.candidate(*start) for start in starts), key=lambda candidate: candidate.merit)

    for profile in _profiles(prepared, limits, motors, ceiling, settings):
        count = _intervals(breakpoints.size - 1, float(profile.times[-1]), limits, law)
        passed = profile.times[np.searchsorted(profile.nodes, breakpoints)] / profile.times[-1]
        search = on_grid(passed, count, 1)
        best = begun(search, profile)
        is_far = best.merit > law.far * profile.times[-1]
        if not is_far:
            break
    if refined and (is_far or any(prepared.resting)):
        coarse = on_grid(passed, count, law.coarser)
        improved = coarse.improved(begun(coarse, profile))
        search = on_grid(np.concatenate([[0.0], improved.law.reaching(breakpoints[1:-1]), [1.0]]), count, 1)
        best = _refined(improved, search)
    motion = None if refined else search.proven(best)
    for margin in law.margins if ends.moving else (0.0,):
        if motion is not None:
            return motion
        best = replace(search, margin=margin).improved(best)
        motion = search.proven(best)
    if motion is None:
        raise InvalidProblem(
            "rates", "no motion was found that keeps the jerk limits with these velocities at its ends"
        )
    return motion


def _profiles(
    prepared: PreparedPath,
    limits: JointLimits,
    motors: PathTorques | None,
    ceiling: SpeedProfile | None,
    settings: RetimingSettings,
) -> Iterator[SpeedProfile]:
    """Profiles from which a search may begin: one without programs, and theirs where laws are far from it.

    Where a path hardly bends, as along lines, the energies of joints decide.
    """
    if ceiling is None and not (prepared.moves_at_an_end or any(prepared.resting)):
        yield energy_profile(prepared.path, limits, settings.law.fewest_intervals)
    yield fastest_profile(prepared, limits, motors, ceiling, rough=ceiling is None, settings=settings.profile)[0]


def _intervals(pieces: int, duration: float, limits: JointLimits, settings: LawSettings) -> int:
    """How many intervals between knots a law has, were all equally long."""
    wanted = int(settings.intervals_per_rise * rises(limits, duration))
    most = min(settings.intervals_per_piece * pieces, settings.most_intervals)
    return max(settings.fewest_intervals, min(wanted, most))


def _refined(coarse: Candidate, fine: ParametrisationSearch) -> Candidate:
    """About the same law with other knots: an interpolation may overshoot where a law hardly moves, a law may not."""
    tau = averaged_knots(fine.knots)
    controls = BSpline.through(fine.knots, tau, coarse.law.at(tau)[:, None], DEGREE).c[:, 0]
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
    _, acceleration, jerk = (bound[np.isfinite(limits.by_order[2])] for bound in limits.by_order)
    swing = float((acceleration / jerk).max())
    for width in sorted({*(min(times * swing, total) for times in swings), total}):
        delay, tail = (0.0 if rate > 0.0 else width / 2.0 for rate in (before, after))
        duration = delay + total + tail
        times = averaged_knots(knots) * duration - delay
        means = (sums(times + width / 2.0) - sums(times - width / 2.0)) / width
        controls = np.clip(means, *profile.nodes[[0, -1]])
        controls[[0, -1]] = profile.nodes[[0, -1]]
        yield controls, duration


def _extended(profile: SpeedProfile, before: float, after: float) -> PiecewisePolynomial:
    """The parameter as a function of the time, as long before the start and after the end at these rates."""
    times, speeds = profile.times, np.sqrt(profile.squares)
    total = times[-1]
    linear = np.concatenate([[before], speeds[:-1], [after]])
    quadratic = np.concatenate([[0.0], np.diff(speeds) / (2.0 * np.diff(times)), [0.0]])
    values = np.concatenate([[profile.nodes[0] - before * total], profile.nodes])
    return PiecewisePolynomial(np.stack([quadratic, linear, values]), np.concatenate([[-total], times, [2.0 * total]]))
