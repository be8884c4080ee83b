"""Mehrotra's method for linear and convex quadratic programs of control points, in NumPy.

:file:`problems/core/cpp/interior_point.hpp` states program, steps and rules; the matrix of Newton's steps is banded in
the control points and has a border for tau.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.rows import ProgramData


@dataclass(frozen=True, kw_only=True)
class InteriorPointSettings:
    """Settings of the interior-point method, equal to those of the compiled core.

    Values are chosen.

    Attributes:
        most_iterations: steps.
        tolerance: error of rows and of stationarity.
        gap: duality gap against the cost, which counts as 0.1 to 1.
        inside: share of a width that solutions keep from bounds.
        first_slack: smallest slack at the beginning.
        first_mu: mean product of slack and multiplier at the beginning.
        boundary_share: share of the way to the nearest bound that a step takes.
        correctors: Gondzio's correctors of a step.
        least_product: smallest product that is not corrected, against mu.
        largest_product: largest product that is not corrected, against mu.
        long_step: share of a step that needs no corrector.
        aimed_gain: gain of a step that a corrector aims at.
        least_gain: gain of a step that a corrector must have.
        least_width: width of a box below which an unknown is a constant.
        least_pivot: share of a pivot that cannot be distinguished from zero.
        diagonal_shares: shares that are added to the diagonal until there is a factor.
    """

    most_iterations: int = 60
    tolerance: float = 1e-8
    gap: float = 1e-7
    inside: float = 1e-10
    first_slack: float = 0.3
    first_mu: float = 0.1
    boundary_share: float = 0.995
    correctors: int = 2
    least_product: float = 0.1
    largest_product: float = 10.0
    long_step: float = 0.95
    aimed_gain: float = 0.2
    least_gain: float = 0.02
    least_width: float = 1e-12
    least_pivot: float = 1e-15
    diagonal_shares: tuple[float, float, float] = (0.0, 1e-13, 1e-10)


SETTINGS = InteriorPointSettings()


def solve_program(program: ProgramData) -> tuple[FloatArray, float] | None:
    """Control points (n, k) and tau; None where nothing was found."""
    box = Unknowns.of(program)
    if not (box.low <= box.high).all():
        return None
    with np.errstate(all="ignore"):  # numbers that are none end the search
        y = Solver(program, box).solution()
    if y is None:
        return None
    y = box.inside(y, SETTINGS.inside)
    return y[:-1].reshape(program.lower.shape), float(y[-1])


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Control points one after the other, and tau, with their bounds.

    Attributes:
        low: bounds, (n k + 1,).
        high: likewise.
    """

    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, program: ProgramData) -> Unknowns:
        """The unknowns of a program."""
        ends = zip((program.lower, program.upper), program.times, strict=True)
        return cls(*(np.append(np.asarray(points, dtype=np.float64).ravel(), time) for points, time in ends))

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each unknown is a constant."""
        return np.asarray(self.high - self.low <= SETTINGS.least_width)

    def inside(self, values: FloatArray, share: float) -> FloatArray:
        """The point nearest to values that keeps a share of each width from both bounds."""
        margin = share * np.minimum(self.high - self.low, 1.0)
        within = np.maximum(self.low + margin, np.minimum(self.high - margin, values))
        return np.where(self.fixed, self.low, within)


@dataclass(frozen=True, eq=False)
class Block:
    """Rows that touch a few unknowns each.

    Attributes:
        columns: numbers of the unknowns that each touches, ascending, (m, w).
        weights: of these, (m, w); zero where there is no such unknown.
        by_time: (m,).
        bound: (m,).
    """

    columns: NDArray[np.intp]
    weights: FloatArray
    by_time: FloatArray
    bound: FloatArray

    @classmethod
    def of(
        cls, first: NDArray[np.intp], joints: NDArray[np.intp], weights: FloatArray, by_time: FloatArray,
        bound: FloatArray, points: int, box: Unknowns,
    ) -> Block:  # fmt: skip
        """Rows from a first control point on, of joints (m, j), weights (m, w, j), grouped by place."""
        k, size = (len(box.low) - 1) // points, weights.shape[1] * weights.shape[2]
        at = first[:, None] + np.arange(weights.shape[1])
        known = (at >= 0) & (at < points)
        columns = (np.clip(at, 0, points - 1)[:, :, None] * k + joints[:, None, :]).reshape(len(first), size)
        weights = np.where(known[:, :, None], weights, 0.0).reshape(len(first), size)
        constant = box.fixed[columns]
        bound = bound - np.where(constant, weights * box.low[columns], 0.0).sum(axis=1)
        if box.fixed[-1]:
            bound, by_time = bound - by_time * box.low[-1], np.zeros(len(by_time))
        return cls(columns, np.where(constant, 0.0, weights), by_time, bound)

    @cached_property
    def _places(self) -> Places:
        """Rows that touch the same unknowns, grouped."""
        begins = np.flatnonzero(np.concatenate([[True], (np.diff(self.columns, axis=0) != 0).any(axis=1)]))
        counts = np.diff(np.append(begins, len(self.columns)))
        within = np.arange(counts.max())
        rows = np.where(within < counts[:, None], begins[:, None] + within, len(self.columns))
        weights = np.concatenate([self.weights, np.zeros((1, self.columns.shape[1]))])[rows]
        one, two = np.broadcast_arrays(self.columns[begins][:, :, None], self.columns[begins][:, None, :])
        below = np.flatnonzero((one >= two).ravel())  # where it is not, an unknown is none and has no weight
        return Places(rows, weights, below, one.ravel()[below], two.ravel()[below])

    def add_squares(self, weight: FloatArray, band: FloatArray) -> None:
        """Add the products of rows with weights (m,) to the lower band of a symmetric matrix, (depth, n)."""
        if len(weight):
            places = self._places
            weighed = places.weights * np.append(weight, 0.0)[places.rows][:, :, None]
            squares = (places.weights.transpose(0, 2, 1) @ weighed).ravel()[places.below]
            at = (places.row - places.column) * band.shape[1] + places.column
            band += np.bincount(at, squares, band.size).reshape(band.shape)


class Places(NamedTuple):
    """Rows grouped by the unknowns that they touch.

    Attributes:
        rows: numbers of those at each place, (places, most); one more than there are where there is none.
        weights: of these, (places, most, w).
        below: which of all products of two weights, (places, w, w), are not above the diagonal, (p,).
        row: the unknown of the first of the two, (p,).
        column: that of the second.
    """

    rows: NDArray[np.intp]
    weights: FloatArray
    below: NDArray[np.intp]
    row: NDArray[np.intp]
    column: NDArray[np.intp]


class Rows:
    """The rows G and bounds h of ``G y - sigma <= h``: of all joints, of one joint, upper and lower bounds.

    Attributes:
        bound: h, (m,).
        price: of sigma, (soft,): of the first rows, those that have a price.
        soft: how many they are.
        bounds: where bounds of unknowns begin.
    """

    def __init__(self, program: ProgramData, box: Unknowns) -> None:
        every, one, (n, k) = program.whole, program.single, program.lower.shape
        kept = (every.price > 0.0) & (every.bound != np.inf)
        own, all_joints = np.flatnonzero(one.bound != np.inf), np.arange(k)[None]
        soft, hard = (
            chosen[np.argsort(every.first[chosen], kind="stable")]
            for chosen in map(np.flatnonzero, (kept & np.isfinite(every.price), kept & np.isinf(every.price)))
        )
        own = own[np.lexsort((one.joint[own], one.first[own]))]
        self.price = every.price[soft]
        whole = [
            Block.of(
                every.first[chosen], np.repeat(all_joints, len(chosen), axis=0), every.weights[chosen],
                every.by_time[chosen], every.bound[chosen], n, box,
            )
            for chosen in (soft, hard)
        ]  # fmt: skip
        single = Block.of(
            one.first[own], one.joint[own][:, None], one.weights[own][:, :, None], one.by_time[own], one.bound[own], n,
            box,
        )  # fmt: skip
        self._blocks, self.soft = (*whole, single), len(self.price)
        self._up = np.flatnonzero(np.isfinite(box.high) & ~box.fixed)
        self._down = np.flatnonzero(np.isfinite(box.low) & ~box.fixed)
        self._time = np.concatenate([block.by_time for block in self._blocks])
        self.bounds, self._depth = len(self._time), min(one.weights.shape[1] * k, n * k)
        own_bounds = [block.bound for block in self._blocks]
        self.bound = np.concatenate([*own_bounds, box.high[self._up], -box.low[self._down]])
        self._matrix = self._sparse(len(box.low))
        self._transposed = self._matrix.T.tocsr()

    def _sparse(self, width: int) -> scipy.sparse.csr_array:
        begins = np.cumsum([0, *(len(block.bound) for block in self._blocks)])
        parts = [
            (
                block.weights.ravel(),
                np.repeat(np.arange(len(block.bound)) + begin, block.columns.shape[1]),
                block.columns.ravel(),
            )
            for block, begin in zip(self._blocks, begins, strict=False)
        ]
        m, up, down = self.bounds, self._up, self._down
        parts += [
            (self._time, np.arange(m), np.full(m, width - 1)),
            (np.ones(up.size), m + np.arange(up.size), up),
            (-np.ones(down.size), m + up.size + np.arange(down.size), down),
        ]
        values, rows, columns = (np.concatenate(column) for column in zip(*parts, strict=True))
        return scipy.sparse.csr_array((values, (rows, columns)), shape=(len(self.bound), width))

    def apply(self, y: FloatArray) -> FloatArray:
        """The product G y, (m,)."""
        return np.asarray(self._matrix @ y)

    def transpose(self, z: FloatArray) -> FloatArray:
        """The product G' z with multipliers z, (m,)."""
        return np.asarray(self._transposed @ z)

    def weighed(self, weight: FloatArray, squares: Squares) -> Bordered | None:
        """The factored matrix G'DG of weights (m,) plus that of squares, or None where it cannot be factored."""
        band = np.zeros((self._depth, self._matrix.shape[1] - 1))
        begin = 0
        for block in self._blocks:
            block.add_squares(weight[begin : begin + len(block.bound)], band)
            begin += len(block.bound)
        diagonal = np.zeros(band.shape[1] + 1)
        diagonal[self._up] += weight[self.bounds : self.bounds + self._up.size]
        diagonal[self._down] += weight[self.bounds + self._up.size :]
        band[0] += diagonal[:-1]
        by_time = weight[: self.bounds] * self._time
        border = self.transpose(np.append(by_time, np.zeros(len(weight) - self.bounds)))
        squares.add_to(band, border)
        band[0, band[0] == 0.0] = 1.0  # an unknown that no row touches
        return Bordered.of(band, border[:-1], float(border[-1]) + float(diagonal[-1]))


