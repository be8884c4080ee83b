"""Where the runs of a campaign are kept: one SQLite file, each run written durably the moment it ends."""

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
from tpbso_casadi.storage.versions import versions

APPLICATION = 0x7450_4253  # SQLite's "application id": whose file this is
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
    """A store that cannot be read or written, or is not ours; the message is one line."""


@dataclass(frozen=True)
class Record:
    """What is kept of a run, without its motion; of a run that failed only the first four and the error.

    Attributes:
        case: what its scenario is called.
        solver: what its solver is called.
        seed: of the search.
        seconds: that it took as a whole.
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
    """The runs that are done. One process at a time; closed by ``with``.

    What was added is on the disk when :meth:`add` returns: SQLite's transactions survive a kill and a power cut.

    Args:
        path: of the file; made if there is none.

    Raises:
        StoreError: it cannot be opened, is not ours, is in use, or was written with other versions.
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
        found_format = self._pragma("user_version")
        if found_format != FORMAT:
            raise StoreError(f"{self.path}: of format {found_format} where this version writes {FORMAT}")
        written_with = dict(self._connection.execute("SELECT name, version FROM versions"))
        if written_with != versions():
            found = difference(versions(), written_with)
            raise StoreError(f"{self.path}: {found}, as its runs were made with that; take another folder")

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
        """Turn SQLite's errors into ours."""
        try:
            yield
        except sqlite3.Error as error:
            reasons = {"SQLITE_NOTADB": "not a database", "SQLITE_BUSY": "in use by another campaign"}
            reason = reasons.get(error.sqlite_errorname, f"{error}; what was stored before is kept")
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
        """Keep how a run ended, in the place of what it may have failed with before.

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
        """The keys of the runs that are kept."""
        condition = "" if failed_too else " WHERE error = ''"
        with self._named():
            return {key for (key,) in self._connection.execute(f"SELECT key FROM runs{condition}")}

    def records(self, runs: Iterable[Run]) -> list[Record]:
        """What is kept of these runs, in their order; those not done are left out. They have the runs' labels."""
        columns = "seconds, error, feasible, objective, unit, cost, evaluations, iterations, stop_reason"
        with self._named():
            rows = {key: rest for key, *rest in self._connection.execute(f"SELECT key, {columns} FROM records")}
        return [_record(run, rows[run.key]) for run in runs if run.key in rows]

    def result(self, run: Run) -> dict[str, Any]:
        """The whole ``result.json`` of a run that did not fail.

        Raises:
            KeyError: it is not kept.
        """
        with self._named():
            row = self._connection.execute("SELECT result FROM runs WHERE key = ?", (run.key,)).fetchone()
        if row is None or row[0] is None:
            raise KeyError(run.key)
        found: dict[str, Any] = json.loads(row[0])
        return found

    def measurement(self, name: str) -> Any:
        """A measurement kept under a name; None where there is none."""
        with self._named():
            row = self._connection.execute("SELECT value FROM measurements WHERE name = ?", (name,)).fetchone()
        return None if row is None else json.loads(row[0])

    def keep(self, name: str, value: Any) -> None:
        """Keep a measurement, plain data, under a name."""
        with self._transaction():
            self._connection.execute("INSERT OR REPLACE INTO measurements VALUES (?, ?)", (name, json.dumps(value)))


def _record(run: Run, row: list[Any]) -> Record:
    seconds, error, feasible, objective, unit, cost, evaluations, iterations, stop_reason = row
    if error:
        return Record(run.case, run.solver, run.seed, seconds, error)
    counts = evaluations, iterations, stop_reason
    return Record(run.case, run.solver, run.seed, seconds, "", bool(feasible), objective, unit, cost, *counts)
