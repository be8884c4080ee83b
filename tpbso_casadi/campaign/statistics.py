"""What a number of runs say: summaries, and which differences are more than chance."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import mannwhitneyu

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.store import Record

SAME = 1e-4  # relative: objectives that near to the best of a case are as good as it
LEVEL = 0.05  # of significance


@dataclass(frozen=True)
class Summary:
    """The runs of one solver on one case.

    Attributes:
        case: of the scenario.
        solver: its label.
        unit: of the objective.
        objectives: of the runs that did not fail, (n,); inf where the plan is not feasible.
        failed: runs that raised.
        evaluations: of a run, mean.
        seconds: of a run, median.
    """

    case: str
    solver: str
    unit: str
    objectives: FloatArray
    failed: int
    evaluations: float
    seconds: float

    @property
    def held(self) -> FloatArray:
        """The objectives of the feasible plans."""
        return self.objectives[np.isfinite(self.objectives)]

    @property
    def infeasible(self) -> int:
        """Runs that ended without a feasible plan."""
        return self.objectives.size - self.held.size

    @property
    def mean(self) -> float:
        """Of the feasible plans; NaN where there is none."""
        return float(self.held.mean()) if self.held.size else float("nan")

    @property
    def std(self) -> float:
        """Standard deviation of the feasible plans, n - 1 in the denominator; NaN where there are fewer than two."""
        return float(self.held.std(ddof=1)) if self.held.size > 1 else float("nan")

    @property
    def best(self) -> float:
        """The lowest objective of a feasible plan; NaN where there is none."""
        return float(self.held.min()) if self.held.size else float("nan")

    @property
    def median(self) -> float:
        """Of all plans, infeasible ones last: inf where more than half are."""
        return float(np.median(self.objectives)) if self.objectives.size else float("nan")

    @property
    def standing(self) -> tuple[int, float]:
        """What orders solvers: fewer runs that failed or are infeasible first, then the lower mean."""
        return self.failed + self.infeasible, self.mean if self.held.size else float("inf")


def summarise(records: Iterable[Record]) -> list[Summary]:
    """One summary for each case and solver, in the order in which they appear."""
    groups: dict[tuple[str, str], list[Record]] = {}
    for record in records:
        groups.setdefault((record.case, record.solver), []).append(record)
    return [_summary(*labels, group) for labels, group in groups.items()]


def _summary(case: str, solver: str, records: Sequence[Record]) -> Summary:
    done = [record for record in records if not record.error]
    objectives = [record.objective if record.feasible else None for record in done]
    values = np.array([np.inf if objective is None else objective for objective in objectives], dtype=np.float64)
    evaluations = float(np.mean([record.evaluations or 0 for record in done])) if done else float("nan")
    seconds = float(np.median([record.seconds for record in done])) if done else float("nan")
    unit = next((record.unit for record in done), "")
    return Summary(case, solver, unit, values, len(records) - len(done), evaluations, seconds)


@dataclass(frozen=True)
class Comparison:
    """How the runs of one solver stand to those of another, on one case.

    Attributes:
        case: of both.
        ours: a solver's label.
        theirs: the other's.
        lower: whether ours has the better standing: fewer infeasible runs, then the lower mean.
        probability: that a run of ours is better than one of theirs, ties half (Vargha and Delaney's A).
        p: of the two-sided rank-sum test (Mann and Whitney), infeasible runs last.
    """

    case: str
    ours: str
    theirs: str
    lower: bool
    probability: float
    p: float

    def verdict(self, p: float) -> str:
        """Better, worse or equal, given the corrected p."""
        if not p < LEVEL or self.probability == 0.5:
            return "equal"
        return "better" if self.probability > 0.5 else "worse"


def compared(ours: Summary, theirs: Summary) -> Comparison:
    """Compare two solvers on a case. Objectives within 0.01 % of the best of both count as equal to it."""
    a, b = levelled(ours.objectives, theirs.objectives)
    lower = ours.standing < theirs.standing
    labels = ours.case, ours.solver, theirs.solver
    if not (a.size and b.size) or np.unique([*a, *b]).size == 1:
        return Comparison(*labels, lower, 0.5, 1.0)
    wins = (a[:, None] < b).mean() + 0.5 * (a[:, None] == b).mean()
    return Comparison(*labels, lower, float(wins), float(mannwhitneyu(a, b).pvalue))


def levelled(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two samples in which everything that is as good as the best of both equals it."""
    best = min((float(values.min()) for values in (a, b) if values.size), default=np.inf)
    near = best + SAME * abs(best)
    return np.where(a <= near, best, a), np.where(b <= near, best, b)


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's correction: of n, the smallest counts n times, the next n - 1 times, never less than the one before."""
    corrected, largest = np.ones(len(p_values)), 0.0
    for rank, index in enumerate(np.argsort(p_values, kind="stable")):
        largest = max(largest, min(1.0, p_values[index] * (len(p_values) - rank)))
        corrected[index] = largest
    return [float(p) for p in corrected]
