"""The descent of the polish: each program leads from a motion to a better one that keeps clear.

The rows of each program are linear in the control points and in the duration, around the motion that is known: limits
of speed, acceleration and jerk are linear in the first already, clearances are to first order, and so are torques. A
program pays for clearance that is missing, so that a motion through an obstacle is a beginning as good as any other.
The objective is linear as well where it is the duration, else convex and quadratic.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import LinearProgram, Nearby, SingleRows, Step, WholeRows, stacked
from problems.polish.deviation import Deviations, JointRows
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.objective import PolishObjective, QuadraticModel
from problems.polish.passages import Passage, Passages
from problems.polish.samples import PolishSamples, slopes_of, state_of
from problems.polish.settings import DEFAULT_POLISH, PolishSettings
from problems.polish.torques import JointTorques
from problems.worlds import World

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
        merit: lowered by programs, s: the value and the price of all that is missing.
        is_clear: whether every posture at a sample keeps at least a share of each margin.
    """

    x: FloatArray
    duration: float
    value: float
    nearby: Nearby
    expressions: FloatArray
    passages: list[Passage]
    missing: float
    merit: float
    is_clear: bool


class Linearisation(NamedTuple):
    """The parts of a program around an iterate that its promise needs again.

    Attributes:
        objective: to second order.
        torques: rows of torques; None where none is large.
        expressions: rows of expressions; None where there are none.
        places: rows of the places on the way; None where there are none.
    """

    objective: QuadraticModel
    torques: WholeRows | None
    expressions: WholeRows | None
    places: WholeRows | None


