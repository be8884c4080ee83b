"""What a polish gains: the motion of a search and the refined one of the same run, seed by seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.judging.targets import quantile

HEADER = (
    "case", "solver", "unit", "runs", "kept", "made_feasible", "median_before", "median_after", "median_gain",
    "lower_quartile", "upper_quartile",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class PolishedRun:
    """A run whose search was refined by IPOPT.

    Attributes:
        case: of the scenario.
        solver: its label.
        seed: of the run.
        before: the objective of the search's motion; inf where that is not certified.
        after: the objective of the refined one, likewise.
        kept: whether the refined one is the plan.
        seconds: that the polish took, with the compilation of its program.
    """

    case: str
    solver: str
    seed: int
    before: float
    after: float
    kept: bool
    seconds: float

    @property
    def final(self) -> float:
        """The objective of the motion that is kept."""
        return self.after if self.kept else self.before

    @property
    def gain(self) -> float:
        """By how much of its larger value the objective fell: 0 where nothing is kept; inf where there was no plan."""
        if not self.kept or not isfinite(self.final):
            return 0.0
        return (self.before - self.after) / max(abs(self.before), abs(self.after)) if isfinite(self.before) else inf


@dataclass(frozen=True, kw_only=True)
class PolishGain:
    """All polished runs of one solver on one case; medians and quartiles are of the runs, seed by seed.

    Attributes:
        case: of the scenario.
        solver: its label.
        unit: of the objective.
        runs: seed by seed.
    """

    case: str
    solver: str
    unit: str
    runs: tuple[PolishedRun, ...]

    @property
    def kept(self) -> int:
        """Runs in which the refined motion is the plan."""
        return sum(run.kept for run in self.runs)

    @property
    def made_feasible(self) -> int:
        """Of these, those whose search had no certified motion."""
        return sum(run.kept and not isfinite(run.before) and isfinite(run.after) for run in self.runs)

    @property
    def gains(self) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of the gains."""
        lower, median, upper = (float(quantile(self._each("gain"), share)) for share in (0.25, 0.5, 0.75))
        return lower, median, upper

    @property
    def before(self) -> float:
        """The median objective of the searches' motions."""
        return float(quantile(self._each("before"), 0.5))

    @property
    def after(self) -> float:
        """The median objective of what is kept."""
        return float(quantile(self._each("final"), 0.5))

    @property
    def seconds(self) -> float:
        """The median duration of a polish."""
        return float(np.median(self._each("seconds")))

    @property
    def row(self) -> list[object]:
        """Under ``HEADER``; without times, so that it is the same however fast the machine is."""
        lower, median, upper = self.gains
        numbers = (self.before, self.after, median, lower, upper)
        counts = (len(self.runs), self.kept, self.made_feasible)
        cells = [number if isfinite(number) else None for number in numbers]
        return [self.case, self.solver, self.unit, *counts, *cells]

    def _each(self, name: str) -> FloatArray:
        return np.array([getattr(run, name) for run in self.runs])


def gains_of(runs: Sequence[PolishedRun], units: dict[str, str]) -> list[PolishGain]:
    """The runs together that are of one solver on one case, in the order of the runs; units by case."""
    grouped: dict[tuple[str, str], list[PolishedRun]] = {}
    for run in runs:
        grouped.setdefault((run.case, run.solver), []).append(run)
    return [
        PolishGain(case=case, solver=solver, unit=units.get(case, ""), runs=tuple(each))
        for (case, solver), each in grouped.items()
    ]


def percent(gain: float) -> str:
    """A gain for a reader."""
    return f"{gain:.2%}" if isfinite(gain) else "a plan where there was none"
