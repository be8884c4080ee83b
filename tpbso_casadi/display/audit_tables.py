"""Audits as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.padding import Padding
from rich.text import Text

from problems import CertificateStatus
from problems.certify import WorstIs
from tpbso_casadi.display.console import OutputConsole, number, prose, said_number, table_of, word
from tpbso_casadi.display.plan_tables import MARKS, limit_of
from tpbso_casadi.plain import visible

LISTED = 12
NO_UNIT = "1"  # of a weighted sum
SAME = 5e-5  # relative: less is not said in hundredths of a per cent
PRICE_HEADINGS = ("limit", "of", "now", "1 % saves", "per unit", "timed again")
SMALL = {"s": (1e3, "ms"), "m": (1e3, "mm")}  # units in which differences are read: how many there are in one


def print_optimum(audit: dict[str, Any], console: OutputConsole) -> None:
    """The optimum's own motion beside the plan, what its program says, the ranking of limits, and that in words."""
    optimum = audit["optimum"]
    for sentence in optimum_in_words(audit):
        console.say(sentence)
    _print_ranking(optimum["ranking"], _unit(audit), console)
    if optimum["unpriced"]:
        console.say(visible(f"near, but not planned again with more of it: {', '.join(optimum['unpriced'])}"))


def optimum_in_words(audit: Mapping[str, Any]) -> tuple[str, str]:
    """The optimum's own motion beside the plan, and what its program says."""
    optimum, unit, verdict = audit["optimum"], _unit(audit), audit["certificate"]["verdict"]
    plan = "the plan" if verdict == CertificateStatus.CERTIFIED else f"the plan, which is {verdict},"
    value = f"{audit['objective']['name']} {limit_of(optimum['objective'], unit)}"
    residual = optimum["residuals"]["stationarity"]
    return (
        f"the nearest optimum, as a motion of its own, certified: {value}; {plan} {_compared(optimum['excess'])}",
        f"its nonlinear program says {limit_of(optimum['program'], unit)}, {_off(optimum)} "
        f"({optimum['status']}, stationarity {residual:.2g}, {optimum['seconds']:.2g} s with all that follows)",
    )


def _unit(audit: Mapping[str, Any]) -> str:
    unit = str(audit["objective"]["unit"])
    return "" if unit == NO_UNIT else unit


def _compared(excess: float) -> str:
    """How a plan compares with the optimum's own motion."""
    if abs(excess) < SAME:
        return "takes the same"
    return f"takes {excess:.2%} more" if excess > 0.0 else f"takes {-excess:.2%} less: it is better than that"


def _off(optimum: dict[str, Any]) -> str:
    """How the objective that the program sees differs from that of the motion, and why."""
    off = optimum["program"] / optimum["objective"] - 1.0 if optimum["objective"] else 0.0
    if abs(off) < SAME:
        return "the same"
    return f"{abs(off):.2%} {'more' if off > 0.0 else 'less'}, as it sees samples alone, and no corners"


def _print_ranking(ranking: list[dict[str, Any]], unit: str, console: OutputConsole) -> None:
    """Print the savings of planning again with a limit looser, as a table and in words."""
    if not ranking:
        console.say("nothing is saved by planning again with any limit one per cent looser")
        return
    first, second, *numbers = PRICE_HEADINGS
    table = table_of(word(first), prose(second), *map(number, numbers))
    for price in ranking[:LISTED]:
        table.add_row(*map(Text, price_row(price, unit)))
    console.print_table(
        "what holds the motion back: what each limit saves where it is one per cent looser and all is planned again; "
        "or the plan just timed again",
        table,
    )
    for sentence in sentences(ranking, unit):
        console.say(visible(sentence))


def price_row(price: dict[str, Any], unit: str) -> tuple[str, ...]:
    """The cells of a price under its headings."""
    size = f"{price['size']:.4g} {price['limit_unit']}"
    planned, timed = (saved(-price[share], unit) if price[share] else "-" for share in ("per_cent", "timed_per_cent"))
    return price["constraint"], price["column"], size, planned, of_one(price, unit), timed


def saved(value: float, unit: str) -> str:
    """A difference of an objective, s in ms."""
    factor, small = SMALL.get(unit, (1.0, unit))
    return f"{value * factor:.3g} {small}".strip()


def of_one(price: dict[str, Any], unit: str) -> str:
    """The rate at which more of it saves, planned again, by its unit; of lengths by one mm."""
    if not price["per_unit"]:
        return "-"
    factor, small = SMALL.get(price["limit_unit"], (1.0, price["limit_unit"]))
    return f"{saved(-price['per_unit'] / factor, unit)} per {small}"


def sentences(ranking: list[dict[str, Any]], unit: str) -> list[str]:
    """Savings of a stronger motor and a lighter payload, as planned again: of the motors that which saves most."""
    replanned = [price for price in ranking if price["per_unit"]]
    motors = [price for price in replanned if price["constraint"] == "torque"][:1]
    loads = [price for price in replanned if price["constraint"] == "payload"]
    said = [f"{p['step']:.3g} {p['limit_unit']} more in {p['column']} saves {_of_step(p, unit)}" for p in motors]
    return said + [f"{p['step']:.3g} kg less in the hand saves {_of_step(p, unit)}" for p in loads]


def _of_step(price: dict[str, Any], unit: str) -> str:
    """The saving of the step that was planned."""
    return saved(-price["per_unit"] * price["step"], unit)


ACTIVE = Text("active", "green")  # it holds with nothing to spare
UNREPRESENTED = 0.02  # violation of scaled rows: of samples it is far less
LISTED_NAMES = 4


