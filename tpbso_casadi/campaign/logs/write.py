"""Write the histories of stored runs as logs of another program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tpbso_casadi.campaign.analysis.convergence import StoredSearch
from tpbso_casadi.campaign.logs.coco import check_coco, write_coco
from tpbso_casadi.campaign.logs.ioh import write_ioh
from tpbso_casadi.campaign.logs.trace import Trace
from tpbso_casadi.campaign.run import AnyRun
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


def traces_of(runs: Sequence[AnyRun], store: Store) -> list[Trace]:
    """The searches that did not fail, without those that descend a program, whose values are no costs of candidates.

    The value is the cost that the search minimises, penalties included. Where the lowest is not known it is that of all
    these runs; the worst is the highest in any of their histories.
    """
    searches = [run for run in runs if not run.section.kind().solves_program]
    stored = [(run, StoredSearch.model_validate_json(text)) for run, text in store.texts(searches) if text is not None]
    costs: dict[str, list[float]] = {}
    for run, search in stored:
        costs.setdefault(run.case, []).extend(cost for cost in search.course.cost if cost is not None)
    dimensions = {run.case: run.box.dimension for run in searches}
    return [_trace(run, search, dimensions[run.case], costs[run.case]) for run, search in stored]


def _trace(run: AnyRun, search: StoredSearch, dimension: int, costs: Sequence[float]) -> Trace:
    return Trace(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        dimension=dimension,
        evaluations=np.array(search.course.evaluations, dtype=np.float64),
        values=np.array([np.inf if cost is None else cost for cost in search.course.cost]),
        done=search.evaluations,
        worst=max(costs, default=np.inf),
        optimum=min(costs, default=np.inf) if run.measure.known is None else run.measure.known,
    )
