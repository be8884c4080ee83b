"""The best plan of each case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.run import Run
from tpbso_casadi.campaign.store import Store, StoreError
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.scenario.scenario import plugin_failures_named
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.recomputation.agreement import Contradiction
from tpbso_casadi.storage.stored_run import checked


@dataclass(frozen=True, kw_only=True)
class BestPlan:
    """The plan of the lowest objective on a case; of equal ones that of the first run.

    Attributes:
        run: that found it.
        record: of that run.
        motion: computed again from what is stored, certificate and objective included.
    """

    run: Run
    record: Record
    motion: Motion


def best_plans(runs: Sequence[Run], store: Store) -> list[BestPlan]:
    """The best plan of each case that has one, in the order of the cases.

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
    return [BestPlan(run=run, record=record, motion=motion_of(run, store)) for run, record in chosen]


def motion_of(run: Run, store: Store) -> Motion:
    """The plan of a run.

    Raises:
        StoreError: what is stored is no result, or not what a recomputation gives.
    """
    result = store.result(run)
    try:
        with plugin_failures_named(result.scenario, Contradiction):
            return checked(result).motion
    except (ScenarioError, Contradiction) as error:
        raise StoreError(f"{store.place(run)}: {error}") from error
