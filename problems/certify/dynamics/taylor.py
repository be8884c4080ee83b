"""Taylor models: a function of one variable as a polynomial and a proven bound of what is left, computed as one goes.

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
from math import factorial

import casadi as ca

DEGREE = 3
ENTRIES = DEGREE + 2  # numbers in a model
ROUNDING = 1e-14  # of what is multiplied or added: more than an operation on models loses in floating point


@dataclass(frozen=True, eq=False)
class TaylorModel:
    """A polynomial, lowest power first, and how far from it the function can be; scalars."""

    coefficients: tuple[ca.SX, ...]
    rest: ca.SX

    @classmethod
    def of(cls, column: ca.SX) -> TaylorModel:
        """From its numbers (ENTRIES,): the coefficients, then the rest."""
        *coefficients, rest = ca.vertsplit(column)
        return cls(tuple(coefficients), rest)

    @property
    def column(self) -> ca.SX:
        """Its numbers (ENTRIES,): the coefficients, then the rest."""
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
        """A multiple."""
        size = ca.fabs(factor)
        multiples = tuple(factor * a for a in self.coefficients)
        return TaylorModel(multiples, size * (self.rest + ROUNDING * self.largest))

    def through(self, derivatives: Sequence[ca.SX]) -> TaylorModel:
        """A function of it whose higher derivatives are at most 1 everywhere.

        Args:
            derivatives: of the function at the middle, DEGREE + 1.
        """
        away = TaylorModel((ca.SX(0.0), *self.coefficients[1:]), self.rest)
        found = TaylorModel((derivatives[0], *([ca.SX(0.0)] * DEGREE)), ca.SX(ROUNDING))
        power = away
        for k in range(1, DEGREE + 1):
            found = found + power.scaled(derivatives[k] / factorial(k))
            power = power * away
        return TaylorModel(found.coefficients, found.rest + away.largest ** (DEGREE + 1) / factorial(DEGREE + 1))


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
    """The same function of models: from those of its inputs, a column (ENTRIES,) each, to those of its outputs.

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
