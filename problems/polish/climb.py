"""From a start to a goal in the best way: ways that were found, polished, proven, the best of a few."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from problems.base import FloatArray
from problems.core import Schedule, World
from problems.limits import looks
from problems.motions import Trajectory
from problems.polish.descent import DeviationPolish, Reached
from problems.polish.deviation import Deviations, direct_motion
from problems.polish.minimised import Minimised
from problems.polish.own_limits import OwnLimits
from problems.polish.passages import Passages
from problems.robots import JointLimits, Robot
from problems.sequential import JointTorques

LOG = logging.getLogger(__name__)
SPARE, OWN_SPARE = 3e-3, 1e-3  # m, kept of obstacles and of each other where postures are looked at
AT_ENDS = 0.8  # of what the ends have to spare
MENDED = 6  # times that a motion is mended
RESERVE, MORE_RESERVE = 1e-3, 4.0  # of limits of joints and motors; times as much where that was too little
LEAP, MOST_RESERVE = 1.2, 0.05  # times as long by the last correction: from the way again with more, up to this
BETWEEN_LOOKS = 1e-4  # of the time scale that torques ask for
DEARER = 1000.0  # s/m or s/rad: the price of places that are missed, before they are passed exactly
AGREEING = 10  # times that a motion between moving ends is led back to its places
FARTHER = 1.5  # times as much is to be spare where a proof fails and nothing was seen
FIRST_PROGRAMS, MORE_PROGRAMS = 25, 6
WAYS, MOST_WAYS = 10, 40  # by RRT-Connect, besides the straight one; where none leads to a motion
FEW_WAYS = 3  # to one of several goals, where a motion to another is known
MOST_FAILED = 2  # searches for a way: there is probably none
AGREED, SAME = 2, 1.002  # so many ways lead to motions that are worth the same, about: no other is tried
SAME_WAY = 6  # digits of control points in rad that two ways have in common that are one
BEND = 0.7  # rad, the standard deviation of how far a way is bent
LOOKS, ENDS, GENTLEST = 200, 0.1, 2.0  # of the direct motion: times, share of it at either end, time scale
GOOD_ENOUGH = 1.002  # of the bound: what is as good needs no other beginning
LONGER, LONG, LONGEST = (
    1.25,
    5.0,
    60.0,
)  # where obstacles move: from way to way; of the bound; s, where nothing is clear


def joint_box(robot: Robot, *postures: FloatArray) -> FloatArray:
    """Lower and upper bounds of what is tried, (2, dof), rad: joints' ranges, at most half a turn beyond postures."""
    known = np.stack(postures)
    low, high = known.min(axis=0) - np.pi, known.max(axis=0) + np.pi
    ranges = robot.limits.position
    if ranges is None:
        return np.stack([low, high])
    return np.stack([np.maximum(low, np.array(ranges)[:, 0]), np.minimum(high, np.array(ranges)[:, 1])])


def gentler(
    start: FloatArray, goal: FloatArray, limits: JointLimits, torques: JointTorques | None
) -> JointLimits | None:
    """Limits within which motors can begin and end the direct motion; None where they can anyway."""
    if torques is None:
        return None
    direct = direct_motion(start, goal, limits)
    times = direct.times(LOOKS)
    times = times[np.minimum(times, direct.duration - times) <= ENDS * direct.duration]
    scale = min(torques.time_scale_of(direct, times), GENTLEST)
    if scale <= 1.0:
        return None
    slower = {"acceleration": scale**2, "jerk": scale**3}
    kept = {name: getattr(limits, name) for name in slower}
    return replace(
        limits,
        **{name: tuple(one / slower[name] for one in values) for name, values in kept.items() if values is not None},
    )


def never() -> bool:
    """Whether there is no time left: there always is."""
    return False


@dataclass(frozen=True)
class Run:
    """When a way is left and its end reached, s."""

    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class Way:
    """A beginning of a polish.

    Attributes:
        x: free control points, (free, k), rad.
        duration: s.
    """

    x: FloatArray
    duration: float