class Squares:
    """Half the weighted sum of squares of how far rows are from their bounds."""

    def __init__(self, program: ProgramData, box: Unknowns) -> None:
        rows, (n, k) = program.squares, program.lower.shape
        self.none = rows is None or not len(rows.bound)
        if rows is None or self.none:
            return
        order = np.argsort(rows.first, kind="stable")
        joints = np.repeat(np.arange(k)[None], len(order), axis=0)
        self._block = Block.of(
            rows.first[order], joints, rows.weights[order], rows.by_time[order], rows.bound[order], n, box
        )
        self._weight = rows.price[order]
        columns, m = self._block.columns, len(order)
        matrix = scipy.sparse.csr_array(
            (self._block.weights.ravel(), (np.repeat(np.arange(m), columns.shape[1]), columns.ravel())),
            shape=(m, len(box.low) - 1),
        )
        self._matrix, self._transposed = matrix, matrix.T.tocsr()

    def _away(self, y: FloatArray) -> FloatArray:
        return np.asarray(self._matrix @ y[:-1] + self._block.by_time * y[-1] - self._block.bound)

    def gradient(self, y: FloatArray) -> FloatArray:
        """The first derivatives, (n k + 1,)."""
        if self.none:
            return np.zeros_like(y)
        away = self._weight * self._away(y)
        return np.append(np.asarray(self._transposed @ away), _sum(self._block.by_time, away))

    def value(self, y: FloatArray) -> float:
        """The value of the half sum."""
        return 0.0 if self.none else 0.5 * _sum(self._weight, self._away(y) ** 2)

    def add_to(self, band: FloatArray, border: FloatArray) -> None:
        """Add second derivatives to a lower band, (depth, n k), and its border with the corner, (n k + 1,)."""
        if not self.none:
            self._block.add_squares(self._weight, band)
            by_time = self._weight * self._block.by_time
            border += np.append(np.asarray(self._transposed @ by_time), _sum(self._block.by_time, by_time))


