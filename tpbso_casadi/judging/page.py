"""Pages of runs that are judged, with their tables and figures: of a comparison, and of runs on a suite."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # whose parts are loaded when they are used
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from solvers import Budget
from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.html import number
from tpbso_casadi.judging.referee import SHOWN_TARGETS, TARGETS, Referee, evaluations_text
from tpbso_casadi.judging.results import POLISH_HEADER, Best, Results
from tpbso_casadi.judging.run import AnyRun
from tpbso_casadi.judging.statistics import against_first, p_text
from tpbso_casadi.judging.tables import HEADER, rows
from tpbso_casadi.judging.targets import PLANS, gaps_of, percent
from tpbso_casadi.plain import settings_of, versions
from tpbso_casadi.storage import write_csv, write_text, writing
from tpbso_casadi.suite import Recording, write_runs

if TYPE_CHECKING:
    from tpbso_casadi.judging.page_figures import PagePicture

PAGE, SUMMARY, POLISH_TABLE = "comparison.html", "summary.csv", "polish.csv"
FIGURES = ("comparison", "polish", "ecdf", "critical-difference", "effect-sizes")
SUITE_PAGE, RUNS, RANKS = "suite.html", "runs.csv", "ranks.csv"  # besides the summary
QUARTER = "expected running time to the best quarter"
RANKS_HEADER = ("solver", "mean rank", "joined with", "evaluations by variables", "runs", "targets reached", QUARTER)
SUITE_HEADER = ("problem", "variables", "reference", "reference is", "solver", "median gap", "runs")  # of the summary
TEMPLATES = Path(__file__).parent


def page(name: str, filters: dict[str, Callable[..., Any]], folder: Path = TEMPLATES, **content: Any) -> str:
    """A page from a template ``name.html``, which extends ``page.html``; its ``style`` is ``page.css``.

    Args:
        name: of the template.
        filters: of the template.
        folder: of the template, and of a ``name.css`` that is added to the style where there is one.
        content: what the template shows.
    """
    environment = Environment(loader=FileSystemLoader([folder, TEMPLATES]), autoescape=True, undefined=StrictUndefined)
    environment.filters |= {"number": number, "p_text": p_text} | filters
    sheets = [path for path in (TEMPLATES / "page.css", folder / f"{name}.css") if path.exists()]
    style = Markup("\n").join(Markup(path.read_text(encoding="utf-8")) for path in sheets)
    return environment.get_template(f"{name}.html").render(style=style, versions=versions(), **content)


# Comparisons


def write_comparison(
    folder: Path,
    results: Results,
    runs: Sequence[AnyRun],
    best: Sequence[Best],
    command: str = "",
    formats: Sequence[str] = DEFAULT,
) -> None:
    """Write ``summary.csv``, ``polish.csv`` where something was polished, figures, and ``comparison.html`` with all.

    Args:
        folder: to write to; it is made.
        results: of the runs.
        runs: all of the campaign.
        best: run of each case.
        command: that does the same runs again, for the page; empty for none.
        formats: of the figures; none for no figures, on the page neither.

    Raises:
        OutputError: they cannot be written.
    """
    pictures: list[PagePicture] = []
    plans: dict[str, Markup] = {}
    with writing(folder):
        write_csv(folder / SUMMARY, HEADER, rows(results.summaries))
        if results.polish_gains:
            write_csv(folder / POLISH_TABLE, POLISH_HEADER, [gain.row for gain in results.polish_gains])
        else:
            (folder / POLISH_TABLE).unlink(missing_ok=True)
        if formats:
            from tpbso_casadi.judging.page_figures import pictures_of, plans_of  # noqa: PLC0415 (matplotlib)

            pictures, plans = pictures_of(folder, results, formats), plans_of(best)
        text = comparison_page(results, runs, best, command, pictures, plans)
        write_text(folder / PAGE, lambda file: file.write(text))


def files_of(formats: Sequence[str]) -> list[str]:
    """The names of the files that :func:`write_comparison` writes."""
    return [SUMMARY, PAGE, *(f"{name}.{kind}" for name in FIGURES for kind in formats)]


def comparison_page(
    results: Results,
    runs: Sequence[AnyRun],
    best: Sequence[Best],
    command: str,
    pictures: Sequence[PagePicture],
    plans: dict[str, Markup],
) -> str:
    """The page of a comparison.

    Args:
        results: of the runs.
        runs: all of the campaign.
        best: run of each case that has one.
        command: that does the same runs again; empty for none.
        pictures: of the comparison; none where none are drawn.
        plans: pictures of the best plans, by case.
    """
    by_case = {each.run.case: each for each in best}
    return page(
        "comparison",
        {"share": percent, "percent": PLANS.shown, "gap": results.measure.shown},
        results=results,
        measure=results.measure,
        command=command,
        solvers=solver_rows(runs),
        seeds=seeds(runs),
        overall=overall(results),
        pictures=pictures,
        judgements=against_first(results.summaries),
        cases=[(case, results.of_case(case), by_case.get(case), plans.get(case, Markup(""))) for case in results.cases],
        gap_of=lambda summary: float(gaps_of(np.array(summary.median), results.references[summary.case])),
        failed=[record for record in results.records if record.error],
        missing=len(runs) - len(results.records),
    )


def solver_rows(runs: Sequence[AnyRun]) -> list[dict[str, Any]]:
    """The solvers of a campaign, in their order: label, all settings, budget of a run, descents of a polish."""
    by_label: dict[str, list[AnyRun]] = {}
    for run in runs:
        by_label.setdefault(run.solver, []).append(run)
    return [
        {
            "label": label,
            "settings": settings_of(of_label[0].section.build()),
            "budget": "; ".join(dict.fromkeys(budget_in_words(run) for run in of_label)),
            "polish": of_label[0].section.polish_starts,
        }
        for label, of_label in by_label.items()
    ]


def budget_in_words(run: AnyRun) -> str:
    """The budget of a run in words: what ends it, whichever comes first."""
    budget: Budget = run.section.budget()
    limits = [(budget.evaluations, "evaluation"), (budget.iterations, run.section.kind().steps.name)]
    parts = [f"{number} {name}{'s' * (number != 1)}" for number, name in limits if number is not None]
    return " or ".join(parts + ([] if budget.seconds is None else [f"{budget.seconds:g} s"]))


def seeds(runs: Sequence[AnyRun]) -> str:
    """The seeds of a campaign, in words."""
    numbers = sorted({run.seed for run in runs})
    if not numbers:
        return "none"
    together = numbers == list(range(numbers[0], numbers[-1] + 1)) and len(numbers) > 2
    return f"{numbers[0]} to {numbers[-1]}" if together else ", ".join(map(str, numbers))


def overall(results: Results) -> list[dict[str, Any]]:
    """Solvers over all cases, by mean rank of their median runs: share of targets reached, plans, runs."""
    ranks = scipy.stats.rankdata(results.scores(), axis=1).mean(axis=0) if results.records else np.empty(0)
    table = [
        {
            "solver": solver,
            "rank": float(rank),
            "reached": float(np.isfinite([results.needed(run) for run in results.runs_of(solver)]).mean()),
            "plans": sum(each.feasible_objectives.size for each in results.summaries if each.solver == solver),
            "runs": len(results.runs_of(solver)),
        }
        for solver, rank in zip(results.solvers, ranks, strict=True)
    ]
    return sorted(table, key=lambda row: row["rank"])


# Runs on a suite


def write_suite(folder: Path, referee: Referee, command: str, pictures: bool = True) -> None:
    """Write ``suite.html`` and its tables ``summary.csv`` and ``ranks.csv`` into a folder.

    Raises:
        OutputError: a file cannot be written.
    """
    with writing(folder):
        drawn: list[PagePicture] = []
        if pictures:
            from tpbso_casadi.judging.page_figures import suite_pictures  # noqa: PLC0415 (matplotlib)

            drawn = suite_pictures(referee)
        text = suite_page(referee, drawn, command)
        write_text(folder / SUITE_PAGE, lambda file: file.write(text))
        write_csv(folder / SUMMARY, SUITE_HEADER, suite_rows(referee))
        times = [f"expected running time to {PLANS.written(target)}" for target in SHOWN_TARGETS]
        write_csv(folder / RANKS, (*RANKS_HEADER, *times), rank_rows(referee))


def write_recordings(folder: Path, runs: Sequence[Recording]) -> None:
    """Write the table of runs on a suite, ``runs.csv``, into a folder.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(folder):
        write_runs(folder / RUNS, runs)


