"""A plan in the terminal: its constraints, its polish, and what to know about it."""

from __future__ import annotations

from collections.abc import Iterator

from rich.text import Text

from problems import CertificateStatus, Verdict
from tpbso_casadi.cli.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.planning.refinement import Polish
from tpbso_casadi.scenario.best_known import best_known
from tpbso_casadi.scenario.builtin import DEFAULT, TITLES

MARKS = {
    CertificateStatus.CERTIFIED: Text("holds", "green"),
    CertificateStatus.VIOLATED: Text("BROKEN", "red"),
    CertificateStatus.UNDECIDED: Text("undecided", "yellow"),
}
FAR = 0.02  # above the best known objective, relative to it: worth a word


def summary_of(plan: Plan) -> str:
    """The objective and its value."""
    objective = plan.problem.objective
    return f"{objective.name} {plan.objective:.6g} {objective.unit}"


def limit_of(bound: float, unit: str) -> str:
    """A bound with its unit."""
    return f"{bound:.6g} {unit}".strip()


def print_plan(plan: Plan, console: OutputConsole) -> None:
    """The objective, every constraint judged for all t, the effort of the search, and remarks."""
    search = plan.search
    table = table_of(word("constraint"), number("worst"), word("limit"), word(""), prose("where"))
    for verdict in plan.verdicts:
        table.add_row(*_row(verdict))
    console.print_table(summary_of(plan), table)
    if plan.polish is not None:
        print_polish(plan, plan.polish, console)
    rounds = f", best of {plan.rounds} rounds" if plan.rounds > 1 else ""
    console.say(
        f"{plan.scenario.solver.name}, seed {plan.scenario.solver.seed}{rounds}: {search.evaluations} evaluations, "
        f"{search.iterations} iterations, {search.seconds:.2f} s, stopped by {search.stop_reason}"
    )
    for remark in remarks(plan):
        console.say(remark)


def _row(verdict: Verdict) -> tuple[Text, ...]:
    limit = limit_of(verdict.bound, verdict.unit)
    texts = Text(verdict.name), Text(f"{verdict.worst:.6g}"), Text(limit), MARKS[verdict.status], Text(verdict.where)
    return texts


def print_polish(plan: Plan, polish: Polish, console: OutputConsole) -> None:
    """The search and its refinement by IPOPT, side by side."""
    objective, descent = plan.problem.objective, polish.search
    decision = "kept" if polish.accepted else "discarded, not better"
    headings = f"{objective.name}, {objective.unit}", "worst violation", "evaluations", "iterations", "seconds"
    table = table_of(word(""), *map(number, headings))
    rows = (
        ("before", polish.before, plan.search.evaluations, plan.search.iterations, plan.search.seconds),
        ("after", polish.after, descent.evaluations, descent.solution.iterations, polish.seconds),
    )
    for name, motion, evaluations, iterations, seconds in rows:
        numbers = f"{motion.objective:.6g}", f"{motion.worst_violation:.3g}"
        table.add_row(name, *numbers, str(evaluations), str(iterations), f"{seconds:.2f}")
    console.print_table(f"polish: {decision} ({descent.solution.status})", table)


def remarks(plan: Plan) -> Iterator[str]:
    """What a user may want to change: joints that turn more than once, a plan far from the best known one."""
    for name, turns in zip(plan.problem.robot.joint_names, plan.motion.turns, strict=True):
        if turns > 1.0:
            yield f"{name} turns {turns:.2f} times; state joint_limits if it must not"
    best = best_known(plan.scenario)
    if best is not None and plan.feasible and plan.objective > (1.0 + FAR) * best:
        excess = plan.objective / best - 1.0
        yield f"{excess:.0%} above the best plan known, {limit_of(best, plan.problem.objective.unit)}; try --within 10"


def print_scenarios(console: OutputConsole) -> None:
    """The built-in scenarios."""
    table = table_of(word("name"), prose("content"))
    for name, title in TITLES.items():
        table.add_row(name, title + (" (the default)" if name == DEFAULT else ""))
    console.print(table)
