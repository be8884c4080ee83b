"""Plans as tables."""

from __future__ import annotations

from collections.abc import Iterator
from math import isinf

import numpy as np
from rich.text import Text

from problems import CertificateStatus, Verdict
from problems.certify import AtGoal, WorstIs
from problems.library import missing_core
from problems.tasks import RecordedMotion
from solvers import Result, StopReason
from tpbso_casadi.display.console import OutputConsole, number, prose, said_number, table_of, word
from tpbso_casadi.display.passing_tables import print_passing
from tpbso_casadi.planning import BOUND, JudgedMotion, PlannedMotion, Polish, Retiming
from tpbso_casadi.scenario import DEFAULT, TITLES, best_known

MARKS = {
    CertificateStatus.CERTIFIED: Text("holds", "green"),
    CertificateStatus.VIOLATED: Text("BROKEN", "red"),
    CertificateStatus.UNDECIDED: Text("undecided", "yellow"),
}
FREE_TO_TURN = "state joint_limits if it must not"
FAR = 0.02  # above the best known objective, relative to it: worth a word
FAR_ABOVE = 0.5  # above the least time in free space, likewise


def summary_of(plan: PlannedMotion) -> str:
    """The objective and its value; of a weighted sum those of its parts, too."""
    objective = plan.criteria.objective
    parts = ", ".join(f"{part.name} {value:.6g} {part.unit}" for part, _, value in plan.motion.objective_parts)
    unit = "" if parts else f" {objective.unit}"
    return f"{objective.name} {plan.objective:.6g}{unit}{parts and f' ({parts})'}"


def limit_of(bound: float, unit: str) -> str:
    """A bound with its unit."""
    return f"{bound:.6g} {unit}".strip()


def print_plan(plan: PlannedMotion, console: OutputConsole) -> None:
    """The objective, every constraint judged for all t, the effort of the search, and remarks."""
    table = table_of(word("constraint"), said_number("worst"), word("limit"), word(""), prose("where"))
    for verdict in plan.verdicts:
        table.add_row(*_row(verdict))
    if plan.motion.stages:
        print_stages(plan.motion, console)
    console.print_table(summary_of(plan), table)
    for line in plan.motion.not_judged:
        console.say(f"not judged: {line}")
    print_passing(plan.motion, console)
    if plan.search is not None and plan.polish is not None:
        print_polish(plan.search, plan.polish, console)
    if plan.retiming is not None:
        print_retiming(plan.retiming, console)
    for line in (*plan.motion.taken, *nearness_of(plan.motion)):
        console.say(line)
    console.say(effort_of(plan))
    for remark in remarks(plan):
        console.say(remark)


def print_stages(motion: JudgedMotion, console: OutputConsole) -> None:
    """When each stage begins and ends, whether its limits hold, and what is told."""
    table = table_of(word("stage"), number("start, s"), number("end, s"), word(""), prose("signal"))
    for stage, verdicts in zip(motion.stages, motion.by_stage, strict=True):
        worst = next((verdict.status for verdict in verdicts if not verdict.satisfied), None)
        mark = MARKS[worst or CertificateStatus.CERTIFIED] if verdicts else Text("")
        table.add_row(Text(stage.label), f"{stage.start:.4f}", f"{stage.end:.4f}", mark, Text(stage.signal_in_words))
    console.print_table("stages", table)


def nearness_of(motion: JudgedMotion) -> Iterator[str]:
    """How near the motion comes to an obstacle, and what comes after arrival, in a line each."""
    closest = motion.closest_approach
    if closest is not None:
        found = WorstIs.FOUND.in_words(f"{closest.distance:.6g} m")
        yield f"closest approach: {found}, {closest.pair}, t = {closest.time:.4g} s"
    after = motion.at_goal
    if after is not None:
        yield f"at the goal: clear {_how_long(after, motion.trajectory.duration)}"


def _how_long(after: AtGoal, arrival: float) -> str:
    if isinf(after.clear_until):
        return "for ever"
    if after.touched:
        return f"until t = {after.clear_until:.4g} s"
    return f"for {after.clear_until - arrival:.4g} s, and no farther was looked"


