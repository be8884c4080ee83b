"""Results of a campaign: what is stored of runs, how their best values fell, what polishing gained, the best runs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidTable
from tpbso_casadi.judging.run import AnyRun, RunFinding, RunRecord
from tpbso_casadi.judging.searches import StoredPart, SuiteRun, find_problem
from tpbso_casadi.judging.statistics import Summary, compare_summaries, summarise
from tpbso_casadi.judging.store import RunStore, StoreError
from tpbso_casadi.judging.targets import PLANS, Convergence, Measure, expected_running_time, gaps_of, quantile
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.storage import Contradiction, HistoryResult, InvalidResult
from tpbso_casadi.suite import Recording


class _Motion(StoredPart):
    objective: float | None
    feasible: bool

    @property
    def certified_objective(self) -> float:
        """The objective; inf where the motion is not certified."""
        return inf if self.objective is None or not self.feasible else self.objective


class _Stage(StoredPart):
    before: _Motion
    evaluations: int = 0


class _PolishStage(_Stage):
    after: _Motion | None = None
    accepted: bool = False
    seconds: float = 0.0


class _Objective(StoredPart):
    value: float | None


class StoredSearch(StoredPart):
    """The part of a stored result that says how its best value fell."""

    feasible: bool
    objective: _Objective
    evaluations: int
    history: HistoryResult = HistoryResult(evaluations=[], cost=[])
    improvements: HistoryResult | None = None
    polish: _PolishStage | None = None
    retiming: _Stage | None = None

    @property
    def done(self) -> int:
        """Evaluations of search and polish; at least one."""
        return max(1, self.evaluations + (0 if self.polish is None else self.polish.evaluations))

    @property
    def course(self) -> HistoryResult:
        """The best so far where it changed: at each evaluation where that is stored, else at each iteration."""
        return self.improvements or self.history

    @property
    def costs(self) -> FloatArray:
        """Costs of :attr:`course`, (n,); inf where none is finite."""
        return np.array([inf if cost is None else cost for cost in self.course.cost])

    @property
    def searched(self) -> _Motion:
        """The motion that the search ended with, before any other stage."""
        stage = self.polish or self.retiming
        return _Motion(objective=self.objective.value, feasible=self.feasible) if stage is None else stage.before


def searches(runs: Iterable[AnyRun], store: RunStore) -> list[tuple[AnyRun, StoredSearch | None]]:
    """Runs with the part of each that is stored, in their order; None of one that failed.

    Raises:
        StoreError: what is stored is not a result.
    """
    found: list[tuple[AnyRun, StoredSearch | None]] = []
    for run, text in store.texts(runs):
        try:
            stored = None if text is None else StoredSearch.from_text(text)
        except InvalidTable as error:
            raise StoreError(f"{store.place(run)}: {error}") from error
        found.append((run, stored))
    return found


def recordings(runs: Sequence[SuiteRun], store: RunStore) -> Iterator[Recording]:
    """Recordings of the stored runs on a suite, without those that failed.

    Raises:
        StoreError: what is stored is not a result.
    """
    for run, stored in searches(runs, store):
        if stored is not None:
            course, problem = stored.course, find_problem(run.case)
            yield Recording(
                problem, run.solver, run.seed, course.evaluations, stored.costs.tolist(), stored.evaluations
            )


def convergence_of(run: AnyRun, stored: StoredSearch | None) -> Convergence:
    """The objective of the best plan of a run so far; None is stored where it failed.

    A run whose plan is not certified in the end, and one that failed, has no plan at any time. The costs of a search
    are those at its samples; they are moved by the constant that makes the last one the certified objective of the
    search's motion. A polish comes after the last evaluation of its search.
    """
    evaluations, objectives = np.empty(0), np.empty(0)
    if stored is not None and stored.feasible and stored.objective.value is not None:
        evaluations, objectives = improvements(stored, run.least_infeasible_cost, stored.objective.value)
    return Convergence(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        evaluations=evaluations,
        values=objectives,
        done=0 if stored is None else stored.done,
    )


def improvements(stored: StoredSearch, least_infeasible: float, objective: float) -> tuple[FloatArray, FloatArray]:
    """Evaluations and objectives of each better plan of a run, both (n,).

    Args:
        stored: of the run.
        least_infeasible: the lowest cost of a candidate that breaks a limit.
        objective: of the certified plan at the end, which no earlier value may undercut.
    """
    evaluations = np.array([*stored.course.evaluations, stored.done], dtype=np.float64)
    cost, end = stored.costs, stored.searched
    if end.feasible and end.objective is not None and cost.size:
        values = np.where(cost < least_infeasible, cost + (end.objective - cost[-1]), np.inf)
    else:
        values = np.full(cost.shape, np.inf)
    values = np.append(np.maximum(values, objective), objective)
    better = values < np.minimum.accumulate(np.concatenate([[np.inf], values]))[:-1]
    evaluations, values = evaluations[better], values[better]
    last = np.diff(evaluations, append=np.inf) > 0.0  # of several after the same evaluation
    return evaluations[last], values[last]


POLISH_HEADER = (
    "case", "solver", "unit", "runs", "kept", "made_feasible", "median_before", "median_after", "median_gain",
    "lower_quartile", "upper_quartile",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class PolishGain:
    """The gain by polishing in the runs of one solver on one case, seed by seed.

    Attributes:
        case: of the scenario.
        solver: its label.
        unit: of the objective.
        before: objectives of the searches' motions, (n,); inf where one is not certified.
        after: objectives of the refined motions, likewise.
        kept: whether the refined motion is the plan, (n,).
        seconds: that each polish took, with the compilation of its program, (n,).
    """

    case: str
    solver: str
    unit: str
    before: FloatArray
    after: FloatArray
    kept: NDArray[np.bool_]
    seconds: FloatArray

    @classmethod
    def all_of(cls, runs: Iterable[tuple[AnyRun, StoredSearch | None]], units: dict[str, str]) -> list[PolishGain]:
        """The gain of each solver on each case, in the order of the runs; units by case."""
        grouped: dict[tuple[str, str], list[tuple[_PolishStage, _Motion]]] = {}
        for run, stored in runs:
            polish = None if stored is None else stored.polish
            if polish is not None and polish.after is not None:
                grouped.setdefault((run.case, run.solver), []).append((polish, polish.after))
        return [
            cls(
                case=case,
                solver=solver,
                unit=units.get(case, ""),
                before=np.array([polish.before.certified_objective for polish, _ in each]),
                after=np.array([after.certified_objective for _, after in each]),
                kept=np.array([polish.accepted for polish, _ in each]),
                seconds=np.array([polish.seconds for polish, _ in each]),
            )
            for (case, solver), each in grouped.items()
        ]

    @property
    def final(self) -> FloatArray:
        """Objectives of the motions that are kept, (n,)."""
        return np.where(self.kept, self.after, self.before)

    @property
    def made_feasible(self) -> int:
        """Runs whose search had no certified motion, and whose refined one is the plan."""
        return int((self.kept & ~np.isfinite(self.before) & np.isfinite(self.after)).sum())

    @property
    def of_runs(self) -> FloatArray:
        """The share of itself by which each objective fell, (n,): 0 where nothing is kept; inf from no plan."""
        had, has = np.isfinite(self.before), self.kept & np.isfinite(self.final)
        before, after = np.where(had, self.before, 1.0), np.where(has, self.after, 1.0)
        fell = (before - after) / np.maximum(np.maximum(np.abs(before), np.abs(after)), np.finfo(float).tiny)
        return np.where(has, np.where(had, fell, inf), 0.0)

    @property
    def gains(self) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of the gains."""
        lower, median, upper = (float(quantile(self.of_runs, share)) for share in (0.25, 0.5, 0.75))
        return lower, median, upper

    @property
    def medians(self) -> tuple[float, float]:
        """Median objectives of the searches' motions, and of what is kept."""
        return float(quantile(self.before, 0.5)), float(quantile(self.final, 0.5))

    @property
    def median_seconds(self) -> float:
        """The median duration of a polish, s."""
        return float(np.median(self.seconds))

    @property
    def row(self) -> list[object]:
        """The row under ``POLISH_HEADER``; without times, so that it is the same however fast the machine is."""
        lower, median, upper = self.gains
        cells = [number if isfinite(number) else None for number in (*self.medians, median, lower, upper)]
        return [self.case, self.solver, self.unit, self.before.size, int(self.kept.sum()), self.made_feasible, *cells]


