"""A search in the terminal: a progress bar during it, tables of the plan after it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from problems import CertificateStatus, Problem
from solvers import Status
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.planning.refinement import Polish
from tpbso_casadi.scenario.builtin import DEFAULT, TITLES

MARKS = {
    CertificateStatus.CERTIFIED: "[green]holds[/]",
    CertificateStatus.VIOLATED: "[red]BROKEN[/]",
    CertificateStatus.UNDECIDED: "[yellow]undecided[/]",
}


@contextmanager
def search_progress(problem: Problem[Any], console: Console) -> Iterator[Callable[[Status], object] | None]:
    """A progress bar, on a terminal only; yields the callback that advances it."""
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[best]}"), TimeRemainingColumn())
    objective = problem.objective
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("searching", total=1.0, best="")

        def show(status: Status) -> None:
            feasible = status.cost <= problem.objective_upper_bound
            objective_text = (
                f"{objective.name} {status.cost:.4g} {objective.unit}" if feasible else "nothing feasible yet"
            )
            progress.update(bar, completed=status.progress, best=f"{objective_text}, {status.evaluations} evaluations")

        yield show


def print_plan(plan: Plan, console: Console) -> None:
    """The final table: the objective, every constraint judged for all t, and the effort of the search."""
    objective, search = plan.problem.objective, plan.search
    table = Table(title=f"{objective.name} {plan.objective:.6g} {objective.unit}", title_justify="left")
    table.add_column("constraint")
    for heading in ("worst", "bound", "unit"):
        table.add_column(heading, justify="right")
    table.add_column("")
    table.add_column("where")
    for verdict in plan.verdicts:
        mark = MARKS[verdict.status]
        numbers = f"{verdict.worst:.6g}", f"{verdict.bound:.6g}"
        table.add_row(verdict.name, *numbers, verdict.unit, mark, verdict.where)
    console.print(table)
    if plan.polish is not None:
        print_polish(plan, plan.polish, console)
    seed = plan.scenario.solver.seed
    rounds = f", best of {plan.rounds} rounds" if plan.rounds > 1 else ""
    console.print(
        f"{plan.scenario.solver.name}, seed {seed}{rounds}: {search.evaluations} evaluations, "
        f"{search.iterations} iterations, {search.seconds:.2f} s, stopped by {search.stop_reason}",
        highlight=False,
    )


def print_polish(plan: Plan, polish: Polish, console: Console) -> None:
    """The search and its refinement by IPOPT, side by side."""
    objective, descent = plan.problem.objective, polish.search
    decision = "kept" if polish.accepted else "discarded, not better"
    headings = f"{objective.name}, {objective.unit}", "worst violation", "evaluations", "iterations", "seconds"
    table = Table(title=f"polish: {decision} ({descent.solution.status})", title_justify="left")
    table.add_column("")
    for heading in headings:
        table.add_column(heading, justify="right")
    rows = (
        ("before", polish.before, plan.search.evaluations, plan.search.iterations, plan.search.seconds),
        ("after", polish.after, descent.evaluations, descent.solution.iterations, polish.seconds),
    )
    for name, motion, evaluations, iterations, seconds in rows:
        numbers = f"{motion.objective:.6g}", f"{motion.worst_violation:.3g}"
        table.add_row(name, *numbers, str(evaluations), str(iterations), f"{seconds:.2f}")
    console.print(table)


def print_scenarios(console: Console) -> None:
    """The built-in scenarios."""
    table = Table("name", "content")
    for name, title in TITLES.items():
        table.add_row(name, title + (" (the default)" if name == DEFAULT else ""))
    console.print(table)
