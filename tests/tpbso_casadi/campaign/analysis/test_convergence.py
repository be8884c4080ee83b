"""Convergence of stored runs: of real ones, and of each stage by hand."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tpbso_casadi import builtin
from tpbso_casadi.campaign import Outcome, Results, Run, Store, StoreError, best_runs, grid, parse_solvers, results_of
from tpbso_casadi.campaign.results import StoredSearch, convergence_of, improvements
from tpbso_casadi.campaign.run import run_one

SOLVERS = "bso,abso+polish,ipopt"


def campaign() -> list[Run]:
    specs = [
        replace(spec, table={"evaluations": 400}, descent_table={"iterations": 2}) for spec in parse_solvers(SOLVERS)
    ]
    return grid({"rotation-2": builtin("rotation-2")}, specs, (1, 2))


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of six runs and of one that failed."""
    path = tmp_path_factory.mktemp("store") / "runs.sqlite"
    with Store(path) as store:
        for run in campaign()[:-1]:
            store.add(run, run_one(*run.task))
        store.add(campaign()[-1], Outcome(None, 0.1, "ValueError: no"))
    return path


def stored(path: Path) -> Results:
    with Store(path) as store:
        return results_of(campaign(), store)


def test_every_run_ends_with_its_certified_objective(path: Path) -> None:
    results = stored(path)
    assert results.solvers == SOLVERS.split(",") and results.cases == ["rotation-2"]
    assert [run.solver for run in results.convergences] == [record.solver for record in results.records]
    for run, record in zip(results.convergences, results.records, strict=True):
        if record.error:
            assert run.evaluations.size == 0 and run.done == 0
        else:
            assert record.feasible and run.objectives[-1] == record.objective
            assert record.evaluations is not None and run.evaluations[-1] <= run.done
            assert run.done > record.evaluations if "polish" in run.solver else run.done == record.evaluations
            assert (np.diff(run.objectives) < 0.0).all() and (np.diff(run.evaluations) > 0.0).all()
            assert run.at(np.array([run.evaluations[0] - 1, 10.0**9])).tolist() == [np.inf, record.objective]


def test_the_best_plan_is_computed_again(path: Path) -> None:
    results = stored(path)
    with Store(path) as store:
        [best] = best_runs(campaign(), store)
    assert (
        best.record.objective
        == results.references["rotation-2"]
        == min(record.objective for record in results.records if record.objective is not None)
    )
    assert best.found.planned is not None
    motion = best.found.planned.motion
    assert motion.objective == pytest.approx(best.record.objective, rel=1e-9) and motion.feasible


@pytest.mark.parametrize(
    ("place", "value", "expected"),
    [
        ("$.history.cost[0]", "fast", "history.cost.0: "),
        ("$.history.evaluations", None, "history.evaluations: "),
        ("$.polish.before.feasible", 3, "polish.before.feasible: "),
    ],
)
def test_what_is_no_search_is_one_line(path: Path, tmp_path: Path, place: str, value: object, expected: str) -> None:
    copy = tmp_path / "runs.sqlite"
    copy.write_bytes(path.read_bytes())
    with closing(sqlite3.connect(copy, isolation_level=None)) as connection:
        connection.execute(
            "UPDATE runs SET result = json_set(result, ?, json(?)) WHERE solver LIKE 'abso%'",
            (place, json.dumps(value)),
        )
    with pytest.raises(StoreError) as caught:
        stored(copy)
    assert str(caught.value).startswith(f"{copy}: result of rotation-2, abso+polish, seed 1: {expected}")
    assert "\n" not in str(caught.value)


def test_a_best_plan_that_was_changed_is_one_line(path: Path, tmp_path: Path) -> None:
    copy = tmp_path / "runs.sqlite"
    copy.write_bytes(path.read_bytes())
    with closing(sqlite3.connect(copy, isolation_level=None)) as connection:
        connection.execute("UPDATE runs SET result = json_set(result, '$.objective.value', 0.001) WHERE error = ''")
    with Store(copy) as store, pytest.raises(StoreError, match=r"result of rotation-2, bso, seed 1: .*changed"):
        best_runs(campaign(), store)


def search(**changes: Any) -> StoredSearch:
    """A search of three iterations whose last two candidates are feasible: costs below 10 are."""
    content: dict[str, Any] = {
        "feasible": True,
        "objective": {"value": 2.5, "name": "time"},
        "evaluations": 30,
        "history": {"evaluations": [10, 20, 30], "cost": [1e6, 3.0, 2.0]},
    }
    return StoredSearch.model_validate_json(json.dumps(content | changes))


def pairs(stored: StoredSearch) -> list[tuple[float, float]]:
    evaluations, objectives = improvements(stored, 10.0, stored.objective.value or 0.0)
    return list(zip(evaluations.tolist(), objectives.tolist(), strict=True))


def test_costs_are_moved_so_that_the_search_ends_with_its_certified_objective() -> None:
    assert pairs(search()) == [(20.0, 3.5), (30.0, 2.5)]


def test_a_polish_comes_behind_its_search() -> None:
    before = {"objective": 2.25, "worst_violation": 0.0, "feasible": True}
    polished = search(objective={"value": 1.5}, polish={"before": before, "evaluations": 7})
    assert polished.done == 37
    assert pairs(polished) == [(20.0, 3.25), (30.0, 2.25), (37.0, 1.5)]
    rejected = search(objective={"value": 2.25}, polish={"before": before, "evaluations": 7})
    assert pairs(rejected) == [(20.0, 3.25), (30.0, 2.25)] and rejected.done == 37


def test_a_search_that_only_its_polish_made_feasible_has_no_plan_before() -> None:
    before = {"objective": 2.25, "worst_violation": 0.5, "feasible": False}
    assert pairs(search(objective={"value": 1.5}, polish={"before": before, "evaluations": 7})) == [(37.0, 1.5)]


def test_a_plan_timed_anew_and_a_path_that_was_timed_alone() -> None:
    before = {"objective": 2.75, "worst_violation": 0.0, "feasible": True, "duration": 1.0}
    assert pairs(search(objective={"value": 2.0}, retiming={"before": before})) == [(20.0, 3.75), (30.0, 2.0)]
    assert pairs(search(evaluations=0, history={"evaluations": [], "cost": []})) == [(1.0, 2.5)]


def test_a_run_without_a_certified_plan_never_has_one() -> None:
    [run, *_] = campaign()
    for content in (search(feasible=False), search(objective={"value": None}), None):
        assert convergence_of(run, content).evaluations.size == 0