def effort_of(plan: PlannedMotion) -> str:
    """How the plan was found, in a line."""
    search, solver = plan.search, plan.scenario.solver
    if plan.motion.stages:
        bound = float(plan.motion.quantities[BOUND][0])
        above = plan.motion.trajectory.duration / bound - 1.0
        count = len(plan.motion.stages)
        moving = sum(stage.criteria is not None for stage in plan.motion.stages)
        kept = "" if plan.kept is None else f"{plan.kept} of {moving} motions kept, "
        what = f"{count} stage{'s' if count > 1 else ''}, {kept}planned in {plan.seconds_timed:.2f} s"
        return f"{what}; {above:.1%} above {bound:.4g} s, their bound in free space between the postures looked at"
    if search is None:
        task = plan.criteria.task
        if isinstance(task, RecordedMotion):
            return f"a motion as it is stated: {task.joined}"
        return f"a given path, timed in {plan.seconds_timed:.2f} s"
    rounds = f", best of {plan.rounds} rounds" if plan.rounds > 1 else ""
    if not search.evaluations:
        at_bound = search.stop_reason is StopReason.TARGET
        how = "nothing between its ends is faster; found" if at_bound else "found"
        return f"{solver.name}, seed {solver.seed}: {how} without a search in {search.seconds:.2f} s"
    return (
        f"{solver.name}, seed {solver.seed}{rounds}: {search.evaluations} evaluations, {search.iterations} iterations, "
        f"{search.seconds:.2f} s, stopped by {search.stop_reason}"
    )


def _row(verdict: Verdict) -> tuple[Text, ...]:
    limit = limit_of(verdict.bound, verdict.unit)
    worst = verdict.worst_is.number(verdict.worst)
    texts = Text(verdict.name), Text(worst), Text(limit), MARKS[verdict.status], Text(verdict.where)
    return texts


def print_polish(search: Result, polish: Polish, console: OutputConsole) -> None:
    """The search and its refinement by IPOPT, side by side."""
    objective, descent = polish.before.criteria.objective, polish.search
    decision = "kept" if polish.accepted else "discarded, not better"
    headings = f"{objective.name}, {objective.unit}", "worst violation", "evaluations", "iterations", "seconds"
    table = table_of(word(""), *map(number, headings))
    rows = (
        ("before", polish.before, search.evaluations, search.iterations, search.seconds),
        ("after", polish.after, descent.evaluations, descent.solution.iterations, polish.seconds),
    )
    for name, motion, evaluations, iterations, seconds in rows:
        numbers = f"{motion.objective:.6g}", f"{motion.worst_violation:.3g}"
        table.add_row(name, *numbers, str(evaluations), str(iterations), f"{seconds:.2f}")
    console.print_table(f"polish: {decision} ({descent.solution.status})", table)


def print_retiming(retiming: Retiming, console: OutputConsole) -> None:
    """The motion before and after it was timed anew, side by side."""
    objective = retiming.before.criteria.objective
    headings = f"{objective.name}, {objective.unit}", "duration, s", "worst violation", "seconds"
    table = table_of(word(""), *map(number, headings))
    rows = [("before", retiming.before, "")]
    rows += [] if retiming.after is None else [(retiming.candidate, retiming.after, f"{retiming.seconds:.2f}")]
    for name, motion, seconds in rows:
        numbers = f"{motion.objective:.6g}", f"{motion.trajectory.duration:.6g}", f"{motion.worst_violation:.3g}"
        table.add_row(name, *numbers, seconds)
    console.print_table(f"retiming: {'kept' if retiming.accepted else 'discarded, not better'}", table)


def remarks(plan: PlannedMotion) -> Iterator[str]:
    """Remarks on how it was read, what was left out, joints that turn, and a plan far from the best or its bound."""
    yield from plan.criteria.task.notes
    if plan.problem is not None and plan.problem.direct.lacks_core:
        yield f"the fastest motions past obstacles and postures need {missing_core()}"
    if plan.problem is not None and plan.scenario.solver.polish_starts and not plan.problem.has_program:
        yield "not polished: this task has no nonlinear program"
    given = plan.criteria.task.given_postures
    asked = np.ptp(given, axis=0) / (2.0 * np.pi) if len(given) else np.zeros(plan.criteria.robot.dof)
    for name, turns, least in zip(plan.criteria.robot.joints.names, plan.motion.turns, asked, strict=True):
        if turns > 1.0:
            why = f"the joints that are given are {least:.2f} turns apart" if least > 1.0 else FREE_TO_TURN
            yield f"{name} turns {turns:.2f} times; {why}"
    best = best_known(plan.scenario)
    if best is not None and plan.feasible and plan.objective > (1.0 + FAR) * best:
        excess, known = plan.objective / best - 1.0, limit_of(best, plan.criteria.objective.unit)
        polish = "" if plan.scenario.solver.polish_starts else "--polish, or "
        yield f"{excess:.0%} above the best plan known, {known}; try {polish}--within 10"
    least = plan.motion.least_duration_between_ends
    if least is not None and plan.feasible and plan.trajectory.duration > (1.0 + FAR_ABOVE) * least:
        excess = plan.trajectory.duration / least - 1.0
        yield f"{excess:.0%} above {least:.4g} s, the least time between its ends where nothing is in the way"


def print_scenarios(console: OutputConsole) -> None:
    """Print the names of the built-in scenarios."""
    table = table_of(word("name"), prose("content"))
    for name, title in TITLES.items():
        table.add_row(name, title + (" (the default)" if name == DEFAULT else ""))
    console.print(table)
