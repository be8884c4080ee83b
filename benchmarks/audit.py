"""What an audit says of a polished run of every built-in case, and CPU time in milliseconds.

python -m benchmarks.audit
"""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rich.console import Console
from rich.table import Table

from tpbso_casadi.audit_report import audit_run, audit_scenario
from tpbso_casadi.display.audit_tables import of_one, saved
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.scenario.cases import TITLES, builtin
from tpbso_casadi.storage import read_run, write_plan

TIMES = ("case", "scenario", "read and recompute a run", "certificate", "optimality", "all of the run's audit")
STATEMENTS = ("case", "the plan", "the optimum's motion", "its program says", "1 % looser saves most")
WIDTH = 140  # columns


def main() -> None:
    times, statements = Table(*TIMES, title="audit [ms]"), Table(*STATEMENTS, title="the nearest optimum")
    for name in TITLES:
        content = builtin(name).table()
        content["solver"] |= {"evaluations": 5000, "polish_starts": 1}
        scenario = parse_scenario(content)
        with TemporaryDirectory() as folder:
            write_plan(Path(folder), plan(scenario))
            began = time.process_time()
            run = read_run(Path(folder))
            read = time.process_time()
            audit = audit_run(run)
        seconds = (
            audit_scenario(scenario)["seconds"],
            read - began,
            audit["certificate"]["seconds"],
            audit["optimality"]["seconds"],
            time.process_time() - read,
        )
        times.add_row(name, *(f"{s * 1e3:.1f}" for s in seconds))
        statements.add_row(name, *_statement(audit))
    console = Console(width=WIDTH)
    console.print(times)
    console.print(statements)


def _statement(audit: dict[str, Any]) -> tuple[str, ...]:
    """The certified objectives of the plan and of the optimum's motion, what the program says, what saves most."""
    optimum, objective = audit["optimum"], audit["objective"]
    plan, unit = f"{objective['value']:.5f} {objective['unit']}", objective["unit"]
    if optimum is None:
        return plan, "no certified one found", "", ""
    prices = [_price(price, unit) for price in optimum["ranking"][:1]]
    off = optimum["program"] / optimum["objective"] - 1.0
    return (
        f"{plan} ({optimum['excess']:+.2%})",
        f"{optimum['objective']:.5f}",
        f"{optimum['program']:.5f} ({off:+.2%})",
        *(prices or ["nothing"]),
    )


def _price(price: dict[str, Any], unit: str) -> str:
    """What is saved by planning again, else by timing the plan again; of a limit of no size its rate."""
    what = f"{price['constraint']}, {price['column']}"
    if not price["size"]:
        return f"{what}: {of_one(price, unit)}"
    if not price["per_unit"]:
        return f"{what}: {saved(-price['timed_per_cent'], unit)} timed again"
    return f"{what}: {saved(-price['per_cent'], unit)}"


if __name__ == "__main__":
    main()
