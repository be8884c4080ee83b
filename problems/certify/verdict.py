"""Verdicts: proven, violated, or undecided."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from problems.base import FloatArray, as_array
from problems.limits import Constraint

TOLERANCE = 1e-9  # relative to the constraint's scale; allows for rounding only


class WorstIs(StrEnum):
    """The meaning of the worst value of a verdict."""

    EXACT = "exact"  # to rounding
    BOUND = "bound"  # proven: no value is worse
    FOUND = "found"  # the worst of many times, followed to its peak; that the limit holds is proven without it

    def in_words(self, value: str) -> str:
        """A value in words; bounds are those of clearances."""
        return {WorstIs.EXACT: value, WorstIs.BOUND: f"at least {value}, proven", WorstIs.FOUND: f"{value} found"}[self]

    def number(self, value: float) -> str:
        """A number of six digits in words; a proven one is rounded down."""
        text = f"{value:.6g}"
        if self is WorstIs.BOUND and float(text) > value:
            text = f"{value - 0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - 5):.6g}"
        return self.in_words(text)

    def distance(self, metres: float) -> str:
        """A distance in mm in words; a proven one is rounded down."""
        tenths = 1e4 * metres
        return self.in_words(f"{(math.floor(tenths) if self is WorstIs.BOUND else tenths) / 10.0:.1f} mm")


class CertificateStatus(StrEnum):
    """Whether a constraint is proven to hold, known to be broken, or neither."""

    CERTIFIED = "certified"  # holds, proven
    VIOLATED = "violated"  # broken, at a time that is known
    UNDECIDED = "undecided"  # neither could be shown


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The result of checking one constraint on a trajectory.

    Attributes:
        name: the constraint's.
        worst: the value nearest to, or farthest beyond, its bound; in ``unit``.
        bound: the bound that it is measured against.
        unit: of both.
        status: whether the bound holds, to ``TOLERANCE`` of its scale: for all t, or at the points that it is about.
        where: the column and the time in s of the worst value.
        worst_is: that value itself, a proven bound of it, or the worst that was found.
        time: of the worst value, s; None where it is not about a time.
        cell: start and end, s, of a cell of time in which it could not be decided; None where it was, and where no cell
            is to blame.
    """

    name: str
    worst: float
    bound: float
    unit: str
    status: CertificateStatus
    where: str
    worst_is: WorstIs = WorstIs.EXACT
    time: float | None = field(default=None, repr=False)
    cell: tuple[float, float] | None = field(default=None, repr=False)

    @property
    def satisfied(self) -> bool:
        """Whether the bound is certain to hold."""
        return self.status is CertificateStatus.CERTIFIED

    def undecided_in(self, cell: tuple[float, float] | None) -> Verdict:
        """An undecided verdict, with the cell of time that is to blame, where there is one."""
        if cell is None:
            return replace(self, status=CertificateStatus.UNDECIDED)
        return replace(
            self, status=CertificateStatus.UNDECIDED, cell=cell, where=f"{self.where}; {cell_in_words(cell)}"
        )

    @property
    def excess(self) -> float:
        """The amount by which the bound is broken, in ``unit``; 0 where it holds or nothing worse is known."""
        return abs(self.worst - self.bound) if self.status is CertificateStatus.VIOLATED else 0.0


def cell_in_words(cell: tuple[float, float]) -> str:
    """A cell of time in which something could not be decided."""
    start, end = cell
    return f"undecided from t = {start:.6g} s on for {end - start:.2g} s"


ZOOMS, ZOOM_POINTS = 3, 65


def peak_near(measure: Callable[[FloatArray], FloatArray], time: float, step: float, end: float) -> tuple[float, float]:
    """The largest value that a measure of times (n,) in s has near a time, and its time, s.

    Args:
        measure: gives a value (n,) for each time.
        time: around which to look.
        step: how far on both sides, s.
        end: of the times, which begin at 0.
    """
    for _ in range(ZOOMS):
        times = np.clip(np.linspace(time - step, time + step, ZOOM_POINTS), 0.0, end)
        values = measure(times)
        time, step = float(times[np.argmax(values)]), 2.0 * step / (ZOOM_POINTS - 1)
    return float(values.max()), time


def verdict(constraint: Constraint, times: FloatArray) -> Verdict:
    """Check a constraint whose expression is numeric, at the times (rows,) in s of its rows."""
    values, (lower, upper) = as_array(constraint.expression), constraint.bounds
    margins = np.minimum(values - lower, upper - values) / constraint.scales
    at, column = np.unravel_index(np.argmin(margins), margins.shape)
    worst, sampled = float(values[at, column]), constraint.for_all_t and constraint.rows > 1
    return Verdict(
        name=constraint.name,
        worst=worst,
        bound=float(lower[column] if worst - lower[column] < upper[column] - worst else upper[column]),
        unit=constraint.unit,
        status=CertificateStatus.CERTIFIED if margins[at, column] >= -TOLERANCE else CertificateStatus.VIOLATED,
        where=constraint.columns[column] + (f", t = {times[at]:.4g} s" if sampled else ""),
        time=float(times[at]) if sampled else None,
    )


JUMPING_NAMES = ("positions", "speeds", "accelerations")  # by order of the derivative


def infinite(outcome: Verdict, jumps: tuple[int, FloatArray]) -> Verdict:
    """The verdict on a value that is infinite for a moment because a lower derivative jumps.

    Args:
        outcome: the verdict on all other times.
        jumps: order of the derivative that jumps, and when it does, the largest jump first, (n,), s.
    """
    order, times = jumps
    where = f"{JUMPING_NAMES[order]} jump, t = {times[0]:.4g} s"
    return replace(outcome, worst=np.inf, status=CertificateStatus.VIOLATED, where=where, time=float(times[0]))
