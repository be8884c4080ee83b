"""All results of a campaign: convergence of runs, references, gaps, targets, the best runs.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

import numpy as np

from problems.base import FloatArray, InvalidTable
from tpbso_casadi.judging.polishing import PolishedRun, PolishGain, gains_of
from tpbso_casadi.judging.run import AnyRun, Record, RunFinding
from tpbso_casadi.judging.searches import StoredPart
from tpbso_casadi.judging.statistics import Summary, compare_summaries, summarise
from tpbso_casadi.judging.store import Store, StoreError
from tpbso_casadi.judging.targets import PLANS, Measure, expected_running_time, gap, quantile
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.storage import Contradiction, HistoryResult, InvalidResult


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """The objective of the best plan of a run so far, where it changed.

    A run whose plan is not certified in the end, and one that failed, has no plan at any time. The costs of a search
    are those at its samples; they are moved by the constant that makes the last one the certified objective of the
    search's motion. A polish comes after the last evaluation of its search.

    Attributes:
        case: of the scenario.
        solver: its label.
        seed: of the run.
        evaluations: after which the plan became better, (n,), ascending.
        objectives: from then on, (n,), descending, in the unit of the objective.
        done: evaluations of the whole run, those of a polish too; 0 where it failed.
    """

    case: str
    solver: str
    seed: int
    evaluations: FloatArray
    objectives: FloatArray
    done: int

    def at(self, evaluations: FloatArray) -> FloatArray:
        """The objective after so many evaluations (m,), (m,); inf before the first plan."""
        steps = np.searchsorted(self.evaluations, evaluations, side="right")
        return np.concatenate([[np.inf], self.objectives])[steps]


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
    """What convergence needs of a ``result.json``."""

    feasible: bool
    objective: _Objective
    evaluations: int
    history: HistoryResult
    improvements: HistoryResult | None = None
    polish: _PolishStage | None = None
    retiming: _Stage | None = None

    @property
    def done(self) -> int:
        """Evaluations of search and polish; at least one."""
        return max(1, self.evaluations + (0 if self.polish is None else self.polish.evaluations))

    @property
    def course(self) -> HistoryResult:
        """Where the best so far changed: at each evaluation where that is stored, else at each iteration."""
        return self.improvements or self.history

    @property
    def searched(self) -> _Motion:
        """The motion that the search ended with, before any other stage."""
        stage = self.polish or self.retiming
        return _Motion(objective=self.objective.value, feasible=self.feasible) if stage is None else stage.before


def searches(runs: Iterable[AnyRun], store: Store) -> list[tuple[AnyRun, StoredSearch | None]]:
    """These runs with what is stored of each, in their order; None of one that failed.

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


def polished_run(run: AnyRun, stored: StoredSearch | None) -> PolishedRun | None:
    """What a polish did to a run; None where there was none."""
    polish = None if stored is None else stored.polish
    if polish is None or polish.after is None:
        return None
    return PolishedRun(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        before=polish.before.certified_objective,
        after=polish.after.certified_objective,
        kept=polish.accepted,
        seconds=polish.seconds,
    )


