"""The fastest motions past places and obstacles, with a duration of its own for each segment, near a known motion.

One program after another has rows of the core's interior-point method that keep distances, torques and expressions to
the first order. Angles change by little in each, so that this holds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import Guards, SegmentCells, SegmentMotion, found_core
from problems.limits import Limit
from problems.motions import Trajectory
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.samples import slopes_of
from problems.polish.settings import DEFAULT_GUARDED, GuardedSettings
from problems.polish.torques import JointTorques
from problems.robots import JointLimits
from problems.timing import Passing, SegmentGrid, least_durations
from problems.worlds import World

ORDERS = range(3)  # angles, velocities, accelerations


class Excesses(NamedTuple):
    """Values at samples that may not be above zero, in shares of limits, and their slopes.

    Attributes:
        sample: of each value, (m,).
        value: (m,).
        slopes: by angles, velocities and accelerations, (m, 3, k).
        allowed: the value that is put up with between the samples of programs.
    """

    sample: NDArray[np.intp]
    value: FloatArray
    slopes: FloatArray
    allowed: float


@dataclass(frozen=True, eq=False)
class SegmentSamples:
    """Parameters of segments at which motions are examined.

    Args:
        grid: of the segments.
        segment: of each, (n,), in their order.
        u: the parameter, (n,), in the order of time.
    """

    grid: SegmentGrid
    segment: NDArray[np.intp]
    u: FloatArray

    @classmethod
    def of(cls, grid: SegmentGrid, per_cell: int) -> Self:
        """Equally spaced samples, so many in each cell of a grid; segments' own ends are left out."""
        shares = np.arange(per_cell) / per_cell
        u = (grid.knots[:, :-1, None] + shares * grid.widths[:, :, None]).reshape(grid.segments, -1)[:, 1:]
        return cls(grid, np.repeat(np.arange(grid.segments), u.shape[1]), u.ravel())

    def chosen(self, numbers: NDArray[np.intp]) -> SegmentSamples:
        """The samples of some numbers, (m,)."""
        return replace(self, segment=self.segment[numbers], u=self.u[numbers])

    def joined(self, other: SegmentSamples) -> SegmentSamples:
        """The samples of both sets, each once."""
        pairs = (self.segment, other.segment), (self.u, other.u)
        both = np.unique(np.stack([np.append(*pair) for pair in pairs]), axis=1)
        return replace(self, segment=both[0].astype(np.intp), u=both[1])

    @cached_property
    def weights(self) -> list[FloatArray]:
        """Weights of the control points that samples know, for each derivative by u, (n, degree + 1)."""
        return [self.grid.weights_at(self.segment, self.u, order) for order in ORDERS]

    @cached_property
    def first(self) -> NDArray[np.intp]:
        """Numbers of the first of these points, (n,)."""
        return self.grid.cells_of(self.segment, self.u)


class Draft(NamedTuple):
    """A motion through places as a program begins with it; it need neither be clear nor keep limits.

    Attributes:
        places: both ends included, (segments + 1, k), rad.
        rates: first and second derivatives by time at the places between, (segments - 1, 2, k).
        samples: postures of each segment in equal steps of time, both ends included, (segments, n, k), rad.
        durations: of the segments, (segments,), s.
    """

    places: FloatArray
    rates: FloatArray
    samples: FloatArray
    durations: FloatArray

    @classmethod
    def of_motion(cls, known: Trajectory, times: FloatArray, count: int = GuardedSettings.draft_samples) -> Self:
        """A motion past its postures at some times (segments + 1,), s, with so many samples in a segment."""
        rates = np.stack([known.at(times[1:-1], order) for order in (1, 2)], axis=1)
        u, durations = np.linspace(0.0, 1.0, count), np.diff(times)
        theta = known.at((times[:-1, None] + u * durations[:, None]).ravel())
        return cls(known.at(times), rates, theta.reshape(durations.size, count, -1), durations)

    @classmethod
    def along(
        cls, paths: Sequence[FloatArray], limits: JointLimits, count: int = GuardedSettings.draft_samples
    ) -> Self:
        """A motion along a path (m, k) in each segment, in the time in which all of their corners are stops."""
        u = np.linspace(0.0, 1.0, count)
        share, samples = u**3 * (10.0 - 15.0 * u + 6.0 * u**2), []
        for path in paths:
            passed = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)))
            samples.append([np.interp(share * passed[-1], passed, joint) for joint in path.T])
        durations = [float(least_durations(np.diff(path, axis=0), limits).max(axis=1).sum()) for path in paths]
        places = np.stack([paths[0][0], *(path[-1] for path in paths)])
        rates = np.zeros((len(paths) - 1, 2, places.shape[1]))
        return cls(places, rates, np.array(samples).transpose(0, 2, 1), np.array(durations))


