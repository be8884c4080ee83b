"""The page of runs on a suite."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

from markupsafe import Markup

from tpbso_casadi.campaign import PLANS, p_text
from tpbso_casadi.html import number, page
from tpbso_casadi.plain import versions
from tpbso_casadi.referee.judging import SHOWN_TARGETS, TARGETS, Referee
from tpbso_casadi.storage import write_csv, write_text, writing
from tpbso_casadi.suite import Recording, write_runs

PAGE, RUNS, SUMMARY, RANKS = "suite.html", "runs.csv", "summary.csv", "ranks.csv"
RANKS_HEADER = ("solver", "mean rank", "joined with", "evaluations by variables", "runs", "targets reached")
HEADER = ("problem", "variables", "reference", "reference is", "solver", "median gap", "runs")  # of the summary
MANY = 1000  # from here on a number in a table has no digits behind the point


@dataclass(frozen=True, kw_only=True)
class SolverRow:
    """A solver over all problems.

    Attributes:
        solver: its label.
        rank: mean rank of its median run over the problems.
        joined: the best solver from which the next down to it show no significant difference.
        budget: evaluations of its median run, by dimension.
        runs: how many.
        reached: share of all targets that they reached.
        times: evaluations by dimension until each of ``SHOWN_TARGETS``, expected.
    """

    solver: str
    rank: float
    joined: str
    budget: float
    runs: int
    reached: float
    times: tuple[float, ...]


def solver_rows(referee: Referee) -> list[SolverRow]:
    """The solvers, the best first."""
    rows = []
    for solver, rank in zip(referee.ranking.solvers, referee.ranking.ranks.tolist(), strict=True):
        _, shares = referee.shares(solver, referee.problems)
        rows.append(
            SolverRow(
                solver=solver,
                rank=rank,
                joined=referee.joined[solver],
                budget=referee.budgets[solver],
                runs=sum(run.solver == solver for run in referee.runs),
                reached=float(shares[-1]) if shares.size else 0.0,
                times=tuple(referee.expected_running_time(solver, referee.problems, t) for t in SHOWN_TARGETS),
            )
        )
    return rows


@dataclass(frozen=True, kw_only=True)
class ClassRow:
    """A solver on a class of problems.

    Attributes:
        name: of the class.
        problems: how many.
        solver: its label.
        reached: share of targets.
        feasible: runs that ended with all constraints kept.
        runs: all of them.
        first: median evaluations by dimension until all constraints were kept.
        times: evaluations by dimension until each of ``SHOWN_TARGETS``, expected.
    """

    name: str
    problems: int
    solver: str
    reached: float
    feasible: int
    runs: int
    first: float
    times: tuple[float, ...]


def class_rows(referee: Referee) -> list[ClassRow]:
    """Every class with every solver that has runs on it."""
    rows = []
    for name, problems in referee.classes().items():
        for solver in referee.ranking.solvers:
            feasible, runs, first = referee.feasibility(solver, problems)
            if runs:
                _, shares = referee.shares(solver, problems)
                rows.append(
                    ClassRow(
                        name=name,
                        problems=len(problems),
                        solver=solver,
                        reached=float(shares[-1]) if shares.size else 0.0,
                        feasible=feasible,
                        runs=runs,
                        first=first,
                        times=tuple(referee.expected_running_time(solver, problems, t) for t in SHOWN_TARGETS),
                    )
                )
    return rows


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
        {"number": _number, "percent": lambda share: f"{100.0 * share:.0f} %", "gap": PLANS.shown, "p_text": p_text},
        referee=referee,
        overall=solver_rows(referee),
        classes=class_rows(referee),
        problems=[(p, referee.scores[row]) for row, p in enumerate(referee.problems)],
        pictures=pictures,
        targets=[PLANS.written(target) for target in SHOWN_TARGETS],
        span=f"{PLANS.written(TARGETS[0])} to {PLANS.written(TARGETS[-1])}",
        command=command,
        versions=versions(),
    )


def _number(value: float) -> str:
    if value == inf:
        return "never"
    return f"{value:,.0f}" if value >= MANY else number(value, 3)


def drawn(referee: Referee) -> list[tuple[str, str, Markup]]:
    """The pictures of the page: titles, how they are read, and themselves."""
    from tpbso_casadi.campaign.drawn_figures import inline_svg  # noqa: PLC0415 (matplotlib)
    from tpbso_casadi.referee.page_figures import ranks_figure, shares_figure  # noqa: PLC0415

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
        rows = [(r.solver, r.rank, r.joined, r.budget, r.runs, r.reached, *r.times) for r in solver_rows(referee)]
        write_csv(folder / RANKS, (*RANKS_HEADER, *times), rows)


def write_table(folder: Path, runs: Sequence[Recording]) -> None:
    """Write the table of runs into a folder.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(folder):
        write_runs(folder / RUNS, runs)
