"""The store: durable, ours, of one version, used by one process at a time."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from tpbso_casadi import builtin
from tpbso_casadi.campaign import Outcome, Run, Store, StoreError
from tpbso_casadi.campaign.run import run_one
from tpbso_casadi.scenario import parse_scenario


def run(seed: int = 1, **solver: object) -> Run:
    content = builtin("time-2").model_dump()
    content["solver"] |= {"seed": seed, "evaluations": 200, **solver}
    return Run("time-2", "bso", parse_scenario(content))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "runs.sqlite"


def test_what_is_added_is_there_again(path: Path) -> None:
    done, failed, undone = run(1), run(2), run(3)
    outcome = run_one(*done.task)
    with Store(path) as store:
        store.add(done, outcome)
        store.add(failed, Outcome(None, 0.5, "ValueError: no", "Traceback ..."))
        store.keep("growth", {"time": [1.0, 2.5]})
    with Store(path) as store:
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
    with Store(path) as store:
        store.add(again, Outcome(None, 0.1, "RuntimeError: first"))
        store.add(again, run_one(*again.task))
        assert store.records([again])[0].error == ""
        with pytest.raises(StoreError, match="UNIQUE"):
            store.add(again, run_one(*again.task))
        assert len(store.records([again])) == 1


@pytest.mark.parametrize(
    "other",
    [
        {"seed": 2},
        {"evaluations": 201},
        {"name": "pso"},
        {"settings": {"lambda_": 0.5}},
        {"population": 31},
        {"polish_starts": 1},
        {"iterations": 7},
    ],
)
def test_another_setting_is_another_run(other: dict[str, object]) -> None:
    assert run(**other).key != run().key  # type: ignore[arg-type]


def test_labels_and_spelled_out_defaults_are_the_same_run() -> None:
    assert Run("mine", "the first", run().scenario).key == run().key
    assert run(settings={"lambda_": 0.95}).key == run().key


def error_of(path: Path) -> str:
    with pytest.raises(StoreError) as caught:
        Store(path)
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
    with Store(path):
        pass
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE versions SET version = '3.0' WHERE name = 'casadi'")
    assert "where 3.0 is needed, as its runs were made with that" in error_of(path)
    with sqlite3.connect(path) as connection:
        connection.execute("PRAGMA user_version = 99")
    assert "of format 99 where this version writes 2" in error_of(path)


def test_one_at_a_time(path: Path) -> None:
    with Store(path):
        assert error_of(path) == f"{path}: in use by another campaign"
    with Store(path):
        pass


def test_an_interrupted_creation_leaves_nothing_half_made(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.campaign.store.versions", lambda: {"a": None})
    assert "NOT NULL" in error_of(path)
    monkeypatch.undo()
    with Store(path) as store:
        assert store.done() == set()


def companions(path: Path) -> set[str]:
    return {other.name.removeprefix(path.name) for other in path.parent.iterdir()}


def test_others_may_read_while_a_campaign_works(path: Path) -> None:
    first, second = run(1), run(2)
    with Store(path) as store:
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
        with Store(path) as store:
            store.keep("growth", 1.0)
            reader.execute("BEGIN")
            assert reader.execute("SELECT value FROM measurements").fetchall() == [("1.0",)]
        assert companions(path) >= {"", "-wal"}
    with Store(path) as store:
        assert store.measurement("growth") == 1.0
    assert companions(path) == {"", ".lock"}


def test_after_a_kill_the_log_is_part_of_the_store(path: Path, tmp_path: Path) -> None:
    killed = tmp_path / "killed"
    killed.mkdir()
    with Store(path) as store:
        store.keep("growth", 1.0)
        for name in (path.name, f"{path.name}-wal"):  # what a kill leaves
            shutil.copy(tmp_path / name, killed / name)
    with Store(killed / path.name) as store:
        assert store.measurement("growth") == 1.0


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("UPDATE runs SET seconds = 'fast'", "seconds: Input should be a valid number, not 'fast'"),
        ("UPDATE runs SET seconds = 9e999", "seconds: Input should be a finite number, not inf"),
        ("UPDATE runs SET error = x'00'", "error: Input should be a valid string"),
        (
            "UPDATE runs SET result = json_set(result, '$.objective.value', 'best')",
            "objective: Input should be a valid",
        ),
        ("UPDATE runs SET result = json_set(result, '$.objective.value', NULL)", "objective is missing"),
        ("UPDATE runs SET result = json_set(result, '$.evaluations', 1.5)", "evaluations: Input should be a valid"),
        ("UPDATE runs SET result = json_set(result, '$.feasible', 'yes')", "feasible: Input should be a valid boolean"),
        ("UPDATE runs SET result = json_set(result, '$.unit', json('[]'), '$.cost', json('{}'))", "cost: Input should"),
        ("UPDATE runs SET result = '{'", "malformed JSON"),
        ("UPDATE runs SET result = NULL", "feasible is missing"),
        ("DROP VIEW records", "no such table: records"),
    ],
)
def test_what_is_no_record_is_one_line(statement: str, expected: str, path: Path) -> None:
    stored = run()
    with Store(path) as store:
        store.add(stored, run_one(*stored.task))
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute(statement)
    with Store(path) as store, pytest.raises(StoreError) as caught:
        store.records([stored])
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)
    assert expected in str(caught.value)


def test_measurements_that_are_no_json_and_values_that_no_store_can_hold(path: Path) -> None:
    with Store(path) as store:
        store.keep("growth", 1.0)
        with pytest.raises(StoreError, match="cannot hold a value"):
            store.keep("\udc80", 1.0)
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        connection.execute("UPDATE measurements SET value = 'much'")
    with Store(path) as store, pytest.raises(StoreError, match="measurement growth: is not JSON"):
        store.measurement("growth")


def test_a_lock_that_cannot_be_made_is_one_line(path: Path) -> None:
    path.with_name(f"{path.name}.lock").mkdir()
    assert error_of(path) == f"{path}: unable to open database file; runs stored before are kept"
