"""A trade-off in the terminal: its points, and what each method's front is worth."""

from __future__ import annotations

from rich.text import Text

from tpbso_casadi.cli.display.console import OutputConsole, number, table_of, word
from tpbso_casadi.trade_off.point import Point, Standing
from tpbso_casadi.trade_off.table import TradeOff

COLOURS = {Standing.FRONT: "green", Standing.NOT_CERTIFIED: "red"}


def say_point(headings: tuple[str, str], point: Point, console: OutputConsole) -> None:
    """A line of a point that is complete."""
    values = ", ".join(f"{heading} {value:.5g}" for heading, value in zip(headings, point.values, strict=True))
    console.say(f"point {point.number}: {values}{'' if point.certified else ', not certified'}")


def print_trade_off(trade_off: TradeOff, console: OutputConsole) -> None:
    """The plans of each method by the first objective, then what all methods' fronts are worth."""
    fronts = trade_off.fronts
    planned = {m: [p for p in points if p.request is not None] for m, points in trade_off.points.items()}
    for method, points in ((method, points) for method, points in planned.items() if points):
        first, second = trade_off.headings
        table = table_of(number("point"), number(first), number(second), number("T [s]"), word("is"))
        for point in sorted(points, key=lambda each: each.values):
            standing = fronts[method].standings[point.number]
            cells = [str(point.number), *(f"{value:.5g}" for value in (*point.values, point.duration))]
            table.add_row(*cells, Text(standing, COLOURS.get(standing, "yellow")))
        console.print_table(method, table)
    table = table_of(word("method"), number("on front"), number("hypervolume"), number("evaluations"), number("s"))
    for s in trade_off.summaries:
        counts = f"{s.on_front} of {s.points}", f"{s.hypervolume:.6g}", str(s.evaluations), f"{s.seconds:.1f}"
        table.add_row(s.method, *counts)
    console.print_table("fronts", table)