def references(summaries: Sequence[Summary]) -> dict[str, float | None]:
    """The lowest objective by case: that of all where it is known, else that of a certified plan of any solver.

    None where there is no plan.
    """
    plans: dict[str, list[float]] = {summary.case: [] for summary in summaries}
    known = {summary.case: summary.measure.known for summary in summaries}
    for summary in summaries:
        plans[summary.case] += summary.feasible_objectives.tolist()
    lowest = {case: min(objectives, default=None) for case, objectives in plans.items()}
    return {case: value if value is None or known[case] is None else known[case] for case, value in lowest.items()}


@dataclass(frozen=True)
class Results:
    """The runs of a campaign, judged.

    Attributes:
        records: of all runs.
        convergences: of all runs.
        measure: that they are judged by.
        polish_gains: a solver on a case each; none where nothing was polished.
        summaries: one for each case and solver, made of the records.
    """

    records: Sequence[RunRecord]
    convergences: Sequence[Convergence]
    measure: Measure = PLANS
    polish_gains: Sequence[PolishGain] = ()
    summaries: list[Summary] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "summaries", summarise(self.records, self.measure))
        object.__setattr__(self, "summaries", [self._timed(summary) for summary in self.summaries])

    def _timed(self, summary: Summary) -> Summary:
        """The summary with its expected running time to the measure's aim, of the runs that did not fail."""
        runs = [run for run in self.runs_of(summary.solver, summary.case) if run.done]
        aim, reference = np.array([self.measure.aim]), self.references[summary.case]
        needed = np.array([run.needed(reference, aim)[0] for run in runs])
        time = expected_running_time(needed, np.array([run.done for run in runs])) if runs else float("nan")
        return replace(summary, expected_running_time=time)

    @property
    def cases(self) -> list[str]:
        """Names of what was searched, in the order of the runs."""
        return list(dict.fromkeys(summary.case for summary in self.summaries))

    @property
    def solvers(self) -> list[str]:
        """Labels of the solvers, in the order of the runs."""
        return list(dict.fromkeys(summary.solver for summary in self.summaries))

    @cached_property
    def references(self) -> dict[str, float | None]:
        """The objective that gaps are measured from, by case: a known lowest one, or the lowest of this campaign."""
        return references(self.summaries)

    def of_case(self, case: str) -> list[Summary]:
        """The summaries of a case, a solver each."""
        return [summary for summary in self.summaries if summary.case == case]

    @cached_property
    def _by_labels(self) -> dict[tuple[str, str | None], list[Convergence]]:
        found: dict[tuple[str, str | None], list[Convergence]] = {}
        for run in self.convergences:
            for case in (run.case, None):
                found.setdefault((run.solver, case), []).append(run)
        return found

    def runs_of(self, solver: str, case: str | None = None) -> list[Convergence]:
        """The convergence of each run of a solver, on one case or on all."""
        return self._by_labels.get((solver, case), [])

    def needed(self, run: Convergence) -> FloatArray:
        """Evaluations after which a run first reached each target, (n,); inf where it never did."""
        return run.needed(self.references[run.case], self.measure.targets)

    def scores(self) -> FloatArray:
        """The gap of each solver's median on each case, (cases, solvers); inf where the median run has no plan.

        Gaps within the tolerance of ties are 0.
        """
        table = np.full((len(self.cases), len(self.solvers)), np.inf)
        for summary in self.summaries:
            if summary.objectives.size:
                gaps = gaps_of(np.array(summary.median), self.references[summary.case])
                place = self.cases.index(summary.case), self.solvers.index(summary.solver)
                table[place] = np.where(gaps <= self.measure.equal, 0.0, gaps)
        return table

    def effect_sizes(self, case: str) -> FloatArray:
        """A12 of each solver (row) against each (column) on a case: how probably a run of the row is better."""
        summaries = self.of_case(case)
        return np.array([[compare_summaries(one, other).a12 for other in summaries] for one in summaries])