def fastest_guarded(
    draft: Draft,
    joint_limits: JointLimits,
    world: World,
    limits: Sequence[Limit] = (),
    rates: FloatArray | None = None,
    settings: GuardedSettings = DEFAULT_GUARDED,
) -> Trajectory | None:
    """The fastest motion past the places of a draft, near it and proven to be clear; None where none is found.

    There is none where two places in a row are the same.

    Args:
        draft: where the search begins.
        joint_limits: of angles, speeds, accelerations and jerks.
        world: the robot and its surroundings.
        limits: of torques and expressions; others are not kept.
        rates: velocities and accelerations at both ends, (2 ends, 2, k), rad/s and rad/s^2; at rest where None.
        settings: of the search.
    """
    if not draft.durations.all():
        return None
    passing, margin = Passing.of(draft.places, joint_limits, rates, settings.through), settings.margin
    for _ in range(settings.attempts):
        found = GuardedPassing(
            passing.postures, joint_limits, passing.ends, settings.through, range_share=1.0, draft=draft,
            world=world, own_limits=tuple(limits), guarded=settings, most_margin=margin,
        ).motion()  # fmt: skip
        if found is None:
            return None
        if world.prove(found).status:
            return found
        margin *= settings.margin_growth
    return None


@dataclass(frozen=True, eq=False, kw_only=True)
class GuardedPassing(Passing):
    """The search for the fastest motion through postures that is clear.

    Args:
        draft: where it begins.
        world: the robot and its surroundings.
        own_limits: of torques and expressions.
        guarded: settings of the search.
        most_margin: clearance on top of those that have to be kept, m, where places have more.
    """

    draft: Draft
    world: World
    own_limits: tuple[Limit, ...]
    guarded: GuardedSettings
    most_margin: float

    @cached_property
    def margin(self) -> float:
        """Clearance on top of those that have to be kept, m: less where places have less."""
        share, most = self.guarded.share_at_places, self.most_margin
        return max(share * float(self.world.clearance_margins(self.postures, most / share).min()), 0.0)

    @cached_property
    def torques(self) -> JointTorques | None:
        """The torques of the robot; None where they are not limited."""
        return JointTorques.among(self.own_limits)

    @cached_property
    def expressions(self) -> ExpressionLimits | None:
        """Limits that are expressions; None where there are none."""
        return ExpressionLimits.among(self.own_limits)

    @cached_property
    def expression_margins(self) -> FloatArray:
        """Margins of the expressions at samples, of their scales, (m,)."""
        return np.empty(0) if self.expressions is None else self.expressions.margins(*self.postures)

    def motion(self) -> Trajectory | None:
        """The motion; None where that on the first grid is not clear, or none is found."""
        grid, start = self._begun()
        lacking = self._with_samples(grid, start).worst
        return super().motion() if lacking <= self.guarded.most_lacking else None

    def _begun(self) -> tuple[SegmentGrid, SegmentMotion]:
        return self._first

    @cached_property
    def _first(self) -> tuple[SegmentGrid, SegmentMotion]:
        """The first grid and the motion on it to which the draft leads."""
        d, draft = self.degree, self.draft
        grid = SegmentGrid.even(self.segments, self.settings.first_cells, d)
        nothing = np.zeros((self.segments, grid.points - 2 * d, self.limits.dof))
        ends = SegmentMotion(draft.rates[:, : d - 1], nothing, draft.durations)
        values = draft.samples - self.postures[:-1, None]
        points = grid.fitted(self.points(grid, ends), np.linspace(0.0, 1.0, draft.samples.shape[1]), values)
        return grid, self._solved(grid, ends._replace(inner=points[:, d:-d]))[0]

    def _with_samples(self, grid: SegmentGrid, motion: SegmentMotion) -> GuardedMotion:
        return GuardedMotion(self, motion, SegmentSamples.of(grid, self.guarded.samples_per_cell))

    def _solved(self, grid: SegmentGrid, start: SegmentMotion) -> tuple[SegmentMotion, bool]:
        core, settings = found_core(), self.guarded
        assert core is not None
        radius = settings.radius if grid.cells == self.settings.first_cells else settings.later_radius
        best, is_solved = self._with_samples(grid, start), False
        for _ in range(settings.programs):
            found, solved = core.pass_through(self._stops, *best.program(radius), best.motion)
            trial = replace(best, motion=found)
            gain = np.inf if not is_solved else best.cost - trial.cost
            if not solved or gain < -settings.worthwhile * best.cost:
                radius *= settings.shrinking
                if radius < settings.least_radius:
                    break
                continue
            best, is_solved = trial, True
            if gain < settings.worthwhile * best.cost:
                between = best.broken_between
                if not between.u.size:
                    break
                best, radius = replace(best, samples=best.samples.joined(between)), settings.later_radius
        return best.motion, is_solved


