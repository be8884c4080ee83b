"""An audit as tables in the terminal."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from problems import CertificateStatus
from tpbso_casadi.cli.display import MARKS

LISTED_NAMES = 4
LISTED_SENSITIVITIES = 6


def print_scenario_audit(audit: dict[str, Any], console: Console) -> None:
    """The structure of the search model and of the nonlinear program."""
    for key, title in (("search", "search model"), ("program", "nonlinear program")):
        model = audit[key]
        table = Table(
            title=f"{title}: {model['variables']} variables, {model['rows']} rows, "
            f"{model['degrees_of_freedom']} degrees of freedom left by equalities",
            title_justify="left",
        )
        for heading in (
            "constraint",
            "paper",
            "unit",
            "rows",
            "degree",
            "Jacobian",
            "depends on",
            "kinks",
            "redundant rows",
        ):
            table.add_column(heading, overflow="fold")
        for c in model["constraints"]:
            kind = "=" if c["equality"] else ("for all t" if c["for_all_t"] else "pointwise")
            size = f"{c['rows']} x {model['variables']}, {c['nonzeros']} nonzero"
            table.add_row(
                f"{c['name']}\n{kind}",
                c["equation"],
                c["unit"],
                str(c["rows"]),
                c["degree"],
                size,
                _names(c["depends_on"]),
                ", ".join(f"{n} {kink}" for kink, n in c["kinks"].items()) or "none",
                _redundant(c),
            )
        console.print(table)
        for c in model["constraints"]:
            console.print(f"  {c['name']}: {c['formula']}", highlight=False, markup=False)
    console.print(f"{audit['seconds'] * 1e3:.0f} ms", highlight=False)


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


def print_run_audit(audit: dict[str, Any], console: Console) -> None:
    """The certificate, the margins, the first-order conditions and the shadow prices of the limits."""
    verdict = audit["certificate"]["verdict"]
    objective, seconds = audit["objective"], audit["certificate"]["seconds"]
    value = "not a number" if objective["value"] is None else f"{objective['value']:.6g}"
    title = f"{verdict} in {seconds * 1e3:.1f} ms: {objective['name']} {value} {objective['unit']}"
    table = Table(title=title, title_justify="left")
    for heading in ("constraint", "worst", "bound", "margin", "unit", "", "active", "where"):
        table.add_column(heading, justify="right" if heading in ("worst", "bound", "margin") else "left")
    for c in audit["constraints"]:
        numbers = (f"{c[key]:.6g}" for key in ("worst", "bound", "margin"))
        mark = MARKS[CertificateStatus(c["status"])]
        table.add_row(c["name"], *numbers, c["unit"], mark, "active" if c["active"] else "", c["where"])
    console.print(table)
    print_optimality(audit, console)


def print_optimality(audit: dict[str, Any], console: Console) -> None:
    """KKT residuals, rank of the active rows, shadow prices."""
    kkt = audit["optimality"]
    independent = "independent (LICQ holds)" if kkt["licq"] else f"of rank {kkt['rank']} (LICQ fails)"
    console.print(
        f"as a KKT point: relative stationarity {kkt['stationarity']:.2g}, "
        f"complementarity {kkt['complementarity']:.2g}, violation {kkt['violation']:.2g}; "
        f"{kkt['active']} active rows, {independent}",
        highlight=False,
    )
    if audit["polish"] is not None:
        residuals = ", ".join(f"{name} {value:.2g}" for name, value in audit["polish"]["residuals"].items())
        console.print(f"the polish ended with {audit['polish']['status']}: {residuals}", highlight=False)
    if not kkt["sensitivities"]:
        console.print("no active limit: all shadow prices are zero", highlight=False)
        return
    table = Table("limit", "of", "change of the objective for one unit more", "unit", title_justify="left")
    table.title = "shadow prices"
    for s in kkt["sensitivities"][:LISTED_SENSITIVITIES]:
        table.add_row(s["constraint"], s["column"], f"{s['per_unit']:.4g}", s["unit"])
    console.print(table)
