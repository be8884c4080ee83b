"""What holds a motion back, in the terminal: the optimum near it, and what each limit there is worth."""

from __future__ import annotations

from typing import Any

from rich.text import Text

from tpbso_casadi.cli.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.cli.display.plan_tables import limit_of
from tpbso_casadi.storage.plain import visible

LISTED = 12
NO_UNIT = "1"  # of a weighted sum
SMALL = {"s": (1e3, "ms"), "m": (1e3, "mm")}  # units in which differences are read: how many there are in one


def print_optimum(optimum: dict[str, Any], objective: dict[str, Any], console: OutputConsole) -> None:
    """Where it is, the ranking of limits, and what that means in words."""
    value, excess = optimum["objective"], optimum["excess"]
    unit = "" if objective["unit"] == NO_UNIT else objective["unit"]
    of = "the plan" if optimum["of_plan"] else "the motion before"
    away = f"{abs(excess):.2%} {'more' if excess >= 0.0 else 'less'}"
    console.print(
        Text(
            f"the nearest optimum ({optimum['status']}, {optimum['seconds']:.2g} s): {objective['name']} "
            f"{limit_of(value, unit)}; {of} takes {away}; stationarity {optimum['residuals']['stationarity']:.2g}"
        )
    )
    ranking = optimum["ranking"]
    if not ranking:
        console.say("no limit holds it back")
        return
    table = table_of(word("limit"), prose("of"), number("now"), number("1 % saves"), number("one unit saves"))
    for price in ranking[:LISTED]:
        size = f"{price['size']:.4g} {price['limit_unit']}"
        savings = saved(-price["per_cent"], unit) if price["size"] else "-", of_one(price, unit)
        table.add_row(*map(Text, (price["constraint"], price["column"], size, *savings)))
    console.print_table("what holds the motion back: what each limit, one per cent looser, saves", table)
    for sentence in sentences(ranking, unit):
        console.say(visible(sentence))


def saved(value: float, unit: str) -> str:
    """A difference of an objective, s in ms."""
    factor, small = SMALL.get(unit, (1.0, unit))
    return f"{value * factor:.3g} {small}".strip()


def of_one(price: dict[str, Any], unit: str) -> str:
    """What one unit saves; of lengths one mm."""
    factor, small = SMALL.get(price["limit_unit"], (1.0, price["limit_unit"]))
    return f"{saved(-price['per_unit'] / factor, unit)} per {small}"


def sentences(ranking: list[dict[str, Any]], unit: str) -> list[str]:
    """What a stronger motor and a lighter payload would buy: of the motors the one that holds it back most."""
    motors = [price for price in ranking if price["constraint"] == "torque"][:1]
    loads = [price for price in ranking if price["constraint"] == "payload"]
    said = [f"1 {p['limit_unit']} more in {p['column']} saves {saved(-p['per_unit'], unit)}" for p in motors]
    return said + [f"1 kg less in the hand saves {saved(-p['per_unit'], unit)}" for p in loads]
