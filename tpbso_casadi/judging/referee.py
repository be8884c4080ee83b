"""Runs on a suite judged: targets, expected running times, shares of targets, ranks, constraints.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021: targets, expected running times and their distributions.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, inf, isfinite

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray
from tpbso_casadi.html import number
from tpbso_casadi.judging.logs import Trace
from tpbso_casadi.judging.statistics import FEWEST_SOLVERS, Ranking, cases_needed, ranking
from tpbso_casadi.judging.targets import PLANS, expected_running_time, gap
from tpbso_casadi.suite import Recording, SuiteProblem

TARGETS = PLANS.targets  # gaps to the reference, descending
SHOWN_TARGETS = (1.0, 0.1, 0.01, 0.001)  # of which expected running times are listed
DIMENSIONS = ((1, 10), (11, 30), (31, 60))  # classes of problems by the number of variables
MOST_UNEQUAL = 1.1  # evaluations of a solver over those of another, so that ranks do not compare budgets
MANY = 1000  # evaluations, from where on they have no digits behind the point
BEATEN = 1e-6  # relative: what is lower than the best known by more than that is better than it


@dataclass(frozen=True, kw_only=True)
class Tally:
    """What a solver reached on some problems.

    Attributes:
        solver: its label.
        runs: how many.
        feasible: those that ended with all constraints kept.
        first: median evaluations by dimension until all constraints were kept; infinite where half of the runs and more
            never were there.
        reached: share of all targets.
        to_quarter: evaluations by dimension until as good as the best quarter of all runs, expected.
        times: the same until each of ``SHOWN_TARGETS``.
    """

    solver: str
    runs: int
    feasible: int
    first: float
    reached: float
    to_quarter: float
    times: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Referee:
    """Runs of several solvers on problems of a suite.

    Attributes:
        runs: all of them, at least one.
    """

    runs: Sequence[Recording]

    @cached_property
    def solvers(self) -> list[str]:
        """Labels, in the order of the runs."""
        return list(dict.fromkeys(run.solver for run in self.runs))

    @cached_property
    def problems(self) -> list[SuiteProblem]:
        """In the order of the runs."""
        return list({run.problem.name: run.problem for run in self.runs}.values())

    @cached_property
    def references(self) -> dict[str, float]:
        """By problem the merit that gaps are measured from: the best known, or that of a run that is better.

        Where none is known the lowest of the runs; infinite where neither is feasible. Of fronts always 0.
        """
        return {problem.name: self._reference(problem) for problem in self.problems}

    def _reference(self, problem: SuiteProblem) -> float:
        if problem.best_front is not None:
            return 0.0
        known = inf if problem.best_merit is None else problem.best_merit
        found = (run.merits[-1] for run in self.of(problem.name) if isfinite(run.feasible_from))
        return min(known, min(found, default=inf))

    def of(self, problem: str, solver: str | None = None) -> list[Recording]:
        """The runs on a problem, of one solver or of all."""
        return self._index.get((problem, solver), [])

    @cached_property
    def _index(self) -> dict[tuple[str, str | None], list[Recording]]:
        """By problem and solver, and by problem alone."""
        found: dict[tuple[str, str | None], list[Recording]] = {}
        for run in self.runs:
            for solver in (run.solver, None):
                found.setdefault((run.problem.name, solver), []).append(run)
        return found

    @property
    def traces(self) -> list[Trace]:
        """The runs as logs for other tools have them: functions with instances, merits above the reference."""
        return [
            Trace(
                case=run.problem.function.name,
                solver=run.solver,
                seed=run.problem.instance,
                dimension=run.problem.dimension,
                evaluations=np.array(run.evaluations, dtype=np.float64),
                values=np.array(run.merits),
                done=run.done,
                worst=run.merits[0],
                optimum=min(self.references[run.problem.name], self.lowest[run.problem.name]),
            )
            for run in self.runs
        ]

    @cached_property
    def lowest(self) -> dict[str, float]:
        """By problem the lowest merit of these runs, feasible or not."""
        return {problem.name: min(run.merits[-1] for run in self.of(problem.name)) for problem in self.problems}

    @cached_property
    def unknown(self) -> list[str]:
        """Problems of which no best value is known, so that the runs are measured from the best of themselves."""
        return [problem.name for problem in self.problems if problem.best_merit is None]

    @cached_property
    def improved(self) -> list[tuple[str, str, float, float]]:
        """Problems on which a run was better than the best known: their names, the solver, its merit, the known one."""
        found = []
        for problem in self.problems:
            best = min(self.of(problem.name), key=lambda run: run.merits[-1])
            known = problem.best_merit
            if known is not None and best.merits[-1] < known - BEATEN * (abs(known) or 1.0):
                found.append((problem.name, best.solver, best.merits[-1], known))
        return found

    def needed(self, run: Recording, targets: FloatArray = TARGETS) -> FloatArray:
        """After how many evaluations a run first came within each gap (n,), with all constraints kept; inf if never."""
        return evaluations_needed(run, self.references[run.problem.name], targets)

    def final_gap(self, run: Recording) -> float:
        """Of a run to the reference, not less than 0; inf where it never kept all constraints."""
        reference = self.references[run.problem.name]
        if not (isfinite(run.feasible_from) and isfinite(reference)):
            return inf
        return max(0.0, float(gap(np.array(run.merits[-1]), reference)))

    @cached_property
    def quarters(self) -> dict[str, float]:
        """By problem the gap within which the best quarter of all runs ends, at least one, or the least target.

        Infinite where fewer end feasible: any feasible candidate is as near.
        """
        return {problem.name: self._quarter(problem.name) for problem in self.problems}

    def _quarter(self, problem: str) -> float:
        gaps = sorted(self.final_gap(run) for run in self.of(problem))
        return max(float(TARGETS[-1]), gaps[ceil(len(gaps) / 4) - 1])

    @cached_property
    def scores(self) -> FloatArray:
        """The median gap of each solver on each problem, (problems, solvers); equal where within 0.01 % of none."""
        table = np.full((len(self.problems), len(self.solvers)), inf)
        for row, problem in enumerate(self.problems):
            for column, solver in enumerate(self.solvers):
                gaps = sorted(self.final_gap(run) for run in self.of(problem.name, solver))
                if gaps:
                    middle = (gaps[(len(gaps) - 1) // 2], gaps[len(gaps) // 2])
                    table[row, column] = middle[0] if middle[0] == middle[1] else sum(middle) / 2.0
        return np.where(table <= PLANS.equal, 0.0, table)

    @cached_property
    def ranking(self) -> Ranking:
        """Solvers by mean rank, and groups without a significant difference; fewer than three are ranked alone."""
        if len(self.solvers) >= FEWEST_SOLVERS:
            return ranking(self.solvers, self.scores)
        ranks = scipy.stats.rankdata(self.scores, axis=1).mean(axis=0)
        order = np.argsort(ranks, kind="stable")
        return Ranking(tuple(self.solvers[k] for k in order), ranks[order], len(self.problems), 1.0, ())

    @cached_property
    def joined(self) -> dict[str, str]:
        """By solver the best one from which the next down to it show no significant difference; empty for the best."""
        found = self.ranking
        places = {
            solver: min((first for first, last in found.groups if first < place <= last), default=place)
            for place, solver in enumerate(found.solvers)
        }
        return {
            solver: found.solvers[place] if found.solvers[place] != solver else "" for solver, place in places.items()
        }

    @cached_property
    def budgets(self) -> dict[str, float]:
        """By solver the evaluations of its median run, by the number of variables."""
        spent: dict[str, list[float]] = {solver: [] for solver in self.solvers}
        for run in self.runs:
            spent[run.solver].append(run.done / run.problem.dimension)
        return {solver: float(np.median(each)) for solver, each in spent.items()}

    @property
    def unequal(self) -> str:
        """Who has had the fewest evaluations, and who the most; empty where all have had about as many."""
        fewest, most = (choose(self.budgets, key=self.budgets.__getitem__) for choose in (min, max))
        low, high = self.budgets[fewest], self.budgets[most]
        return f"{told(low)} of {fewest}, {told(high)} of {most}" if high > MOST_UNEQUAL * low else ""

    @property
    def too_few(self) -> str:
        """Why no difference between solvers can be significant; empty where one can."""
        if len(self.solvers) < FEWEST_SOLVERS:
            return f"{len(self.solvers)} solvers, where the test needs {FEWEST_SOLVERS}"
        least = cases_needed(len(self.solvers))
        return f"{len(self.problems)} problems, where {least} are needed" if len(self.problems) < least else ""

    def expected_running_time(self, solver: str, targets: Mapping[str, float]) -> float:
        """Evaluations of all runs until they came within a gap, over how many did [1], each by the problem's dimension.

        Infinite where no run did.

        Args:
            solver: its label.
            targets: the gap by problem.
        """
        runs = [(run, target) for problem, target in targets.items() for run in self.of(problem, solver)]
        dimensions = np.array([run.problem.dimension for run, _ in runs], dtype=np.float64)
        needed = np.array([self.needed(run, np.array([target]))[0] for run, target in runs])
        done = np.array([run.done for run, _ in runs])
        return expected_running_time(needed / dimensions, done / dimensions)

    def shares(self, solver: str, problems: Iterable[SuiteProblem]) -> tuple[FloatArray, FloatArray]:
        """The share of runs and targets reached, (n,), after so many evaluations by dimension, (n,)."""
        runs = [run for problem in problems for run in self.of(problem.name, solver)]
        every = np.concatenate([self.needed(run) / run.problem.dimension for run in runs] or [np.empty(0)])
        evaluations, counts = np.unique(every[np.isfinite(every)], return_counts=True)
        return evaluations, np.cumsum(counts) / max(1, every.size)

    def classes(self) -> dict[str, list[SuiteProblem]]:
        """What shares are shown of: all problems, groups of them, dimensions."""
        found = {"all problems": self.problems}
        for group in dict.fromkeys(problem.group for problem in self.problems):
            found[group] = [problem for problem in self.problems if problem.group == group]
        for low, high in DIMENSIONS:
            found[f"{low} to {high} variables"] = [p for p in self.problems if low <= p.dimension <= high]
        return {name: problems for name, problems in found.items() if problems}

    def tally(self, solver: str, problems: Sequence[SuiteProblem]) -> Tally:
        """What a solver reached on some problems."""
        runs = [run for problem in problems for run in self.of(problem.name, solver)]
        firsts = sorted(run.feasible_from / run.problem.dimension for run in runs)
        _, shares = self.shares(solver, problems)
        names = [problem.name for problem in problems]
        return Tally(
            solver=solver,
            runs=len(runs),
            feasible=sum(map(isfinite, firsts)),
            first=firsts[len(firsts) // 2] if firsts else inf,
            reached=float(shares[-1]) if shares.size else 0.0,
            to_quarter=self.expected_running_time(solver, {name: self.quarters[name] for name in names}),
            times=tuple(self.expected_running_time(solver, dict.fromkeys(names, each)) for each in SHOWN_TARGETS),
        )

    @cached_property
    def overall(self) -> list[tuple[float, Tally]]:
        """Mean ranks, and what was reached on all problems; the best solver first."""
        found = self.ranking
        tallies = [self.tally(solver, self.problems) for solver in found.solvers]
        return list(zip(found.ranks.tolist(), tallies, strict=True))


def on_common_problems(runs: Sequence[Recording]) -> list[Recording]:
    """The runs on problems that every solver of them has searched: on others nobody can be ranked."""
    solvers: dict[str, set[str]] = {}
    for run in runs:
        solvers.setdefault(run.problem.name, set()).add(run.solver)
    everybody = set[str]().union(*solvers.values())
    return [run for run in runs if solvers[run.problem.name] == everybody]


def told(value: float) -> str:
    """Evaluations by dimension, in three digits."""
    if value == inf:
        return "never"
    return f"{value:,.0f}" if value >= MANY else number(value, 3)


def evaluations_needed(run: Recording, reference: float, targets: FloatArray) -> FloatArray:
    """After how many evaluations a run first had a feasible merit within each gap (n,) of a reference; inf if never."""
    merits, evaluations = np.array(run.merits), np.array(run.evaluations, dtype=np.float64)
    feasible = merits <= run.feasible_merit
    gaps = gap(merits[feasible], reference) if isfinite(reference) else np.empty(0)
    evaluations = evaluations[feasible][: gaps.size]
    first = np.searchsorted(-gaps, -targets * (1.0 + 1e-12))
    return np.append(evaluations, inf)[first]