def suite_rows(referee: Referee) -> list[tuple[Any, ...]]:
    """The rows of a problem and a solver each: dimension, reference, whether it is known, median gap, runs."""
    return [
        (
            problem.name,
            problem.dimension,
            referee.references[problem.name],
            "best known" if referee.references[problem.name] == problem.best_merit else "best of these runs",
            solver,
            referee.scores[row, column],
            len(referee.of(problem.name, solver)),
        )
        for row, problem in enumerate(referee.problems)
        for column, solver in enumerate(referee.solvers)
    ]


def rank_rows(referee: Referee) -> list[tuple[Any, ...]]:
    """The rows of a solver each, the best first: rank, who it is joined with, evaluations, runs, what was reached."""
    return [
        (name, rank, referee.joined[name], referee.budgets[name], of.runs, of.reached, of.to_quarter, *of.times)
        for rank, of in referee.overall
        for name in [of.solver]
    ]


def suite_page(referee: Referee, pictures: Sequence[PagePicture], command: str) -> str:
    """The page of runs on a suite.

    Args:
        referee: of the runs.
        pictures: of the page.
        command: that made the page.
    """
    return page(
        "suite",
        {"number": evaluations_text, "percent": lambda share: f"{100.0 * share:.0f} %", "gap": PLANS.shown},
        referee=referee,
        classes=[
            (name, len(problems), tally)
            for name, problems in referee.classes().items()
            for solver in referee.ranking.solvers
            if (tally := referee.tally(solver, problems)).runs
        ],
        problems=[(p, referee.scores[row]) for row, p in enumerate(referee.problems)],
        pictures=pictures,
        targets=[PLANS.written(target) for target in SHOWN_TARGETS],
        span=f"{PLANS.written(TARGETS[0])} to {PLANS.written(TARGETS[-1])}",
        command=command,
    )
