"""The store of a campaign: one SQLite file, each run written durably the moment it ends."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

from tpbso_casadi.campaign.run import Outcome, Run, difference
from tpbso_casadi.storage.result import InvalidResult, RunResult
from tpbso_casadi.storage.versions import versions

APPLICATION = 0x7450_4253  # SQLite's "application id" of our files
FORMAT = 1
SCHEMA = """
CREATE TABLE versions (name TEXT PRIMARY KEY, version TEXT NOT NULL);
CREATE TABLE runs (
    key TEXT PRIMARY KEY, case_name TEXT NOT NULL, solver TEXT NOT NULL, seed INTEGER NOT NULL,
    finished TEXT NOT NULL, seconds REAL NOT NULL, error TEXT NOT NULL, details TEXT NOT NULL, result TEXT
);
CREATE TABLE measurements (name TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE VIEW records AS SELECT
    key, case_name, solver, seed, error, seconds,
    json_extract(result, '$.feasible') AS feasible,
    json_extract(result, '$.objective.value') AS objective,
    json_extract(result, '$.objective.unit') AS unit,
    json_extract(result, '$.cost') AS cost,
    json_extract(result, '$.evaluations') AS evaluations,
    json_extract(result, '$.iterations') AS iterations,
    json_extract(result, '$.stop_reason') AS stop_reason
FROM runs;
"""


class StoreError(ValueError):
    """A store that cannot be read or written, or is of another program; the message is one line."""


@dataclass(frozen=True, kw_only=True)
class Record:
    """A stored run without its motion; of a failed run only the first five fields.

    Attributes:
        case: name of the scenario.
        solver: label of the solver.
        seed: of the search.
        seconds: wall-clock time of the whole run.
        error: why it failed; empty where it did not.
        feasible: whether the plan is certified.
        objective: of the plan, in ``unit``.
        unit: of the objective.
        cost: of the search's best candidate.
        evaluations: of the search.
        iterations: of the search.
        stop_reason: of the search.
    """

    case: str
    solver: str
    seed: int
    seconds: float
    error: str
    feasible: bool = False
    objective: float | None = None
    unit: str = ""
    cost: float | None = None
    evaluations: int | None = None
    iterations: int | None = None
    stop_reason: str = ""


class Store:
    """The completed runs of a campaign. For one process at a time; a context manager.

    A run is on the disk when :meth:`add` returns: SQLite's transactions survive a kill and a power cut.

    Args:
        path: of the file; made if there is none.

    Raises:
        StoreError: it cannot be opened, is of another program, is in use, or was written with other versions.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with self._named():
            self._connection = sqlite3.connect(path, isolation_level=None, timeout=1.0)
            try:
                self._open()
            except BaseException:
                self._connection.close()
                raise

    def _open(self) -> None:
        self._connection.execute("PRAGMA locking_mode = EXCLUSIVE")
        self._connection.execute("PRAGMA synchronous = EXTRA")
        with self._transaction():
            if self._pragma("schema_version") == 0:
                self._create()
        if self._pragma("application_id") != APPLICATION:
            raise StoreError(f"{self.path}: a database, but not of a campaign")
        file_format = self._pragma("user_version")
        if file_format != FORMAT:
            raise StoreError(f"{self.path}: of format {file_format} where this version writes {FORMAT}")
        written_with = dict(self._connection.execute("SELECT name, version FROM versions"))
        if written_with != versions():
            reason = difference(versions(), written_with)
            raise StoreError(f"{self.path}: {reason}, as its runs were made with that; take another folder")

    def _create(self) -> None:
        for statement in filter(str.strip, SCHEMA.split(";")):
            self._connection.execute(statement)
        self._connection.execute(f"PRAGMA application_id = {APPLICATION}")
        self._connection.execute(f"PRAGMA user_version = {FORMAT}")
        self._connection.executemany("INSERT INTO versions VALUES (?, ?)", versions().items())

    def _pragma(self, name: str) -> int:
        return int(self._connection.execute(f"PRAGMA {name}").fetchone()[0])

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Turn SQLite's errors into a :class:`StoreError`."""
        try:
            yield
        except sqlite3.Error as error:
            reasons = {"SQLITE_NOTADB": "not a database", "SQLITE_BUSY": "in use by another campaign"}
            reason = reasons.get(error.sqlite_errorname, f"{error}; runs stored before are kept")
            raise StoreError(f"{self.path}: {reason}") from error

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with self._named():
            self._connection.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._connection.close()

    def add(self, run: Run, outcome: Outcome) -> None:
        """Store the outcome of a run; it replaces that of an earlier attempt that failed.

        Raises:
            StoreError: it could not be written.
        """
        finished = datetime.now(UTC).isoformat(timespec="milliseconds")
        labels = run.key, run.case, run.solver, run.seed
        values = *labels, finished, outcome.seconds, outcome.error, outcome.details, outcome.result
        with self._transaction():
            self._connection.execute("DELETE FROM runs WHERE key = ? AND error <> ''", (run.key,))
            self._connection.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", values)

    def done(self, failed_too: bool = True) -> set[str]:
        """The keys of the stored runs."""
        condition = "" if failed_too else " WHERE error = ''"
        with self._named():
            return {key for (key,) in self._connection.execute(f"SELECT key FROM runs{condition}")}

    def records(self, runs: Iterable[Run]) -> list[Record]:
        """The records of these runs, in their order and with their labels; without those that are not stored."""
        columns = "seconds, error, feasible, objective, unit, cost, evaluations, iterations, stop_reason"
        with self._named():
            rows = {key: rest for key, *rest in self._connection.execute(f"SELECT key, {columns} FROM records")}
        return [_record(run, rows[run.key]) for run in runs if run.key in rows]

    def result(self, run: Run) -> RunResult:
        """The whole ``result.json`` of a run that did not fail.

        Raises:
            KeyError: it is not stored, or failed.
            StoreError: what is stored is not a result.
        """
        with self._named():
            row = self._connection.execute("SELECT result FROM runs WHERE key = ?", (run.key,)).fetchone()
        if row is None or row[0] is None:
            raise KeyError(run.key)
        try:
            return RunResult.from_json(row[0])
        except InvalidResult as error:
            raise StoreError(f"{self.path}: result of {run.case}, {run.solver}, seed {run.seed}: {error}") from error

    def measurement(self, name: str) -> Any:
        """The measurement stored under a name; None where there is none."""
        with self._named():
            row = self._connection.execute("SELECT value FROM measurements WHERE name = ?", (name,)).fetchone()
        return None if row is None else json.loads(row[0])

    def keep(self, name: str, value: Any) -> None:
        """Store a measurement, plain data, under a name."""
        with self._transaction():
            self._connection.execute("INSERT OR REPLACE INTO measurements VALUES (?, ?)", (name, json.dumps(value)))


def _record(run: Run, row: list[Any]) -> Record:
    seconds, error, feasible, objective, unit, cost, evaluations, iterations, stop_reason = row
    if error:
        return Record(case=run.case, solver=run.solver, seed=run.seed, seconds=seconds, error=error)
    return Record(
        case=run.case,
        solver=run.solver,
        seed=run.seed,
        seconds=seconds,
        error="",
        feasible=bool(feasible),
        objective=objective,
        unit=unit,
        cost=cost,
        evaluations=evaluations,
        iterations=iterations,
        stop_reason=stop_reason,
    )
