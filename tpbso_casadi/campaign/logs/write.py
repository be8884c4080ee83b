"""Write the histories of stored runs as logs of another program."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tpbso_casadi.campaign.functions.run import FunctionRun
from tpbso_casadi.campaign.logs.coco import check_coco, write_coco
from tpbso_casadi.campaign.logs.ioh import write_ioh
from tpbso_casadi.campaign.logs.trace import Trace
from tpbso_casadi.campaign.run import AnyRun, Run, problem_of
from tpbso_casadi.campaign.store import Store
from tpbso_casadi.storage.files import check_writable, writing

WRITERS: dict[str, Callable[[Path, Sequence[Trace]], None]] = {"coco": write_coco, "ioh": write_ioh}
CHECKS: dict[str, Callable[[int], None]] = {"coco": check_coco, "ioh": lambda cases: None}


def write_logs(formats: Sequence[str], folder: Path, traces: Sequence[Trace]) -> None:
    """Write ``folder/coco`` or ``folder/ioh``, or both.

    Raises:
        OutputError: a file cannot be written, or there are more cases than the format has room for.
    """
    with writing(folder):
        for name in formats:
            WRITERS[name](folder / name, traces)


def check_logs(formats: Sequence[str], folder: Path, cases: int) -> None:
    """Make sure before the runs that logs of so many cases can be written.

    Raises:
        OutputError: they cannot.
    """
    for name in formats:
        CHECKS[name](cases)
        check_writable(folder / name)


def traces_of_functions(runs: Sequence[FunctionRun], store: Store) -> list[Trace]:
    """The runs that did not fail; their values are above the minimum, which is 0."""
    return [
        _trace(run, content, "improvements", len(content["x"]), worst=np.inf, optimum=0.0)
        for run, content in _stored(runs, store)
    ]


def traces_of_scenarios(runs: Sequence[Run], store: Store) -> list[Trace]:
    """The searches that did not fail, without those that descend a program, whose values are no costs of candidates.

    The value is the cost that the search minimises, penalties included; the optimum the lowest of all these runs, and
    the worst the highest in any of their histories.
    """
    searches = [run for run in runs if not run.scenario.solver.kind().solves_program]
    stored = _stored(searches, store)
    costs: dict[str, list[float]] = {}
    for run, content in stored:
        costs.setdefault(run.case, []).extend(cost for cost in content["history"]["cost"] if cost is not None)
    dimensions = {run.case: problem_of(run.scenario).bounds[0].size for run, _ in stored}
    return [
        _trace(
            run,
            content,
            "history",
            dimensions[run.case],
            worst=max(costs[run.case], default=np.inf),
            optimum=min(costs[run.case], default=np.inf),
        )
        for run, content in stored
    ]


def _stored(runs: Sequence[Any], store: Store) -> list[tuple[Any, dict[str, Any]]]:
    return [(run, json.loads(text)) for run, text in store.texts(runs) if text is not None]


def _trace(run: AnyRun, content: dict[str, Any], key: str, dimension: int, worst: float, optimum: float) -> Trace:
    history = content[key]
    return Trace(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        dimension=dimension,
        evaluations=np.array(history["evaluations"], dtype=np.float64),
        values=np.array([np.inf if cost is None else cost for cost in history["cost"]]),
        done=content["evaluations"],
        worst=worst,
        optimum=optimum,
    )
