"""The best run of each case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from pydantic import ValidationError

from tpbso_casadi.campaign.analysis.convergence import in_one_line
from tpbso_casadi.campaign.analysis.found import Found
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.campaign.store import Store, StoreError
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.recomputation.agreement import Contradiction
from tpbso_casadi.storage.result import InvalidResult


@dataclass(frozen=True, kw_only=True)
class Best:
    """The run of the lowest objective on a case; of equal ones the first.

    Attributes:
        run: itself.
        record: of it.
        found: what it found.
    """

    run: AnyRun
    record: Record
    found: Found


def best_runs(runs: Sequence[AnyRun], store: Store) -> list[Best]:
    """The best run of each case that has one, in the order of the cases.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    by_labels = {(run.case, run.solver, run.seed): run for run in runs}
    best: dict[str, tuple[float, Record]] = {}
    for record in store.records(runs):
        if record.feasible and record.objective is not None:
            lowest = best[record.case][0] if record.case in best else inf
            if record.objective < lowest:
                best[record.case] = record.objective, record
    chosen = [(by_labels[record.case, record.solver, record.seed], record) for _, record in best.values()]
    return [Best(run=run, record=record, found=found_by(run, store)) for run, record in chosen]


def found_by(run: AnyRun, store: Store) -> Found:
    """What a run that did not fail found.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    [(_, text)] = store.texts([run])
    try:
        return run.found(text or "")
    except ValidationError as error:
        raise StoreError(f"{store.place(run)}: {in_one_line(error)}") from error
    except (InvalidResult, ScenarioError, Contradiction) as error:
        raise StoreError(f"{store.place(run)}: {error}") from error
