"""Logs for IOHprofiler [1]: a folder a solver, which IOHanalyzer reads.

[1] J. de Nobel et al., "IOHexperimenter: Benchmarking Platform for Iterative Optimization Heuristics", Evolutionary
    Computation 32, 2024; the files are those of its logger "Analyzer", 0.3.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tpbso_casadi.campaign.logs.trace import Trace, folder_names, grouped, numbered
from tpbso_casadi.storage.files import write_text

VERSION = "0.3.18"  # of IOHexperimenter, whose format it is
SUITE = "tpbso-casadi"
ATTRIBUTES = ("evaluations", "raw_y")


def write_ioh(folder: Path, traces: Sequence[Trace]) -> None:
    """Write a folder for each solver.

    Raises:
        OSError: a file cannot be written.
    """
    numbers, solvers = numbered(traces), grouped(traces)
    names = folder_names(list(solvers))
    for solver, cases in solvers.items():
        for case, runs in cases.items():
            _write_case(folder / names[solver], solver, numbers[case], runs)


def _write_case(folder: Path, solver: str, number: int, runs: Sequence[Trace]) -> None:
    case, dimension = re.sub(r"[^A-Za-z0-9-]+", "-", runs[0].case), runs[0].dimension
    data = f"data_f{number}_{case}/IOHprofiler_f{number}_DIM{dimension}.dat"
    (folder / data).parent.mkdir(parents=True, exist_ok=True)
    blocks = [_block(run) for run in runs]
    write_text(folder / data, lambda file: file.write("".join(blocks)))
    described: dict[str, Any] = {
        "version": VERSION,
        "suite": SUITE,
        "function_id": number,
        "function_name": case,
        "maximization": False,
        "algorithm": {"name": solver, "info": "tpbso-casadi"},
        "attributes": list(ATTRIBUTES),
        "scenarios": [{"dimension": dimension, "path": data, "runs": [_described(run) for run in runs]}],
    }
    content = json.dumps(described, indent="\t") + "\n"
    write_text(folder / f"IOHprofiler_f{number}_{case}.json", lambda file: file.write(content))


def _block(run: Trace) -> str:
    """One run: a header, then evaluations and the lowest value, in full precision."""
    lines = [" ".join(ATTRIBUTES), *(f"{evaluations} {value!r}" for evaluations, value in run.improvements)]
    return "\n".join(lines) + "\n"


def _described(run: Trace) -> dict[str, Any]:
    best = min(run.entries, key=lambda entry: entry[1])
    evaluations = run.entries[-1][0]
    return {"instance": run.seed, "evals": evaluations, "best": {"evals": best[0], "y": best[1], "x": []}}