def print_scenario_audit(audit: dict[str, Any], console: OutputConsole) -> None:
    """The structure of the search model and of the nonlinear program, constraint by constraint."""
    for key, title in (("search", "search model"), ("program", "nonlinear program")):
        model = audit[key]
        if model is None:
            console.say("there is no nonlinear program of this task")
            continue
        console.print(
            Text(
                f"{title}: {model['variables']} variables, {model['rows']} rows, "
                f"{model['degrees_of_freedom']} degrees of freedom left by equalities"
            )
        )
        for constraint in model["constraints"]:
            console.print(Padding(Text(_described(constraint, model["variables"])), (0, 0, 0, 2)))
    console.say(f"{audit['seconds'] * 1e3:.0f} ms")


def _described(c: dict[str, Any], variables: int) -> str:
    """A constraint of a scenario in three lines."""
    kind = "=" if c["equality"] else ("for all t" if c["for_all_t"] else "pointwise")
    heading = ", ".join(filter(None, [f"{c['name']} {c['equation']}".strip(), c["unit"], kind]))
    kinks = ", ".join(f"{count} {kink}" for kink, count in c["kinks"].items()) or "none"
    return (
        f"{heading}: {c['formula']}\n"
        f"  {c['rows']} rows, {c['degree']}; Jacobian {c['rows']} x {variables}, {c['nonzeros']} nonzero\n"
        f"  depends on {_names(c['depends_on'])}; kinks: {kinks}; redundant rows: {_redundant(c)}"
    )


def _names(names: list[str]) -> str:
    if len(names) <= LISTED_NAMES:
        return ", ".join(names)
    return f"{', '.join(names[: LISTED_NAMES - 1])} ... ({len(names)})"


def _redundant(c: dict[str, Any]) -> str:
    counts = {
        "constant": c["constant_rows"],
        "repeated": c["duplicate_rows"],
        "always met": c["always_met"],
        "NEVER met": c["never_met"],
    }
    return ", ".join(f"{count} {name}" for name, count in counts.items() if count) or "none"


def print_run_audit(audit: dict[str, Any], console: OutputConsole) -> None:
    """The certificate, the margins, the first-order conditions, the nearest optimum and the prices of limits."""
    verdict = audit["certificate"]["in_words"]
    objective, seconds = audit["objective"], audit["certificate"]["seconds"]
    value = "not a number" if objective["value"] is None else f"{objective['value']:.6g}"
    table = table_of(
        word("constraint"), said_number("worst"), word("limit"), number("margin"), word(""), prose("where")
    )
    for c in audit["constraints"]:
        status = CertificateStatus(c["status"])
        mark = ACTIVE if c["active"] and status is CertificateStatus.CERTIFIED else MARKS[status]
        worst = WorstIs(c["worst_is"]).number(c["worst"])
        limit, margin = limit_of(c["bound"], c["unit"]), f"{c['margin']:.4g}"
        table.add_row(*map(Text, (c["name"], worst, limit, margin)), mark, Text(c["where"]))
    title = f"{verdict} in {seconds * 1e3:.1f} ms: {objective['name']} {value} {objective['unit']}"
    console.print_table(title, table)
    for line in audit["certificate"]["not_judged"]:
        console.say(f"not judged: {line}")
    if audit["retiming"] is not None:
        print_retiming(audit["retiming"], console)
    if audit["optimality"] is None:
        known = "there is no nonlinear program to judge by" if audit["searched"] else "there was nothing else to choose"
        timed = audit["retiming"] is not None
        told = audit["nothing_chosen"] or (f"the timing is the fastest of its path; {known}" if timed else known)
        console.say(told)
    else:
        print_optimality(audit, console)


def print_retiming(retiming: dict[str, Any], console: OutputConsole) -> None:
    """Print what the last stage made of the motion of search and polish, whose optimality is judged."""
    before, after = retiming["before"], retiming["after"]
    if not retiming["accepted"]:
        console.say("timed anew, which made it no better")
        return
    durations = f"{before['duration']:.6g} s before, {after['duration']:.6g} s after"
    console.say(f"timed anew ({retiming['candidate']}): {durations}; as a KKT point the one before is judged")


def print_optimality(audit: dict[str, Any], console: OutputConsole) -> None:
    """KKT residuals and rank of the active rows; the nearest optimum and prices of limits."""
    kkt = audit["optimality"]
    if kkt["violation"] > UNREPRESENTED:
        console.say("no motion of the nonlinear program is like this one")
    else:
        _print_conditions(kkt, audit["polish"], console)
    if audit["optimum"] is not None:
        print_optimum(audit, console)
    else:
        console.say("no certified optimum is found near the plan")


def _print_conditions(kkt: dict[str, Any], polish: dict[str, Any] | None, console: OutputConsole) -> None:
    """KKT residuals of the motion itself."""
    rest = kkt["active"] - kkt["rank"]
    independent = "none follows from the others" if kkt["licq"] else f"{rest} of them follow from the others (no LICQ)"
    console.print(
        Text(
            f"as a KKT point: relative stationarity {kkt['stationarity']:.2g}, "
            f"complementarity {kkt['complementarity']:.2g}, violation {kkt['violation']:.2g}; "
            f"{kkt['active']} limits of the program are reached, {independent}"
        )
    )
    if polish is not None:
        residuals = ", ".join(f"{name} {_number(value)}" for name, value in polish["residuals"].items())
        console.print(Text(visible(f"the polish ended with {polish['status']}: {residuals}")))


def _number(value: float | None) -> str:
    return "not a number" if value is None else f"{value:.2g}"
