"""Bounds on expressions of one instant, as linear programs and samples take them.

Every bound is written as g <= 0, in shares of the limit's scale. What a motion breaks a little between samples it may
keep by some room there; what falls where a motion is run more slowly is kept by the duration. A length has no slope
where it is zero. Where postures alone keep it below a small number, as the accuracy of a path, programs have planes
besides that touch the ball of its components, and keep so much room of these that what is left lies within.
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

from problems.base import FloatArray, Matrix, as_array
from problems.limits import ExpressionLimit, Limit
from problems.motions import Samples, Trajectory

KEPT = 16  # sets of limits
STATE = 3  # angles, velocities, accelerations
UNKNOWN = ("jerk", "time", "duration")  # quantities that are no function of these
SPARE = 0.01  # of the scale, kept at samples
SMALL = 0.05  # m or rad: a length whose ball steps of programs lead through has planes that touch that
INSIDE, MOST_COMPONENTS = 0.2, 3  # of the length, kept of the planes: what they leave is within the ball
AT_ENDS = 0.8  # of what the ends leave of that
ROUNDING = 1e-10  # of the scale
STEPS, ENOUGH = 30, 1e-3  # of a projection; of the scale: what is missing of less is enough
LONGEST = 0.2  # rad or m: no joint goes farther in a step of it
DAMPED = 1e-6  # relative: keeps a step finite where joints do not matter


class Row(NamedTuple):
    """One bound.

    Attributes:
        value: g, of the scale.
        spare: what is kept of it at samples, where the ends let it, of the scale.
    """

    value: Matrix
    spare: float


def components(value: Matrix) -> list[Matrix]:
    """Those of which an expression is the length, sqrt(sum of squares), or the least length; else none."""
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
class OwnLimits:
    """Expressions that a motion keeps within bounds.

    Args:
        limits: of angles, velocities and accelerations.
    """

    limits: tuple[ExpressionLimit, ...]

    @classmethod
    @lru_cache(maxsize=KEPT)
    def of(cls, limits: tuple[ExpressionLimit, ...]) -> OwnLimits:
        """The same object for the same limits, so that its functions are made once."""
        return cls(limits)

    @classmethod
    def among(cls, limits: Iterable[Limit]) -> OwnLimits | None:
        """Of those among some; None where there are none."""
        own = tuple(limit for limit in limits if isinstance(limit, ExpressionLimit))
        return cls.of(own) if own else None

    @staticmethod
    def know(limit: Limit) -> bool:
        """Whether a limit can be one of these."""
        return isinstance(limit, ExpressionLimit) and not limit.function.uses(*UNKNOWN)

    @cached_property
    def _now(self) -> Samples:
        return Samples.symbolic(self.limits[0].robot, STATE)

    @property
    def _state(self) -> Matrix:
        return ca.horzcat(*map(self._now.derivative, range(STATE))).T

    def _rows_of(self, limit: ExpressionLimit) -> list[Row]:
        """What is at most 0 of one limit."""
        smooth, exact, found = limit.function.at(self._now, smooth=True), limit.function.at(self._now), list[Row]()
        for sign, bound in ((-1.0, limit.lower), (1.0, limit.upper)):
            for column, number in enumerate(() if bound is None else bound):
                if not np.isfinite(number):
                    continue
                small = sign > 0.0 and 0.0 < number <= SMALL and self._are_static(exact[0, column])[0]
                parts = components(exact[0, column]) if small else []
                scale = number if parts else limit.scale[column]
                found.append(Row(sign * (smooth[0, column] - number) / scale, SPARE))
                if 0 < len(parts) <= MOST_COMPONENTS:
                    found += [Row((along - number) / scale, INSIDE) for along in _in_directions(parts)]
        return found

    def _are_static(self, values: Matrix) -> NDArray[np.bool_]:
        """Which values (m, 1) depend on angles alone, (m,)."""
        moving = ca.vec(ca.horzcat(self._now.speed, self._now.acceleration))
        return ~np.array(ca.which_depends(values, moving, 1, True), dtype=bool)

    @cached_property
    def _rows(self) -> list[Row]:
        return [row for limit in self.limits for row in self._rows_of(limit)]

    @property
    def _symbolic(self) -> Matrix:
        return ca.densify(ca.vertcat(*(row.value for row in self._rows)))

    @cached_property
    def _values(self) -> ca.Function:
        return ca.Function("values", [self._state], [self._symbolic], {"cse": True})

    @cached_property
    def _slopes(self) -> ca.Function:
        slopes = ca.densify(ca.jacobian(self._symbolic, self._state))
        return ca.Function("slopes", [self._state], [self._symbolic, ca.vec(slopes.T)], {"cse": True})

    @cached_property
    def _time_scales(self) -> ca.Function | None:
        scaling = [limit for limit in self.limits if limit.scales_with_time]
        if not scaling:
            return None
        scales = [limit.time_scale(limit.magnitudes(self._now) / (1.0 - SPARE)) for limit in scaling]
        return ca.Function("time_scales", [self._state], [ca.vertcat(*scales)], {"cse": True})

    @cached_property
    def is_static(self) -> NDArray[np.bool_]:
        """Which rows depend on angles alone, (m,)."""
        return self._are_static(self._symbolic)

    def values(self, state: FloatArray) -> FloatArray:
        """g, (n, m), of angles, velocities and accelerations, (n, 3 k)."""
        return as_array(self._values(state.T)).T

    def linear(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """g, (n, m), and how it changes with angles, velocities and accelerations: (n, m, 3, k)."""
        values, slopes = (as_array(part).T for part in self._slopes(state.T))
        return values, slopes.reshape(len(state), values.shape[1], STATE, -1)

    def time_scale(self, state: FloatArray) -> float:
        """At which a motion keeps by room at samples what can be kept by time; 0 where nothing can."""
        return 0.0 if self._time_scales is None else float(as_array(self._time_scales(state.T)).max())

    def at_rest(self, theta: FloatArray) -> FloatArray:
        """The same in postures (n, k) at rest, (n, m)."""
        return self.values(np.pad(theta, ((0, 0), (0, (STATE - 1) * theta.shape[1]))))

    def allow(self, theta: FloatArray) -> NDArray[np.bool_]:
        """Which postures (n, k) keep what depends on angles alone, (n,)."""
        if not self.is_static.any():
            return np.ones(len(theta), dtype=bool)
        return np.asarray((self.at_rest(theta)[:, self.is_static] <= ROUNDING).all(axis=1))

    def hold(self, trajectory: Trajectory, times: FloatArray) -> bool:
        """Whether a motion keeps them at times (n,) in s."""
        state = np.concatenate([trajectory.at(times, order) for order in range(STATE)], axis=1)
        return bool((self.values(state) <= ROUNDING).all())

    def spare(self, *ends: FloatArray) -> FloatArray:
        """What is kept at samples of a motion between postures (k,), of the scale, (m,)."""
        left = -self.at_rest(np.stack(ends)).max(axis=0)
        return np.asarray(np.clip(AT_ENDS * left, 0.0, [row.spare for row in self._rows]))

    def projected(self, theta: FloatArray, spare: FloatArray) -> FloatArray:
        """Postures near some (n, k) that keep what depends on angles alone by some room (m,), as far as steps lead."""
        theta = theta.copy()
        for _ in range(STEPS):
            state = np.pad(theta, ((0, 0), (0, (STATE - 1) * theta.shape[1])))
            values, slopes = self.linear(state)
            missing = np.where(self.is_static, np.maximum(values + spare, 0.0), 0.0)
            broken = np.flatnonzero((missing > ENOUGH).any(axis=1))
            if not broken.size:
                break
            theta[broken] -= _steps(missing[broken], slopes[broken, :, 0])
        return theta


def _steps(missing: FloatArray, slopes: FloatArray) -> FloatArray:
    """Least changes of joints (n, k) that make up for what is missing (n, m), by slopes (n, m, k)."""
    own = slopes * (missing > 0.0)[:, :, None]
    square = np.einsum("nmk,nlk->nml", own, own)
    size = square.shape[1]
    damped = square + (DAMPED * np.trace(square, axis1=1, axis2=2) + np.finfo(float).tiny)[:, None, None] * np.eye(size)
    steps = np.einsum("nmk,nm->nk", own, np.linalg.solve(damped, missing[:, :, None])[:, :, 0])
    longest = np.abs(steps).max(axis=1, keepdims=True)
    return np.asarray(steps * np.minimum(1.0, LONGEST / np.maximum(longest, np.finfo(float).tiny)))
