"""The page of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy  # whose parts are loaded when they are used
from markupsafe import Markup

from solvers import Budget
from tpbso_casadi.html import number, page
from tpbso_casadi.judging.polishing import percent
from tpbso_casadi.judging.results import Best, Results, gaps_of
from tpbso_casadi.judging.run import AnyRun
from tpbso_casadi.judging.statistics import Judgement, Summary, against_first, p_text
from tpbso_casadi.judging.targets import PLANS
from tpbso_casadi.plain import settings_of, versions


@dataclass(frozen=True, kw_only=True)
class SolverRow:
    """A solver of a campaign.

    Attributes:
        label: as stated.
        settings: all of them by name, those that no one stated too.
        budget: of a run, in words; several where it depends on the case.
        polish: descents that refine the plan; 0 for none.
    """

    label: str
    settings: Mapping[str, object]
    budget: str
    polish: int


def solver_rows(runs: Sequence[AnyRun]) -> list[SolverRow]:
    """The solvers of a campaign, in their order."""
    by_label: dict[str, list[AnyRun]] = {}
    for run in runs:
        by_label.setdefault(run.solver, []).append(run)
    return [_solver_row(label, of_label) for label, of_label in by_label.items()]


def _solver_row(label: str, runs: Sequence[AnyRun]) -> SolverRow:
    section = runs[0].section
    step = section.kind().steps.name
    budgets = dict.fromkeys(in_words(run.section.budget(), step) for run in runs)
    return SolverRow(
        label=label,
        settings=settings_of(section.build()),
        budget="; ".join(budgets),
        polish=section.polish_starts,
    )


def in_words(budget: Budget, step: str) -> str:
    """A budget: what ends a run, whichever comes first."""
    limits = [(budget.evaluations, "evaluation"), (budget.iterations, step)]
    parts = [f"{number} {name}{'s' * (number != 1)}" for number, name in limits if number is not None]
    return " or ".join(parts + ([] if budget.seconds is None else [f"{budget.seconds:g} s"]))


def seeds(runs: Sequence[AnyRun]) -> str:
    """The seeds of a campaign, in words."""
    numbers = sorted({run.seed for run in runs})
    if not numbers:
        return "none"
    together = numbers == list(range(numbers[0], numbers[-1] + 1)) and len(numbers) > 2
    return f"{numbers[0]} to {numbers[-1]}" if together else ", ".join(map(str, numbers))


@dataclass(frozen=True, kw_only=True)
class ComparisonPicture:
    """A figure on the page, or why there is none.

    Attributes:
        title: of its section.
        name: of its files.
        reading: how it is read.
        svg: itself; empty where it is left out.
        reason: why it is left out.
    """

    title: str
    name: str
    reading: str
    svg: Markup
    reason: str


@dataclass(frozen=True, kw_only=True)
class Overall:
    """A solver over all cases.

    Attributes:
        solver: its label.
        rank: mean rank of its median run over the cases.
        reached: share of all targets.
        plans: runs with a certified plan.
        runs: all of them.
    """

    solver: str
    rank: float
    reached: float
    plans: int
    runs: int


@dataclass(frozen=True, kw_only=True)
class SummaryRow:
    """A solver on a case.

    Attributes:
        summary: of its runs.
        gap: of its median run.
        judgement: of it against the first solver; None for that.
    """

    summary: Summary
    gap: float
    judgement: Judgement | None


@dataclass(frozen=True, kw_only=True)
class CaseSection:
    """A case on the page.

    Attributes:
        name: of what was searched.
        unit: of the objective.
        rows: a solver each.
        best: the best run; None where there is none.
        picture: of that; empty where none is drawn.
    """

    name: str
    unit: str
    rows: list[SummaryRow]
    best: Best | None
    picture: Markup


def render(
    results: Results,
    runs: Sequence[AnyRun],
    best: Sequence[Best],
    command: str,
    pictures: Sequence[ComparisonPicture],
    plans: dict[str, Markup],
) -> str:
    """The page.

    Args:
        results: of the runs.
        runs: all of the campaign.
        best: run of each case that has one.
        command: that does the same runs again; empty for none.
        pictures: of the comparison; none where none are drawn.
        plans: pictures of the best plans, by case.
    """
    return page(
        Path(__file__).parent,
        "comparison",
        {"number": number, "share": percent, "percent": PLANS.shown, "gap": results.measure.shown, "p_text": p_text},
        results=results,
        measure=results.measure,
        command=command,
        solvers=solver_rows(runs),
        seeds=seeds(runs),
        versions=versions(),
        overall=overall(results),
        pictures=pictures,
        cases=case_sections(results, best, plans),
        failed=[record for record in results.records if record.error],
        missing=len(runs) - len(results.records),
    )


def overall(results: Results) -> list[Overall]:
    """Each solver over all cases, by mean rank."""
    ranks = scipy.stats.rankdata(results.scores(), axis=1).mean(axis=0) if results.records else np.empty(0)
    rows = []
    for solver, rank in zip(results.solvers, ranks, strict=True):
        of_solver = [summary for summary in results.summaries if summary.solver == solver]
        runs = results.runs_of(solver)
        needed = np.array([results.needed(run) for run in runs])
        rows.append(
            Overall(
                solver=solver,
                rank=float(rank),
                reached=float(np.isfinite(needed).mean()),
                plans=sum(summary.feasible_objectives.size for summary in of_solver),
                runs=len(runs),
            )
        )
    return sorted(rows, key=lambda row: row.rank)


def case_sections(results: Results, best: Sequence[Best], plans: dict[str, Markup]) -> list[CaseSection]:
    """Everything about each case."""
    judgements = against_first(results.summaries)
    by_case = {each.run.case: each for each in best}
    return [
        CaseSection(
            name=case,
            unit=next((summary.unit for summary in results.of_case(case) if summary.unit), ""),
            rows=[
                SummaryRow(
                    summary=summary,
                    gap=float(gaps_of(np.array(summary.median), results.references[case])),
                    judgement=judgements.get((case, summary.solver)),
                )
                for summary in results.of_case(case)
            ],
            best=by_case.get(case),
            picture=plans.get(case, Markup("")),
        )
        for case in results.cases
    ]
