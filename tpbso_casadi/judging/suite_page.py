"""The page of runs on a suite."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from tpbso_casadi.html import page
from tpbso_casadi.judging.referee import SHOWN_TARGETS, TARGETS, Referee, told
from tpbso_casadi.judging.statistics import p_text
from tpbso_casadi.judging.targets import PLANS
from tpbso_casadi.plain import versions
from tpbso_casadi.storage import write_csv, write_text, writing
from tpbso_casadi.suite import Recording, write_runs

PAGE, RUNS, SUMMARY, RANKS = "suite.html", "runs.csv", "summary.csv", "ranks.csv"
QUARTER = "expected running time to the best quarter"
RANKS_HEADER = ("solver", "mean rank", "joined with", "evaluations by variables", "runs", "targets reached", QUARTER)
HEADER = ("problem", "variables", "reference", "reference is", "solver", "median gap", "runs")  # of the summary


def summary_rows(referee: Referee) -> list[tuple[Any, ...]]:
    """By problem and solver: dimension, reference, whether it is known, median gap, runs."""
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
    """By solver, the best first: rank, who it is joined with, evaluations, runs, what was reached."""
    return [
        (name, rank, referee.joined[name], referee.budgets[name], of.runs, of.reached, of.to_quarter, *of.times)
        for rank, of in referee.overall
        for name in [of.solver]
    ]


def render(referee: Referee, pictures: Sequence[tuple[str, str, Markup]], command: str) -> str:
    """The page.

    Args:
        referee: of the runs.
        pictures: titles, how they are read, and themselves.
        command: that made the page.
    """
    return page(
        Path(__file__).parent,
        "suite",
        {
            "number": told,
            "percent": lambda share: f"{100.0 * share:.0f} %",
            "gap": PLANS.shown,
            "p_text": p_text,
        },
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
        versions=versions(),
    )


def drawn(referee: Referee) -> list[tuple[str, str, Markup]]:
    """The pictures of the page: titles, how they are read, and themselves."""
    from tpbso_casadi.judging.drawn_figures import inline_svg  # noqa: PLC0415 (matplotlib)
    from tpbso_casadi.judging.suite_figures import ranks_figure, shares_figure  # noqa: PLC0415

    reading = "The share of runs and targets that were reached after so many evaluations, by the number of variables."
    shares = "Targets reached", reading, inline_svg(shares_figure(referee), "shares", "Shares of targets reached")
    if referee.too_few:
        return [shares]
    reading = "Mean ranks of median runs, the best on the left; a bar joins solvers that do not differ significantly."
    return [shares, ("Ranks", reading, inline_svg(ranks_figure(referee), "ranks", "Mean ranks of the solvers"))]


def write_report(folder: Path, referee: Referee, command: str, pictures: bool = True) -> None:
    """Write the page and its tables into a folder.

    Raises:
        OutputError: a file cannot be written.
    """
    with writing(folder):
        text = render(referee, drawn(referee) if pictures else [], command)
        write_text(folder / PAGE, lambda file: file.write(text))
        write_csv(folder / SUMMARY, HEADER, summary_rows(referee))
        times = [f"expected running time to {PLANS.written(target)}" for target in SHOWN_TARGETS]
        write_csv(folder / RANKS, (*RANKS_HEADER, *times), rank_rows(referee))


def write_table(folder: Path, runs: Sequence[Recording]) -> None:
    """Write the table of runs into a folder.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(folder):
        write_runs(folder / RUNS, runs)
