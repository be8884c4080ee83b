"""What is minimised, as programs take it: a convex quadratic function of control points and duration near a motion.

With u = t / T an objective is a sum over samples of T f(q, q' / T, q'' / T^2, ...), derivatives by u, and a function of
T. Squares of torques and the like are squares of linear functions in a program (Gauss and Newton). A length |r| counts
as (|r|^2 / |r_0| + |r_0|) / 2, which is nowhere less and the same where r = r_0 [1]; of everything else the second
derivatives count, as far as they are convex. It is all scaled so that the best direct motion is worth as much as it
takes time, in s: prices of what is missing need to know no unit.

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

from problems.base import FloatArray, Matrix, total
from problems.core import WholeRows, joined
from problems.motions import SAMPLED_ORDERS, Samples
from problems.objectives import DirectMoves, Integrand, Objective
from problems.polish.deviation import Deviations, PostureRows
from problems.polish.spline import AT_REST
from problems.robots import Robot

KEPT = 16  # objectives
POINTS, SHARES = 3, np.polynomial.legendre.leggauss(3)  # in each piece of the spline
CONVEX = 1e-9  # of the largest second derivative: less is none
WEIGHT_OF_TIME = 1e-3  # what a motion pays for its duration where that is not minimised
CORNER = 1e-2  # of the mean length of a vector: what is shorter counts as that long
LATE_PRICE = 3.0  # for each second beyond the longest duration
FASTER, SLOWER = 0.4, 1.0  # shares of the duration that a program may save or add
TIME_TRUST = 2.0  # 1/rad: where the duration is chosen, the share of it that may change for each rad of control points
LOOKS, NARROWING = 16, 2  # durations that are compared at a time, and how often
NEAREST = 1e-6  # of a bound of the duration: rounding


@dataclass(frozen=True)
class Integrals:
    """An objective of a robot as functions of angles and their derivatives by u.

    Args:
        objective: whose integrand is known.
        robot: that moves.
    """

    objective: Objective
    robot: Robot

    @classmethod
    @lru_cache(maxsize=KEPT)
    def of(cls, objective: Objective, robot: Robot) -> Integrals | None:
        """The same object for the same two, so that its functions are made once; None where it is not known enough."""
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
        known = self.objective.integrand(now)
        assert known is not None
        return known

    @cached_property
    def _parts(self) -> tuple[Matrix, Matrix, Matrix]:
        """For each unit of u: what is squared, (m, 1), vectors below each other, (m, 1), and the rest, scalar."""
        known, duration, none = self._integrand, self._symbols[2], ca.SX(1, 0)
        squares = none if known.squares is None else known.squares
        rest = none if known.rest is None else known.rest
        return ca.sqrt(duration) * squares.T, duration * ca.horzcat(none, *known.lengths).T, duration * total(rest)

    @cached_property
    def vector_of(self) -> NDArray[np.intp]:
        """Which vector each row of these belongs to, (m,)."""
        sizes = [vector.shape[1] for vector in self._integrand.lengths]
        return np.repeat(np.arange(len(sizes)), sizes)

    @cached_property
    def orders(self) -> tuple[int, ...]:
        """Derivatives that matter."""
        state, k = self._symbols[0], self.robot.dof
        depends = np.array(ca.which_depends(ca.vertcat(*self._parts), state, 1, False)).reshape(SAMPLED_ORDERS, k)
        return tuple(np.flatnonzero(depends.any(axis=1)).tolist())

    @cached_property
    def _given(self) -> Matrix:
        """Those that matter, and the duration, (m k + 1, 1)."""
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
        """For each unit of u, (n,).

        Args:
            state: angles and derivatives by u that matter, (n, m k).
            u: (n,).
            durations: of the motion, (n,), s.
        """
        return _mapped(self._values, np.column_stack([state, durations]), u)[0].ravel()

    def linear(self, state: FloatArray, u: FloatArray, duration: float) -> tuple[FloatArray, ...]:
        """To second order, by what is given of :meth:`values`, the duration last.

        Returns:
            What is squared, (n, a), its slopes, (n, a, m k + 1), vectors, (n, b), their slopes, (n, b, m k + 1), and of
            the rest slopes, (n, m k + 1), and second derivatives, (n, m k + 1, m k + 1), or none, (n, 0, m k + 1).
        """
        n, width = state.shape[0], state.shape[1] + 1
        given = np.column_stack([state, np.full(n, duration)])
        squares, by_squares, vectors, by_vectors, first, second = _mapped(self._slopes, given, u)
        return (
            squares, by_squares.reshape(n, squares.shape[1], width),
            vectors, by_vectors.reshape(n, vectors.shape[1], width), first, second.reshape(n, -1, width),
        )  # fmt: skip

    def terminal(self, duration: float) -> tuple[float, float, float]:
        """What the duration in s itself counts, and its derivatives."""
        value, first, second = (float(part) for part in self._terminal(duration))
        return value, first, second


def _mapped(function: ca.Function, *arguments: FloatArray) -> list[FloatArray]:
    """Dense outputs (n, m) of a function for n rows of each of its arguments."""
    n = len(arguments[0])
    mapped = function.map(n)
    given = [np.ascontiguousarray(part) for part in arguments]
    found = [np.empty((n, function.numel_out(number))) for number in range(function.n_out())]
    buffer, evaluate = mapped.buffer()
    for number, part in enumerate(given):
        buffer.set_arg(number, part.data)  # type: ignore[call-arg]
    for number, part in enumerate(found):
        buffer.set_res(number, part.data)  # type: ignore[call-arg]
    evaluate()
    return found


@dataclass(frozen=True, eq=False)
class Nearly:
    """The objective near a motion, for changes of all control points and of the duration.

    Attributes:
        cost: of control points, (pieces + 3, k), s/rad.
        time_cost: of the duration.
        squares: whose halves count; None where there are none.
    """

    cost: FloatArray | None
    time_cost: float
    squares: WholeRows | None

    def change(self, padded: FloatArray, longer: float) -> float:
        """By how much it changes with all control points, (pieces + 3, k), and the duration, s."""
        found = self.time_cost * longer
        if self.cost is not None:
            found += float((self.cost * padded).sum())
        if self.squares is not None:
            before = -self.squares.bound
            after = before + _moved(self.squares, padded, longer)
            found += 0.5 * float((self.squares.price * (after**2 - before**2)).sum())
        return found


def _moved(rows: WholeRows, padded: FloatArray, longer: float) -> FloatArray:
    points = padded[rows.first[:, None] + AT_REST + np.arange(rows.weights.shape[1])]
    return np.asarray(np.einsum("mak,mak->m", rows.weights, points) + rows.by_time * longer)


@dataclass(frozen=True, eq=False)
class Minimised:
    """An objective of motions between two postures, in s.

    Args:
        motions: that are compared.
        integrals: of the objective.
        durations: the shortest and the longest that are allowed, s.
    """

    motions: Deviations
    integrals: Integrals
    durations: tuple[float, float]

    @property
    def _objective(self) -> Objective:
        return self.integrals.objective

    @cached_property
    def _u(self) -> FloatArray:
        """Where the integrand is looked at, (n,): Gauss's points of each piece."""
        edges = self.motions.spline.edges
        begin, width = edges[:-1, None], np.diff(edges)[:, None]
        return np.asarray((begin + width * (SHARES[0] + 1.0) / 2.0).ravel())

    @cached_property
    def _weights(self) -> FloatArray:
        return np.asarray((np.diff(self.motions.spline.edges)[:, None] * SHARES[1] / 2.0).ravel())

    @cached_property
    def _moving(self) -> tuple[PostureRows, ...]:
        return tuple(self.motions.postures(self._u, order) for order in self.integrals.orders)

    def _state(self, padded: FloatArray) -> FloatArray:
        """Angles and derivatives by u that matter, (n, m k)."""
        parts = [rows.values(padded) for rows in self._moving]
        return np.concatenate(parts, axis=1) if parts else np.empty((self._u.size, 0))

    @cached_property
    def scale(self) -> float:
        """What one unit of the objective is worth, s."""
        x = np.zeros((self.motions.free, self.motions.dof))
        value = abs(self._unscaled(x, self._best_of(x, self.motions.direct.duration)))
        least = NEAREST * self._objective.size(self.integrals.robot)
        return self.motions.direct.duration / max(value, least)

    @cached_property
    def bound(self) -> float:
        """No motion is worth less, s."""
        moves = DirectMoves(
            robot=self.integrals.robot,
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
    def has_several(self) -> bool:
        """Whether there may be several best motions, each better than all near it."""
        return not self._objective.direct_is_least

    def _unscaled(self, x: FloatArray, duration: float) -> float:
        if not self._moving:
            return self.integrals.terminal(duration)[0]
        return float(self._of_durations(x, np.array([duration]))[0])

    def _of_durations(self, x: FloatArray, durations: FloatArray) -> FloatArray:
        """The objective of free control points (free, k) run in several durations, (n,) s: (n,)."""
        n, states = self._u.size, [self._state(self.motions.padded(x, each)) for each in durations.tolist()]
        u, each = np.tile(self._u, durations.size), np.repeat(durations, n)
        rates = self.integrals.values(np.concatenate(states), u, each).reshape(durations.size, n)
        return np.asarray(rates @ self._weights + [self.integrals.terminal(each)[0] for each in durations.tolist()])

    def value(self, x: FloatArray, duration: float) -> float:
        """What a motion of free control points (free, k) is worth, s."""
        late = 0.0 if self.in_time(duration) else LATE_PRICE * (duration - self._longest)
        return self.scale * self._unscaled(x, duration) + self._weight_of_time * duration + late

    @property
    def _weight_of_time(self) -> float:
        return 0.0 if self._objective.is_time_dependent else WEIGHT_OF_TIME

    def in_time(self, duration: float) -> bool:
        """Whether a motion of a duration in s is not there too late."""
        return not self.chooses_duration or duration <= self._longest

    def reach(self, duration: float, trust: float) -> tuple[float, float]:
        """How much a program may take from a duration, and add to it, s, where control points move by so much, rad."""
        faster, slower = FASTER * duration, SLOWER * duration
        if not self.chooses_duration:
            return faster, slower
        later = min(slower, self._longest - duration, TIME_TRUST * trust * duration)
        return min(faster, TIME_TRUST * trust * duration), max(later, 0.0)

    @property
    def _longest(self) -> float:
        shortest, longest = self.durations
        return max(longest * (1.0 - NEAREST), shortest)

    def duration(self, least: float, wanted: float) -> float:
        """The duration of a motion that takes at least so much, where a program wants another, s."""
        if not self.chooses_duration:
            return least
        return max(least, min(max(wanted, self.durations[0] * (1.0 + NEAREST)), self._longest))

    def best_duration(self, x: FloatArray, least: float) -> float:
        """The best of free control points (free, k) that take at least so much, s."""
        return self._best_of(x, least) if self.chooses_duration else least

    def _best_of(self, x: FloatArray, least: float) -> float:
        if not self.chooses_duration:
            return least
        low, high = self.duration(least, 0.0), self.duration(least, np.inf)
        best = low
        for _ in range(NARROWING):
            looks = np.geomspace(low, high, LOOKS)
            values = self._of_durations(x, looks)
            number = int(np.argmin(values))
            best = float(looks[number])
            low, high = float(looks[max(number - 1, 0)]), float(looks[min(number + 1, LOOKS - 1)])
        return best

    def nearly(self, x: FloatArray, duration: float) -> Nearly:
        """The objective near a motion of free control points (free, k) of a duration in s."""
        _, slope, bend = self.integrals.terminal(duration)
        time_cost = self.scale * slope + self._weight_of_time + (0.0 if self.in_time(duration) else LATE_PRICE)
        squares = [self._bend(self.scale * bend)] if bend > 0.0 else []
        if not self._moving:
            return Nearly(None, time_cost, joined(squares) if squares else None)
        state = self._state(self.motions.padded(x, duration))
        squared, by_squared, vectors, by_vectors, first, second = self.integrals.linear(state, self._u, duration)
        weights = self.scale * self._weights
        squares += [
            self._rows(squared, by_squared, np.broadcast_to(2.0 * weights[:, None], squared.shape)),
            self._rows(vectors, by_vectors, self._of_lengths(vectors, weights)),
        ]
        squares += [self._convex(second, weights)] if second.size else []
        cost, by_time = self._cost(weights[:, None] * first)
        kept = [rows for rows in squares if rows.bound.size]
        return Nearly(cost, time_cost + by_time, joined(kept) if kept else None)

    def _of_lengths(self, vectors: FloatArray, weights: FloatArray) -> FloatArray:
        """Weights of the squares of vectors (n, m), by those of samples, (n,): (n, m)."""
        lengths = np.zeros((vectors.shape[0], self.integrals.vector_of.max(initial=-1) + 1))
        np.add.at(lengths.T, self.integrals.vector_of, np.square(vectors.T))
        lengths = np.sqrt(lengths)
        least = CORNER * (self._weights @ lengths) + np.finfo(float).tiny
        return np.asarray((weights[:, None] / np.maximum(lengths, least))[:, self.integrals.vector_of])

    def _bend(self, weight: float) -> WholeRows:
        """The square of a change of the duration."""
        one, nothing = np.ones(1), np.zeros((1, 4, self.motions.dof))
        return WholeRows(np.zeros(1, dtype=np.intp), nothing, one, 0.0 * one, weight * one)

    def _rows(self, values: FloatArray, slopes: FloatArray, weights: FloatArray) -> WholeRows:
        """Of values (n, m) with slopes (n, m, w) and weights (n, m)."""
        n, m = values.shape
        sample = np.repeat(np.arange(n), m)
        return self._chosen(sample, values.ravel(), slopes.reshape(n * m, slopes.shape[2]), weights.ravel())

    def _chosen(
        self, sample: NDArray[np.intp], values: FloatArray, slopes: FloatArray, weights: FloatArray
    ) -> WholeRows:
        """Rows (m,) of samples: their values, slopes (m, w) and weights."""
        k, by_points = self.motions.dof, np.zeros((sample.size, 4, self.motions.dof))
        for number, rows in enumerate(self._moving):
            by_points += rows.weights[sample][:, :, None] * slopes[:, None, number * k : (number + 1) * k]
        return WholeRows(self._moving[0].first[sample] - AT_REST, by_points, slopes[:, -1], -values, weights)

    def _convex(self, second: FloatArray, weights: FloatArray) -> WholeRows:
        """The convex part of second derivatives (n, w, w): squares along its axes."""
        sizes, axes = np.linalg.eigh(second)
        largest = np.abs(sizes).max(initial=0.0)
        sample, axis = np.nonzero(sizes > CONVEX * largest)
        return self._chosen(sample, np.zeros(sample.size), axes[sample, :, axis], sizes[sample, axis] * weights[sample])

    def _cost(self, slopes: FloatArray) -> tuple[FloatArray, float]:
        """Of all control points, and of the duration, by slopes of samples (n, w)."""
        k, cost = self.motions.dof, np.zeros_like(self.motions.at_ends)
        for number, rows in enumerate(self._moving):
            own = rows.weights[:, :, None] * slopes[:, None, number * k : (number + 1) * k]
            np.add.at(cost, rows.first[:, None] + np.arange(4), own)
        return cost, float(slopes[:, -1].sum())