@dataclass(frozen=True, eq=False)
class Bordered:
    """A banded matrix with a border of one row and column, factored.

    Attributes:
        factor: of the banded part.
        border: (n,).
        solved: what the banded part makes of that.
        inverse: of the last pivot; 0 where no row resists that direction.
    """

    factor: FloatArray
    border: FloatArray
    solved: FloatArray
    inverse: float

    @classmethod
    def of(cls, band: FloatArray, border: FloatArray, corner: float) -> Bordered | None:
        """The factored matrix, or None where it is not positive definite to rounding."""
        for share in SETTINGS.diagonal_shares:
            stiffer = band.copy()
            stiffer[0] *= 1.0 + share
            factor, wrong = scipy.linalg.lapack.dpbtrf(stiffer, lower=1, overwrite_ab=1)
            if wrong == 0:
                solved = scipy.linalg.lapack.dpbtrs(factor, border, lower=1)[0]
                pivot = corner - _sum(border, solved)
                return cls(factor, border, solved, 1.0 / pivot if pivot > SETTINGS.least_pivot * abs(corner) else 0.0)
        return None

    def solve(self, right: FloatArray) -> FloatArray:
        """The solution, (n + 1,)."""
        last = (right[-1] - _sum(self.solved, right[:-1])) * self.inverse
        return np.append(scipy.linalg.lapack.dpbtrs(self.factor, right[:-1], lower=1)[0] - self.solved * last, last)