@dataclass(frozen=True, eq=False)
class GuardedMotion:
    """A motion whose distances, torques and expressions are known to the first order.

    Args:
        passing: the search.
        motion: on the grid of the samples.
        samples: where it is examined.
    """

    passing: GuardedPassing
    motion: SegmentMotion
    samples: SegmentSamples

    @cached_property
    def cost(self) -> float:
        """The duration, s, and more where something is exceeded."""
        return float(self.motion.durations.sum()) * (1.0 + self.passing.guarded.price * self.worst)

    @property
    def worst(self) -> float:
        """The largest excess at samples; 0 where there is none."""
        return max(float(each.value.max(initial=0.0)) for each in self._excesses)

    @property
    def broken_between(self) -> SegmentSamples:
        """The samples where a motion exceeds something most between those that programs know."""
        fine = replace(self, samples=SegmentSamples.of(self.samples.grid, self.passing.guarded.proof_samples_per_cell))
        worst = np.full(fine.samples.u.size, -np.inf)
        for each in fine._excesses:
            np.maximum.at(worst, each.sample, each.value - each.allowed)
        around = np.pad(worst, 1, constant_values=-np.inf)
        peaks = np.flatnonzero((worst > 0.0) & (worst >= around[:-2]) & (worst >= around[2:]))
        return fine.samples.chosen(peaks)

    def program(self, radius: float) -> tuple[SegmentCells, Guards]:
        """The rows of the program in which angles change by at most a radius, rad."""
        passing, grid = self.passing, self.samples.grid
        middle, half = np.moveaxis(passing.angle_ranges(grid), 2, 0)
        weights, first = grid.at_angles()
        own = self._all_points[:, first[:, None] + np.arange(weights.shape[2])]
        theta = np.einsum("sra,srak->srk", weights, own) + passing.postures[:-1, None]
        low, high = np.maximum(middle - half, theta - radius), np.minimum(middle + half, theta + radius)
        ranges = np.stack([(low + high) / 2.0, np.maximum(high - low, passing.guarded.least_range) / 2.0], axis=2)
        parts = [self._guards(each, radius) for each in self._excesses]
        return grid.limited(passing.settings.speed_shares, ranges), Guards.joined(parts)

    @cached_property
    def _all_points(self) -> FloatArray:
        """The control points, from the first place of each segment, (segments, points, k), rad."""
        return self.passing.points(self.samples.grid, self.motion)

    @cached_property
    def _points(self) -> FloatArray:
        """The control points that each sample knows, (n, degree + 1, k)."""
        numbers = self.samples.first[:, None] + np.arange(self.samples.grid.degree + 1)
        return np.asarray(self._all_points[self.samples.segment[:, None], numbers])

    @cached_property
    def _durations(self) -> FloatArray:
        """The duration of each sample's segment, (n,), s."""
        return self.motion.durations[self.samples.segment]

    @cached_property
    def _state(self) -> FloatArray:
        """Angles, velocities and accelerations at samples, (n, 3 k)."""
        parts = [np.einsum("na,nak->nk", weights, self._points) for weights in self.samples.weights]
        parts[0] += self.passing.postures[self.samples.segment]
        return np.concatenate([part / self._durations[:, None] ** order for order, part in enumerate(parts)], axis=1)

    @property
    def _times(self) -> FloatArray:
        """The times of samples, (n,), s."""
        begins = np.cumsum(self.motion.durations) - self.motion.durations
        return begins[self.samples.segment] + self._durations * self.samples.u

    @cached_property
    def _excesses(self) -> list[Excesses]:
        return [self._distances, *self._torques, *self._expressions]

    @property
    def _distances(self) -> Excesses:
        passing, k, margin = self.passing, self.passing.limits.dof, self.passing.margin
        reach, (theta, *rates) = passing.guarded.reach, np.split(self._state, len(ORDERS), axis=1)
        errors = None if passing.world.is_exact else passing.world.errors(*rates)
        near = passing.world.nearby(theta, margin + reach, self._times, errors)
        slopes = np.zeros((near.samples.size, len(ORDERS), k))
        slopes[:, 0] = -near.gradients / reach
        allowed = passing.guarded.allowed_share * margin / reach
        return Excesses(near.samples.astype(np.intp), (margin - near.clearance_margins) / reach, slopes, allowed)

    @property
    def _torques(self) -> Iterator[Excesses]:
        torques, settings = self.passing.torques, self.passing.guarded
        if torques is not None:
            shares, slopes = torques.shares(self._state), torques.slopes(self._state)
            for sign in (1.0, -1.0):
                yield self._near_limits(
                    sign * shares - settings.torque_share, sign * slopes, 1.0 - settings.torque_share
                )

    @property
    def _expressions(self) -> Iterator[Excesses]:
        expressions = self.passing.expressions
        if expressions is not None:
            values, slopes = expressions.linear(self._state)
            margins = self.passing.expression_margins
            yield self._near_limits(values + margins, slopes, self.passing.guarded.allowed_share * float(margins.min()))

    def _near_limits(self, values: FloatArray, slopes: FloatArray, allowed: float) -> Excesses:
        """The excesses among values (n, m) with slopes (n, m, 3, k): zero, above it, or a little below."""
        sample, row = np.nonzero(values > -self.passing.guarded.near)
        return Excesses(sample, values[sample, row], slopes[sample, row], allowed)

    def _guards(self, excesses: Excesses, radius: float) -> Guards:
        """Rows that keep excesses at zero or below, of those that may be above it."""
        settings = self.passing.guarded
        change = np.abs(excesses.slopes[:, 0]).sum(axis=1) * radius
        at_rest = ~excesses.slopes[:, 1:].any(axis=(1, 2))
        matters = np.flatnonzero((excesses.value > -change) | ~at_rest)
        chosen = matters[np.argsort(-excesses.value[matters], kind="stable")[: settings.most_guards]]
        sample = excesses.sample[chosen]
        by_points, by_time = slopes_of(
            [weights[sample] for weights in self.samples.weights], excesses.slopes[chosen], self._state[sample],
            self._durations[sample],
        )  # fmt: skip
        most = np.where(at_rest, settings.most_asked * change, np.inf)
        asked = np.minimum(excesses.value, most)[chosen]
        least = asked - np.einsum("mak,mak->m", by_points, self._points[sample])
        by_log_duration = -by_time * self._durations[sample]
        return Guards(self.samples.segment[sample], self.samples.first[sample], -by_points, by_log_duration, least)
