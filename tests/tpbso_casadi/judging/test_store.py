"""The store: durable, ours, of one version, used by one process at a time; the convergence of what it holds."""

from __future__ import annotations

import json
import shutil
import signal
import sqlite3
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest
from helpers.slow import slow_except

from tpbso_casadi import builtin
from tpbso_casadi.judging.executors import run_one
from tpbso_casadi.judging.grid import function_grid, grid, parse_solvers
from tpbso_casadi.judging.results import Results, StoredSearch, best_runs, convergence_of, improvements, results_of
from tpbso_casadi.judging.run import Outcome, Run
from tpbso_casadi.judging.store import RunStore, StoreError
from tpbso_casadi.scenario import parse_scenario


def run(seed: int = 1, **solver: object) -> Run:
    content = builtin("time-2").table()
    content["solver"] |= {"seed": seed, "evaluations": 200, **solver}
    return Run("time-2", "bso", parse_scenario(content))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs.sqlite"


def test_what_is_added_is_there_again(path: Path) -> None:
    done, failed, undone = run(1), run(2), run(3)
    outcome = run_one(*done.task)
    with RunStore(path) as store:
        store.add(done, outcome)
        store.add(failed, Outcome(None, 0.5, "ValueError: no", "Traceback ..."))
        store.keep("growth", {"time": [1.0, 2.5]})
    with RunStore(path) as store:
        assert store.done() == {done.key, failed.key}
        assert store.done(failed_too=False) == {done.key}
        first, second = store.records([undone, done, failed])
        result = store.result(done)
        assert store.measurement("growth") == {"time": [1.0, 2.5]}
        assert store.measurement("other") is None
        with pytest.raises(KeyError):
            store.result(failed)
    assert (first.case, first.solver, first.seed, first.error) == ("time-2", "bso", 1, "")
    assert first.objective == result.objective.value
    assert (first.evaluations, first.cost, first.feasible) == (200, result.cost, result.feasible)
    assert outcome.result is not None and result.to_json(indent=None) == outcome.result
    assert (second.seed, second.error, second.objective) == (2, "ValueError: no", None)


def test_a_run_is_kept_once_and_a_failed_one_may_be_replaced(path: Path) -> None:
    again = run()
    with RunStore(path) as store:
        store.add(again, Outcome(None, 0.1, "RuntimeError: first"))
        store.add(again, run_one(*again.task))
        assert store.records([again])[0].error == ""
        with pytest.raises(StoreError, match="UNIQUE"):
            store.add(again, run_one(*again.task))
        assert len(store.records([again])) == 1


OTHERS: list[dict[str, object]] = [
    {"seed": 2},
    {"evaluations": 201},
    {"name": "pso"},
    {"settings": {"lambda_": 0.5}},
    {"population": 31},
    {"polish_starts": 1},
    {"iterations": 7},
]


def test_runs_are_the_same_that_say_the_same_whatever_their_labels() -> None:
    assert len({run().key, *(run(**other).key for other in OTHERS)}) == len(OTHERS) + 1  # type: ignore[arg-type]
    assert Run("mine", "the first", run().scenario).key == run().key
    assert run(settings={"lambda_": 0.95}).key == run().key


def error_of(path: Path) -> str:
    with pytest.raises(StoreError) as caught:
        RunStore(path)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_what_is_not_ours_is_refused_and_left_alone(path: Path, tmp_path: Path) -> None:
    path.write_text("hello " * 500)
    assert error_of(path) == f"{path}: not a database"
    assert path.read_text() == "hello " * 500
    other = tmp_path / "other.sqlite"
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE x (a)")
    before = other.read_bytes()
    assert error_of(other) == f"{other}: a database, but not of a campaign"
    assert other.read_bytes() == before
    assert "unable to open" in error_of(tmp_path / "nowhere" / "runs.sqlite")


def test_other_versions_and_formats_are_refused(path: Path) -> None:
    with RunStore(path):
        pass
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE versions SET version = '3.0' WHERE name = 'casadi'")
    assert "where 3.0 is needed, as its runs were made with that" in error_of(path)
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 99")
    assert "of format 99 where this version writes 3" in error_of(path)


def test_one_at_a_time(path: Path) -> None:
    with RunStore(path):
        assert error_of(path) == f"{path}: in use by another campaign"
    with RunStore(path):
        pass