@dataclass(frozen=True, eq=False)
class Step:
    """A change of all unknowns, slacks and multipliers.

    Attributes:
        y: of the unknowns.
        along: G y.
        s: of slacks.
        z: of multipliers.
        sigma: of what is missing in soft rows.
        v: of its multipliers.
        primal: share of it that keeps s and sigma positive.
        dual: share that keeps z and v positive.
    """

    y: FloatArray
    along: FloatArray
    s: FloatArray
    z: FloatArray
    sigma: FloatArray
    v: FloatArray
    primal: float
    dual: float


def _sum(a: FloatArray, b: FloatArray) -> float:
    """The sum of products, without a library's own threads, which would cost more than they save."""
    return float((a * b).sum())


def _share(step: FloatArray, values: FloatArray) -> float:
    """The share of a step that takes the first of these values to zero, or 1."""
    return float(1.0 / max(1.0, (-step / values).max(initial=1.0)))


def _correction(product: FloatArray, mu: float) -> FloatArray:
    low, high = SETTINGS.least_product * mu, SETTINGS.largest_product * mu
    return np.maximum(np.clip(product, low, high) - product, -high)


class Solver:
    """One program on its way to a solution; s, z, sigma, v and y are the iterate, excess is ``G y - h``."""

    def __init__(self, program: ProgramData, box: Unknowns) -> None:
        self.rows = Rows(program, box)
        cost = np.zeros(len(box.low)) if program.cost is None else np.append(program.cost.ravel(), 0.0)
        cost[-1] = program.time_cost
        self._squares = Squares(program, box)
        self._cost, self._free_cost = cost, np.where(box.fixed, 0.0, cost)
        rows, soft = self.rows, self.rows.soft
        self.y = box.inside(np.zeros(len(cost)), 0.1)
        self.excess = rows.apply(np.where(box.fixed, 0.0, self.y)) - rows.bound
        self.s = np.maximum(-self.excess, np.where(np.arange(len(rows.bound)) < rows.bounds, SETTINGS.first_slack, 0.0))
        # s - sigma = room, s z = sigma (price - z) = mu
        least, room = SETTINGS.first_mu / rows.price, -self.excess[:soft]
        root = np.sqrt(0.25 * room * room + least * least)
        above = np.where(room > 0.0, root + 0.5 * room, least * least / (root - 0.5 * room))
        self.s[:soft] = least + above
        self.z = SETTINGS.first_mu / self.s
        self.v = rows.price * above / self.s[:soft]
        self.sigma = SETTINGS.first_mu / self.v

    def solution(self) -> FloatArray | None:
        """The unknowns, or None where the method did not converge."""
        rows, products = self.rows, len(self.s) + len(self.sigma)
        for _ in range(SETTINGS.most_iterations):
            dual = rows.transpose(self.z) + self._free_cost + self._squares.gradient(self.y)
            error, gap = self._error(dual), _sum(self.s, self.z) + _sum(self.sigma, self.v)
            if not (error < 1e100 and gap < 1e100):
                return None
            if error <= SETTINGS.tolerance and gap <= SETTINGS.gap * max(0.1, min(abs(self._value()), 1.0)):
                return self.y
            soft = rows.soft
            weight = self.z / self.s
            weight[:soft] = 1.0 / (self.s[:soft] / self.z[:soft] + self.sigma / self.v)
            matrix = rows.weighed(weight, self._squares)
            if matrix is None:
                return None
            newton = Newton(self, weight, dual, matrix)
            step = newton(np.zeros(len(self.s)), np.zeros(soft))
            mu = (self._complement(step, step.primal, step.dual) / gap) ** 3 * gap / products
            q, p = mu - step.s * step.z, mu - step.sigma * step.v
            self._advance(self._corrected(newton, newton(q, p), q, p, mu))
        return None

    def _error(self, dual: FloatArray) -> float:
        """The greatest error of a row and of the stationarity."""
        missing = self.excess + self.s
        missing[: self.rows.soft] -= self.sigma
        return float(np.max([np.abs(dual).max(), np.abs(missing).max(initial=0.0)]))

    def _value(self) -> float:
        return _sum(self._cost, self.y) + _sum(self.rows.price, self.sigma) + self._squares.value(self.y)

    def _complement(self, step: Step, primal: float, dual: float) -> float:
        """The sum of all products after shares of a step."""
        total = _sum(self.s + primal * step.s, self.z + dual * step.z)
        return total + _sum(self.sigma + primal * step.sigma, self.v + dual * step.v)

    def _corrected(self, newton: Newton, step: Step, q: FloatArray, p: FloatArray, mu: float) -> Step:
        """Gondzio's correctors, which aim products that a longer step would leave far from mu at the edge of near."""
        for _ in range(SETTINGS.correctors):
            if min(step.primal, step.dual) >= SETTINGS.long_step:
                break
            primal, dual = min(1.0, step.primal + SETTINGS.aimed_gain), min(1.0, step.dual + SETTINGS.aimed_gain)
            q = q + _correction((self.s + primal * step.s) * (self.z + dual * step.z), mu)
            p = p + _correction((self.sigma + primal * step.sigma) * (self.v + dual * step.v), mu)
            trial = newton(q, p)
            if trial.primal + trial.dual < step.primal + step.dual + SETTINGS.least_gain:
                break
            step = trial
        return step

    def _advance(self, step: Step) -> None:
        primal, dual = (min(1.0, SETTINGS.boundary_share * share) for share in (step.primal, step.dual))
        if not self._squares.none:  # which keeps the error of the stationarity shrinking
            primal = dual = min(primal, dual)
        self.y = self.y + primal * step.y
        self.excess = self.excess + primal * step.along
        self.s, self.sigma = self.s + primal * step.s, self.sigma + primal * step.sigma
        self.z, self.v = self.z + dual * step.z, self.v + dual * step.v


@dataclass(frozen=True, eq=False)
class Newton:
    """Newton steps from one point.

    Attributes:
        at: the point.
        weight: D, (m,).
        dual: f' + G'z.
        matrix: f'' + G'DG.
    """

    at: Solver
    weight: FloatArray
    dual: FloatArray
    matrix: Bordered

    def __call__(self, q: FloatArray, p: FloatArray) -> Step:
        """The step towards s z = q and sigma v = p."""
        at, rows = self.at, self.at.rows
        soft = rows.soft
        e = at.excess + q / at.z
        e[:soft] -= p / at.v
        y = self.matrix.solve(-(self.dual + rows.transpose(self.weight * e)))
        along = rows.apply(y)
        z = self.weight * (along + e)
        s = -(along + at.excess + at.s)
        moved = (p + at.sigma * z[:soft]) / at.v
        s[:soft] += moved
        sigma, v = moved - at.sigma, -z[:soft]
        primal = min(_share(s, at.s), _share(sigma, at.sigma))
        return Step(y, along, s, z, sigma, v, primal, min(_share(z, at.z), _share(v, at.v)))
