"""The polish: from one motion to a better one that keeps clear, by one program after the other.

The rows of each program are linear in the control points and in the duration, around the motion that is known: limits
of speed, acceleration and jerk are linear in the first already, clearances are to first order, and so are torques. It
pays for clearance that is missing, so that a motion through an obstacle is a beginning as good as any other. What is
minimised is linear as well where that is the duration, else convex and quadratic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import LinearProgram, Nearby, SingleRows, WholeRows, World, joined
from problems.limits import looks
from problems.polish.deviation import Deviations, JointRows, PostureRows
from problems.polish.minimised import Minimised, Nearly
from problems.polish.own_limits import OwnLimits
from problems.polish.passages import Passage, Passages
from problems.polish.spline import AT_REST
from problems.sequential import JointTorques

CLEARANCE_PRICE = 30.0  # s/m: what a program pays for clearance that is missing
FIRST_TRUST, LEAST_TRUST, LARGEST_TRUST = 0.25, 2e-3, 0.4  # rad, how far a control point may move
GROWS, SHRINKS = 2.0, 0.35
GOOD, POOR = 0.6, 0.15  # shares of the promised gain
PROGRAMS = 25
LEAST_GAIN, PATIENCE = 3e-4, 2  # of the duration; and how many programs may gain less
AT_BOUND = 1.0005
HOPELESS = 1.3  # of a duration that is known, after a few programs
HOPELESS_AFTER = 5
CLOSER = 0.35  # m/rad: what is looked at comes no farther than that beyond what is kept, of the trust region
ENOUGH = 0.5  # of what is to be spare: a motion that keeps so much is clear
TORQUE_PRICE = 3.0  # s: what a program pays for a torque beyond its limit, of that
TORQUE_SAMPLES = 2  # in each piece, at which torques are looked at, besides where accelerations are extreme
NEARLY, LARGE = 0.9, 0.5  # shares of limits of torques: from where on they matter, and where they are then looked at
FINE = 48  # postures in each piece that are looked at when a motion is made
NEEDED = 0.25  # of what is to be spare: what less than that is left of between two postures is mended
MOST_MORE = 24  # postures that are looked at besides, at a time
INNER = 0.5  # of what the ends leave of joints' ranges, kept in between
MOST_INNER = 0.01  # rad
ROUNDING = 1e-10  # rad
TIGHTER = 3e-5  # rad, of ranges where one was broken between postures that were looked at
OUT_OF_RANGE = 1e-5  # rad, of a range that is a little smaller than the joint's
MENDING = 0.5  # of what a step can reach: so much of what a joint is out of its range has to be mended
RANGE_PRICE = 3.0  # s/rad: what a motion pays that leaves the range
OWN_PRICE = 3.0  # s: what a program pays for an own limit that is broken, of its scale
OWN_NEAR = 0.5  # of the scale: what depends on how fast a motion is matters from there on
OWN_ROUNDING = 1e-10  # of the scale
OWN_NEEDED = 0.25  # of what is kept of own limits: less than that between two postures is mended


@dataclass(frozen=True, eq=False)
class Reached:
    """A motion that keeps the limits of its joints.

    Attributes:
        x: free control points, (free, k), rad.
        duration: the least that its joints' limits allow, or a longer one that is better, s.
        value: what is minimised, s.
        near: what comes near in its postures.
        own: own limits in its postures, and by how much of what is kept there they miss it, (n, m), of the scale.
        passages: where it comes nearest to the places on its way.
        missing: the sum of the clearances that are missing, m, and, as dear, of what joints are out of their ranges,
            of own limits that are broken and of places that are missed.
        is_clear: whether no posture that is looked at lacks more than a share of what is spare.
    """

    x: FloatArray
    duration: float
    value: float
    near: Nearby
    own: FloatArray
    passages: list[Passage]
    missing: float
    is_clear: bool

    @property
    def cost(self) -> float:
        """What programs minimise, s."""
        return self.value + CLEARANCE_PRICE * self.missing

    def better_than(self, other: Reached) -> bool:
        """Clear, and worth less."""
        return (not self.is_clear, self.cost) < (not other.is_clear, other.cost)


@dataclass(frozen=True, eq=False)
class DeviationPolish:
    """Sequential programs, linear or convex and quadratic.

    Args:
        motions: among which the best is sought.
        minimised: of them.
        world: what is around, and the robot.
        spare: kept of obstacles and of each other on top of what must be, where postures are looked at, m, (2,).
        u: parameters of these postures, (n,).
        stay: for how long the goal has to be clear after the arrival, s; it matters where obstacles move.
        torques: of the robot; None where they are not limited.
        own: limits that are expressions; None where there are none.
        passages: places on the way; None where there are none.
        running_out: whether there is no time left.
        reserve: share of the limits of joints and motors that programs keep for what comes after them.
    """

    motions: Deviations
    minimised: Minimised
    world: World
    spare: FloatArray
    u: FloatArray
    torques: JointTorques | None = None
    own: OwnLimits | None = None
    passages: Passages | None = None
    running_out: Callable[[], bool] = lambda: False
    stay: float = 0.0
    reserve: float = 0.0

    @cached_property
    def _since(self) -> FloatArray:
        """How long after the arrival the goal is looked at, (m,), s: where obstacles stand still, not at all."""
        if not self.world.moves:
            return np.empty(0)
        return looks(self.stay) * self.stay if self.stay else np.zeros(1)

    @cached_property
    def _postures(self) -> PostureRows:
        return self.motions.postures(self._passed)

    @cached_property
    def _passed(self) -> FloatArray:
        """Parameters at which distances are looked at, the goal's for each time there, (n + m,)."""
        return np.append(self.u, np.ones_like(self._since))

    def _times(self, duration: float) -> FloatArray:
        """When that is, of a motion that takes so many s: (n + m,), s."""
        return self._passed * duration + np.append(np.zeros_like(self.u), self._since)

    @cached_property
    def _rates(self) -> tuple[PostureRows, ...]:
        """Speeds and accelerations where distances are looked at; they matter where joints are off."""
        return tuple(self.motions.postures(self._passed, order) for order in (1, 2))

    def _errors(self, rates: Sequence[PostureRows], padded: FloatArray, duration: float) -> FloatArray | None:
        """How far joints may be off at speeds and accelerations of a motion, (n, k)."""
        if self.world.is_exact:
            return None
        speed, acceleration = (part.values(padded) / duration**order for order, part in enumerate(rates, start=1))
        return self.world.errors(speed, acceleration)

    def reach(self, trust: float) -> float:
        """How far a step brings anything nearer, about, m: of what is farther nothing is said in a program."""
        return (2.0 if self.world.moves else 1.0) * CLOSER * trust

    def _longest(self, trust: float) -> float:
        """By how much a program may change the duration, s: obstacles that move come no farther than joints do."""
        return CLOSER * trust / self.world.fastest if self.world.moves else np.inf

    @cached_property
    def _angles(self) -> JointRows:
        return self.motions.angles(self._more)

    @property
    def _more(self) -> FloatArray:
        """Parameters that have joined those of the beginning, (m,)."""
        return np.setdiff1d(self.u, self.motions.parameters())

    @cached_property
    def _moving(self) -> tuple[PostureRows, ...]:
        """Postures and their derivatives where torques are looked at."""
        u = np.union1d(self.motions.parameters(TORQUE_SAMPLES), self.motions.switches)
        return tuple(self.motions.postures(u, order) for order in range(3))

    @cached_property
    def _own_moving(self) -> tuple[PostureRows, ...]:
        """The postures that are looked at, and their derivatives, for own limits."""
        return tuple(self.motions.postures(self.u, order) for order in range(3))

    @cached_property
    def own_spare(self) -> FloatArray:
        """What is kept of each own limit where postures are looked at, of its scale, (m,)."""
        return np.empty(0) if self.own is None else self.own.spare(self.motions.start, self.motions.goal)

    def __call__(
        self, x: FloatArray, to_beat: float = np.inf, programs: int = PROGRAMS, near: float | None = None
    ) -> Reached:
        """The best that steps from a motion lead to.

        Args:
            x: its free control points, (free, k), rad.
            to_beat: duration of a motion that is known, s.
            programs: at most.
            near: its duration, s, if that matters; the direct motion's where None.
        """
        near = self.motions.direct.duration if near is None else near
        best, trust, idle = self.reached(x, FIRST_TRUST, near), FIRST_TRUST, 0
        for number in range(programs):
            if self._done(best, number, to_beat) or self.running_out():
                break
            own, passed = self._own_rows(best, trust), self._passed_rows(best)
            nearly = self.minimised.nearly(best.x, best.duration)
            step = self._program(best, trust, nearly, own, passed).solved()
            if step is None:
                trust *= SHRINKS
                if trust < LEAST_TRUST:
                    break
                continue
            change, saved = step[0], -step[1]
            other = self._stepped(best.x + change, min(GROWS * trust, LARGEST_TRUST), best.duration - saved)
            gain, promised = best.cost - other.cost, self._promised(best, change, saved, nearly, own, passed)
            if gain > 0.0:
                share = gain / max(promised, gain, 1e-12)
                idle = idle + 1 if gain < LEAST_GAIN * abs(best.value) else 0
                trust = min(trust * (GROWS if share > GOOD else SHRINKS if share < POOR else 1.0), LARGEST_TRUST)
                best = other
            else:
                trust *= SHRINKS
            if idle == PATIENCE or trust < LEAST_TRUST or promised < LEAST_GAIN * abs(best.value) * 0.1:
                break
        return best

    def _stepped(self, x: FloatArray, trust: float, duration: float) -> Reached:
        """The motion of control points, or of those near by that keep own limits, which bend away from a long step."""
        found = self.reached(x, trust, duration)
        if self.own is None or (found.own[:, self.own.is_static] <= 0.0).all():
            return found
        other = self.reached(self.kept(x), trust, duration)
        return other if other.cost < found.cost else found

    def kept(self, x: FloatArray) -> FloatArray:
        """Control points near some whose postures keep what own limits say of angles."""
        if self.own is None:
            return x
        theta = self.motions.postures(self.motions.parameters()).values(self.motions.padded(x))
        return x + self.motions.fit @ (self.own.projected(theta, self.own_spare) - theta)

    def _done(self, best: Reached, number: int, to_beat: float) -> bool:
        if best.is_clear and best.value <= AT_BOUND * self.minimised.bound:
            return True
        return number >= HOPELESS_AFTER and best.cost > HOPELESS * to_beat

    def between(self, x: FloatArray, duration: float) -> FloatArray:
        """Where a motion breaks something between the postures that are looked at: parameters (m,), the worst ones."""
        u, least = self.motions.parameters(FINE), NEEDED * self.spare.min()
        padded = self.motions.padded(x, duration)
        theta = self.motions.postures(u).values(padded)
        errors = self._errors([self.motions.postures(u, order) for order in (1, 2)], padded, duration)
        found = [_dips(self.world.rooms(theta, least, times=u * duration, errors=errors), least)]
        if self._ranges is not None:
            low, high = np.array(self.motions.limits.position).T
            found.append(_dips(np.minimum(theta - low, high - theta).min(axis=1), -ROUNDING))
        if self.own is not None:
            state = _state_of([self.motions.postures(u, order) for order in range(3)], padded, duration)
            kept = OWN_NEEDED * self.own_spare
            found.append(_dips(-(self.own.values(state) + kept).max(axis=1), -OWN_ROUNDING))
        return np.unique(u[np.concatenate(found)])

    def looking_at(self, more: FloatArray) -> DeviationPolish:
        """The same that looks at more postures, at parameters (m,)."""
        return replace(self, u=np.union1d(self.u, more))

    def reached(self, x: FloatArray, trust: float, near: float) -> Reached:
        """The motion of free control points (free, k) in a time near one in s, and what comes near it.

        Args:
            x: control points.
            trust: how far they may move next.
            near: the duration that is wanted, where that may be chosen; where an end moves, one that is near this;
                where obstacles do, or programs keep a reserve, no less.
        """
        matters = self.world.moves or self.reserve > 0.0
        duration = self.motions.least_duration(x, near, near if matters else 0.0)
        padded = self.motions.padded(x, duration)
        if self.torques is not None:
            state = self._state(padded, duration)
            if np.abs(self.torques.shares(state)).max() > 1.0:
                duration *= max(1.0, self.torques.time_scale(state))
        own = np.empty((0, 0))
        if self.own is not None:
            duration *= max(1.0, self.own.time_scale(_state_of(self._own_moving, padded, duration)))
        duration = self.minimised.duration(duration, near)
        padded = self.motions.padded(x, duration)
        if self.own is not None:
            own = self.own.values(_state_of(self._own_moving, padded, duration)) + self.own_spare
        below, times = self.spare.max() + self.reach(trust), self._times(duration)
        errors = self._errors(self._rates, padded, duration)
        nearby = self.world.nearby(self._postures.values(padded), below, times, errors)
        kept = self.spare[nearby.own.astype(int)]
        lacking, outside = kept - nearby.rooms, self._outside(padded)
        is_clear = outside == 0.0 and bool((lacking <= (1.0 - ENOUGH) * kept).all())
        is_clear = is_clear and self.minimised.in_time(duration)
        is_clear = is_clear and bool((own <= (1.0 - ENOUGH) * self.own_spare + OWN_ROUNDING).all())
        missing = float(np.maximum(lacking, 0.0).sum()) + RANGE_PRICE / CLEARANCE_PRICE * outside
        missing += OWN_PRICE / CLEARANCE_PRICE * float(np.maximum(own, 0.0).sum())
        passages = [] if self.passages is None else self.passages.nearest(padded)
        if self.passages is not None:
            missing += self.passages.price / CLEARANCE_PRICE * self.passages.missing(passages)
        return Reached(x, duration, self.minimised.value(x, duration), nearby, own, passages, missing, is_clear)

    def _outside(self, padded: FloatArray) -> float:
        """By how much angles are out of the joints' ranges, together, rad."""
        if self._ranges is None:
            return 0.0
        rows, (low, high) = self._angles, self._ranges
        angles = rows.values(padded)
        beyond = np.maximum(angles - high[rows.joint], low[rows.joint] - angles)
        return float(beyond[beyond > OUT_OF_RANGE].sum())

    def _state(self, padded: FloatArray, duration: float) -> FloatArray:
        """Angles, velocities and accelerations where torques are looked at, (n, 3 k)."""
        return _state_of(self._moving, padded, duration)

    def _promised(
        self,
        around: Reached,
        change: FloatArray,
        saved: float,
        nearly: Nearly,
        own: WholeRows | None,
        passed: WholeRows | None,
    ) -> float:
        """What a program promises to save, s, with what it leaves missing itself: clearance, own limits, places."""
        near = around.near
        moved = self._postures
        by_joints = np.einsum(
            "ma,mak->mk", moved.weights[near.samples],
            self.motions.changed(change, -saved)[moved.first[near.samples][:, None] + np.arange(4)],
        )  # fmt: skip
        left = self.spare[near.own.astype(int)] - near.rooms - np.einsum("mk,mk->m", near.gradients, by_joints)
        left += near.rates * self._passed[near.samples] * saved
        gained = -nearly.change(self.motions.changed(change, -saved), -saved)
        gained += CLEARANCE_PRICE * (around.missing - float(np.maximum(left, 0.0).sum()))
        if own is not None:
            padded = self.motions.changed(change, -saved)[own.first[:, None] + AT_REST + np.arange(4)]
            moved = np.einsum("mak,mak->m", own.weights, padded) - own.by_time * saved
            gained -= OWN_PRICE * float(np.maximum(moved - own.bound, 0.0).sum())
        if self.passages is not None and passed is not None:
            gained -= self.passages.price * self.passages.left(passed, self.motions.changed(change, -saved))
        return gained

    def _program(
        self, around: Reached, trust: float, nearly: Nearly, own: WholeRows | None, passed: WholeRows | None
    ) -> LinearProgram:
        motions, longest = self.motions, self._longest(trust)
        faster, slower = (min(share, longest) for share in self.minimised.reach(around.duration, trust))
        padded = motions.padded(around.x, around.duration)
        parts = [
            self._limit(rows, (1.0 - self.reserve) * bound, padded, around.duration, trust, faster)
            for rows, bound in zip(motions.limited, motions.limits.by_order, strict=True)
        ]
        parts += self._range(padded, trust)
        box = np.full(around.x.shape, trust)
        least = max(-faster, motions.bound - around.duration - 1e-12)
        whole = [self._clearances(around, trust), *self._torques(padded, around.duration)]
        whole += [rows for rows in (own, passed) if rows is not None]
        single, every = motions.with_ends(joined(parts)), motions.with_ends(joined(whole))
        squares = None if nearly.squares is None else motions.with_ends(nearly.squares)
        cost, time_cost = motions.cost_with_ends(nearly.cost, nearly.time_cost)
        return LinearProgram(single, every, -box, box, (least, slower), cost, time_cost, squares)

    def _limit(
        self, rows: JointRows, bound: FloatArray, padded: FloatArray, duration: float, trust: float, faster: float
    ) -> SingleRows:
        """Both sides of the limit of one derivative, as shares of it, as far as they may matter."""
        scale = bound[rows.joint] * duration**rows.order
        shares, own = rows.values(padded) / scale, rows.weights / scale[:, None]
        reach = np.abs(own).sum(axis=1) * trust + rows.order * faster / duration
        parts = []
        for sign in (1.0, -1.0):
            kept = np.flatnonzero(1.0 - sign * shares < reach)
            by_time = np.full(kept.size, -rows.order / duration)
            first, left = rows.first[kept] - AT_REST, 1.0 - sign * shares[kept]
            parts.append(SingleRows(rows.joint[kept], first, sign * own[kept], by_time, left))
        return joined(parts)

    @cached_property
    def _ranges(self) -> FloatArray | None:
        """Bounds of angles, (2, k), rad: a little within the joints' ranges, as far as the ends let it."""
        if self.motions.limits.position is None:
            return None
        low, high = np.array(self.motions.limits.position).T
        ends = np.stack([self.motions.start, self.motions.goal])
        inner = [
            np.clip(INNER * room, 0.0, MOST_INNER) for room in ((ends - low).min(axis=0), (high - ends).min(axis=0))
        ]
        return np.stack([low + inner[0], high - inner[1]])

    def _range(self, padded: FloatArray, trust: float) -> list[SingleRows]:
        """The joints' ranges, where they may matter."""
        if self._ranges is None:
            return []
        rows, (low, high) = self._angles, self._ranges
        tighter = np.zeros(len(rows.joint))
        tighter[len(rows.joint) - self.motions.dof * self._more.size :] = TIGHTER
        angles, reach = rows.values(padded), np.abs(rows.weights).sum(axis=1) * trust
        parts = []
        for sign, left in ((1.0, high[rows.joint] - angles - tighter), (-1.0, angles - low[rows.joint] - tighter)):
            kept = np.flatnonzero((left < reach) & (rows.weights.any(axis=1)))
            first, most = rows.first[kept] - AT_REST, np.maximum(left[kept], -MENDING * reach[kept])
            parts.append(SingleRows(rows.joint[kept], first, sign * rows.weights[kept], np.zeros(kept.size), most))
        return parts

    def _clearances(self, around: Reached, trust: float) -> WholeRows:
        """What must be kept of what comes near."""
        near, rows = around.near, self._postures
        left = near.rooms - self.spare[near.own.astype(int)]
        reach = np.abs(near.gradients).sum(axis=1) * trust
        if self.world.moves:
            reach += np.abs(near.rates) * self._longest(trust)
        kept = np.flatnonzero(left < reach)
        sample = near.samples[kept]
        own = -rows.weights[sample][:, :, None] * near.gradients[kept][:, None, :]
        by_time = -near.rates[kept] * self._passed[sample]
        return WholeRows(rows.first[sample] - AT_REST, own, by_time, left[kept], np.full(kept.size, CLEARANCE_PRICE))

    def _torques(self, padded: FloatArray, duration: float) -> list[WholeRows]:
        """Torques as shares of their limits where they are large, if they are somewhere nearly too large."""
        if self.torques is None:
            return []
        state = self._state(padded, duration)
        shares = self.torques.shares(state)
        if np.abs(shares).max() < NEARLY:
            return []
        sample, joint = np.nonzero(np.abs(shares) > LARGE)
        used, place = np.unique(sample, return_inverse=True)
        slopes = self.torques.slopes(state[used])[place, joint] * np.sign(shares[sample, joint])[:, None, None]
        own, by_time = _slopes_of(self._moving, sample, slopes, state, duration)
        left = 1.0 - self.reserve - np.abs(shares[sample, joint])
        first = self._moving[0].first[sample] - AT_REST
        return [WholeRows(first, own, by_time, left, np.full(len(sample), TORQUE_PRICE))]

    def _passed_rows(self, around: Reached) -> WholeRows | None:
        """The places on the way to first order."""
        return None if self.passages is None else self.passages.rows(around.passages)

    def _own_rows(self, around: Reached, trust: float) -> WholeRows | None:
        """Own limits to first order, where they may matter."""
        if self.own is None:
            return None
        padded = self.motions.padded(around.x, around.duration)
        state = _state_of(self._own_moving, padded, around.duration)
        _, slopes = self.own.linear(state)
        reach = np.where(self.own.is_static, np.abs(slopes[:, :, 0]).sum(axis=2) * trust, OWN_NEAR)
        sample, row = np.nonzero(-around.own < reach)
        own, by_time = _slopes_of(self._own_moving, sample, slopes[sample, row], state, around.duration)
        first, price = self._own_moving[0].first[sample] - AT_REST, np.full(sample.size, OWN_PRICE)
        return WholeRows(first, own, by_time, -around.own[sample, row], price)


