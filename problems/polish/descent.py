"""The polish: from one motion to a better one that keeps clear, by one program after the other.

The rows of each program are linear in the control points and in the duration, around the motion that is known: limits
of speed, acceleration and jerk are linear in the first already, clearances are to first order, and so are torques. A
program pays for clearance that is missing, so that a motion through an obstacle is a beginning as good as any other.
The objective is linear as well where it is the duration, else convex and quadratic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import LinearProgram, Nearby, SingleRows, WholeRows, World, joined
from problems.limits import looks
from problems.polish.deviation import Deviations, JointRows, PostureRows
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.objective import PolishObjective, QuadraticModel
from problems.polish.passages import Passage, Passages
from problems.polish.settings import DEFAULT_POLISH, PolishSettings
from problems.polish.spline import AT_REST
from problems.sequential import JointTorques

ANGLE_ROUNDING = 1e-10  # rad
EXPRESSION_ROUNDING = 1e-10  # of the scale


@dataclass(frozen=True, eq=False, kw_only=True)
class Iterate:
    """A motion of the descent, which keeps the limits of its joints.

    Attributes:
        x: free control points, (free, k), rad.
        duration: the least that its joints' limits allow, or a longer one that is better, s.
        value: its objective, s.
        nearby: bodies that come near each other in its postures.
        expressions: values of expressions in its postures with their margins, (n, m), shares of their scales; at most 0
            where they are kept.
        passages: where it comes nearest to the places on its way.
        missing: the sum of the clearances that are missing, m, and, at the same price, of angles out of their ranges,
            of broken expressions and of missed places.
        cost: the merit of programs, s: the value and the price of what is missing.
        is_clear: whether every posture at a sample keeps at least a share of each margin.
    """

    x: FloatArray
    duration: float
    value: float
    nearby: Nearby
    expressions: FloatArray
    passages: list[Passage]
    missing: float
    cost: float
    is_clear: bool


class Linearisation(NamedTuple):
    """The parts of a program around an iterate that its promise needs again.

    Attributes:
        objective: to second order.
        expressions: rows of expressions; None where there are none.
        places: rows of the places on the way; None where there are none.
    """

    objective: QuadraticModel
    expressions: WholeRows | None
    places: WholeRows | None


@dataclass(frozen=True, eq=False, kw_only=True)
class DeviationPolish:
    """A descent over deviations by sequential programs, linear or convex and quadratic.

    Args:
        motions: among which the best is sought.
        objective: of these motions.
        world: the robot and its surroundings.
        proof_margin: clearance of obstacles and of own links on top of the margins, at samples, m, (2,).
        u: parameters of the samples, (n,).
        torques: of the robot; None where they are not limited.
        expressions: limits that are expressions; None where there are none.
        passages: places on the way; None where there are none.
        running_out: whether no time is left.
        stay: for how long the goal has to be clear after the arrival, s; it matters where obstacles move.
        limit_reserve: share of the limits of joints and motors that programs keep for later corrections.
        settings: of the descent.
    """

    motions: Deviations
    objective: PolishObjective
    world: World
    proof_margin: FloatArray
    u: FloatArray
    torques: JointTorques | None = None
    expressions: ExpressionLimits | None = None
    passages: Passages | None = None
    running_out: Callable[[], bool] = lambda: False
    stay: float = 0.0
    limit_reserve: float = 0.0
    settings: PolishSettings = DEFAULT_POLISH

    # The descent

    def __call__(
        self, x: FloatArray, to_beat: float = np.inf, programs: int | None = None, near: float | None = None
    ) -> Iterate:
        """The best motion that steps from a given one lead to.

        Args:
            x: its free control points, (free, k), rad.
            to_beat: objective of a motion that is known, s.
            programs: at most; those of the settings where None.
            near: its duration, s, if that matters; the direct motion's where None.
        """
        near = self.motions.direct.duration if near is None else near
        region, settings = self.settings.region, self.settings
        trust, idle = region.first, 0
        best = self.iterate(x, trust, near)
        for number in range(settings.programs if programs is None else programs):
            if self._is_done(best, number, to_beat) or self.running_out():
                break
            model = self._linearised(best, trust)
            step = self._program(best, trust, model).solved()
            if step is None:
                trust = region.rejected(trust)
                if trust < region.least:
                    break
                continue
            change, saved = step[0], -step[1]
            other = self._stepped(best.x + change, region.grown(trust), best.duration - saved)
            gain, promised = best.cost - other.cost, self._promised(best, change, saved, model)
            least_gain = settings.least_gain * abs(best.value)
            if gain > 0.0:
                idle = idle + 1 if gain < least_gain else 0
                trust = region.accepted(trust, gain / max(promised, gain, 1e-12))
                best = other
            else:
                trust = region.rejected(trust)
            least_promise = settings.least_gain * abs(best.value) * 0.1
            if idle == settings.patience or trust < region.least or promised < least_promise:
                break
        return best

    def _is_done(self, best: Iterate, number: int, to_beat: float) -> bool:
        """Whether a motion is as good as any, or hopeless, after a number of programs."""
        settings = self.settings
        if best.is_clear and best.value <= settings.at_bound * self.objective.bound:
            return True
        return number >= settings.hopeless_after and best.cost > settings.hopeless * to_beat

    def _stepped(self, x: FloatArray, trust: float, duration: float) -> Iterate:
        """The motion of control points, or of those near by that keep expressions, which bend away from a long step."""
        straight = self.iterate(x, trust, duration)
        if self.expressions is None or (straight.expressions[:, self.expressions.is_static] <= 0.0).all():
            return straight
        bent = self.iterate(self.projected(x), trust, duration)
        return bent if bent.cost < straight.cost else straight

    def projected(self, x: FloatArray) -> FloatArray:
        """Control points near given ones whose postures keep the expressions that depend on angles alone."""
        if self.expressions is None:
            return x
        theta = self.motions.postures(self.motions.parameters()).values(self.motions.padded(x))
        return x + self.motions.fit @ (self.expressions.projected(theta, self.expression_margin) - theta)

    def sampled_at(self, more: FloatArray) -> DeviationPolish:
        """The polish with samples at more parameters (m,)."""
        return replace(self, u=np.union1d(self.u, more))

    # Samples

    @cached_property
    def _waits(self) -> FloatArray:
        """Times after the arrival at which the goal is examined, (m,), s: none where obstacles stand still."""
        if not self.world.moves:
            return np.empty(0)
        return looks(self.stay) * self.stay if self.stay else np.zeros(1)

    @cached_property
    def _passed(self) -> FloatArray:
        """Parameters at which distances are examined, the goal's for each time there, (n + m,)."""
        return np.append(self.u, np.ones_like(self._waits))

    @cached_property
    def _postures(self) -> PostureRows:
        return self.motions.postures(self._passed)

    def _times(self, duration: float) -> FloatArray:
        """Times at which distances are examined in a motion of a duration in s, (n + m,), s."""
        return self._passed * duration + np.append(np.zeros_like(self.u), self._waits)

    @cached_property
    def _rates(self) -> tuple[PostureRows, ...]:
        """Speeds and accelerations where distances are examined; they matter where joints have tracking errors."""
        return tuple(self.motions.postures(self._passed, order) for order in (1, 2))

    def _errors(self, rates: Sequence[PostureRows], padded: FloatArray, duration: float) -> FloatArray | None:
        """Tracking errors of the joints at speeds and accelerations of a motion, (n, k)."""
        if self.world.is_exact:
            return None
        speed, acceleration = (part.values(padded) / duration**order for order, part in enumerate(rates, start=1))
        return self.world.errors(speed, acceleration)

    def _reach(self, trust: float) -> float:
        """The distance, about, by which a step brings anything nearer, m: what is farther is left out of a program."""
        return (2.0 if self.world.moves else 1.0) * self.settings.approach * trust

    def _longest_change(self, trust: float) -> float:
        """The most by which a program may change the duration, s: moving obstacles come no farther than joints do."""
        return self.settings.approach * trust / self.world.fastest if self.world.moves else np.inf

    @property
    def _repairs(self) -> FloatArray:
        """Parameters that have joined the usual ones, (m,)."""
        return np.setdiff1d(self.u, self.motions.parameters())

    @cached_property
    def _angles(self) -> JointRows:
        return self.motions.angles(self._repairs)

    @cached_property
    def _torque_states(self) -> tuple[PostureRows, ...]:
        """Postures and their derivatives where torques are examined."""
        u = np.union1d(self.motions.parameters(self.settings.torque_samples), self.motions.switches)
        return tuple(self.motions.postures(u, order) for order in range(3))

    @cached_property
    def _expression_states(self) -> tuple[PostureRows, ...]:
        """Postures and their derivatives where expressions are examined."""
        return tuple(self.motions.postures(self.u, order) for order in range(3))

    @cached_property
    def expression_margin(self) -> FloatArray:
        """The margin that is kept of each row of expressions at samples, of its scale, (m,)."""
        return (
            np.empty(0) if self.expressions is None else self.expressions.margins(self.motions.start, self.motions.goal)
        )

    def broken_between(self, x: FloatArray, duration: float) -> FloatArray:
        """Parameters (m,) between samples at which a motion breaks something, the worst ones."""
        settings, u = self.settings, self.motions.parameters(self.settings.proof_samples)
        least, padded = settings.proof_share * self.proof_margin.min(), self.motions.padded(x, duration)
        theta = self.motions.postures(u).values(padded)
        errors = self._errors([self.motions.postures(u, order) for order in (1, 2)], padded, duration)
        dips = [self._dips(self.world.rooms(theta, least, times=u * duration, errors=errors), least)]
        if self._ranges is not None:
            low, high = np.array(self.motions.limits.position).T
            dips.append(self._dips(np.minimum(theta - low, high - theta).min(axis=1), -ANGLE_ROUNDING))
        if self.expressions is not None:
            state = _state_of([self.motions.postures(u, order) for order in range(3)], padded, duration)
            margin = settings.expression_proof_share * self.expression_margin
            worst = (self.expressions.values(state) + margin).max(axis=1)
            dips.append(self._dips(-worst, -EXPRESSION_ROUNDING))
        return np.unique(u[np.concatenate(dips)])

    def _dips(self, values: FloatArray, least: float) -> NDArray[np.intp]:
        """The worst minima of values (n,) in a row that are below what is needed: their indices."""
        around = np.pad(values, 1, constant_values=np.inf)
        lowest = np.flatnonzero((values < least) & (values <= around[:-2]) & (values <= around[2:]))
        return lowest[np.argsort(values[lowest], kind="stable")[: self.settings.most_repairs]]

    # The iterate of control points

    def iterate(self, x: FloatArray, trust: float, near: float) -> Iterate:
        """The motion of free control points (free, k) in a time near one in s, and what comes near it.

        Args:
            x: control points.
            trust: how far they may move next.
            near: the duration that is wanted, where that may be chosen; where an end moves, one that is near this;
                where obstacles do, or programs keep a reserve, no less.
        """
        settings, duration = self.settings, self._duration(x, near)
        padded = self.motions.padded(x, duration)
        expressions = np.empty((0, 0))
        if self.expressions is not None:
            state = _state_of(self._expression_states, padded, duration)
            expressions = self.expressions.values(state) + self.expression_margin
        below, times = self.proof_margin.max() + self._reach(trust), self._times(duration)
        errors = self._errors(self._rates, padded, duration)
        nearby = self.world.nearby(self._postures.values(padded), below, times, errors)
        margins = self.proof_margin[nearby.own.astype(int)]
        lacking, outside = margins - nearby.rooms, self._outside(padded)
        share = 1.0 - settings.enough_margin
        is_clear = outside == 0.0 and bool((lacking <= share * margins).all())
        is_clear = is_clear and self.objective.in_time(duration)
        is_clear = is_clear and bool((expressions <= share * self.expression_margin + EXPRESSION_ROUNDING).all())
        missing = float(np.maximum(lacking, 0.0).sum()) + settings.range_price / settings.clearance_price * outside
        missing += settings.expression_price / settings.clearance_price * float(np.maximum(expressions, 0.0).sum())
        passages = [] if self.passages is None else self.passages.nearest(padded)
        if self.passages is not None:
            missing += self.passages.price / settings.clearance_price * self.passages.missing(passages)
        value = self.objective.value(x, duration)
        return Iterate(
            x=x, duration=duration, value=value, nearby=nearby, expressions=expressions, passages=passages,
            missing=missing, cost=value + settings.clearance_price * missing, is_clear=is_clear,
        )  # fmt: skip

    def _duration(self, x: FloatArray, near: float) -> float:
        """The duration of a motion of control points (free, k), near one in s, within all limits that time keeps."""
        matters = self.world.moves or self.limit_reserve > 0.0
        duration = self.motions.least_duration(x, near, near if matters else 0.0)
        padded = self.motions.padded(x, duration)
        if self.torques is not None:
            state = _state_of(self._torque_states, padded, duration)
            if np.abs(self.torques.shares(state)).max() > 1.0:
                duration *= max(1.0, self.torques.time_scale(state))
        if self.expressions is not None:
            state = _state_of(self._expression_states, padded, duration)
            duration *= max(1.0, self.expressions.time_scale(state))
        return self.objective.duration(duration, near)

    def _outside(self, padded: FloatArray) -> float:
        """The sum of the angles by which joints are out of their ranges, rad."""
        if self._ranges is None:
            return 0.0
        rows, (low, high) = self._angles, self._ranges
        angles = rows.values(padded)
        beyond = np.maximum(angles - high[rows.joint], low[rows.joint] - angles)
        return float(beyond[beyond > self.settings.range_tolerance].sum())

    @cached_property
    def _ranges(self) -> FloatArray | None:
        """Bounds of angles, (2, k), rad: a little within the joints' ranges, as far as the ends let it."""
        if self.motions.limits.position is None:
            return None
        settings, (low, high) = self.settings, np.array(self.motions.limits.position).T
        ends = np.stack([self.motions.start, self.motions.goal])
        inner = [
            np.clip(settings.inner_range * distance, 0.0, settings.most_inner_range)
            for distance in ((ends - low).min(axis=0), (high - ends).min(axis=0))
        ]
        return np.stack([low + inner[0], high - inner[1]])

    # Programs

    def _linearised(self, around: Iterate, trust: float) -> Linearisation:
        places = None if self.passages is None else self.passages.rows(around.passages)
        objective = self.objective.quadratic_model(around.x, around.duration)
        return Linearisation(objective, self._expression_rows(around, trust), places)

    def _program(self, around: Iterate, trust: float, model: Linearisation) -> LinearProgram:
        """The program around an iterate whose control points move by at most so many rad."""
        motions, longest = self.motions, self._longest_change(trust)
        faster, slower = (min(share, longest) for share in self.objective.duration_range(around.duration, trust))
        padded = motions.padded(around.x, around.duration)
        parts = [
            self._limit_rows(rows, (1.0 - self.limit_reserve) * bound, padded, around.duration, trust, faster)
            for rows, bound in zip(motions.limited, motions.limits.by_order, strict=True)
        ]
        parts += self._range_rows(padded, trust)
        box = np.full(around.x.shape, trust)
        least = max(-faster, motions.bound - around.duration - 1e-12)
        whole = [self._clearance_rows(around, trust), *self._torque_rows(padded, around.duration)]
        whole += [rows for rows in (model.expressions, model.places) if rows is not None]
        single, every = motions.with_ends(joined(parts)), motions.with_ends(joined(whole))
        squares = None if model.objective.squares is None else motions.with_ends(model.objective.squares)
        cost, time_cost = motions.cost_with_ends(model.objective.cost, model.objective.time_cost)
        return LinearProgram(single, every, -box, box, (least, slower), cost, time_cost, squares)

    def _promised(self, around: Iterate, change: FloatArray, saved: float, model: Linearisation) -> float:
        """The merit that a program promises to save, s, less the price of what it leaves missing itself."""
        near, moved = around.nearby, self._postures
        changed = self.motions.changed(change, -saved)
        by_joints = np.einsum(
            "ma,mak->mk", moved.weights[near.samples], changed[moved.first[near.samples][:, None] + np.arange(4)]
        )
        margins = self.proof_margin[near.own.astype(int)]
        left = margins - near.rooms - np.einsum("mk,mk->m", near.gradients, by_joints)
        left += near.rates * self._passed[near.samples] * saved
        gained = -model.objective.change(changed, -saved)
        gained += self.settings.clearance_price * (around.missing - float(np.maximum(left, 0.0).sum()))
        if model.expressions is not None:
            rows = model.expressions
            points = changed[rows.first[:, None] + AT_REST + np.arange(4)]
            values = np.einsum("mak,mak->m", rows.weights, points) - rows.by_time * saved
            gained -= self.settings.expression_price * float(np.maximum(values - rows.bound, 0.0).sum())
        if self.passages is not None and model.places is not None:
            gained -= self.passages.price * self.passages.left(model.places, changed)
        return gained

    def _limit_rows(
        self, rows: JointRows, bound: FloatArray, padded: FloatArray, duration: float, trust: float, faster: float
    ) -> SingleRows:
        """Rows of both sides of the limit of one derivative, as shares of it, as far as they may matter."""
        scale = bound[rows.joint] * duration**rows.order
        shares, weights = rows.values(padded) / scale, rows.weights / scale[:, None]
        reach = np.abs(weights).sum(axis=1) * trust + rows.order * faster / duration
        parts = []
        for sign in (1.0, -1.0):
            chosen = np.flatnonzero(1.0 - sign * shares < reach)
            by_time = np.full(chosen.size, -rows.order / duration)
            first, left = rows.first[chosen] - AT_REST, 1.0 - sign * shares[chosen]
            parts.append(SingleRows(rows.joint[chosen], first, sign * weights[chosen], by_time, left))
        return joined(parts)

    def _range_rows(self, padded: FloatArray, trust: float) -> list[SingleRows]:
        """Rows of the joints' ranges, where they may matter."""
        if self._ranges is None:
            return []
        rows, (low, high) = self._angles, self._ranges
        tighter = np.zeros(len(rows.joint))
        tighter[len(rows.joint) - self.motions.dof * self._repairs.size :] = self.settings.repaired_range
        angles, reach = rows.values(padded), np.abs(rows.weights).sum(axis=1) * trust
        parts = []
        for sign, left in ((1.0, high[rows.joint] - angles - tighter), (-1.0, angles - low[rows.joint] - tighter)):
            chosen = np.flatnonzero((left < reach) & (rows.weights.any(axis=1)))
            first = rows.first[chosen] - AT_REST
            most = np.maximum(left[chosen], -self.settings.range_recovery * reach[chosen])
            weights = sign * rows.weights[chosen]
            parts.append(SingleRows(rows.joint[chosen], first, weights, np.zeros(chosen.size), most))
        return parts

    def _clearance_rows(self, around: Iterate, trust: float) -> WholeRows:
        """Rows of the clearances of bodies that come near."""
        near, rows = around.nearby, self._postures
        left = near.rooms - self.proof_margin[near.own.astype(int)]
        reach = np.abs(near.gradients).sum(axis=1) * trust
        if self.world.moves:
            reach += np.abs(near.rates) * self._longest_change(trust)
        chosen = np.flatnonzero(left < reach)
        sample, price = near.samples[chosen], np.full(chosen.size, self.settings.clearance_price)
        weights = -rows.weights[sample][:, :, None] * near.gradients[chosen][:, None, :]
        by_time = -near.rates[chosen] * self._passed[sample]
        return WholeRows(rows.first[sample] - AT_REST, weights, by_time, left[chosen], price)

    def _torque_rows(self, padded: FloatArray, duration: float) -> list[WholeRows]:
        """Rows of torques as shares of their limits where they are large, if one is nearly too large somewhere."""
        if self.torques is None:
            return []
        state = _state_of(self._torque_states, padded, duration)
        shares = self.torques.shares(state)
        if np.abs(shares).max() < self.settings.torque_threshold:
            return []
        sample, joint = np.nonzero(np.abs(shares) > self.settings.large_torque)
        used, place = np.unique(sample, return_inverse=True)
        slopes = self.torques.slopes(state[used])[place, joint] * np.sign(shares[sample, joint])[:, None, None]
        weights, by_time = _slopes_of(self._torque_states, sample, slopes, state, duration)
        left = 1.0 - self.limit_reserve - np.abs(shares[sample, joint])
        first, price = self._torque_states[0].first[sample] - AT_REST, self.settings.torque_price
        return [WholeRows(first, weights, by_time, left, np.full(len(sample), price))]

    def _expression_rows(self, around: Iterate, trust: float) -> WholeRows | None:
        """Rows of expressions to first order, where they may matter."""
        if self.expressions is None:
            return None
        padded = self.motions.padded(around.x, around.duration)
        state = _state_of(self._expression_states, padded, around.duration)
        _, slopes = self.expressions.linear(state)
        by_angles = np.abs(slopes[:, :, 0]).sum(axis=2) * trust
        reach = np.where(self.expressions.is_static, by_angles, self.settings.expression_threshold)
        sample, row = np.nonzero(-around.expressions < reach)
        weights, by_time = _slopes_of(self._expression_states, sample, slopes[sample, row], state, around.duration)
        first = self._expression_states[0].first[sample] - AT_REST
        price = np.full(sample.size, self.settings.expression_price)
        return WholeRows(first, weights, by_time, -around.expressions[sample, row], price)


def _state_of(states: Sequence[PostureRows], padded: FloatArray, duration: float) -> FloatArray:
    """Angles, velocities and accelerations in some postures, (n, 3 k)."""
    return np.concatenate([part.values(padded) / duration**order for order, part in enumerate(states)], axis=1)


def _slopes_of(
    states: Sequence[PostureRows], sample: NDArray[np.intp], slopes: FloatArray, state: FloatArray, duration: float
) -> tuple[FloatArray, FloatArray]:
    """Slopes by control points, (m, 4, k), and by the duration, (m,), of values with slopes (m, 3, k) by the state.

    Args:
        states: postures and their derivatives.
        sample: in which of the postures, (m,).
        slopes: by angles, velocities and accelerations.
        state: of all postures, (n, 3 k).
        duration: of the motion, s.
    """
    k = slopes.shape[2]
    by_points, by_time = np.zeros((len(sample), 4, k)), np.zeros(len(sample))
    for order, part in enumerate(states):
        by_points += part.weights[sample][:, :, None] * (slopes[:, order] / duration**order)[:, None, :]
        change = -order / duration * state[sample, order * k : (order + 1) * k]
        by_time += np.einsum("mk,mk->m", slopes[:, order], change)
    return by_points, by_time
