"""Taylor models over cells of time.

On ``-1 <= s <= 1`` a model stands for every function that is nowhere farther than ``rest`` from a polynomial of degree
``DEGREE``. A product of two models is one again: what exceeds the degree goes to the rest, and so does rounding, so
that bounds hold in floating point too. Over a cell of length h the rest shrinks as h^4; what plain intervals add, as h.

[1] K. Makino, M. Berz: Taylor models and other validated functional inclusion methods. International Journal of Pure
    and Applied Mathematics 4 (2003).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from math import comb, factorial, perm

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.motions import Trajectory

DEGREE = 3
ENTRIES = DEGREE + 2  # numbers in a model
ROUNDING = 1e-14  # relative: more than an operation on models loses in floating point


@dataclass(frozen=True, eq=False)
class TaylorModel:
    """A polynomial, lowest power first, and how far from it the function can be; scalars."""

    coefficients: tuple[ca.SX, ...]
    rest: ca.SX

    @classmethod
    def of(cls, column: ca.SX) -> TaylorModel:
        """The model of a column (ENTRIES,): the coefficients, then the rest."""
        *coefficients, rest = ca.vertsplit(column)
        return cls(tuple(coefficients), rest)

    @property
    def column(self) -> ca.SX:
        """The column of the model (ENTRIES,): the coefficients, then the rest."""
        return ca.vertcat(*self.coefficients, self.rest)

    @cached_property
    def tails(self) -> tuple[ca.SX, ...]:
        """The largest absolute value of the polynomial from each power on, (DEGREE + 1,)."""
        tails = [ca.fabs(self.coefficients[-1])]
        for coefficient in self.coefficients[-2::-1]:
            tails.append(ca.fabs(coefficient) + tails[-1])
        return tuple(tails[::-1])

    @cached_property
    def largest(self) -> ca.SX:
        """A bound of its absolute value."""
        return self.tails[0] + self.rest

    def __add__(self, other: TaylorModel) -> TaylorModel:
        sums = tuple(a + b for a, b in zip(self.coefficients, other.coefficients, strict=True))
        return TaylorModel(sums, self.rest + other.rest + ROUNDING * (self.largest + other.largest))

    def __neg__(self) -> TaylorModel:
        return TaylorModel(tuple(-a for a in self.coefficients), self.rest)

    def __sub__(self, other: TaylorModel) -> TaylorModel:
        return self + -other

    def __mul__(self, other: TaylorModel) -> TaylorModel:
        a, b = self.coefficients, other.coefficients
        products = tuple(_sum([a[i] * b[k - i] for i in range(k + 1)]) for k in range(DEGREE + 1))
        higher = _sum([ca.fabs(a[i]) * other.tails[DEGREE + 1 - i] for i in range(1, DEGREE + 1)])
        uncertain = self.rest * other.largest + self.tails[0] * other.rest
        return TaylorModel(products, higher + uncertain + ROUNDING * self.largest * other.largest)

    def scaled(self, factor: float | ca.SX) -> TaylorModel:
        """The product of the model and a number."""
        size = ca.fabs(factor)
        multiples = tuple(factor * a for a in self.coefficients)
        return TaylorModel(multiples, size * (self.rest + ROUNDING * self.largest))

    def through(self, derivatives: Sequence[ca.SX]) -> TaylorModel:
        """A function of it whose higher derivatives are at most 1 everywhere.

        Args:
            derivatives: of the function at the middle, DEGREE + 1.
        """
        away = TaylorModel((ca.SX(0.0), *self.coefficients[1:]), self.rest)
        series = TaylorModel((derivatives[0], *([ca.SX(0.0)] * DEGREE)), ca.SX(ROUNDING))
        power = away
        for k in range(1, DEGREE + 1):
            series = series + power.scaled(derivatives[k] / factorial(k))
            power = power * away
        return TaylorModel(series.coefficients, series.rest + away.largest ** (DEGREE + 1) / factorial(DEGREE + 1))


def _sum(terms: Sequence[ca.SX]) -> ca.SX:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def _sine(a: TaylorModel) -> TaylorModel:
    s, c = ca.sin(a.coefficients[0]), ca.cos(a.coefficients[0])
    return a.through([s, c, -s, -c, s, c][: DEGREE + 1])


def _cosine(a: TaylorModel) -> TaylorModel:
    s, c = ca.sin(a.coefficients[0]), ca.cos(a.coefficients[0])
    return a.through([c, -s, -c, s, c, -s][: DEGREE + 1])


OPERATIONS: dict[int, Callable[..., TaylorModel]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_NEG: lambda a: -a,
    ca.OP_SQ: lambda a: a * a,
    ca.OP_TWICE: lambda a: a + a,
    ca.OP_SIN: _sine,
    ca.OP_COS: _cosine,
}


@cache
def _operation(code: int) -> ca.Function:
    """An operation on models as a function of their columns: one call in the place of many small ones."""
    operate = OPERATIONS[code]
    columns = [ca.SX.sym("model", ENTRIES) for _ in range(operate.__code__.co_argcount)]
    return ca.Function("operation", columns, [operate(*(TaylorModel.of(column) for column in columns)).column])


def modelled(function: ca.Function) -> ca.Function:
    """A function on models: from columns (ENTRIES,) of its inputs to columns of its outputs.

    Args:
        function: SX, of one vector (n,), with one dense output (m,), made of sums, products, sines and cosines.

    Returns:
        From (n ENTRIES,) to (m ENTRIES,).
    """
    symbols = ca.SX.sym("models", function.nnz_in(0) * ENTRIES)
    inputs = ca.vertsplit(symbols, ENTRIES)
    outputs = [ca.SX(ENTRIES, 1)] * function.nnz_out(0)
    work: dict[int, ca.SX] = {}
    for k in range(function.n_instructions()):
        code, sources, targets = (
            function.instruction_id(k),
            function.instruction_input(k),
            function.instruction_output(k),
        )
        if code == ca.OP_OUTPUT:
            outputs[targets[1]] = work[sources[0]]
        elif code == ca.OP_INPUT:
            work[targets[0]] = inputs[sources[1]]
        elif code == ca.OP_CONST:
            work[targets[0]] = ca.vertcat(function.instruction_constant(k), ca.SX.zeros(ENTRIES - 1))
        else:
            work[targets[0]] = _operation(code)(*(work[i] for i in sources))
    return ca.Function("models", [symbols], [ca.densify(ca.vertcat(*outputs))])


ORDERS = 3  # angles, speeds, accelerations


@dataclass(frozen=True, eq=False)
class TimeCells:
    """Cells of time, none of which crosses a breakpoint, so that derivatives may jump there.

    Args:
        trajectory: the motion.
        pieces: in which each lies, (n,).
        middles: from the start of the piece, (n,), s.
        halves: of their lengths, (n,), s.
    """

    trajectory: Trajectory
    pieces: NDArray[np.intp]
    middles: FloatArray
    halves: FloatArray

    @classmethod
    def over(cls, trajectory: Trajectory, at_least: int) -> TimeCells:
        """Cells over the whole motion, at least so many, equally long in each piece."""
        durations = np.diff(trajectory.breakpoints)
        each = int(np.ceil(at_least / durations.size))
        lengths = np.repeat(durations / each, each)
        pieces = np.repeat(np.arange(durations.size), each)
        return cls(trajectory, pieces, (np.tile(np.arange(each), durations.size) + 0.5) * lengths, lengths / 2.0)

    def __len__(self) -> int:
        return int(self.pieces.size)

    @property
    def first(self) -> tuple[float, float]:
        """Start and end of the first cell, s."""
        start, end = (float(self.moments(side * np.ones(len(self))).times[0]) for side in (-1.0, 1.0))
        return start, end

    def halved(self, chosen: NDArray[np.bool_]) -> TimeCells:
        """The halves of chosen cells, (n,) of them."""
        pieces, middles, halves = self.pieces[chosen], self.middles[chosen], self.halves[chosen] / 2.0
        both = np.concatenate([middles - halves, middles + halves])
        return TimeCells(self.trajectory, np.tile(pieces, 2), both, np.tile(halves, 2))

    def divided(self, most: int) -> list[TimeCells]:
        """The cells in parts of at most so many."""
        edges = np.arange(most, len(self), most)
        parts = (np.split(values, edges) for values in (self.pieces, self.middles, self.halves))
        return [TimeCells(self.trajectory, *part) for part in zip(*parts, strict=True)] if len(self) else []

    def moments(self, shares: FloatArray) -> PieceTimes:
        """A time in each cell, (n,): -1 at its start, 1 at its end."""
        return PieceTimes(self.trajectory, self.pieces, self.middles + shares * self.halves)

    def models(self) -> FloatArray:
        """Angles, speeds and accelerations of all k joints as Taylor models, (3 k ENTRIES, n), joint by joint."""
        coefficients = self.trajectory.coefficients[::-1]
        local, ends = coefficients[:, self.pieces], self.middles + self.halves
        around = shifted(local, self.middles)
        sizes = shifted(np.abs(local), ends)
        models = [self._modelled(around, sizes, order) for order in range(ORDERS)]
        return np.concatenate(models).reshape(-1, len(self))

    def _modelled(self, around: FloatArray, sizes: FloatArray, order: int) -> FloatArray:
        """Models of one derivative, (k, ENTRIES, n)."""
        degree, _, joints = around.shape
        models = np.zeros((joints, ENTRIES, len(self)))
        for power in range(degree - order):
            term = (perm(power + order, order) * around[power + order] * self.halves[:, None] ** power).T
            if power <= DEGREE:
                models[:, power] = term
            else:
                models[:, -1] += np.abs(term)
        if order < degree:
            models[:, -1] += ROUNDING * (perm(order, order) * sizes[order]).T
        return models


@dataclass(frozen=True, eq=False)
class PieceTimes:
    """Times of a motion, each seen from the piece that it is in.

    Args:
        trajectory: the motion.
        pieces: (n,).
        offsets: from the start of the piece, (n,), s.
    """

    trajectory: Trajectory
    pieces: NDArray[np.intp]
    offsets: FloatArray

    @classmethod
    def at(cls, trajectory: Trajectory, times: FloatArray) -> PieceTimes:
        """Times (n,) in s, and both sides of every breakpoint."""
        last = trajectory.breakpoints.size - 2
        pieces = np.clip(np.searchsorted(trajectory.breakpoints, times, side="right") - 1, 0, last)
        offsets = times - trajectory.breakpoints[pieces]
        every, durations = np.arange(last + 1), np.diff(trajectory.breakpoints)
        return cls(
            trajectory,
            np.concatenate([pieces, every, every]),
            np.concatenate([offsets, np.zeros(last + 1), durations]),
        )

    @property
    def times(self) -> FloatArray:
        """The times of all moments, (n,), s."""
        return np.asarray(self.trajectory.breakpoints[self.pieces] + self.offsets)

    def chosen(self, some: NDArray[np.intp]) -> PieceTimes:
        """Some of the moments, by their numbers."""
        return PieceTimes(self.trajectory, self.pieces[some], self.offsets[some])

    def together(self, other: PieceTimes) -> PieceTimes:
        """The moments of this and another object, of one motion."""
        pieces = np.concatenate([self.pieces, other.pieces])
        return PieceTimes(self.trajectory, pieces, np.concatenate([self.offsets, other.offsets]))

    def derivatives(self) -> FloatArray:
        """Angles, speeds and accelerations of all k joints, (3 k, n)."""
        around = shifted(self.trajectory.coefficients[::-1][:, self.pieces], self.offsets, ORDERS)
        parts = [perm(n, n) * around[n].T if n < len(around) else np.zeros_like(around[0].T) for n in range(ORDERS)]
        return np.concatenate(parts)


def shifted(coefficients: FloatArray, offsets: FloatArray, count: int | None = None) -> FloatArray:
    """Polynomials around other times.

    Args:
        coefficients: (m, n, k), lowest power first.
        offsets: of the new middles, (n,).
        count: how many of the new coefficients; all where None.

    Returns:
        (count, n, k).
    """
    m = len(coefficients)
    powers = offsets[:, None] ** np.arange(m)[:, None, None]
    moved = [sum(comb(j, i) * coefficients[j] * powers[j - i] for j in range(i, m)) for i in range(min(m, count or m))]
    return np.array(moved)
