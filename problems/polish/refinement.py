"""The best motion from a start to a goal: paths are found, polished, repaired and proven, and the best one is kept."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from problems.base import FloatArray
from problems.core import Schedule
from problems.limits import Limit, Proximity, TorqueLimit, stay_shares
from problems.motions import Trajectory
from problems.polish.descent import DeviationPolish, Iterate
from problems.polish.deviation import JUST_BEFORE, Deviations, direct_motion
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.guarded import Draft
from problems.polish.objective import PolishObjective
from problems.polish.passages import Passages
from problems.polish.samples import PolishSamples
from problems.polish.settings import DEFAULT_GUARDED, DEFAULT_REFINEMENT, GuardedSettings, RefinementSettings
from problems.polish.spline import PIECES
from problems.polish.torques import JointTorques
from problems.robots import JointLimits, Robot
from problems.worlds import World

JOINT_ORDERS = range(4)  # derivatives of the joint angles whose limits programs keep


def programs_know(limits: Iterable[Limit]) -> bool:
    """Whether programs can keep all of some limits, those on expressions aside."""
    return all(limit.order in JOINT_ORDERS or isinstance(limit, Proximity | TorqueLimit) for limit in limits)


def joint_box(robot: Robot, *postures: FloatArray) -> FloatArray:
    """The bounds of joints that are tried, (2, dof), rad: their ranges, at most half a turn beyond given postures."""
    known = np.stack(postures)
    low, high = known.min(axis=0) - np.pi, known.max(axis=0) + np.pi
    ranges = robot.limits.position
    if ranges is None:
        return np.stack([low, high])
    return np.stack([np.maximum(low, np.array(ranges)[:, 0]), np.minimum(high, np.array(ranges)[:, 1])])


def deviations_from_rest(
    start: FloatArray,
    goal: FloatArray,
    limits: JointLimits,
    torques: JointTorques | None,
    *,
    at_least: float = 0.0,
    pieces: int = PIECES,
    settings: RefinementSettings = DEFAULT_REFINEMENT,
) -> Deviations:
    """The motions between two postures at rest that deviate from the direct one, or from one that motors can follow.

    Where accelerations may jump and the direct motion takes larger torques than there are, that is one cubic.
    """
    if torques is None:
        return Deviations(start, goal, limits, at_least=at_least, pieces=pieces)
    direct = direct_motion(start, goal, limits)
    times, jumps = direct.times(settings.examined_times), direct.breakpoints
    times = np.union1d(times, [*jumps[:-1], *(jumps[1:] - JUST_BEFORE * direct.duration)])
    if limits.jerk is None:
        is_smooth = torques.time_scale_of(direct, times) > 1.0
        return Deviations(start, goal, limits, is_smooth=is_smooth, at_least=at_least, pieces=pieces)
    times = times[np.minimum(times, direct.duration - times) <= settings.end_share * direct.duration]
    scale = min(torques.time_scale_of(direct, times), settings.gentlest_scale)
    gentler = _gentler(limits, scale) if scale > 1.0 else None
    return Deviations(start, goal, limits, gentler=gentler, at_least=at_least, pieces=pieces)


def _gentler(limits: JointLimits, scale: float) -> JointLimits:
    """The limits of accelerations and jerks that a motion keeps that is run so many times as slowly."""
    assert limits.acceleration is not None and limits.jerk is not None
    acceleration, jerk = (
        tuple(one / scale**order for one in each) for order, each in ((2, limits.acceleration), (3, limits.jerk))
    )
    return replace(limits, acceleration=acceleration, jerk=jerk)


def never(is_known: bool) -> bool:
    """Whether to come to an end, where a motion is known or none is: there always is time."""
    return False


@dataclass(frozen=True)
class TimeWindow:
    """The times at which a path is left and its end is reached, s."""

    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class InitialMotion:
    """A motion at which a polish begins.

    Attributes:
        x: free control points, (free, k), rad.
        duration: s.
    """

    x: FloatArray
    duration: float


@dataclass(frozen=True, eq=False)
class Attempt:
    """A polish and the motion at which it begins.

    Attributes:
        polish: with the samples and margins of this attempt.
        x: free control points, (free, k), rad.
        duration: s.
        programs: of the descent, at most.
    """

    polish: DeviationPolish
    x: FloatArray
    duration: float
    programs: int


@dataclass(frozen=True, eq=False)
class Flaws:
    """The reasons why a polished motion is not proven.

    Attributes:
        between: parameters between samples at which it breaks something, (m,); without any, the proof itself failed.
        is_too_fast: whether it exceeds limits that a longer duration cannot restore.
        time_mends: whether nothing but torques are too large, so that it only has to be run more slowly.
    """

    between: FloatArray
    is_too_fast: bool
    time_mends: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class PathRefinement:
    """The refinement of motions between two postures, past given places.

    Args:
        world: the robot and its surroundings.
        motions: between the two postures.
        objective: of these motions.
        box: lower and upper bounds of the joints that are tried, (2, dof), rad.
        torques: of the robot; None where they are not limited.
        expressions: limits that are expressions; None where there are none.
        passages: places on the way; None where there are none.
        through: postures that paths lead through, one at each of these places, (n, dof), rad.
        known: a motion through them that breaks limits of the surroundings alone; None where none is known.
        is_enough: whether to come to an end, with a motion that is known or without one.
        stay: for how long the goal has to be clear after the arrival, s; it matters where obstacles move.
        settings: of the refinement.
    """

    world: World
    motions: Deviations
    objective: PolishObjective
    box: FloatArray
    torques: JointTorques | None = None
    expressions: ExpressionLimits | None = None
    passages: Passages | None = None
    through: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    known: Trajectory | None = None
    is_enough: Callable[[bool], bool] = never
    stay: float = 0.0
    settings: RefinementSettings = DEFAULT_REFINEMENT

    def best_motion(self, seed: int, to_beat: float = np.inf) -> Trajectory | None:
        """The best motion that was proven to be clear; None where none beats a given value, or was found in time."""
        settings, best, values = self.settings, None, list[float]()
        to_beat *= self.objective.scale
        known: dict[tuple[bytes, float], Iterate | None] = {}  # different paths may become the same motion
        for number, initial in enumerate(self._initial_motions(seed)):
            if number > self._most_paths(best is not None, to_beat):
                break
            limit = to_beat if best is None else min(to_beat, best.value)
            key = (np.round(initial.x, settings.path_digits) + 0.0).tobytes(), initial.duration
            if key not in known:
                known[key] = self._refined(initial, limit)
            refined = known[key]
            values += [] if refined is None else [refined.value]
            if refined is not None and refined.value < limit:
                best = refined
            if best is not None and best.value <= settings.near_bound * self.objective.bound:
                break
            if self.is_enough(best is not None):
                break
            if sum(each <= settings.near_optimal * min(values) for each in values) >= settings.agreeing_paths:
                break
        return None if best is None else self._trajectory(best)

    def polished_motion(self) -> Trajectory | None:
        """The known motion, or that which all others deviate from, polished; None where the result is not proven."""
        refined = self._refined(next(self._initial_motions(0)), np.inf)
        return None if refined is None else self._trajectory(refined)

    def drafts(self, seed: int, settings: GuardedSettings = DEFAULT_GUARDED) -> Iterator[Draft]:
        """Drafts of motions with a duration for each segment: near the known one, then along paths that are found."""
        if self.known is not None:
            pieces = (self.known.breakpoints.size - 1) // (len(self._stops) - 1)
            yield Draft.of_motion(self.known, self.known.breakpoints[::pieces])
        for number in range(settings.ways):
            parts = self._connected_parts(settings.ways * seed + number, TimeWindow(0.0, self.motions.direct.duration))
            if parts is not None:
                yield Draft.along(parts, self.motions.limits)

    # One motion: polished, repaired, proven

    def _refined(self, initial: InitialMotion, to_beat: float) -> Iterate | None:
        """The initial motion polished and proven, after repairs; None where it fails or does not beat a value."""
        running_out = partial(self.is_enough, to_beat < np.inf)
        attempt, slower = self._first_attempt(initial, running_out), None
        for number in range(self.settings.repairs + 1):
            if number and running_out():
                break
            polished = attempt.polish(attempt.x, to_beat, attempt.programs, attempt.duration)
            exact = self._passing(attempt.polish, polished)
            if self._had_too_little_reserve(attempt.polish, polished, exact):
                attempt = replace(attempt, polish=self._tightened(attempt.polish))
                continue
            if exact is None or exact.value > self.settings.near_optimal * to_beat or not exact.is_clear:
                return slower
            flaws = self._flaws(attempt.polish, exact)
            if flaws is None:
                return exact
            slower = exact if flaws.time_mends else slower
            attempt = self._repaired(attempt.polish, exact, flaws)
        return slower

    def _first_attempt(self, initial: InitialMotion, running_out: Callable[[], bool]) -> Attempt:
        settings, u = self.settings.polish, self.motions.parameters()
        polish = DeviationPolish(
            samples=PolishSamples(motions=self.motions, world=self.world, u=u, stay=self.stay, settings=settings),
            objective=self.objective,
            proof_margin=self._proof_margin,
            torques=self.torques,
            expressions=self.expressions,
            passages=self.passages,
            running_out=running_out,
            limit_reserve=self._limit_reserve,
            settings=settings,
        )
        x, duration = polish.projected(initial.x), initial.duration
        if self.objective.chooses_duration and not self.world.moves:
            duration = self.objective.best_duration(x, self.motions.least_duration(x, duration))
        return Attempt(polish, x, duration, self.settings.first_programs)

    def _passing(self, polish: DeviationPolish, iterate: Iterate) -> Iterate | None:
        """The motion that passes its places exactly; None where none is found.

        Between ends that move, a motion that passes them in one duration may need another: programs come so near before
        that the limits leave room for the last correction.
        """
        settings = self.settings
        if self.passages is None:
            return iterate
        if self.motions.moving:
            nearer = replace(polish, passages=replace(self.passages, price=settings.exact_passage_price))
            iterate = nearer(iterate.x, np.inf, settings.more_programs, iterate.duration)
        whole = replace(polish, limit_reserve=0.0)
        for _ in range(settings.duration_steps if self.motions.moving else 1):
            x = self.passages.exact(iterate.x, iterate.duration)
            if x is None or x is iterate.x:
                return None if x is None else iterate
            duration, iterate = iterate.duration, whole.iterate(x, 0.0, iterate.duration)
            if iterate.duration == duration:
                break
        return iterate

    def _had_too_little_reserve(self, polish: DeviationPolish, before: Iterate, after: Iterate | None) -> bool:
        """Whether the correction that passes places exactly took much longer, and a larger reserve may help."""
        if after is None or after.duration <= self.settings.longest_correction * before.duration:
            return False
        return 0.0 < polish.limit_reserve < self.settings.largest_limit_reserve

    def _tightened(self, polish: DeviationPolish) -> DeviationPolish:
        """The polish that keeps a larger reserve of the limits."""
        larger = self.settings.limit_reserve_growth * polish.limit_reserve
        return replace(polish, limit_reserve=max(larger, self.settings.limit_reserve))

    def _repaired(self, polish: DeviationPolish, iterate: Iterate, flaws: Flaws) -> Attempt:
        """The next attempt, from a motion with flaws: more reserve, larger margins, samples at what was broken."""
        if flaws.is_too_fast:
            polish = self._tightened(polish)
        elif not flaws.between.size:
            polish = replace(polish, proof_margin=self.settings.margin_growth * polish.proof_margin)
        programs = self.settings.first_programs if flaws.is_too_fast else self.settings.more_programs
        return Attempt(polish.sampled_at(flaws.between), iterate.x, iterate.duration, programs)

    def _flaws(self, polish: DeviationPolish, iterate: Iterate) -> Flaws | None:
        """The flaws of a motion; None where it is proven to have none."""
        between, trajectory = polish.broken_between(iterate.x, iterate.duration), self._trajectory(iterate)
        is_too_fast = not self._is_slow_enough(trajectory)
        if between.size or is_too_fast or not self._is_proven_clear(trajectory):
            return Flaws(between, is_too_fast)
        overloaded = polish.overloaded_between(iterate.x, iterate.duration)
        return Flaws(overloaded, False, time_mends=not self.world.moves) if overloaded.size else None

    def _is_slow_enough(self, trajectory: Trajectory) -> bool:
        """Whether a motion between moving ends keeps the limits that other motions keep by a longer duration."""
        if not self.motions.moving:
            return True
        torques, times = self.torques, trajectory.times(self.settings.examined_times)
        longest = 1.0 - self.settings.torque_tolerance
        keeps_torques = torques is None or torques.time_scale_of(trajectory, times) <= longest
        return keeps_torques and self.motions.keeps_limits(trajectory)

    def _is_proven_clear(self, trajectory: Trajectory) -> bool:
        """Whether a motion is proven to be clear for all t, and its goal after it."""
        if not self.world.prove(trajectory).status:
            return False
        if not (self.stay and self.world.moves):
            return True
        begin = trajectory.duration
        standing = Trajectory(np.array([begin, begin + self.stay]), trajectory.at(np.array([begin]))[None])
        return bool(self.world.prove(standing).status)

    def _trajectory(self, iterate: Iterate) -> Trajectory:
        """The motion, as long as its iterate where obstacles move or the duration is chosen."""
        chosen = self.world.moves or self.objective.chooses_duration
        return self.motions.trajectory(iterate.x, iterate.duration, iterate.duration if chosen else 0.0)

    @property
    def _limit_reserve(self) -> float:
        """The share of limits that programs keep for the last correction, where no longer duration mends it."""
        return self.settings.limit_reserve if self.motions.moving and self.passages is not None else 0.0

    @cached_property
    def _proof_margin(self) -> FloatArray:
        """Clearance on top of the margins, of obstacles and of own links, m, (2,): less where the ends have less."""
        still, start, margin = self.world.still, self.motions.start[None], self.settings.proof_margin
        left = [
            min(
                still.clearance_margins(self._stops, margin, which).min(),
                self.world.clearance_margins(start, margin, which)[0],
            )
            for which in self.world.margins
        ]
        most = (margin, self.settings.own_proof_margin)
        return np.maximum(np.minimum(self.settings.share_at_ends * np.array(left), most), 0.0)

    # Initial motions

    @property
    def _stops(self) -> FloatArray:
        """The postures that paths lead through, both ends included, (n, dof), rad."""
        return np.stack([self.motions.start, *self.through, self.motions.goal])

    def _most_paths(self, is_known: bool, to_beat: float) -> int:
        """Paths that are tried, besides the straight one."""
        if is_known:
            rounds = self.settings.rounds if self.known is not None and not len(self.through) else 0
            return max(self.settings.paths, rounds * len(self._windows))
        return self.settings.most_paths if to_beat == np.inf else self.settings.other_goal_paths

    def _initial_motions(self, seed: int) -> Iterator[InitialMotion]:
        """Initial motions: along the straight path, then along paths that are found by RRT-Connect.

        Where the nearest of several best motions need not be the best of all, every other one is a bent straight path.
        """
        settings, straight = self.settings, np.zeros((self.motions.free, self.motions.dof))
        if self.known is not None:
            fitted, duration = self.motions.nearest_to(self.known), self.known.duration
        else:
            fitted = self.motions.fitted(self._stops) if len(self.through) else straight
            duration = self.motions.direct.duration
        yield InitialMotion(fitted, duration)
        failures, windows, rng = 0, self._windows, np.random.default_rng(seed)
        for number in range(settings.most_paths):
            usual = TimeWindow(0.0, self.motions.direct.duration)
            window = windows[number % len(windows)] if windows else usual
            if self.objective.has_several_optima or self.motions.is_smooth:
                yield InitialMotion(self._bent(fitted, rng), window.end)
            path = self._connected(settings.most_paths * seed + number, window)
            failures += path is None
            if path is not None:
                yield InitialMotion(self.motions.fitted(path, window.begin / window.end), window.end)
            elif failures >= max(settings.most_failures, len(windows)):
                return

    def _bent(self, x: FloatArray, rng: np.random.Generator) -> FloatArray:
        """A motion moved sideways, most in the middle, within the box."""
        u = self.motions.parameters()
        theta = self.motions.postures(u).values(self.motions.padded(x))
        bend = 4.0 * (u * (1.0 - u))[:, None] * rng.normal(0.0, self.settings.bend, self.motions.dof)
        return x + self.motions.fit @ (np.clip(theta + bend, *self.box) - theta)

    @cached_property
    def _windows(self) -> list[TimeWindow]:
        """Times at which a path may begin and arrive so that the goal is clear then, the earliest arrival first.

        There are none where obstacles stand still: times do not matter.
        """
        if not self.world.moves:
            return []
        settings, bound, since = self.settings, self.motions.bound, stay_shares(self.stay) * self.stay
        standing, end, windows = np.tile(self.motions.goal, (since.size, 1)), bound, list[TimeWindow]()
        while end <= settings.latest_arrival * bound or (not windows and end <= settings.latest_first_arrival):
            if self.world.clear(standing, times=end + since).all():
                windows += [TimeWindow(begin, end) for begin in dict.fromkeys((0.0, end - bound))]
            end *= settings.arrival_growth
        return windows

    def _connected(self, seed: int, window: TimeWindow) -> FloatArray | None:
        """A path through all stops, (m, dof), rad; None where none is found."""
        parts = self._connected_parts(seed, window)
        return None if parts is None else np.concatenate(parts)

    def _connected_parts(self, seed: int, window: TimeWindow) -> list[FloatArray] | None:
        """Paths (m, dof) from each stop to the next one, rad; None where one is not found."""
        lengths = np.linalg.norm(np.diff(self._stops, axis=0), axis=1)
        shares = np.append(0.0, np.cumsum(lengths)) / max(lengths.sum(), np.finfo(float).tiny)
        times = window.begin + shares * (window.end - window.begin)
        parts = []
        for (start, goal), (begin, end) in zip(pairwise(self._stops), pairwise(times.tolist()), strict=True):
            part = self.world.connect(start, goal, self.box, seed, schedule=Schedule(start, goal, begin, end))
            if part is None:
                return None
            parts.append(part)
        return parts
