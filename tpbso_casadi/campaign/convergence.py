"""Convergence of runs: gaps over evaluations, targets reached."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from problems.base import FloatArray
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.campaign.store import Store, StoreError
from tpbso_casadi.storage import HistoryResult


@dataclass(frozen=True, kw_only=True)
class Convergence:
    """The objective of the best plan of a run so far, where it changed.

    A run whose plan is not certified in the end, and one that failed, has no plan at any time. The costs of a search
    are those at its samples; they are moved by the constant that makes the last one the certified objective of the
    search's motion. A polish comes after the last evaluation of its search.

    Attributes:
        case: of the scenario.
        solver: its label.
        seed: of the run.
        evaluations: after which the plan became better, (n,), ascending.
        objectives: from then on, (n,), descending, in the unit of the objective.
        done: evaluations of the whole run, those of a polish too; 0 where it failed.
    """

    case: str
    solver: str
    seed: int
    evaluations: FloatArray
    objectives: FloatArray
    done: int

    def at(self, evaluations: FloatArray) -> FloatArray:
        """The objective after so many evaluations (m,), (m,); inf before the first plan."""
        steps = np.searchsorted(self.evaluations, evaluations, side="right")
        return np.concatenate([[np.inf], self.objectives])[steps]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, extra="ignore")


class _Motion(_Part):
    objective: float | None
    feasible: bool


class _Stage(_Part):
    before: _Motion
    evaluations: int = 0


class _Objective(_Part):
    value: float | None


class StoredSearch(_Part):
    """What convergence needs of a ``result.json``."""

    feasible: bool
    objective: _Objective
    evaluations: int
    history: HistoryResult
    improvements: HistoryResult | None = None
    polish: _Stage | None = None
    retiming: _Stage | None = None

    @property
    def done(self) -> int:
        """Evaluations of search and polish; at least one."""
        return max(1, self.evaluations + (0 if self.polish is None else self.polish.evaluations))

    @property
    def course(self) -> HistoryResult:
        """Where the best so far changed: at each evaluation where that is stored, else at each iteration."""
        return self.improvements or self.history

    @property
    def searched(self) -> _Motion:
        """The motion that the search ended with, before any other stage."""
        stage = self.polish or self.retiming
        return _Motion(objective=self.objective.value, feasible=self.feasible) if stage is None else stage.before


def convergences(runs: Iterable[AnyRun], store: Store) -> list[Convergence]:
    """The convergence of each of these runs that is stored, in their order.

    Raises:
        StoreError: what is stored is not a result.
    """
    found = []
    for run, text in store.texts(runs):
        try:
            stored = None if text is None else StoredSearch.model_validate_json(text)
        except ValidationError as error:
            raise StoreError(f"{store.place(run)}: {in_one_line(error)}") from error
        found.append(convergence_of(run, stored))
    return found


def in_one_line(error: ValidationError) -> str:
    """The first thing that is wrong with a stored result, and where."""
    first = error.errors(include_url=False, include_context=False)[0]
    return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"


def convergence_of(run: AnyRun, stored: StoredSearch | None) -> Convergence:
    """The convergence of a run; None is stored where it failed."""
    evaluations, objectives = np.empty(0), np.empty(0)
    if stored is not None and stored.feasible and stored.objective.value is not None:
        evaluations, objectives = improvements(stored, run.least_infeasible_cost, stored.objective.value)
    return Convergence(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        evaluations=evaluations,
        objectives=objectives,
        done=0 if stored is None else stored.done,
    )


def improvements(stored: StoredSearch, least_infeasible: float, objective: float) -> tuple[FloatArray, FloatArray]:
    """Evaluations and objectives of each better plan of a run, both (n,).

    Args:
        stored: of the run.
        least_infeasible: the lowest cost of a candidate that breaks a limit.
        objective: of the certified plan at the end, which no earlier value may undercut.
    """
    evaluations = np.array([*stored.course.evaluations, stored.done], dtype=np.float64)
    cost = np.array([np.inf if c is None else c for c in stored.course.cost])
    end = stored.searched
    if end.feasible and end.objective is not None and cost.size:
        values = np.where(cost < least_infeasible, cost + (end.objective - cost[-1]), np.inf)
    else:
        values = np.full(cost.shape, np.inf)
    values = np.append(np.maximum(values, objective), objective)
    better = values < np.minimum.accumulate(np.concatenate([[np.inf], values]))[:-1]
    evaluations, values = evaluations[better], values[better]
    last = np.diff(evaluations, append=np.inf) > 0.0  # of several after the same evaluation
    return evaluations[last], values[last]
