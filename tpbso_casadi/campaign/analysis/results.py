"""The results of a campaign, from which all its tables, figures and pages are made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.convergence import Convergence, convergences
from tpbso_casadi.campaign.analysis.measures import PLANS, Measure
from tpbso_casadi.campaign.analysis.references import gaps_of, references
from tpbso_casadi.campaign.analysis.targets import evaluations_needed
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.campaign.statistics import Summary, a12, summarise, with_ties
from tpbso_casadi.campaign.store import Store


@dataclass(frozen=True)
class Results:
    """The runs of a campaign.

    Attributes:
        records: of all runs.
        convergences: of all runs.
        measure: that they are judged by.
        summaries: one for each case and solver, made of the records.
    """

    records: Sequence[Record]
    convergences: Sequence[Convergence]
    measure: Measure = PLANS
    summaries: list[Summary] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "summaries", summarise(self.records, self.measure))

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
        objectives = [summary.objectives for summary in self.of_case(case)]
        reached = self.measure.reached
        return np.array([[a12(*with_ties(one, other, reached)) for other in objectives] for one in objectives])


def results_of(runs: Sequence[AnyRun], store: Store) -> Results:
    """The results of these runs, as far as they are stored.

    Raises:
        StoreError: what is stored is not a result.
    """
    measure = runs[0].measure if runs else PLANS
    return Results(store.records(runs), convergences(runs, store), measure)