@dataclass(frozen=True, eq=False, kw_only=True)
class DeviationPolish:
    """A descent over deviations by sequential programs, linear or convex and quadratic.

    Args:
        samples: of the motions among which the best is sought.
        objective: of these motions.
        proof_margin: clearance of obstacles and of own links on top of the margins, at samples, m, (2,).
        torques: of the robot; None where they are not limited.
        expressions: limits that are expressions; None where there are none.
        passages: places on the way; None where there are none.
        running_out: whether no time is left.
        limit_reserve: share of the limits of joints and motors that programs keep for later corrections.
        settings: of the descent.
    """

    samples: PolishSamples
    objective: PolishObjective
    proof_margin: FloatArray
    torques: JointTorques | None = None
    expressions: ExpressionLimits | None = None
    passages: Passages | None = None
    running_out: Callable[[], bool] = lambda: False
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
        settings, region = self.settings, self.settings.region

        def is_done(best: Iterate, number: int) -> bool:
            at_bound = best.is_clear and best.value <= settings.at_bound * self.objective.bound
            is_hopeless = number >= settings.hopeless_after and best.merit > settings.hopeless * to_beat
            return at_bound or is_hopeless or self.running_out()

        start = self.iterate(x, region.first, self.motions.direct.duration if near is None else near)
        return region.descent(start, settings.programs if programs is None else programs, self._step, is_done)

    def _step(self, around: Iterate, trust: float) -> Step[Iterate] | None:
        """The motion to which the program around one leads; None where it has no solution."""
        model = self._linearised(around, trust)
        solution = self._program(around, trust, model).solved()
        if solution is None:
            return None
        change, saved = solution[0], -solution[1]
        motion = self._bent(around.x + change, self.settings.region.grown(trust), around.duration - saved)
        return Step(motion, self._promised(around, change, saved, model))

    def _bent(self, x: FloatArray, trust: float, duration: float) -> Iterate:
        """The motion of control points, or of those near by that keep expressions, which bend away from a long step."""
        straight = self.iterate(x, trust, duration)
        if self.expressions is None or (straight.expressions[:, self.expressions.is_static] <= 0.0).all():
            return straight
        bent = self.iterate(self.projected(x), trust, duration)
        return bent if bent.merit < straight.merit else straight

    def projected(self, x: FloatArray) -> FloatArray:
        """Control points near given ones whose postures keep the expressions that depend on angles alone."""
        if self.expressions is None:
            return x
        theta = self.motions.postures(self.motions.parameters()).values(self.motions.padded(x))
        return x + self.motions.fit @ (self.expressions.projected(theta, self.expression_margin) - theta)

    def sampled_at(self, more: FloatArray) -> DeviationPolish:
        """The polish with samples at more parameters (m,)."""
        return replace(self, samples=self.samples.joined(more))

    @property
    def motions(self) -> Deviations:
        """The motions among which the best is sought."""
        return self.samples.motions

    @property
    def world(self) -> World:
        """The robot and its surroundings."""
        return self.samples.world

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
        errors = self.samples.errors([self.motions.postures(u, order) for order in (1, 2)], padded, duration)
        dips = [self._dips(self.world.clearance_margins(theta, least, times=u * duration, errors=errors), least)]
        if self.samples.ranges is not None:
            low, high = np.array(self.motions.limits.position).T
            dips.append(self._dips(np.minimum(theta - low, high - theta).min(axis=1), -ANGLE_ROUNDING))
        if self.expressions is not None:
            state = state_of([self.motions.postures(u, order) for order in range(3)], padded, duration)
            margin = settings.expression_proof_share * self.expression_margin
            worst = (self.expressions.values(state) + margin).max(axis=1)
            dips.append(self._dips(-worst, -EXPRESSION_ROUNDING))
        return np.unique(u[np.concatenate(dips)])

    def overloaded_between(self, x: FloatArray, duration: float) -> FloatArray:
        """Parameters (m,) between samples at which a motion takes larger torques than there are, the worst ones."""
        if self.torques is None:
            return np.empty(0)
        u, padded = self.motions.parameters(self.settings.proof_samples), self.motions.padded(x, duration)
        state = state_of([self.motions.postures(u, order) for order in range(3)], padded, duration)
        left = 1.0 - np.abs(self.torques.shares(state)).max(axis=1)
        return u[np.sort(self._dips(left, -self.settings.torque_tolerance))]

    def _dips(self, values: FloatArray, least: float) -> NDArray[np.intp]:
        """Indices of the deepest local minima of values (n,) in a row below a needed one."""
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
            state = state_of(self.samples.expression_states, padded, duration)
            expressions = self.expressions.values(state) + self.expression_margin
        below, times = self.proof_margin.max() + self.samples.reach(trust), self.samples.times(duration)
        errors = self.samples.errors(self.samples.rates, padded, duration)
        nearby = self.world.nearby(self.samples.postures.values(padded), below, times, errors)
        margins = self.proof_margin[nearby.is_link.astype(int)]
        lacking, outside = margins - nearby.clearance_margins, self._outside(padded)
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
            missing=missing, merit=value + settings.clearance_price * missing, is_clear=is_clear,
        )  # fmt: skip

    def _duration(self, x: FloatArray, near: float) -> float:
        """The duration of a motion of control points (free, k), near one in s, within all limits that time keeps."""
        matters = self.world.moves or self.limit_reserve > 0.0
        duration = self.motions.least_duration(x, near, near if matters else 0.0, 1.0 - self.limit_reserve)
        padded = self.motions.padded(x, duration)
        if self.torques is not None:
            state = state_of(self.samples.torque_states, padded, duration)
            if np.abs(self.torques.shares(state)).max() > 1.0:
                duration *= max(1.0, self.torques.time_scale(state))
        if self.expressions is not None:
            state = state_of(self.samples.expression_states, padded, duration)
            duration *= max(1.0, self.expressions.time_scale(state))
        return self.objective.duration(duration, near)

    def _outside(self, padded: FloatArray) -> float:
        """The sum of the angles by which joints are out of their ranges, rad."""
        if self.samples.ranges is None:
            return 0.0
        rows, (low, high) = self.samples.angles, self.samples.ranges
        angles = rows.values(padded)
        beyond = np.maximum(angles - high[rows.joint], low[rows.joint] - angles)
        return float(beyond[beyond > self.settings.range_tolerance].sum())

    # Programs

    def _linearised(self, around: Iterate, trust: float) -> Linearisation:
        places = None if self.passages is None else self.passages.rows(around.passages)
        objective = self.objective.quadratic_model(around.x, around.duration)
        return Linearisation(objective, self._torque_rows(around, trust), self._expression_rows(around, trust), places)

    def _program(self, around: Iterate, trust: float, model: Linearisation) -> LinearProgram:
        """The program around an iterate whose control points move by at most so many rad."""
        motions, longest = self.motions, self.samples.longest_change(trust)
        faster, slower = (min(share, longest) for share in self.objective.duration_range(around.duration, trust))
        padded = motions.padded(around.x, around.duration)
        parts = [
            self._limit_rows(rows, (1.0 - self.limit_reserve) * bound, padded, around.duration, trust, faster)
            for rows, bound in zip(motions.limited, motions.limits.by_order, strict=True)
        ]
        parts += self._range_rows(padded, trust)
        box = np.full(around.x.shape, trust)
        least = max(-faster, motions.bound - around.duration - 1e-12)
        whole = [self._clearance_rows(around, trust)]
        whole += [rows for rows in (model.torques, model.expressions, model.places) if rows is not None]
        duration, squares = around.duration, model.objective.squares
        single, every = motions.with_ends(stacked(parts), duration), motions.with_ends(stacked(whole), duration)
        squares = None if squares is None else motions.with_ends(squares, duration)
        cost, time_cost = motions.cost_with_ends(model.objective.cost, model.objective.time_cost, duration)
        return LinearProgram(single, every, -box, box, (least, slower), cost, time_cost, squares)

    def _promised(self, around: Iterate, change: FloatArray, saved: float, model: Linearisation) -> float:
        """The merit that a program promises to save, s, less the price of what it leaves missing itself."""
        near, moved = around.nearby, self.samples.postures
        changed = self.motions.changed(change, -saved, around.duration)
        by_joints = np.einsum(
            "ma,mak->mk", moved.weights[near.samples], changed[moved.first[near.samples][:, None] + np.arange(4)]
        )
        margins = self.proof_margin[near.is_link.astype(int)]
        left = margins - near.clearance_margins - np.einsum("mk,mk->m", near.gradients, by_joints)
        left += near.rates * self.samples.passed[near.samples] * saved
        gained = -model.objective.change(changed, -saved)
        gained += self.settings.clearance_price * (around.missing - float(np.maximum(left, 0.0).sum()))
        for rows in (model.torques, model.expressions):
            if rows is not None:
                excess = rows.moved(changed, self.motions.fixed, -saved) - rows.bound
                gained -= float((rows.price * np.maximum(excess, 0.0)).sum())
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
            first, left = rows.first[chosen] - self.motions.fixed, 1.0 - sign * shares[chosen]
            parts.append(SingleRows(rows.joint[chosen], first, sign * weights[chosen], by_time, left))
        return stacked(parts)

    def _range_rows(self, padded: FloatArray, trust: float) -> list[SingleRows]:
        """Rows of the joints' ranges, where they may matter."""
        if self.samples.ranges is None:
            return []
        rows, (low, high) = self.samples.angles, self.samples.ranges
        tighter = np.zeros(len(rows.joint))
        tighter[len(rows.joint) - self.motions.dof * self.samples.repairs.size :] = self.settings.repaired_range
        angles, reach = rows.values(padded), np.abs(rows.weights).sum(axis=1) * trust
        parts = []
        for sign, left in ((1.0, high[rows.joint] - angles - tighter), (-1.0, angles - low[rows.joint] - tighter)):
            chosen = np.flatnonzero((left < reach) & (rows.weights.any(axis=1)))
            first = rows.first[chosen] - self.motions.fixed
            most = np.maximum(left[chosen], -self.settings.range_recovery * reach[chosen])
            weights = sign * rows.weights[chosen]
            parts.append(SingleRows(rows.joint[chosen], first, weights, np.zeros(chosen.size), most))
        return parts

    def _clearance_rows(self, around: Iterate, trust: float) -> WholeRows:
        """Rows of the clearances of bodies that come near."""
        near, rows = around.nearby, self.samples.postures
        left = near.clearance_margins - self.proof_margin[near.is_link.astype(int)]
        reach = np.abs(near.gradients).sum(axis=1) * trust
        if self.world.moves:
            reach += np.abs(near.rates) * self.samples.longest_change(trust)
        chosen = np.flatnonzero(left < reach)
        sample, price = near.samples[chosen], np.full(chosen.size, self.settings.clearance_price)
        weights = -rows.weights[sample][:, :, None] * near.gradients[chosen][:, None, :]
        by_time = -near.rates[chosen] * self.samples.passed[sample]
        return WholeRows(rows.first[sample] - self.motions.fixed, weights, by_time, left[chosen], price)

    def _torque_rows(self, around: Iterate, trust: float) -> WholeRows | None:
        """Rows of both sides of torques as shares of their limits, as far as they may matter."""
        if self.torques is None:
            return None
        padded, states = self.motions.padded(around.x, around.duration), self.samples.torque_states
        state = state_of(states, padded, around.duration)
        shares = self.torques.shares(state)
        if np.abs(shares).max() < self.settings.torque_threshold:
            return None
        n, k = shares.shape
        slopes = self.torques.slopes(state).reshape(n * k, -1, k)
        sample, values = np.repeat(np.arange(n), k), shares.ravel()
        chosen_weights, durations = [part.weights[sample] for part in states], np.full(sample.size, around.duration)
        weights, by_time = slopes_of(chosen_weights, slopes, state[sample], durations)
        reach = np.abs(weights).sum(axis=(1, 2)) * trust
        parts = []
        for sign in (1.0, -1.0):
            left = 1.0 - self.limit_reserve - sign * values
            chosen = np.flatnonzero(left < reach)
            first = states[0].first[sample[chosen]] - self.motions.fixed
            price = np.full(chosen.size, self.settings.torque_price)
            parts.append(WholeRows(first, sign * weights[chosen], sign * by_time[chosen], left[chosen], price))
        return stacked(parts)

    def _expression_rows(self, around: Iterate, trust: float) -> WholeRows | None:
        """Rows of expressions to first order, where they may matter."""
        if self.expressions is None:
            return None
        padded = self.motions.padded(around.x, around.duration)
        states = self.samples.expression_states
        state = state_of(states, padded, around.duration)
        _, slopes = self.expressions.linear(state)
        by_angles = np.abs(slopes[:, :, 0]).sum(axis=2) * trust
        reach = np.where(self.expressions.is_static, by_angles, self.settings.expression_threshold)
        sample, row = np.nonzero(-around.expressions < reach)
        weights, by_time = slopes_of(
            [part.weights[sample] for part in states], slopes[sample, row], state[sample],
            np.full(sample.size, around.duration),
        )  # fmt: skip
        first = states[0].first[sample] - self.motions.fixed
        price = np.full(sample.size, self.settings.expression_price)
        return WholeRows(first, weights, by_time, -around.expressions[sample, row], price)
