"""The least time with jerk limits: sequential linear programs over a smooth parametrisation.

Each program linearises speed, acceleration, jerk and torques at samples around the last law. What it finds is judged by
the exact peaks, between samples too, and by torques at denser samples: where the motion can be slowed, by the duration
that all limits need; else by the duration and by how far a limit is broken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.sparse import csr_array, diags_array, hstack, vstack

from problems.base import FloatArray, InvalidProblem
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits
from problems.timing.parametrisation import (
    DEGREE,
    ORDERS,
    Parametrisation,
    ParametrisationEnds,
    ParametrisationRows,
    along_path,
    averaged_knots,
    graded_knots,
    operators,
    parametrisation_rows,
    torque_parametrisation_rows,
)
from problems.timing.prepared import PathTorques, PreparedPath, minimum_time_scale
from problems.timing.speed_profile import SpeedProfile, fastest_profile, minimizer

SAMPLES = 4  # of each interval between knots
TORQUE_SAMPLES = 8  # of each interval, to judge torques by
BESIDE = 1e-7  # of the duration: as far before and after a change of the path's piece are samples too
ITERATIONS = 25
MOST_FAILURES = 5  # in a row
EVEN = 1e-7  # the share of an even law in every law, so that none stands still
MOST_CLOSING = 0.9  # how much nearer control points may come in one iteration, of their distance
FIRST_TRUST, LARGEST_TRUST = 0.3, 2.0  # how far a control point may move, of the distance to its neighbours
LARGEST_CHANGE = 0.2  # of the duration, in one iteration
LEAST_GAIN = 5e-4  # of the merit
ALLOWED = 1e-9  # of a limit; rounding
BREAKING = 20.0  # per cent of the duration that one per cent of a limit is worth
MARGIN_GROWS = 0.1  # of the duration: as long do margins grow from nothing next to an end that is given
NEARLY_ACTIVE, NEWLY_ACTIVE, BROKEN = 0.9, -0.02, 1e-6  # shares of limits that decide on the rows of a program
MOST_PROGRAMS = 6  # for one step


@dataclass(frozen=True)
class Candidate:
    """A time law, its duration in s, and the scale of time with which it would keep its limits."""

    law: Parametrisation
    duration: float
    scale: float

    @property
    def merit(self) -> float:
        """In s; lower is better, and what keeps its limits always is."""
        return self.duration * (1.0 if self.keeps_limits else 2.0 + BREAKING * (self.scale - 1.0))

    @property
    def keeps_limits(self) -> bool:
        """Whether it does, but for rounding."""
        return self.scale <= 1.0 + ALLOWED


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
        scale = minimum_time_scale(law.trajectory(self.path, duration), self.limits)
        if self.motors is not None:
            scale = max(scale, self.motors.time_scale(*along_path(self.path, self._judged, law.controls, duration)))
        return Candidate(law, duration, scale) if self.ends.moving else Candidate(law, duration * scale, 1.0)

    @cached_property
    def _judged(self) -> list[csr_array]:
        """What turns control points into a law and two derivatives where its torques are judged."""
        return operators(self.knots, _samples(self.knots, TORQUE_SAMPLES), 3)

    def improved(self, best: Candidate) -> Candidate:
        """The best law that a trust region around the last one leads to."""
        tau = _samples(self.knots, SAMPLES)
        basis = operators(self.knots, tau, ORDERS + 1)
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

    def _step(
        self, around: Candidate, tau: FloatArray, basis: list[csr_array], trust: float
    ) -> tuple[FloatArray, float] | None:
        """Changes of the control points, and of the duration as a share of it; None where there are none."""
        controls, duration = around.law.controls, around.duration
        crossed = around.law.reaching(self.path.breakpoints[1:-1])
        beside = np.concatenate([crossed - BESIDE, crossed + BESIDE])
        near = operators(self.knots, beside, ORDERS + 1)
        basis = [csr_array(vstack([part, extra])) for part, extra in zip(basis, near, strict=True)]
        room = 1.0 - self.margin * self._growing(np.concatenate([tau, beside]))
        rows = parametrisation_rows(self.path, self.limits, basis, controls, duration)
        if self.motors is not None:
            rows = rows.with_rows(torque_parametrisation_rows(self.motors, basis, controls, duration))
        free = self.ends.free(controls.size)
        padded = np.pad(controls, 2, mode="edge")
        width = trust * (padded[4:] - padded[:-4])[free] / 4.0
        moves = csr_array((width, (np.arange(controls.size)[free], np.arange(width.size))), (controls.size, width.size))
        slowing = csr_array(self.ends.slopes(self.knots, duration)[:, None])
        changes = csr_array(hstack([moves, slowing]))  # of the control points, with each variable but the last
        solution = _solution(rows, changes, np.diff(controls), room[rows.samples], self.ends.moving)
        return None if solution is None else (np.asarray(moves @ solution[: width.size]), float(solution[width.size]))


def _samples(knots: FloatArray, count: int) -> FloatArray:
    """Of each interval between knots so many, the end of the last one just before it."""
    distinct = np.unique(knots)
    inner = distinct[:-1, None] + np.diff(distinct)[:, None] * np.arange(count) / count
    return np.append(inner.ravel(), np.nextafter(1.0, 0.0))


def _solution(
    rows: ParametrisationRows, changes: csr_array, gaps: FloatArray, room: FloatArray, elastic: bool
) -> FloatArray | None:
    """Variables of one linear program: shares of the trust region, the duration's change, what limits are broken by.

    Rows join the program when a solution without them breaks them.
    """
    count = rows.values.size
    slopes = csr_array(hstack([rows.slopes @ changes, csr_array((count, 1))]))
    if rows.slowing.any():
        column = csr_array(rows.slowing[:, None])
        slopes = csr_array(slopes + hstack([csr_array((count, changes.shape[1] - 1)), column, csr_array((count, 1))]))
    none = csr_array((count, changes.shape[1] - 1))
    slack = csr_array(hstack([none, csr_array(-rows.orders[:, None]), csr_array(-np.ones((count, 1)))]))
    increasing = csr_array(hstack([changes[:-1] - changes[1:], csr_array((gaps.size, 1))]))
    costs = np.concatenate([np.zeros(changes.shape[1] - 1), [1.0, BREAKING]])
    box = np.repeat([[-1.0, 1.0]], costs.size, axis=0)
    box[-2:] = [-LARGEST_CHANGE, LARGEST_CHANGE], [0.0, np.inf if elastic else 0.0]
    reach = np.asarray(abs(slopes[:, :-2]).sum(axis=1)).ravel()
    signs = np.where(rows.values < 0.0, -1.0, 1.0)
    active = (reach > BROKEN) & (np.abs(rows.values) + np.minimum(reach, FIRST_TRUST) > NEARLY_ACTIVE)
    solution = None
    for program in range(MOST_PROGRAMS):
        chosen = np.flatnonzero(active)
        matrix = vstack([diags_array(signs[chosen]) @ slopes[chosen] + slack[chosen], increasing])
        bound = np.concatenate([(room - signs * rows.values)[chosen], MOST_CLOSING * gaps])
        solution = minimizer(costs, csr_array(matrix), bound, box)
        if solution is None:
            break
        values = rows.values + slopes @ solution
        excess = np.where(reach > BROKEN, np.abs(values) + slack @ solution - room, -np.inf)
        broken = excess > BROKEN
        if not broken.any():
            break
        active |= excess > (NEWLY_ACTIVE if program < MOST_PROGRAMS - 3 else -1.0)
        signs[broken] = np.where(values[broken] < 0.0, -1.0, 1.0)
    return solution


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
    ends, breakpoints = ParametrisationEnds.of(prepared), prepared.path.breakpoints
    count = max(FEWEST, min(INTERVALS * (breakpoints.size - 1), MOST))
    passed = profile.times[np.searchsorted(profile.nodes, breakpoints)] / profile.times[-1]
    coarser = COARSER if ceiling is None else 1  # what follows a profile is not improved afterwards
    knots = graded_knots(passed, count // coarser, IN_PIECE / coarser, MOST // coarser)
    coarse = ParametrisationSearch(prepared.path, limits, ends, knots, motors=motors)
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


def _refined(coarse: Candidate, fine: ParametrisationSearch) -> Candidate:
    """About the same law with other knots: an interpolation may overshoot where a law hardly moves, a law may not."""
    tau = averaged_knots(fine.knots)
    controls = np.asarray(make_interp_spline(tau, coarse.law.at(tau), DEGREE, t=fine.knots).c)
    return fine.candidate(np.maximum.accumulate(np.clip(controls, *controls[[0, -1]])), coarse.duration)


def _smoothed(
    profile: SpeedProfile, limits: JointLimits, ends: ParametrisationEnds, knots: FloatArray, swings: tuple[float, ...]
) -> Iterator[tuple[FloatArray, float]]:
    """Control points and durations: moving averages of a profile, over times accelerations need and over all.

    Beyond an end the profile goes on at the end's velocity; an end at rest takes half of the averaged time longer.
    """
    total = float(profile.times[-1])
    before, after = (given[0] if any(given) else 0.0 for given in (ends.start, ends.goal))
    _, acceleration, jerk = limits.by_order
    swing = float((acceleration / jerk).max())
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
