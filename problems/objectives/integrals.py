"""Integrands of objectives, and their integrals over time: exact of finished motions, by parts for programs.

All cells that are left are evaluated at once: SciPy's ``cubature``, which settles one after the other, takes twenty
times as long here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import sqrt

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix


@dataclass(frozen=True, eq=False, kw_only=True)
class Integrand:
    """The integrand at n samples, made of smooth functions: the sum over all that it names.

    What programs make of a motion near by depends on how it is made: a square of a function is the square of one that
    is linear there, and so on; only of the rest second derivatives are taken.

    Attributes:
        squares: functions whose squares count, (n, m).
        lengths: vectors whose lengths count, (n, d) each.
        rest: functions that count themselves, (n, m).
    """

    squares: Matrix | None = None
    lengths: tuple[Matrix, ...] = ()
    rest: Matrix | None = None

    @property
    def values(self) -> Matrix:
        """The values of all columns, (n, m)."""
        squared = () if self.squares is None else (self.squares * self.squares,)
        lengths = (ca.fabs(v) if v.shape[1] == 1 else ca.sqrt(ca.sum2(v * v)) for v in self.lengths)
        return ca.horzcat(*squared, *lengths, *(() if self.rest is None else (self.rest,)))

    def weighted(self, weight: float) -> Integrand:
        """The integrand times a positive weight."""
        return Integrand(
            squares=None if self.squares is None else sqrt(weight) * self.squares,
            lengths=tuple(weight * vector for vector in self.lengths),
            rest=None if self.rest is None else weight * self.rest,
        )

    @classmethod
    def sum_of(cls, parts: Sequence[Integrand]) -> Integrand:
        """The sum of several integrands."""

        def columns(each: Iterable[Matrix | None]) -> Matrix | None:
            found = [part for part in each if part is not None]
            return ca.horzcat(*found) if found else None

        return cls(
            squares=columns(part.squares for part in parts),
            lengths=tuple(vector for part in parts for vector in part.lengths),
            rest=columns(part.rest for part in parts),
        )


NODES, WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True, kw_only=True)
class QuadratureSettings:
    """Settings of integrals over finished motions.

    Values are chosen.

    Attributes:
        relative_tolerance: share of the integral of |f|, divided among the cells by their lengths.
        most_halvings: halvings of a cell.
        most_cells: cells at once; more are only left where the integrand is nothing but rounding.
    """

    relative_tolerance: float = 1e-11
    most_halvings: int = 48
    most_cells: int = 20_000


SETTINGS = QuadratureSettings()


def integral(f: Callable[[FloatArray], FloatArray], edges: FloatArray, floor: float) -> float:
    """The integral of f from the first edge to the last; to 1e-9, kinks between the edges included.

    Args:
        f: values (n,) at arguments (n,).
        edges: increasing, (m,): where f may have kinks that need no search.
        floor: what is too small to matter, in the unit of the integral.
    """
    starts, ends = edges[:-1], edges[1:]
    coarse, settled = _gauss(f, starts, ends), 0.0
    allowed = (SETTINGS.relative_tolerance * np.abs(coarse).sum() + floor) / (edges[-1] - edges[0])
    for _ in range(SETTINGS.most_halvings):
        middles = (starts + ends) / 2.0
        halves = np.array([_gauss(f, starts, middles), _gauss(f, middles, ends)])
        fine = halves.sum(axis=0)
        left = np.abs(fine - coarse) > allowed * (ends - starts)
        settled += float(fine[~left].sum())
        if not left.any() or 2 * left.sum() > SETTINGS.most_cells:
            return settled + float(fine[left].sum())
        coarse = halves[:, left].ravel()
        starts, ends = np.append(starts[left], middles[left]), np.append(middles[left], ends[left])
    return settled + float(coarse.sum())


def _gauss(f: Callable[[FloatArray], FloatArray], starts: FloatArray, ends: FloatArray) -> FloatArray:
    """The integral over each cell, by one rule."""
    half = (ends - starts)[:, None] / 2.0
    points = (starts + ends)[:, None] / 2.0 + half * NODES
    return np.asarray((f(points.ravel()).reshape(points.shape) * half) @ WEIGHTS)
