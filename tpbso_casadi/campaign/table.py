"""The table of a comparison: one for the terminal, one for programs."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from rich.box import SIMPLE
from rich.console import Group
from rich.markup import escape
from rich.table import Table

from tpbso_casadi.campaign.statistics import Comparison, Summary, compare_summaries, holm

COUNTS = ("runs", "failed", "infeasible")
NUMBERS = ("mean", "std", "best", "median", "evaluations")
HEADER = ("case", "solver", "unit", *COUNTS, *NUMBERS, "probability_against_first", "p", "p_corrected")


def against_first(summaries: Sequence[Summary]) -> dict[tuple[str, str], tuple[Comparison, float]]:
    """By case and solver, the comparison with the first solver, and p corrected over the whole table."""
    first = {summary.case: summary for summary in reversed(summaries)}
    comparisons = [compare_summaries(s, first[s.case]) for s in summaries if s is not first[s.case]]
    corrected = holm([comparison.p for comparison in comparisons])
    return {(c.case, c.solver): (c, p) for c, p in zip(comparisons, corrected, strict=True)}


def rows(summaries: Sequence[Summary]) -> list[list[object]]:
    """The whole table, under ``HEADER``, without times: it is the same on any machine and any number of workers."""
    comparisons = against_first(summaries)
    table = []
    for s in summaries:
        comparison, p = comparisons.get((s.case, s.solver), (None, None))
        counts = s.objectives.size + s.failed, s.failed, s.infeasible
        numbers = [_cell(number) for number in (s.mean, s.std, s.best, s.median, s.evaluations)]
        test = (None, None, None) if comparison is None else (comparison.probability, comparison.p, p)
        table.append([s.case, s.solver, s.unit, *counts, *numbers, *test])
    return table


def _cell(number: float) -> float | None:
    return number if isfinite(number) else None


MARKS = {"better": "[green]better[/]", "worse": "[red]worse[/]", "equal": "equal"}


def printable(summaries: Sequence[Summary]) -> Group:
    """The tables for the terminal, one a case."""
    comparisons = against_first(summaries)
    cases = list(dict.fromkeys(summary.case for summary in summaries))
    return Group(*(_case([s for s in summaries if s.case == case], comparisons) for case in cases))


def _case(summaries: Sequence[Summary], comparisons: dict[tuple[str, str], tuple[Comparison, float]]) -> Table:
    first = summaries[0]
    unit = next((summary.unit for summary in summaries if summary.unit), "")
    table = Table(title=escape(f"{first.case} [{unit}]"), title_justify="left", title_style="bold", box=SIMPLE)
    table.add_column("solver", overflow="fold")
    for heading in ("mean", "std", "runs", "evals", "seconds", "vs first, p"):
        table.add_column(heading, justify="right")
    for s in summaries:
        comparison, p = comparisons.get((s.case, s.solver), (None, 1.0))
        numbers = (_short(s.mean, ".5g"), _short(s.std, ".1e"))
        relation = "" if comparison is None else f"{MARKS[comparison.relation(p)]} {p:.2f}"
        table.add_row(
            escape(s.solver), *numbers, _count(s), _short(s.evaluations, ".0f"), _short(s.seconds, ".2f"), relation
        )
    return table


def _short(number: float, digits: str) -> str:
    return format(number, digits) if isfinite(number) else "-"


def _count(summary: Summary) -> str:
    """How many runs, and how many of them without a plan."""
    without_plan = [f"{n} {word}" for n, word in ((summary.infeasible, "infeasible"), (summary.failed, "failed")) if n]
    return ", ".join([str(summary.objectives.size + summary.failed), *without_plan])
