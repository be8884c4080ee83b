"""Bounds on expressions of one instant, as rows of linear programs and as values at samples.

Every bound is written as g <= 0, in shares of the limit's scale. A margin at samples is kept so that a motion keeps the
bound between them too; a bound on values that fall with the speed is kept by the duration. A length has no slope where
it is zero: where angles alone decide on it and its bound is small, as for the accuracy of a path, programs have planes
besides that touch the ball of its components, with a margin such that everything within them lies in the ball.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import CACHE_SIZE, FloatArray, Matrix, as_array
from problems.core import CoreExpression
from problems.limits import MOVING, ExpressionLimit, Limit
from problems.motions import SAMPLED_ORDERS, SampleFunction, Samples, Trajectory, quantity_named, written
from problems.polish.settings import DEFAULT_EXPRESSIONS, ExpressionSettings
from problems.robots import Robot

STATE_ORDERS = 3  # angles, velocities, accelerations
OTHER_QUANTITIES = ("jerk", "time", "duration")  # that are no function of these
ROUNDING = 1e-10  # of the scale


class BoundRow(NamedTuple):
    """One bound of an expression.

    Attributes:
        value: g, of the scale.
        margin: kept at samples, where the ends let it, of the scale.
        radius: of the ball that planes touch besides, m or rad; infinite where there is none.
    """

    value: Matrix
    margin: float
    radius: float = np.inf


def components(value: Matrix) -> list[Matrix]:
    """Components of which an expression is the length, sqrt(sum of squares), or the least length; else none."""
    return _squared_in(value.dep(0)) if value.is_op(ca.OP_SQRT) else []


def _squared_in(value: Matrix) -> list[Matrix]:
    if value.is_op(ca.OP_SQ):
        return [value.dep(0)]
    if not (value.is_op(ca.OP_ADD) or value.is_op(ca.OP_FMIN)):
        return []
    one, other = (_squared_in(value.dep(number)) for number in range(2))
    if value.is_op(ca.OP_ADD):
        return [*one, *other] if one and other else []
    first = value.dep(0) < value.dep(1)
    return [ca.if_else(first, *each) for each in zip(one, other, strict=True)] if len(one) == len(other) else []


def _in_directions(parts: list[Matrix]) -> list[Matrix]:
    """A vector along its axes and their diagonals, both ways."""
    signs = [each for each in product((-1.0, 0.0, 1.0), repeat=len(parts)) if np.count_nonzero(each) in (1, len(parts))]
    return [ca.dot(ca.DM(each) / np.linalg.norm(each), ca.vertcat(*parts)) for each in signs]


@dataclass(frozen=True)
class ExpressionLimits:
    """Expressions that a motion keeps within bounds.

    Args:
        limits: of angles, velocities and accelerations.
        settings: of their rows.
    """

    limits: tuple[ExpressionLimit, ...]
    settings: ExpressionSettings = DEFAULT_EXPRESSIONS

    @classmethod
    @lru_cache(maxsize=CACHE_SIZE)
    def of(cls, limits: tuple[ExpressionLimit, ...]) -> ExpressionLimits:
        """The cached object of given limits, whose functions are made once."""
        return cls(limits)

    @classmethod
    def among(cls, limits: Iterable[Limit]) -> ExpressionLimits | None:
        """The expressions among some limits; None where there are none."""
        expressions = tuple(limit for limit in limits if isinstance(limit, ExpressionLimit))
        return cls.of(expressions) if expressions else None

    @staticmethod
    def supports(limit: Limit) -> bool:
        """Whether a limit is an expression of angles, velocities and accelerations alone."""
        return isinstance(limit, ExpressionLimit) and not limit.function.uses(*OTHER_QUANTITIES)

    @property
    def _robot(self) -> Robot:
        return self.limits[0].robot

    @cached_property
    def _symbols(self) -> dict[str, ca.SX]:
        """A symbol for each quantity that limits depend on."""
        names = dict.fromkeys(name for limit in self.limits for name, _ in limit.function.entries)
        return {name: ca.SX.sym(name, quantity_named(name).width(self._robot)) for name in names}

    def _rows_of(self, limit: ExpressionLimit) -> list[BoundRow]:
        """The rows of one limit, each at most 0."""
        settings, rows = self.settings, list[BoundRow]()
        numbers = ca.vertcat(ca.SX(0, 1), *(self._symbols[name][index] for name, index in limit.function.entries))
        smooth, exact = limit.function.of_numbers(numbers, smooth=True), limit.function.of_numbers(numbers)
        for sign, bound in ((-1.0, limit.lower), (1.0, limit.upper)):
            for column, number in enumerate(() if bound is None else bound):
                if not np.isfinite(number):
                    continue
                small = sign > 0.0 and 0.0 < number <= settings.small_length and self._are_static(exact[column])[0]
                parts = components(exact[column]) if small else []
                scale = number if parts else limit.scale[column]
                value, radius = sign * (smooth[column] - number) / scale, number if parts else np.inf
                rows.append(BoundRow(value, settings.margin, radius))
                if 0 < len(parts) <= settings.most_components:
                    planes = [(along - number) / scale for along in _in_directions(parts)]
                    rows += [BoundRow(plane, settings.plane_margin) for plane in planes]
        return rows

    def _are_static(self, values: Matrix) -> NDArray[np.bool_]:
        """Mask of the values (m, 1) that depend on angles alone, (m,)."""
        moving = ca.vertcat(ca.SX(0, 1), *(symbol for name, symbol in self._symbols.items() if name in MOVING))
        return ~np.array(ca.which_depends(values, moving, 1, True), dtype=bool)

    @cached_property
    def _rows(self) -> list[BoundRow]:
        return [row for limit in self.limits for row in self._rows_of(limit)]

    @property
    def _symbolic(self) -> Matrix:
        return ca.densify(ca.vertcat(*(row.value for row in self._rows)))

    @cached_property
    def _function(self) -> SampleFunction:
        """All rows as one expression."""
        return SampleFunction(written(ca.SX(self._symbolic), self._symbols))

    @cached_property
    def _in_core(self) -> CoreExpression | None:
        """All rows in the compiled core, where that knows their operations and the robot."""
        return CoreExpression.of(self._robot, self._function)

    @cached_property
    def _slopes(self) -> ca.Function:
        """The slopes of all rows by the state, row by row, where the core does not know them."""
        state = ca.SX.sym("state", SAMPLED_ORDERS * self._robot.dof + 1)
        values = self._function.of_state(self._robot)(state, 1.0)
        slopes = ca.densify(ca.jacobian(values, state)[:, : STATE_ORDERS * self._robot.dof])
        return ca.Function("slopes", [state], [ca.vec(slopes.T)], {"cse": True})

    def _states(self, state: FloatArray) -> FloatArray:
        """States (n, 3 k) with what rows do not depend on, (n, 4 k + 1)."""
        whole = np.zeros((len(state), SAMPLED_ORDERS * self._robot.dof + 1))
        whole[:, : state.shape[1]] = state
        return whole

    @cached_property
    def is_static(self) -> NDArray[np.bool_]:
        """Mask of the rows that depend on angles alone, (m,)."""
        return self._are_static(self._symbolic)

    @property
    def longest_first_step(self) -> float:
        """The change of a joint whose second order may fill the smallest ball, of a tool 1 m away, rad."""
        return float(np.sqrt(2.0 * min((row.radius for row in self._rows), default=np.inf)))

    def values(self, state: FloatArray) -> FloatArray:
        """g, (n, m), of angles and as many velocities and accelerations as matter, (n, up to 3 k)."""
        core, states = self._in_core, self._states(state)
        return self._function.probed(self._robot, states) if core is None else core.values(states, 1.0)

    def linear(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """g, (n, m), and how it changes with angles, velocities and accelerations: (n, m, 3, k)."""
        states, values = self._states(state), self.values(state)
        if self._in_core is not None:
            return values, self._in_core.slopes(states, 1.0)
        slopes = as_array(self._slopes(states.T)).T
        return values, slopes.reshape(*values.shape, STATE_ORDERS, -1)

    def time_scale(self, state: FloatArray) -> float:
        """The time scale at which a motion keeps, with margins, all limits that time can keep; 0 without any."""
        scaling = [limit for limit in self.limits if limit.scales_with_time]
        if not scaling:
            return 0.0
        *derivatives, times = np.split(self._states(state), self._robot.dof * np.arange(1, SAMPLED_ORDERS + 1), axis=1)
        parts = tuple(map(ca.DM, derivatives))
        now = Samples(robot=self._robot, derivatives=parts, duration=ca.DM(1.0), times=ca.DM(times))
        shares = [limit.magnitudes(now) / (1.0 - self.settings.margin) for limit in scaling]
        return max(float(limit.time_scale(share)) for limit, share in zip(scaling, shares, strict=True))

    def at_rest(self, theta: FloatArray) -> FloatArray:
        """Values g in postures (n, k) at rest, (n, m)."""
        return self.values(theta)

    def allow(self, theta: FloatArray) -> NDArray[np.bool_]:
        """Mask of the postures (n, k) that keep the rows that depend on angles alone, (n,)."""
        if not self.is_static.any():
            return np.ones(len(theta), dtype=bool)
        return np.asarray((self.at_rest(theta)[:, self.is_static] <= ROUNDING).all(axis=1))

    def broken_at(self, theta: FloatArray) -> str:
        """The name of the limit that a posture (k,) at rest breaks most, in shares of the scales."""
        names = [limit.name for limit in self.limits for _ in self._rows_of(limit)]
        return names[int(np.argmax(np.where(self.is_static, self.at_rest(theta[None])[0], -np.inf)))]

    def are_kept(self, trajectory: Trajectory, times: FloatArray) -> bool:
        """Whether a motion keeps all limits at times (n,) in s."""
        state = np.concatenate([trajectory.at(times, order) for order in range(STATE_ORDERS)], axis=1)
        return bool((self.values(state) <= ROUNDING).all())

    def margins(self, *ends: FloatArray) -> FloatArray:
        """Margins that are kept at samples of a motion between postures (k,), of the scale, (m,)."""
        left = -self.at_rest(np.stack(ends)).max(axis=0)
        return np.asarray(np.clip(self.settings.share_at_ends * left, 0.0, [row.margin for row in self._rows]))

    def projected(self, theta: FloatArray, margins: FloatArray) -> FloatArray:
        """Postures near given ones (n, k) that keep rows of angles alone by margins (m,), as far as steps lead."""
        theta, left = theta.copy(), np.arange(len(theta))
        for _ in range(self.settings.projection_steps):
            values, slopes = self.linear(theta[left])
            missing = np.where(self.is_static, np.maximum(values + margins, 0.0), 0.0)
            broken = (missing > self.settings.projection_tolerance).any(axis=1)
            left = left[broken]
            if not left.size:
                break
            theta[left] -= self._steps(missing[broken], slopes[broken, :, 0])
        return theta

    def _steps(self, missing: FloatArray, slopes: FloatArray) -> FloatArray:
        """Least changes of joints (n, k) that make up for missing values (n, m), by slopes (n, m, k)."""
        active = slopes * (missing > 0.0)[:, :, None]
        square = np.einsum("nmk,nlk->nml", active, active)
        damping = self.settings.damping * np.trace(square, axis1=1, axis2=2) + np.finfo(float).tiny
        damped = square + damping[:, None, None] * np.eye(square.shape[1])
        steps = np.einsum("nmk,nm->nk", active, np.linalg.solve(damped, missing[:, :, None])[:, :, 0])
        longest = np.maximum(np.abs(steps).max(axis=1, keepdims=True), np.finfo(float).tiny)
        return np.asarray(steps * np.minimum(1.0, self.settings.longest_step / longest))
