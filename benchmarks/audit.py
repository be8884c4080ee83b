"""Time of an audit in milliseconds, for every built-in case: of its scenario, and of a polished run of it.

python -m benchmarks.audit
"""

from __future__ import annotations

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.table import Table

from tpbso_casadi.audit_report import audit_run, audit_scenario
from tpbso_casadi.figures import write_run
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.scenario.cases import TITLES, builtin
from tpbso_casadi.storage import read_run


def main() -> None:
    table = Table("case", "scenario", "read and recompute a run", "certificate", "optimality", title="audit [ms]")
    for name in TITLES:
        content = builtin(name).model_dump()
        content["solver"] |= {"evaluations": 5000, "polish_starts": 1}
        scenario = parse_scenario(content)
        with TemporaryDirectory() as folder:
            write_run(Path(folder), plan(scenario), plots=False)
            began = time.perf_counter()
            run = read_run(Path(folder))
            read = time.perf_counter() - began
        of_run = audit_run(run)
        seconds = (
            audit_scenario(scenario)["seconds"],
            read,
            of_run["certificate"]["seconds"],
            of_run["optimality"]["seconds"],
        )
        table.add_row(name, *(f"{s * 1e3:.1f}" for s in seconds))
    Console().print(table)


if __name__ == "__main__":
    main()