def _state_of(moving: Sequence[PostureRows], padded: FloatArray, duration: float) -> FloatArray:
    """Angles, velocities and accelerations in some postures, (n, 3 k)."""
    return np.concatenate([part.values(padded) / duration**order for order, part in enumerate(moving)], axis=1)


def _slopes_of(
    moving: Sequence[PostureRows], sample: NDArray[np.intp], slopes: FloatArray, state: FloatArray, duration: float
) -> tuple[FloatArray, FloatArray]:
    """By control points, (m, 4, k), and by the duration, (m,), of what changes with the state by slopes (m, 3, k).

    Args:
        moving: postures and their derivatives.
        sample: in which of the postures, (m,).
        slopes: by angles, velocities and accelerations.
        state: of all postures, (n, 3 k).
        duration: of the motion, s.
    """
    k = slopes.shape[2]
    by_points, by_time = np.zeros((len(sample), 4, k)), np.zeros(len(sample))
    for order, part in enumerate(moving):
        by_points += part.weights[sample][:, :, None] * (slopes[:, order] / duration**order)[:, None, :]
        change = -order / duration * state[sample, order * k : (order + 1) * k]
        by_time += np.einsum("mk,mk->m", slopes[:, order], change)
    return by_points, by_time


def _dips(values: FloatArray, least: float) -> NDArray[np.intp]:
    """Where values (n,) are lowest for a while, and below what is needed: the worst of them."""
    around = np.pad(values, 1, constant_values=np.inf)
    lowest = np.flatnonzero((values < least) & (values <= around[:-2]) & (values <= around[2:]))
    return lowest[np.argsort(values[lowest], kind="stable")[:MOST_MORE]]