@dataclass(frozen=True, eq=False)
class Climb:
    """The ladder between two postures at rest, past others.

    Args:
        world: the robot and what is around.
        motions: between the two.
        minimised: of these.
        box: lower and upper bounds of what is tried, (2, dof), rad.
        torques: of the robot; None where they are not limited.
        own: limits that are expressions; None where there are none.
        passages: places on the way; None where there are none.
        through: postures that ways lead through, one at each of them, (n, dof), rad.
        running_out: whether there is no time left for something better.
        stay: for how long the goal has to be clear after the arrival, s; it matters where obstacles move.
    """

    world: World
    motions: Deviations
    minimised: Minimised
    box: FloatArray
    torques: JointTorques | None = None
    own: OwnLimits | None = None
    passages: Passages | None = None
    through: FloatArray = field(default_factory=lambda: np.empty((0, 0)))
    running_out: Callable[[], bool] = never
    stay: float = 0.0

    @cached_property
    def _spare(self) -> FloatArray:
        """What is kept on top of what must be, of obstacles and of each other, m, (2,)."""
        still, start = self.world.still, self.motions.start[None]
        left = [
            min(still.rooms(self._stops, SPARE, which).min(), self.world.rooms(start, SPARE, which)[0])
            for which in self.world.margins
        ]
        return np.maximum(np.minimum(AT_ENDS * np.array(left), (SPARE, OWN_SPARE)), 0.0)

    @property
    def _stops(self) -> FloatArray:
        """The postures that ways lead through, both ends included, (n, dof), rad."""
        return np.stack([self.motions.start, *self.through, self.motions.goal])

    def _ways(self, seed: int) -> Iterator[Way]:
        """What to begin with: the straight way, then ways that were found.

        Where the nearest of several best motions need not be the best of all, one of two is the straight way bent.
        """
        straight = np.zeros((self.motions.free, self.motions.dof))
        fitted = self.motions.fitted(self._stops) if len(self.through) else straight
        yield Way(fitted, self.motions.direct.duration)
        failed, runs, rng = 0, self._runs, np.random.default_rng(seed)
        for number in range(MOST_WAYS):
            run = runs[number % len(runs)] if runs else Run(0.0, self.motions.direct.duration)
            if self.minimised.has_several:
                yield Way(self._bent(fitted, rng), run.end)
            path = self._connected(MOST_WAYS * seed + number, run)
            failed += path is None
            if path is not None:
                yield Way(self.motions.fitted(path, run.begin / run.end), run.end)
            elif failed >= max(MOST_FAILED, len(runs)):
                return

    def _bent(self, x: FloatArray, rng: np.random.Generator) -> FloatArray:
        """A way moved sideways, most in the middle, within the box."""
        u = self.motions.parameters()
        theta = self.motions.postures(u).values(self.motions.padded(x))
        bend = 4.0 * (u * (1.0 - u))[:, None] * rng.normal(0.0, BEND, self.motions.dof)
        return x + self.motions.fit @ (np.clip(theta + bend, *self.box) - theta)

    @cached_property
    def _runs(self) -> list[Run]:
        """When ways may begin and end that arrive where the goal is clear then, the soonest first.

        Where obstacles stand still it does not matter.
        """
        if not self.world.moves:
            return []
        bound, since = self.motions.bound, looks(self.stay) * self.stay
        standing, end, found = np.tile(self.motions.goal, (since.size, 1)), bound, list[Run]()
        while end <= LONG * bound or (not found and end <= LONGEST):
            if self.world.clear(standing, times=end + since).all():
                found += [Run(begin, end) for begin in dict.fromkeys((0.0, end - bound))]
            end *= LONGER
        return found

    def _connected(self, seed: int, run: Run) -> FloatArray | None:
        """A way through all stops, (m, dof), rad; None where none was found."""
        lengths = np.linalg.norm(np.diff(self._stops, axis=0), axis=1)
        shares = np.append(0.0, np.cumsum(lengths)) / max(lengths.sum(), np.finfo(float).tiny)
        times = run.begin + shares * (run.end - run.begin)
        parts = []
        for (start, goal), (begin, end) in zip(pairwise(self._stops), pairwise(times.tolist()), strict=True):
            part = self.world.connect(start, goal, self.box, seed, schedule=Schedule(start, goal, begin, end))
            if part is None:
                return None
            parts.append(part)
        return np.concatenate(parts)

    def __call__(self, seed: int, to_beat: float = np.inf) -> Trajectory | None:
        """The best motion that was proven to be clear; None where there is none that beats a value of the objective.

        Where no other motion is known, it goes on without time until there is one.
        """
        best: Reached | None = None
        to_beat *= self.minimised.scale
        values: list[float] = []
        known: dict[tuple[bytes, float], Reached | None] = {}  # what ways lead to, some of which are the same
        for number, way in enumerate(self._ways(seed)):
            if number > self._most(best is not None, to_beat):
                break
            limit = to_beat if best is None else min(to_beat, best.value)
            key = (np.round(way.x, SAME_WAY) + 0.0).tobytes(), way.duration
            if key not in known:
                known[key] = self._proven(way, limit, self.running_out if limit < np.inf else never)
            found = known[key]
            values += [] if found is None else [found.value]
            if found is not None and found.value < limit:
                best = found
            if best is not None and best.value <= GOOD_ENOUGH * self.minimised.bound:
                break
            if best is not None and self.running_out():
                break
            if sum(each <= SAME * min(values) for each in values) >= AGREED:
                break
        return None if best is None else self._made(best)

    def deviated(self) -> Trajectory | None:
        """What a polish makes of the motion that all others deviate from; None where that is not proven to be clear."""
        found = self._proven(Way(np.zeros((self.motions.free, self.motions.dof)), self.motions.direct.duration), np.inf)
        return None if found is None else self._made(found)

    def _made(self, reached: Reached) -> Trajectory:
        """The motion, as long as it has to be where obstacles move or that is chosen."""
        chosen = self.world.moves or self.minimised.chooses_duration
        return self.motions.trajectory(reached.x, reached.duration, reached.duration if chosen else 0.0)

    def _is_clear(self, trajectory: Trajectory) -> bool:
        """Whether a motion is proven to be, and the goal after it."""
        if not self.world.prove(trajectory).status:
            return False
        if not (self.stay and self.world.moves):
            return True
        begin = trajectory.duration
        standing = Trajectory(np.array([begin, begin + self.stay]), trajectory.at(np.array([begin]))[None])
        return bool(self.world.prove(standing).status)

    @staticmethod
    def _most(found: bool, to_beat: float) -> int:
        """Ways that are tried, besides the straight one."""
        if found:
            return WAYS
        return MOST_WAYS if to_beat == np.inf else FEW_WAYS

    def _proven(self, way: Way, to_beat: float, running_out: Callable[[], bool] = never) -> Reached | None:
        """What a polish makes of a beginning, mended where it comes too near between the postures looked at."""
        polish = DeviationPolish(
            self.motions, self.minimised, self.world, self._spare, self.motions.parameters(), self.torques, self.own,
            self.passages, running_out, self.stay, self._reserve,
        )  # fmt: skip
        x, near = polish.kept(way.x), way.duration
        if self.minimised.chooses_duration and not self.world.moves:
            near = self.minimised.best_duration(x, self.motions.least_duration(x, near))
        programs = FIRST_PROGRAMS
        for _ in range(MENDED + 1):
            before = polish(x, to_beat, programs, near)
            reached = self._passing(polish, before)
            leapt = reached is not None and reached.duration > LEAP * before.duration
            if leapt and 0.0 < polish.reserve < MOST_RESERVE:
                polish = replace(polish, reserve=MORE_RESERVE * polish.reserve)
                continue
            if reached is None or reached.value > SAME * to_beat or not reached.is_clear:
                return None
            between, made = polish.between(reached.x, reached.duration), self._made(reached)
            is_slow_enough = self._is_slow_enough(made)
            if not between.size and is_slow_enough and self._is_clear(made):
                return reached
            if not is_slow_enough:
                polish = replace(polish, reserve=max(MORE_RESERVE * polish.reserve, RESERVE))
            elif not between.size:
                polish = replace(polish, spare=FARTHER * polish.spare)
            polish, x, near, programs = polish.looking_at(between), reached.x, reached.duration, MORE_PROGRAMS
        return None

    @property
    def _reserve(self) -> float:
        """What programs keep of limits for the last correction, which time mends unless an end moves."""
        return RESERVE if self.motions.moving and self.passages is not None else 0.0

    def _is_slow_enough(self, trajectory: Trajectory) -> bool:
        """Whether a motion between ends that move keeps what others are run more slowly for."""
        if not self.motions.moving:
            return True
        torques, times = self.torques, trajectory.times(LOOKS)
        held = torques is None or torques.time_scale_of(trajectory, times) <= 1.0 - BETWEEN_LOOKS
        return held and self.motions.keeps_limits(trajectory)

    def _passing(self, polish: DeviationPolish, reached: Reached) -> Reached | None:
        """The motion that passes its places exactly; None where none is found.

        Between ends that move, what passes them in one duration may need another: programs come so near before that
        there is room in the limits for the last correction.
        """
        if self.passages is None:
            return reached
        if self.motions.moving:
            dearer = replace(polish, passages=replace(self.passages, price=DEARER))
            reached = dearer(reached.x, np.inf, MORE_PROGRAMS, reached.duration)
        for _ in range(AGREEING if self.motions.moving else 1):
            x = self.passages.exact(reached.x, reached.duration)
            if x is None or x is reached.x:
                return None if x is None else reached
            before, reached = reached.duration, polish.reached(x, 0.0, reached.duration)
            if reached.duration == before:
                break
        return reached