def convergence_of(run: AnyRun, stored: StoredSearch | None) -> Convergence:
    """The convergence of a run; None is stored where it failed."""
    evaluations, objectives = np.empty(0), np.empty(0)
    if stored is not None and stored.feasible and stored.objective.value is not None:
        evaluations, objectives = improvements(stored, run.least_infeasible_cost, stored.objective.value)
    return Convergence(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        evaluations=evaluations,
        objectives=objectives,
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
    cost = np.array([np.inf if c is None else c for c in stored.course.cost])
    end = stored.searched
    if end.feasible and end.objective is not None and cost.size:
        values = np.where(cost < least_infeasible, cost + (end.objective - cost[-1]), np.inf)
    else:
        values = np.full(cost.shape, np.inf)
    values = np.append(np.maximum(values, objective), objective)
    better = values < np.minimum.accumulate(np.concatenate([[np.inf], values]))[:-1]
    evaluations, values = evaluations[better], values[better]
    last = np.diff(evaluations, append=np.inf) > 0.0  # of several after the same evaluation
    return evaluations[last], values[last]


def references(summaries: Sequence[Summary]) -> dict[str, float | None]:
    """By case the lowest objective: where it is known that of all, else that of a certified plan of any solver.

    None where there is no plan.
    """
    plans: dict[str, list[float]] = {summary.case: [] for summary in summaries}
    known = {summary.case: summary.measure.known for summary in summaries}
    for summary in summaries:
        plans[summary.case] += summary.feasible_objectives.tolist()
    lowest = {case: min(objectives, default=None) for case, objectives in plans.items()}
    return {case: value if value is None or known[case] is None else known[case] for case, value in lowest.items()}


def gaps_of(objectives: FloatArray, reference: float | None) -> FloatArray:
    """The gaps of objectives; inf where there is no plan at all."""
    return np.full(np.shape(objectives), np.inf) if reference is None else gap(objectives, reference)


def evaluations_needed(run: Convergence, reference: float | None, targets: FloatArray) -> FloatArray:
    """After how many evaluations a run first had a plan within each gap.

    Args:
        run: its convergence.
        reference: the objective that gaps are measured from; None where no run has a plan.
        targets: gaps (n,).

    Returns:
        Shape (n,); inf where it never had.
    """
    gaps = gaps_of(run.objectives, reference)
    first = np.searchsorted(-gaps, -targets * (1.0 + 1e-12))
    return np.append(run.evaluations, np.inf)[first]


def shares_reached(needed: Sequence[FloatArray] | Iterable[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """The empirical distribution of evaluations needed: at each number (m,), the share of all targets reached (m,)."""
    every = np.concatenate(list(needed))
    evaluations, counts = np.unique(every[np.isfinite(every)], return_counts=True)
    return evaluations, np.cumsum(counts) / every.size


@dataclass(frozen=True)
class Results:
    """The runs of a campaign.

    Attributes:
        records: of all runs.
        convergences: of all runs.
        measure: that they are judged by.
        polished: the runs whose searches were refined.
        summaries: one for each case and solver, made of the records.
    """

    records: Sequence[Record]
    convergences: Sequence[Convergence]
    measure: Measure = PLANS
    polished: Sequence[PolishedRun] = ()
    summaries: list[Summary] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "summaries", summarise(self.records, self.measure))
        runs: dict[tuple[str, str], list[Convergence]] = {}
        for run in self.convergences:
            if run.done:
                runs.setdefault((run.case, run.solver), []).append(run)
        timed = [self._timed(each, runs.get((each.case, each.solver), [])) for each in self.summaries]
        object.__setattr__(self, "summaries", timed)

    def _timed(self, summary: Summary, runs: Sequence[Convergence]) -> Summary:
        """With the evaluations until a run is expected to be within the measure's aim, from runs that did not fail."""
        aim, reference = np.array([self.measure.aim]), self.references[summary.case]
        needed = np.array([evaluations_needed(run, reference, aim)[0] for run in runs])
        time = expected_running_time(needed, np.array([run.done for run in runs])) if runs else float("nan")
        return replace(summary, expected_running_time=time)

    @cached_property
    def polish_gains(self) -> list[PolishGain]:
        """What polishing gains, a solver on a case each; none where nothing was polished."""
        return gains_of(self.polished, {summary.case: summary.unit for summary in self.summaries})

    @property
    def cases(self) -> list[str]:
        """Names of what was searched, in the order of the runs."""
        return list(dict.fromkeys(summary.case for summary in self.summaries))

    @property
    def solvers(self) -> list[str]:
        """Labels of the solvers, likewise."""
        return list(dict.fromkeys(summary.solver for summary in self.summaries))

    @cached_property
    def references(self) -> dict[str, float | None]:
        """By case the objective that gaps are measured from: a known lowest one, or the lowest of this campaign."""
        return references(self.summaries)

    def of_case(self, case: str) -> list[Summary]:
        """The summaries of a case, a solver each."""
        return [summary for summary in self.summaries if summary.case == case]

    def runs_of(self, solver: str, case: str | None = None) -> list[Convergence]:
        """The convergence of each run of a solver, on one case or on all."""
        return [run for run in self.convergences if run.solver == solver and case in {None, run.case}]

    def needed(self, run: Convergence) -> FloatArray:
        """After how many evaluations a run first reached each target, (n,); inf where it never did."""
        return evaluations_needed(run, self.references[run.case], self.measure.targets)

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


def results_of(runs: Sequence[AnyRun], store: Store) -> Results:
    """The results of these runs, as far as they are stored.

    Raises:
        StoreError: what is stored is not a result.
    """
    measure = runs[0].measure if runs else PLANS
    found = searches(runs, store)
    polished = [each for run, stored in found if (each := polished_run(run, stored)) is not None]
    return Results(store.records(runs), [convergence_of(run, stored) for run, stored in found], measure, polished)


GRID = 240  # numbers of evaluations at which quartiles are computed
FEWEST_FOR_QUARTILES = 4  # runs; fewer have a median alone


@dataclass(frozen=True, kw_only=True)
class GapCurve:
    """The runs of one solver on one case.

    Attributes:
        end: evaluations of its longest run.
        evaluations: up to the end of the longest run of any solver, (n,).
        lower: quartile of the gaps, (n,), inf where that run has no plan.
        median: likewise.
        upper: likewise.
    """

    end: int
    evaluations: FloatArray
    lower: FloatArray
    median: FloatArray
    upper: FloatArray


def gap_curve(results: Results, case: str, solver: str) -> GapCurve:
    """The curve of one solver; a run without a plan, or without one yet, is infinitely far from the best."""
    longest = max(run.done for run in results.convergences if run.case == case)
    evaluations = np.geomspace(1.0, max(2, longest), GRID)
    runs = results.runs_of(solver, case)
    gaps = gaps_of(np.array([run.at(evaluations) for run in runs]), results.references[case])
    shares = (0.25, 0.5, 0.75) if len(runs) >= FEWEST_FOR_QUARTILES else (0.5, 0.5, 0.5)
    lower, median, upper = (quantile(gaps, share) for share in shares)
    return GapCurve(end=max(run.done for run in runs), evaluations=evaluations, lower=lower, median=median, upper=upper)


@dataclass(frozen=True, kw_only=True)
class Best:
    """The run of the lowest objective on a case; of equal ones the first.

    Attributes:
        run: itself.
        record: of it.
        found: what it found.
    """

    run: AnyRun
    record: Record
    found: RunFinding


def best_runs(runs: Sequence[AnyRun], store: Store) -> list[Best]:
    """The best run of each case that has one, in the order of the cases.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    by_labels = {(run.case, run.solver, run.seed): run for run in runs}
    best: dict[str, tuple[float, Record]] = {}
    for record in store.records(runs):
        if record.feasible and record.objective is not None:
            lowest = best[record.case][0] if record.case in best else inf
            if record.objective < lowest:
                best[record.case] = record.objective, record
    chosen = [(by_labels[record.case, record.solver, record.seed], record) for _, record in best.values()]
    return [Best(run=run, record=record, found=found_by(run, store)) for run, record in chosen]


def found_by(run: AnyRun, store: Store) -> RunFinding:
    """What a run that did not fail found.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    [(_, text)] = store.texts([run])
    try:
        return run.found(text or "")
    except (InvalidResult, InvalidTable, ScenarioError, Contradiction) as error:
        raise StoreError(f"{store.place(run)}: {error}") from error
