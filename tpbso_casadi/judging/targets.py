"""How the best value fell in a run, and what is measured of it: gaps, targets, expected running times.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from problems.base import FloatArray


@dataclass(frozen=True, kw_only=True, eq=False)
class Convergence:
    """How the best value of a run fell.

    Attributes:
        case: what was searched.
        solver: its label.
        seed: of the run.
        evaluations: after which the value fell, (n,), ascending.
        values: from then on, (n,), descending; inf where none of a candidate counts.
        done: evaluations of the whole run, those of a polish too; 0 where it failed.
        dimension: number of variables that were searched.
        worst: stands at the first evaluation of logs, whose readers need one, where its value is not known.
        optimum: the lowest value that is known of the case, which logs measure from.
    """

    case: str
    solver: str
    seed: int
    evaluations: FloatArray
    values: FloatArray
    done: int
    dimension: int = 1
    worst: float = inf
    optimum: float = inf

    @property
    def first(self) -> float:
        """The evaluation after which there was a value that counts; inf where there was none."""
        return float(self.evaluations[0]) if self.evaluations.size else inf

    def at(self, evaluations: FloatArray) -> FloatArray:
        """The value after so many evaluations (m,), (m,); inf before the first one."""
        steps = np.searchsorted(self.evaluations, evaluations, side="right")
        return np.concatenate([[np.inf], self.values])[steps]

    def needed(self, reference: float | None, targets: FloatArray) -> FloatArray:
        """Evaluations after which the value first was within gaps (n,) of a reference, (n,); inf where it never was.

        Args:
            reference: that gaps are measured from; None, or inf, where there is none.
            targets: gaps, descending.
        """
        gaps = gaps_of(self.values, reference)
        first = np.searchsorted(-gaps, -targets * (1.0 + 1e-12))
        return np.append(self.evaluations, np.inf)[first]


def quantile(values: FloatArray, share: float) -> FloatArray:
    """The quantile of each column, linear between neighbours (Hyndman and Fan's type 7); inf beside an infinite one.

    Args:
        values: (n, ...), n > 0; inf allowed.
        share: from 0 to 1.

    Returns:
        Shape (...).
    """
    ordered = np.sort(values, axis=0)
    place = share * (len(ordered) - 1)
    below, weight = int(place), place - int(place)
    if weight == 0.0:
        return np.asarray(ordered[below])
    low, high = ordered[below], ordered[below + 1]
    finite = np.isfinite(high)
    return np.where(finite, (1.0 - weight) * low + weight * np.where(finite, high, 0.0), np.inf)


def gap(values: FloatArray, reference: float) -> FloatArray:
    """How far values lie above a reference, relative to its size; absolute where it is 0."""
    return (values - reference) / (abs(reference) or 1.0)


def gaps_of(values: FloatArray, reference: float | None) -> FloatArray:
    """Gaps of values to a reference; inf where there is none."""
    if reference is None or not isfinite(reference):
        return np.full(np.shape(values), np.inf)
    return gap(values, reference)


def percent(gain: float) -> str:
    """A gain for a reader, who is told where there was nothing before."""
    return f"{gain:.2%}" if isfinite(gain) else "a plan where there was none"


def shares_reached(needed: Iterable[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """The empirical distribution of evaluations needed: at each number (m,), the share of all targets reached (m,)."""
    every = np.concatenate([np.empty(0), *needed])
    evaluations, counts = np.unique(every[np.isfinite(every)], return_counts=True)
    return evaluations, np.cumsum(counts) / max(1, every.size)


def expected_running_time(needed: FloatArray, done: FloatArray) -> float:
    """Evaluations of all runs until they reached a target, over how many did; inf where none did [1].

    Args:
        needed: evaluations until each run reached it, (n,); inf where it never did.
        done: evaluations of each run, (n,).
    """
    reached = np.isfinite(needed)
    return float(np.where(reached, needed, done).sum() / reached.sum()) if reached.any() else inf


TIE_TOLERANCE = 1e-4  # relative: objectives this close to the best of two samples count as equal to it
PRECISE = 1e-8  # above a minimum: values below count as equal to it, as COCO's last target


@dataclass(frozen=True, eq=False, kw_only=True)
class Measure:
    """The measure that runs are judged by.

    Attributes:
        known: the objective that gaps are measured from; None for the best of the campaign itself.
        equal: gaps up to which statistics count as none.
        reached: objectives up to it count as equal to each other, however far apart.
        targets: gaps (n,), descending, for the share of them that is reached.
        aim: the gap whose expected running time is listed.
        scale: of gaps where they are written.
        unit: likewise, behind the number.
        case: what is searched.
        title: of what is shown first.
        reference: what gaps are measured from.
        so_far: what a run has while it works.
        begins: when it first has that.
        without: of runs that have nothing in the end.
        final: what a run has in the end.
        result: this, in a word.
        counts: which of them count.
        none: that no run has one.
        best: the best of these, before its number.
    """

    known: float | None
    equal: float
    reached: float
    targets: FloatArray
    aim: float
    scale: float
    unit: str
    case: str
    title: str
    reference: str
    so_far: str
    begins: str
    without: str
    final: str
    result: str
    counts: str
    none: str
    best: str

    @property
    def drawn(self) -> float:
        """The gap at which smaller ones are drawn."""
        return self.equal / 10.0

    @property
    def span(self) -> str:
        """The first and the last target, in words."""
        return f"{self.written(self.targets[0])} to {self.written(self.targets[-1])}"

    def written(self, gap: float) -> str:
        """The text of a gap, exactly."""
        return f"{self.scale * gap:g}{self.unit}"

    def shown(self, gap: float) -> str:
        """A gap for a table; a dash where there is none."""
        if not isfinite(gap):
            return "-"
        return f"< {self.written(self.equal)}" if 0.0 < gap < self.equal else f"{self.scale * gap:.3g}{self.unit}"

    def axis(self, reference: float, unit: str) -> str:
        """The name of an axis of gaps to a reference in a unit."""
        return f"gap to {reference:.5g} {unit}" if self.known is None else f"{self.so_far} {unit}"

    def ticked(self, gap: float) -> str:
        """The text of a gap for an axis; the least one stands for all below."""
        return ("≤ " if gap <= 1.001 * self.drawn else "") + self.written(gap)


PLANS = Measure(
    known=None,
    equal=TIE_TOLERANCE,
    reached=-inf,
    targets=np.logspace(1.0, -4.0, 51),  # ten a decade
    aim=0.01,
    scale=100.0,
    unit=" %",
    case="scenario",
    title="Gap to the best plan",
    reference="the best certified plan of this campaign",
    so_far="best plan",
    begins="; it begins where half of the runs, and the band where a quarter, have a plan that keeps all limits at the "
    "samples of the search",
    without="A run whose plan is not certified in the end, and one that failed, has no plan at any time and counts as "
    "the worst",
    final="certified plan",
    result="plan",
    counts="A plan counts only if it is certified: every limit is proven to be kept for all t.",
    none="no run has a certified plan",
    best="Best plan",
)
VALUES = Measure(
    known=0.0,
    equal=PRECISE,
    reached=PRECISE,
    targets=np.logspace(2.0, -8.0, 51),  # COCO's
    aim=0.001,
    scale=1.0,
    unit="",
    case="function",
    title="Gap to the minimum",
    reference="the known minimum of the function",
    so_far="lowest value",
    begins="",
    without="A run that failed has no value at any time and counts as the worst",
    final="lowest value",
    result="value",
    counts="Values are those above the known minimum of the function, f(x) - f*; below 1e-08 they count as equal.",
    none="no run found a finite value",
    best="Lowest value",
)