def results_of(runs: Sequence[AnyRun], store: RunStore) -> Results:
    """The results of these runs, as far as they are stored.

    Raises:
        StoreError: what is stored is not a result.
    """
    measure = runs[0].measure if runs else PLANS
    found, records = searches(runs, store), store.records(runs)
    units = {record.case: record.unit for record in reversed(records) if not record.error}
    convergences = [convergence_of(run, stored) for run, stored in found]
    return Results(records, convergences, measure, PolishGain.all_of(found, units))


@dataclass(frozen=True, kw_only=True)
class Best:
    """The run of the lowest objective on a case; of equal ones the first.

    Attributes:
        run: of the campaign.
        record: of it.
        found: what it found.
    """

    run: AnyRun
    record: RunRecord
    found: RunFinding


def best_runs(runs: Sequence[AnyRun], store: RunStore) -> list[Best]:
    """The best run of each case that has one, in the order of the cases.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    by_labels = {(run.case, run.solver, run.seed): run for run in runs}
    best: dict[str, tuple[float, RunRecord]] = {}
    for record in store.records(runs):
        if record.feasible and record.objective is not None:
            lowest = best[record.case][0] if record.case in best else inf
            if record.objective < lowest:
                best[record.case] = record.objective, record
    chosen = [(by_labels[record.case, record.solver, record.seed], record) for _, record in best.values()]
    return [Best(run=run, record=record, found=found_by(run, store)) for run, record in chosen]


def found_by(run: AnyRun, store: RunStore) -> RunFinding:
    """The finding of a run that did not fail.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    [(_, text)] = store.texts([run])
    try:
        return run.found(text or "")
    except (InvalidResult, InvalidTable, ScenarioError, Contradiction) as error:
        raise StoreError(f"{store.place(run)}: {error}") from error
