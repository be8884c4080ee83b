"""A simulation in the terminal."""

from __future__ import annotations

from rich.text import Text

from tpbso_casadi.cli.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.simulation.record import Replan
from tpbso_casadi.simulation.result import LARGEST_JUMP, WHAT, SimulationResult, SummaryResult

GOOD, BAD = "green", "red"


class ReplanLines:
    """Lines on what becomes otherwise while a simulation runs: the arm stops, goes on, or is without a proof."""

    def __init__(self, console: OutputConsole) -> None:
        self._console = console
        self._last = "goes on"

    def __call__(self, replan: Replan) -> None:
        """Say what an answer of the planner changes; nothing where that is nothing."""
        unproven = "" if replan.certified else ", not certified"
        unsafe = "" if replan.fail_safe else ", no stop in time is proven"
        words = f"{'stops' if replan.kind == 'stop' else 'goes on'}{unproven}{unsafe}"
        if words != self._last:
            self._console.say(f"t = {replan.time:.4g} s: {words}")
        self._last = words


def print_simulation(result: SimulationResult, console: OutputConsole) -> None:
    """What was measured, each with a mark where it should be otherwise; and limits that were broken."""
    summary = result.summary
    table = table_of(word("measured"), number("value"), prose(""))
    for name, value, good, remark in _rows(summary):
        table.add_row(name, Text(value, "" if good is None else GOOD if good else BAD), remark)
    console.print_table(f"{WHAT}; {summary.seconds:.6g} s", table)
    for limit in result.limits:
        if not limit.satisfied:
            worst = "?" if limit.worst is None else f"{limit.worst:.6g}"
            console.say(
                f"{limit.name} was {worst} {limit.unit} ({limit.where}); the limit is {limit.bound} {limit.unit}"
            )


def _rows(summary: SummaryResult) -> list[tuple[str, str, bool | None, str]]:
    closest, largest = summary.closest, max(summary.largest_jumps)
    distance = "-" if closest.distance is None else f"{1000.0 * closest.distance:.4g} mm"
    where = f"{closest.pair}, t = {closest.time:.4g} s, {'moving' if closest.moving else 'standing'}"
    kinds = f"{summary.new} new, {summary.old} old, {summary.stop} stops"
    proven = f"{summary.certified} certified as predicted, {summary.fail_safe} with a stop in time proven"
    return [
        ("collisions while moving", str(summary.collisions), not summary.collisions, "with what obstacles really did"),
        *([("moves without a proof", str(summary.unproven), False, "of that")] if summary.unproven else []),
        ("contacts while standing", str(summary.standing_contacts), None, "something came to the arm where it stood"),
        ("closest", distance, None, where if closest.pair else "nothing within reach"),
        ("largest jump", f"{largest:.2g}", largest < LARGEST_JUMP, "of angle, speed, acceleration where motions join"),
        ("goals reached", str(summary.goals_reached), None, ""),
        ("replans", str(summary.replans), None, f"{kinds}; {proven}"),
        ("deadlines met", f"{summary.deadlines_met:.1%}", None, ""),
        ("time of a replan", f"{summary.median_ms:.4g} ms", None, _slowest(summary)),
    ]


def _slowest(summary: SummaryResult) -> str:
    return f"median; 99 %: {summary.percentile_99_ms:.4g} ms, largest: {summary.largest_ms:.4g} ms"