def test_an_interrupted_creation_leaves_nothing_half_made(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.judging.store.versions", lambda: {"a": None})
    assert "NOT NULL" in error_of(path)
    monkeypatch.undo()
    with RunStore(path) as store:
        assert store.done() == set()


@pytest.mark.parametrize("every", slow_except([5, 1], 1))
def test_wherever_an_interruption_comes_the_next_run_is_stored(path: Path, every: int) -> None:
    runs = function_grid(["sphere-2"], parse_solvers("bso"), range(2000))

    def add_interrupted(store: RunStore, seed: int, lines: int) -> bool:
        """Add a run, with Ctrl-C at a line; returns whether there were so many lines."""

        def trace(frame: FrameType, event: str, _: object) -> Any:
            nonlocal lines
            lines -= frame.f_globals["__name__"].startswith(("tpbso_casadi", "contextlib"))
            if not lines:
                signal.raise_signal(signal.SIGINT)
            return trace

        before = sys.gettrace()
        sys.settrace(trace)
        try:
            store.add(runs[seed], Outcome("{}", 1.0))
        except KeyboardInterrupt:
            sys.settrace(before)
            store.add(runs[seed + 1], Outcome("{}", 1.0))  # while what is on the stack is alive
            return True
        finally:
            sys.settrace(before)
        return False

    with RunStore(path) as store:
        places = 0
        while add_interrupted(store, 2 * places, every * places + 1):
            places += 1
            assert runs[2 * places - 1].key in store.done()
        assert every * places > 20


def companions(path: Path) -> set[str]:
    return {other.name.removeprefix(path.name) for other in path.parent.iterdir()}


def test_others_may_read_while_a_campaign_works(path: Path) -> None:
    first, second = run(1), run(2)
    with RunStore(path) as store:
        store.add(first, run_one(*first.task))
        with closing(sqlite3.connect(path, timeout=0.0, isolation_level=None)) as reader:
            reader.execute("BEGIN")
            assert reader.execute("SELECT solver, seed, feasible FROM records").fetchall() == [("bso", 1, 1)]
            store.add(second, run_one(*second.task))  # a reader holds nothing up
            assert reader.execute("SELECT count(*) FROM runs").fetchone() == (1,)
            reader.execute("COMMIT")
            assert reader.execute("SELECT count(*) FROM runs").fetchone() == (2,)
    assert companions(path) == {"", ".lock"}


def test_a_reader_does_not_keep_a_campaign_from_ending(path: Path) -> None:
    with closing(sqlite3.connect(path, isolation_level=None)) as reader:
        with RunStore(path) as store:
            store.keep("growth", 1.0)
            reader.execute("BEGIN")
            assert reader.execute("SELECT value FROM measurements").fetchall() == [("1.0",)]
        assert companions(path) >= {"", "-wal"}
    with RunStore(path) as store:
        assert store.measurement("growth") == 1.0
    assert companions(path) == {"", ".lock"}


def test_after_a_kill_the_log_is_part_of_the_store(path: Path, tmp_path: Path) -> None:
    killed = tmp_path / "killed"
    killed.mkdir()
    with RunStore(path) as store:
        store.keep("growth", 1.0)
        for name in (path.name, f"{path.name}-wal"):  # what a kill leaves
            shutil.copy(tmp_path / name, killed / name)
    with RunStore(killed / path.name) as store:
        assert store.measurement("growth") == 1.0


VALUE, ANY = "UPDATE runs SET result = json_set(result, '$.objective.value', {})", "UPDATE runs SET {}"
NO_RECORDS = {
    ANY.format("seconds = 'fast'"): "seconds: a number is needed, not 'fast'",
    ANY.format("seconds = 9e999"): "seconds: a finite number is needed, not inf",
    ANY.format("error = x'00'"): "error: a word is needed",
    VALUE.format("'best'"): "objective: a number is needed",
    VALUE.format("NULL"): "objective is missing",
    ANY.format("result = json_set(result, '$.evaluations', 1.5)"): "evaluations: a whole number is needed",
    ANY.format("result = json_set(result, '$.feasible', 'yes')"): "feasible: true or false is needed",
    ANY.format("result = json_set(result, '$.unit', json('[]'), '$.cost', json('{}'))"): "cost: a number is needed",
    ANY.format("result = '{'"): "malformed JSON",
    ANY.format("result = NULL"): "feasible is missing",
    "DROP VIEW records": "no such table: records",
}


def test_what_is_no_record_is_one_line(path: Path, tmp_path: Path) -> None:
    stored = run()
    with RunStore(path) as store:
        store.add(stored, run_one(*stored.task))
    for number, (statement, expected) in enumerate(NO_RECORDS.items()):
        copy = Path(shutil.copy(path, tmp_path / f"{number}.sqlite"))
        with closing(sqlite3.connect(copy, isolation_level=None)) as connection:
            connection.execute(statement)
        with RunStore(copy) as store, pytest.raises(StoreError) as caught:
            store.records([stored])
        assert str(caught.value).startswith(f"{copy}: ") and "\n" not in str(caught.value)
        assert expected in str(caught.value)


def test_measurements_that_are_no_json_and_values_that_no_store_can_hold(path: Path) -> None:
    with RunStore(path) as store:
        store.keep("growth", 1.0)
        with pytest.raises(StoreError, match="cannot hold a value"):
            store.keep("\udc80", 1.0)
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("UPDATE measurements SET value = 'much'")
    with RunStore(path) as store, pytest.raises(StoreError, match="measurement growth: is not JSON"):
        store.measurement("growth")


def test_a_lock_that_cannot_be_made_is_one_line(path: Path) -> None:
    path.with_name(f"{path.name}.lock").mkdir()
    assert error_of(path) == f"{path}: unable to open database file; runs stored before are kept"


SOLVERS = "bso,abso+polish,ipopt"


def campaign() -> list[Run]:
    specs = [
        replace(spec, table={"evaluations": 400}, descent_table={"iterations": 2}) for spec in parse_solvers(SOLVERS)
    ]
    return grid({"rotation-2": builtin("rotation-2")}, specs, (1, 2))


@pytest.fixture(scope="module")
def searched(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of six runs and of one that failed."""
    searched = tmp_path_factory.mktemp("store") / "runs.sqlite"
    with RunStore(searched) as store:
        for run in campaign()[:-1]:
            store.add(run, run_one(*run.task))
        store.add(campaign()[-1], Outcome(None, 0.1, "ValueError: no"))
    return searched


def stored(searched: Path) -> Results:
    with RunStore(searched) as store:
        return results_of(campaign(), store)


def test_every_run_ends_with_its_certified_objective(searched: Path) -> None:
    results = stored(searched)
    assert results.solvers == SOLVERS.split(",") and results.cases == ["rotation-2"]
    assert [run.solver for run in results.convergences] == [record.solver for record in results.records]
    for run, record in zip(results.convergences, results.records, strict=True):
        if record.error:
            assert run.evaluations.size == 0 and run.done == 0
        else:
            assert record.feasible and run.values[-1] == record.objective
            assert record.evaluations is not None and run.evaluations[-1] <= run.done
            assert run.done == record.evaluations
            assert (np.diff(run.values) < 0.0).all() and (np.diff(run.evaluations) > 0.0).all()
            assert run.at(np.array([run.evaluations[0] - 1, 10.0**9])).tolist() == [np.inf, record.objective]


def test_the_best_plan_is_computed_again(searched: Path) -> None:
    results = stored(searched)
    with RunStore(searched) as store:
        [best] = best_runs(campaign(), store)
    assert (
        best.record.objective
        == results.references["rotation-2"]
        == min(record.objective for record in results.records if record.objective is not None)
    )
    assert best.found.planned is not None
    motion = best.found.planned.motion
    assert motion.objective == pytest.approx(best.record.objective, rel=1e-9) and motion.feasible


def updated(searched: Path, copy: Path, statement: str, *values: object) -> Path:
    """A copy of the store in which results were changed."""
    copy.write_bytes(searched.read_bytes())
    with closing(sqlite3.connect(copy, isolation_level=None)) as connection:
        connection.execute(statement, values)
    return copy


def test_what_is_no_search_is_one_line(searched: Path, tmp_path: Path) -> None:
    change = "UPDATE runs SET result = json_set(result, ?, json(?)) WHERE solver LIKE 'abso%'"
    for place, value in (
        ("history.cost[0]", '"fast"'),
        ("history.evaluations", "null"),
        ("polish.before.feasible", "3"),
    ):
        copy = updated(searched, tmp_path / "runs.sqlite", change, f"$.{place}", value)
        with pytest.raises(StoreError) as caught:
            stored(copy)
        key = place.replace("[0]", ".0")
        assert str(caught.value).startswith(f"{copy}: result of rotation-2, abso+polish, seed 1: {key}: ")
        assert "\n" not in str(caught.value)


def test_a_best_plan_that_was_changed_is_one_line(searched: Path, tmp_path: Path) -> None:
    change = "UPDATE runs SET result = json_set(result, '$.objective.value', 0.001) WHERE error = ''"
    copy = updated(searched, tmp_path / "runs.sqlite", change)
    with RunStore(copy) as store, pytest.raises(StoreError, match=r"result of rotation-2, bso, seed 1: .*changed"):
        best_runs(campaign(), store)


def search(**changes: Any) -> StoredSearch:
    """A search of three iterations whose last two candidates are feasible: costs below 10 are."""
    content: dict[str, Any] = {
        "feasible": True,
        "objective": {"value": 2.5, "name": "time"},
        "evaluations": 30,
        "history": {"evaluations": [10, 20, 30], "cost": [1e6, 3.0, 2.0]},
    }
    return StoredSearch.from_text(json.dumps(content | changes))


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
