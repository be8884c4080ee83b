"""The judge of runs on a suite: targets, expected running times, shares of targets, ranks, constraints.

[1] N. Hansen et al., "COCO: a platform for comparing continuous optimizers in a black-box setting",
    Optimization Methods and Software 36, 2021: targets, expected running times and their distributions.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, inf, isfinite
from pathlib import Path

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray
from tpbso_casadi.html import number
from tpbso_casadi.judging.statistics import FEWEST_SOLVERS, Ranking, cases_needed, ranking
from tpbso_casadi.judging.targets import PLANS, Convergence, expected_running_time, gap, quantile, shares_reached
from tpbso_casadi.suite import InvalidSuite, Recording, SuiteProblem, read_runs

TARGETS = PLANS.targets  # gaps to the reference, descending
SHOWN_TARGETS = (1.0, 0.1, 0.01, 0.001)  # of which expected running times are listed
DIMENSIONS = ((1, 10), (11, 30), (31, 60))  # classes of problems by the number of variables
MOST_UNEQUAL = 1.1  # evaluations of a solver over those of another, so that ranks do not compare budgets
MANY = 1000  # evaluations, from where on they have no digits behind the point
BEATEN = 1e-6  # relative: what is lower than the best known by more than that is better than it


@dataclass(frozen=True, kw_only=True)
class Tally:
    """The targets that a solver reached on some problems.

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
        """Labels of the solvers, in the order of the runs."""
        return list(dict.fromkeys(run.solver for run in self.runs))

    @cached_property
    def problems(self) -> list[SuiteProblem]:
        """The problems, in the order of the runs."""
        return list({run.problem.name: run.problem for run in self.runs}.values())

    @cached_property
    def references(self) -> dict[str, float]:
        """The merit that gaps are measured from, by problem: the best known, or that of a run that is better.

        Where none is known the lowest of the runs; infinite where neither is feasible. Of fronts always 0.
        """
        return {problem.name: self._reference(problem) for problem in self.problems}

    def _reference(self, problem: SuiteProblem) -> float:
        if problem.best_front is not None:
            return 0.0
        known = inf if problem.best_merit is None else problem.best_merit
        found = (float(run.values[-1]) for run in self.of(problem.name) if run.values.size)
        return min(known, min(found, default=inf))

    def of(self, problem: str, solver: str | None = None) -> list[Convergence]:
        """The runs on a problem, of one solver or of all: how the merit fell, all constraints kept."""
        return self._index.get((problem, solver), [])

    def on(self, problems: Iterable[SuiteProblem], solver: str) -> list[Convergence]:
        """The runs of a solver on some problems."""
        return [run for problem in problems for run in self.of(problem.name, solver)]

    @cached_property
    def _index(self) -> dict[tuple[str, str | None], list[Convergence]]:
        """The runs by problem and solver, and by problem alone."""
        found: dict[tuple[str, str | None], list[Convergence]] = {}
        for run in self.runs:
            convergence = convergence_of(run)
            for solver in (run.solver, None):
                found.setdefault((run.problem.name, solver), []).append(convergence)
        return found

    @property
    def logged(self) -> list[Convergence]:
        """The runs as logs for other tools have them: functions with instances, merits of any candidates."""
        lowest = {problem.name: inf for problem in self.problems}
        for run in self.runs:
            lowest[run.problem.name] = min(lowest[run.problem.name], run.merits[-1])
        return [
            replace(
                convergence_of(run, feasible_alone=False),
                case=run.problem.function.name,
                seed=run.problem.instance,
                worst=run.merits[0],
                optimum=min(self.references[run.problem.name], lowest[run.problem.name]),
            )
            for run in self.runs
        ]

    @cached_property
    def unknown(self) -> list[str]:
        """Problems of which no best value is known, so that the runs are measured from the best of themselves."""
        return [problem.name for problem in self.problems if problem.best_merit is None]

    @cached_property
    def improved(self) -> list[tuple[str, str, float, float]]:
        """Problems on which a run was better than the best known: their names, the solver, its merit, the known one."""
        found = []
        for problem in self.problems:
            known, runs = problem.best_merit, [run for run in self.of(problem.name) if run.values.size]
            best = min(runs, key=lambda run: float(run.values[-1]), default=None)
            if best is not None and known is not None and best.values[-1] < known - BEATEN * (abs(known) or 1.0):
                found.append((problem.name, best.solver, float(best.values[-1]), known))
        return found

    def needed(self, run: Convergence, targets: FloatArray = TARGETS) -> FloatArray:
        """Evaluations after which a run first came within gaps (n,), (n,); inf where it never did."""
        return run.needed(self.references[run.case], targets)

    def final_gap(self, run: Convergence) -> float:
        """The gap of a run to the reference, not less than 0; inf where it never kept all constraints."""
        return max(0.0, float(gap(run.values[-1], self.references[run.case]))) if run.values.size else inf

    @cached_property
    def quarters(self) -> dict[str, float]:
        """The gap within which the best quarter of all runs ends, by problem: at least one run, or the least target.

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
                if gaps := [self.final_gap(run) for run in self.of(problem.name, solver)]:
                    table[row, column] = quantile(np.array(gaps), 0.5)
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
        """The best solver from which the next down to a solver show no significant difference; empty for the best."""
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
        """Evaluations of the median run of each solver, by the number of variables."""
        return {
            solver: float(np.median([run.done / run.dimension for run in self.on(self.problems, solver)]))
            for solver in self.solvers
        }

    @property
    def unequal(self) -> str:
        """The solvers with the fewest and with the most evaluations; empty where all have had about as many."""
        fewest, most = (choose(self.budgets, key=self.budgets.__getitem__) for choose in (min, max))
        low, high = self.budgets[fewest], self.budgets[most]
        return (
            f"{evaluations_text(low)} of {fewest}, {evaluations_text(high)} of {most}"
            if high > MOST_UNEQUAL * low
            else ""
        )

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
        dimensions = np.array([run.dimension for run, _ in runs], dtype=np.float64)
        needed = np.array([self.needed(run, np.array([target]))[0] for run, target in runs])
        done = np.array([run.done for run, _ in runs])
        return expected_running_time(needed / dimensions, done / dimensions)

    def shares(self, solver: str, problems: Iterable[SuiteProblem]) -> tuple[FloatArray, FloatArray]:
        """The share of runs and targets reached, (n,), after so many evaluations by dimension, (n,)."""
        return shares_reached(self.needed(run) / run.dimension for run in self.on(problems, solver))

    def classes(self) -> dict[str, list[SuiteProblem]]:
        """The classes whose shares are shown: all problems, groups of them, dimensions."""
        found = {"all problems": self.problems}
        for group in dict.fromkeys(problem.group for problem in self.problems):
            found[group] = [problem for problem in self.problems if problem.group == group]
        for low, high in DIMENSIONS:
            found[f"{low} to {high} variables"] = [p for p in self.problems if low <= p.dimension <= high]
        return {name: problems for name, problems in found.items() if problems}

    def tally(self, solver: str, problems: Sequence[SuiteProblem]) -> Tally:
        """The targets that a solver reached on some problems, and what it took."""
        runs = self.on(problems, solver)
        firsts = sorted(run.first / run.dimension for run in runs)
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


def referee_of(tables: Sequence[Path], names: Collection[str]) -> tuple[Referee, list[str]]:
    """The judge of the runs in tables, and the names of problems that are left out: not all solvers have searched them.

    Args:
        tables: files of runs, one at least.
        names: of the problems that count.

    Raises:
        InvalidSuite: a file is no table of runs, a run is there twice, or nothing is left to be judged.
    """
    runs = [run for file in tables for run in read_runs(file) if run.problem.name in names]
    for (solver, name, run), count in Counter((each.solver, each.problem.name, each.run) for each in runs).items():
        if count > 1:
            raise InvalidSuite(f"{tables[-1]}: run {run} of {solver} on {name} is in {count} tables")
    if not runs:
        raise InvalidSuite(f"{tables[0]}: there are no runs of these functions and instances in it")
    referee = Referee(on_common_problems(runs))
    if not referee.runs:
        raise InvalidSuite(f"{tables[-1]}: there is no problem that all of the solvers have searched")
    kept = {problem.name for problem in referee.problems}
    return referee, list(dict.fromkeys(run.problem.name for run in runs if run.problem.name not in kept))


def on_common_problems(runs: Sequence[Recording]) -> list[Recording]:
    """The runs on problems that every solver of them has searched: on others nobody can be ranked."""
    solvers: dict[str, set[str]] = {}
    for run in runs:
        solvers.setdefault(run.problem.name, set()).add(run.solver)
    everybody = set[str]().union(*solvers.values())
    return [run for run in runs if solvers[run.problem.name] == everybody]


def evaluations_text(value: float) -> str:
    """Evaluations by dimension, in three digits."""
    if value == inf:
        return "never"
    return f"{value:,.0f}" if value >= MANY else number(value, 3)


def convergence_of(run: Recording, feasible_alone: bool = True) -> Convergence:
    """How the merit of a run fell; of candidates that keep all constraints alone, or of any."""
    evaluations, merits = np.array(run.evaluations, dtype=np.float64), np.array(run.merits)
    counts = merits <= (run.feasible_merit if feasible_alone else inf)
    return Convergence(
        case=run.problem.name,
        solver=run.solver,
        seed=run.run,
        evaluations=evaluations[counts],
        values=merits[counts],
        done=run.done,
        dimension=run.problem.dimension,
    )
