"""The objective of the polish: near a motion a convex quadratic function of control points and duration.

With u = t / T an objective is a sum over samples of T f(q, q' / T, q'' / T^2, ...), derivatives by u, and a function of
T. Squares of torques and the like are squares of linear functions in a program (Gauss and Newton). A length |r| counts
as (|r|^2 / |r_0| + |r_0|) / 2, which is nowhere less and the same where r = r_0 [1]; of everything else the second
derivatives count, as far as they are convex. It is all scaled so that the best direct motion is worth as much as it
takes time, in s, so that prices of missing clearance and the like depend on no unit.

[1] E. Weiszfeld: Sur le point pour lequel la somme des distances de n points donnes est minimum. Tohoku Mathematical
    Journal 43 (1937).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import CACHE_SIZE, FloatArray, Matrix, total
from problems.core import WholeRows, stacked
from problems.motions import SAMPLED_ORDERS, Samples
from problems.objectives import DirectMoves, Integrand, Objective
from problems.polish.deviation import Deviations, PostureRows
from problems.polish.settings import DEFAULT_OBJECTIVE, ObjectiveSettings
from problems.robots import Robot

GAUSS_POINTS, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)  # in each piece of the spline
DURATION_ROUNDING = 1e-6  # of a bound of the duration


@dataclass(frozen=True)
class IntegrandFunctions:
    """An objective of a robot as CasADi functions of angles and their derivatives by u.

    Args:
        objective: whose integrand is known.
        robot: that moves.
    """

    objective: Objective
    robot: Robot

    @classmethod
    @lru_cache(maxsize=CACHE_SIZE)
    def of(cls, objective: Objective, robot: Robot) -> IntegrandFunctions | None:
        """The cached functions of an objective of a robot; None where its integrand is unknown."""
        return None if objective.integrand(Samples.symbolic(robot, SAMPLED_ORDERS)) is None else cls(objective, robot)

    @cached_property
    def _symbols(self) -> tuple[Matrix, Matrix, Matrix]:
        """Angles and derivatives by u, (4 k, 1), u, T."""
        return ca.SX.sym("state", SAMPLED_ORDERS * self.robot.dof), ca.SX.sym("u"), ca.SX.sym("duration")

    @cached_property
    def _integrand(self) -> Integrand:
        state, u, duration = self._symbols
        rows = [part.T for part in ca.vertsplit(state, self.robot.dof)]
        now = Samples(
            robot=self.robot,
            derivatives=tuple(row / duration**order for order, row in enumerate(rows)),
            duration=duration,
            times=u * duration,
        )
        integrand = self.objective.integrand(now)
        assert integrand is not None
        return integrand

    @cached_property
    def _parts(self) -> tuple[Matrix, Matrix, Matrix]:
        """The integrand by u: values to square, (m, 1), vectors below each other, (m, 1), and the rest, scalar."""
        integrand, duration, none = self._integrand, self._symbols[2], ca.SX(1, 0)
        squares = none if integrand.squares is None else integrand.squares
        rest = none if integrand.rest is None else integrand.rest
        return ca.sqrt(duration) * squares.T, duration * ca.horzcat(none, *integrand.lengths).T, duration * total(rest)

    @cached_property
    def vector_of(self) -> NDArray[np.intp]:
        """The index of the vector to which each row of the vectors belongs, (m,)."""
        sizes = [vector.shape[1] for vector in self._integrand.lengths]
        return np.repeat(np.arange(len(sizes)), sizes)

    @cached_property
    def orders(self) -> tuple[int, ...]:
        """The orders of derivatives on which the integrand depends."""
        state, k = self._symbols[0], self.robot.dof
        depends = np.array(ca.which_depends(ca.vertcat(*self._parts), state, 1, False)).reshape(SAMPLED_ORDERS, k)
        return tuple(np.flatnonzero(depends.any(axis=1)).tolist())

    @cached_property
    def _given(self) -> Matrix:
        """The derivatives on which the integrand depends, and the duration, (m k + 1, 1)."""
        state, _, duration = self._symbols
        k = self.robot.dof
        return ca.vertcat(*(state[order * k : (order + 1) * k] for order in self.orders), duration)

    def _function(self, outputs: Sequence[Matrix]) -> ca.Function:
        _, u, _ = self._symbols
        return ca.Function("integrals", [self._given, u], [ca.densify(each) for each in outputs], {"cse": True})

    @cached_property
    def _values(self) -> ca.Function:
        duration = self._symbols[2]
        return self._function([duration * ca.sum2(self._integrand.values)])

    @cached_property
    def _slopes(self) -> ca.Function:
        squares, vectors, rest = self._parts
        second, first = ca.hessian(rest, self._given)
        second = ca.densify(second) if second.nnz() else ca.SX(0, 0)
        slopes = [ca.vec(ca.jacobian(part, self._given).T) for part in (squares, vectors)]
        return self._function([squares, slopes[0], vectors, slopes[1], first, ca.vec(second)])

    @cached_property
    def _terminal(self) -> ca.Function:
        duration = self._symbols[2]
        value = ca.densify(ca.SX(self.objective.terminal(duration)))
        second, first = ca.hessian(value, duration)
        return ca.Function("terminal", [duration], [value, ca.densify(first), ca.densify(second)])

    def values(self, state: FloatArray, u: FloatArray, durations: FloatArray) -> FloatArray:
        """The integrand by u, (n,).

        Args:
            state: angles and derivatives by u that matter, (n, m k).
            u: (n,).
            durations: of the motion, (n,), s.
        """
        return _mapped(self._values, np.column_stack([state, durations]), u)[0].ravel()

    def linear(self, state: FloatArray, u: FloatArray, duration: float) -> tuple[FloatArray, ...]:
        """The integrand to second order, by the arguments of :meth:`values`, the duration last.

        Returns:
            Values to square, (n, a), their slopes, (n, a, m k + 1), vectors, (n, b), their slopes, (n, b, m k + 1), and
            of the rest slopes, (n, m k + 1), and second derivatives, (n, m k + 1, m k + 1), or none, (n, 0, m k + 1).
        """
        n, width = state.shape[0], state.shape[1] + 1
        given = np.column_stack([state, np.full(n, duration)])
        squares, by_squares, vectors, by_vectors, first, second = _mapped(self._slopes, given, u)
        return (
            squares, by_squares.reshape(n, squares.shape[1], width),
            vectors, by_vectors.reshape(n, vectors.shape[1], width), first, second.reshape(n, -1, width),
        )  # fmt: skip

    def terminal(self, duration: float) -> tuple[float, float, float]:
        """The part of the objective that depends on the duration in s alone, and its first two derivatives."""
        value, first, second = (float(part) for part in self._terminal(duration))
        return value, first, second


def _mapped(function: ca.Function, *arguments: FloatArray) -> list[FloatArray]:
    """Dense outputs (n, m) of a function for n rows of each of its arguments."""
    n = len(arguments[0])
    mapped = function.map(n)
    given = [np.ascontiguousarray(part) for part in arguments]
    results = [np.empty((n, function.numel_out(number))) for number in range(function.n_out())]
    buffer, evaluate = mapped.buffer()
    for number, part in enumerate(given):
        buffer.set_arg(number, part.data)  # type: ignore[call-arg]
    for number, part in enumerate(results):
        buffer.set_res(number, part.data)  # type: ignore[call-arg]
    evaluate()
    return results


@dataclass(frozen=True, eq=False)
class QuadraticModel:
    """The objective near a motion, for changes of all control points and of the duration.

    Attributes:
        cost: of control points, (pieces + 3, k), s/rad.
        time_cost: of the duration.
        squares: whose halves count; None where there are none.
        fixed: control points at either end, of which rows do not count the first ones.
    """

    cost: FloatArray | None
    time_cost: float
    squares: WholeRows | None
    fixed: int

    def change(self, padded: FloatArray, longer: float) -> float:
        """The change of the objective with all control points, (pieces + 3, k), and the duration, s."""
        change = self.time_cost * longer
        if self.cost is not None:
            change += float((self.cost * padded).sum())
        if self.squares is not None:
            before = -self.squares.bound
            after = before + self.squares.moved(padded, self.fixed, longer)
            change += 0.5 * float((self.squares.price * (after**2 - before**2)).sum())
        return change


@dataclass(frozen=True, eq=False)
class PolishObjective:
    """An objective of motions between two postures, scaled to s.

    Args:
        motions: that are compared.
        integrand: of the objective.
        durations: the shortest and the longest that are allowed, s.
        settings: of its model.
    """

    motions: Deviations
    integrand: IntegrandFunctions
    durations: tuple[float, float]
    settings: ObjectiveSettings = DEFAULT_OBJECTIVE

    @property
    def _objective(self) -> Objective:
        return self.integrand.objective

    @cached_property
    def _u(self) -> FloatArray:
        """Parameters at which the integrand is evaluated, (n,): Gauss's points of each piece."""
        edges = self.motions.spline.edges
        begin, width = edges[:-1, None], np.diff(edges)[:, None]
        return np.asarray((begin + width * (GAUSS_POINTS + 1.0) / 2.0).ravel())

    @cached_property
    def _weights(self) -> FloatArray:
        return np.asarray((np.diff(self.motions.spline.edges)[:, None] * GAUSS_WEIGHTS / 2.0).ravel())

    @cached_property
    def _rows_of_orders(self) -> tuple[PostureRows, ...]:
        return tuple(self.motions.postures(self._u, order) for order in self.integrand.orders)

    def _state(self, padded: FloatArray) -> FloatArray:
        """Angles and derivatives by u that matter, (n, m k)."""
        parts = [rows.values(padded) for rows in self._rows_of_orders]
        return np.concatenate(parts, axis=1) if parts else np.empty((self._u.size, 0))

    @cached_property
    def scale(self) -> float:
        """The s that one unit of the objective counts, so that the best direct motion counts its duration."""
        x = np.zeros((self.motions.free, self.motions.dof))
        value = abs(self._unscaled(x, self._best_of(x, self.motions.direct.duration)))
        least = DURATION_ROUNDING * self._objective.size(self.integrand.robot)
        return self.motions.direct.duration / max(value, least)

    @cached_property
    def bound(self) -> float:
        """A lower bound of the objective of all motions, s."""
        moves = DirectMoves(
            robot=self.integrand.robot,
            start=self.motions.start,
            goals=self.motions.goal[None],
            durations=np.array([self.motions.bound]),
        )
        return self.scale * float(self._objective.lower_bound(moves)[0]) + self._weight_of_time * self.motions.bound

    @property
    def chooses_duration(self) -> bool:
        """Whether a motion may have to be slower than it could be."""
        return self._objective.chooses_duration

    @property
    def has_several_optima(self) -> bool:
        """Whether there may be several local optima."""
        return not self._objective.direct_is_least

    def _unscaled(self, x: FloatArray, duration: float) -> float:
        if not self._rows_of_orders:
            return self.integrand.terminal(duration)[0]
        return float(self._of_durations(x, np.array([duration]))[0])

    def _of_durations(self, x: FloatArray, durations: FloatArray) -> FloatArray:
        """The objective of free control points (free, k) run in several durations, (n,) s: (n,)."""
        n, states = self._u.size, [self._state(self.motions.padded(x, each)) for each in durations.tolist()]
        u, each = np.tile(self._u, durations.size), np.repeat(durations, n)
        rates = self.integrand.values(np.concatenate(states), u, each).reshape(durations.size, n)
        return np.asarray(rates @ self._weights + [self.integrand.terminal(each)[0] for each in durations.tolist()])

    def value(self, x: FloatArray, duration: float) -> float:
        """The objective of a motion of free control points (free, k) in a duration in s, s."""
        late = 0.0 if self.in_time(duration) else self.settings.lateness_price * (duration - self._longest)
        return self.scale * self._unscaled(x, duration) + self._weight_of_time * duration + late

    @property
    def _weight_of_time(self) -> float:
        return 0.0 if self._objective.is_time_dependent else self.settings.weight_of_time

    def in_time(self, duration: float) -> bool:
        """Whether a motion of a duration in s does not arrive too late."""
        return not self.chooses_duration or duration <= self._longest

    def duration_range(self, duration: float, trust: float) -> tuple[float, float]:
        """How much a program may take from a duration, and add to it, s, where control points move by so much, rad."""
        faster, slower = self.settings.most_saved * duration, self.settings.most_added * duration
        if not self.chooses_duration:
            return faster, slower
        change = self.settings.duration_trust * trust * duration
        return min(faster, change), max(min(slower, self._longest - duration, change), 0.0)

    @property
    def _longest(self) -> float:
        shortest, longest = self.durations
        return max(longest * (1.0 - DURATION_ROUNDING), shortest)

    def duration(self, least: float, wanted: float) -> float:
        """The duration of a motion that takes at least so much, where a program wants another, all s."""
        if not self.chooses_duration:
            return least
        return max(least, min(max(wanted, self.durations[0] * (1.0 + DURATION_ROUNDING)), self._longest))

    def best_duration(self, x: FloatArray, least: float) -> float:
        """The best of free control points (free, k) that take at least so much, s."""
        return self._best_of(x, least) if self.chooses_duration else least

    def _best_of(self, x: FloatArray, least: float) -> float:
        if not self.chooses_duration:
            return least
        low, high = self.duration(least, 0.0), self.duration(least, np.inf)
        best, count = low, self.settings.compared_durations
        for _ in range(self.settings.duration_passes):
            durations = np.geomspace(low, high, count)
            number = int(np.argmin(self._of_durations(x, durations)))
            best = float(durations[number])
            low, high = float(durations[max(number - 1, 0)]), float(durations[min(number + 1, count - 1)])
        return best

    def quadratic_model(self, x: FloatArray, duration: float) -> QuadraticModel:
        """The objective near a motion of free control points (free, k) of a duration in s."""
        _, slope, curvature = self.integrand.terminal(duration)
        lateness = 0.0 if self.in_time(duration) else self.settings.lateness_price
        time_cost = self.scale * slope + self._weight_of_time + lateness
        squares = [self._time_square(self.scale * curvature)] if curvature > 0.0 else []
        if not self._rows_of_orders:
            return QuadraticModel(None, time_cost, stacked(squares) if squares else None, self.motions.fixed)
        state = self._state(self.motions.padded(x, duration))
        squared, by_squared, vectors, by_vectors, first, second = self.integrand.linear(state, self._u, duration)
        weights = self.scale * self._weights
        squares += [
            self._square_rows(squared, by_squared, np.broadcast_to(2.0 * weights[:, None], squared.shape)),
            self._square_rows(vectors, by_vectors, self._length_weights(vectors, weights)),
        ]
        squares += [self._convex_squares(second, weights)] if second.size else []
        cost, by_time = self._costs(weights[:, None] * first)
        squares = [rows for rows in squares if rows.bound.size]
        return QuadraticModel(cost, time_cost + by_time, stacked(squares) if squares else None, self.motions.fixed)

    def _length_weights(self, vectors: FloatArray, weights: FloatArray) -> FloatArray:
        """Weights of the squares of vectors (n, m), by those of samples, (n,): (n, m)."""
        lengths = np.zeros((vectors.shape[0], self.integrand.vector_of.max(initial=-1) + 1))
        np.add.at(lengths.T, self.integrand.vector_of, np.square(vectors.T))
        lengths = np.sqrt(lengths)
        least = self.settings.corner * (self._weights @ lengths) + np.finfo(float).tiny
        return np.asarray((weights[:, None] / np.maximum(lengths, least))[:, self.integrand.vector_of])

    def _time_square(self, weight: float) -> WholeRows:
        """The square of a change of the duration."""
        one, no_points = np.ones(1), np.zeros((1, 4, self.motions.dof))
        return WholeRows(np.zeros(1, dtype=np.intp), no_points, one, 0.0 * one, weight * one)

    def _square_rows(self, values: FloatArray, slopes: FloatArray, weights: FloatArray) -> WholeRows:
        """Squares of values (n, m) with slopes (n, m, w) and weights (n, m)."""
        n, m = values.shape
        sample = np.repeat(np.arange(n), m)
        return self._rows_of_samples(sample, values.ravel(), slopes.reshape(n * m, slopes.shape[2]), weights.ravel())

    def _rows_of_samples(
        self, sample: NDArray[np.intp], values: FloatArray, slopes: FloatArray, weights: FloatArray
    ) -> WholeRows:
        """Rows (m,) of samples: their values, slopes (m, w) and weights."""
        k, by_points = self.motions.dof, np.zeros((sample.size, 4, self.motions.dof))
        for number, rows in enumerate(self._rows_of_orders):
            by_points += rows.weights[sample][:, :, None] * slopes[:, None, number * k : (number + 1) * k]
        first = self._rows_of_orders[0].first[sample] - self.motions.fixed
        return WholeRows(first, by_points, slopes[:, -1], -values, weights)

    def _convex_squares(self, second: FloatArray, weights: FloatArray) -> WholeRows:
        """The convex part of second derivatives (n, w, w): squares along its axes."""
        sizes, axes = np.linalg.eigh(second)
        largest = np.abs(sizes).max(initial=0.0)
        sample, axis = np.nonzero(sizes > self.settings.convexity * largest)
        return self._rows_of_samples(
            sample, np.zeros(sample.size), axes[sample, :, axis], sizes[sample, axis] * weights[sample]
        )

    def _costs(self, slopes: FloatArray) -> tuple[FloatArray, float]:
        """Costs of all control points, and of the duration, by slopes of samples (n, w)."""
        k = self.motions.dof
        cost = np.zeros((self.motions.spline.count, k))
        for number, rows in enumerate(self._rows_of_orders):
            by_points = rows.weights[:, :, None] * slopes[:, None, number * k : (number + 1) * k]
            np.add.at(cost, rows.first[:, None] + np.arange(4), by_points)
        return cost, float(slopes[:, -1].sum())
