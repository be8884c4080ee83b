"""Audits as tables."""

from __future__ import annotations

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


ACTIVE = Text("active", "green")  # it holds with nothing to spare
UNREPRESENTED = 0.02  # violation of scaled rows: of samples it is far less
LISTED_NAMES = 4
LISTED_SENSITIVITIES = 6


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
    """The certificate, the margins, the first-order conditions and the shadow prices of the limits."""
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
    """What the last stage made of the motion of search and polish, which the conditions of optimality are about."""
    before, after = retiming["before"], retiming["after"]
    if not retiming["accepted"]:
        console.say("timed anew, which made it no better")
        return
    durations = f"{before['duration']:.6g} s before, {after['duration']:.6g} s after"
    console.say(
        f"timed anew ({retiming['candidate']}): {durations}; the conditions that follow are about the one before"
    )


def print_optimality(audit: dict[str, Any], console: OutputConsole) -> None:
    """KKT residuals, rank of the active rows, shadow prices."""
    kkt = audit["optimality"]
    if kkt["violation"] > UNREPRESENTED:
        console.say("no motion of the nonlinear program is like this one")
    else:
        _print_conditions(kkt, audit["polish"], console)
    if audit["optimum"] is not None:
        print_optimum(audit["optimum"], audit["objective"], console)
    else:
        console.say("no optimum is found near the plan")
        if kkt["violation"] <= UNREPRESENTED:
            _print_prices(kkt["sensitivities"], console)


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


def _print_prices(sensitivities: list[dict[str, Any]], console: OutputConsole) -> None:
    """Shadow prices by least squares, where no optimum is found."""
    if not sensitivities:
        console.say("no active limit: all shadow prices are zero")
        return
    table = table_of(word("limit"), word("of"), number("price"), word("unit"))
    for s in sensitivities[:LISTED_SENSITIVITIES]:
        table.add_row(*map(Text, (s["constraint"], s["column"], f"{s['per_unit']:.4g}", s["unit"])))
    console.print_table("shadow prices: change of the objective for one unit more of a limit", table)


def _number(value: float | None) -> str:
    return "not a number" if value is None else f"{value:.2g}"
