"""The store of a campaign, a file a run.

While a campaign works, its file has two companions, ``-wal`` and ``-shm`` (SQLite's write-ahead log), so that others
can read it at any time without holding the campaign up. They go when it ends; after a kill they stay and belong to the
file: whoever opens it next reads them too. An empty file ``.lock`` keeps a second campaign away.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

from tpbso_casadi.judging.run import AnyRun, AnyRunT, Outcome, RunRecord, difference, read_record
from tpbso_casadi.plain import versions
from tpbso_casadi.storage import InvalidResult, RunResult, writing

STORE = "runs.sqlite"  # the file in the folder of a campaign
APPLICATION = 0x7450_4253  # SQLite's "application id" of our files
FORMAT = 3
BUSY_SECONDS = 10.0  # to wait for others that write to the file
LOCK_SECONDS = 1.0  # to wait for a campaign that is ending
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
    json_extract(result, '$.evaluations') + ifnull(json_extract(result, '$.polish.evaluations'), 0) AS evaluations,
    json_extract(result, '$.iterations') AS iterations,
    json_extract(result, '$.stop_reason') AS stop_reason
FROM runs;
"""
COLUMNS = (
    "seconds", "error", "feasible", "objective", "unit", "cost", "evaluations", "iterations", "stop_reason",
)  # fmt: skip


class StoreError(ValueError):
    """A store that cannot be read or written, or is of another program; the message is one line."""


class RunStore:
    """The completed runs of a campaign. One campaign at a time, any number of readers; a context manager.

    A run is on the disk when :meth:`add` returns: SQLite's transactions survive a kill and a power cut.

    Args:
        path: of the file; made if there is none.

    Raises:
        StoreError: it cannot be opened, is of another program, is in use, or was written with other versions.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        with ExitStack() as opened:
            with self._named():
                self._connection = sqlite3.connect(path, isolation_level=None, timeout=BUSY_SECONDS)
            opened.enter_context(closing(self._connection))
            self._open(opened)
            self._opened = opened.pop_all()

    @classmethod
    def in_folder(cls, folder: Path) -> Self:
        """The store in the folder of a campaign, which is made if there is none.

        Raises:
            OutputError: the folder cannot be made.
            StoreError: the store cannot be used.
        """
        with writing(folder):
            pass
        return cls(folder / STORE)

    def _open(self, opened: ExitStack) -> None:
        self._transact(self._create)
        with self._named():
            self._check()
            opened.enter_context(closing(_locked(self.path)))
            self._connection.execute("PRAGMA journal_mode = WAL")  # where the file system cannot, nothing changes
            self._connection.execute("PRAGMA synchronous = EXTRA")

    def _check(self) -> None:
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
        if self._pragma("schema_version"):
            return
        for statement in filter(str.strip, SCHEMA.split(";")):
            self._connection.execute(statement)
        self._connection.execute(f"PRAGMA application_id = {APPLICATION}")
        self._connection.execute(f"PRAGMA user_version = {FORMAT}")
        self._connection.executemany("INSERT INTO versions VALUES (?, ?)", versions().items())

    def _pragma(self, name: str) -> int:
        return int(self._connection.execute(f"PRAGMA {name}").fetchone()[0])

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Turn errors of SQLite, and of values that it cannot hold, into a :class:`StoreError`."""
        try:
            yield
        except sqlite3.Error as error:
            name = getattr(error, "sqlite_errorname", "")  # errors of Python's own layer have none
            reasons = {"SQLITE_NOTADB": "not a database", "SQLITE_BUSY": "in use by another program"}
            reason = reasons.get(name, f"{error}; runs stored before are kept")
            raise StoreError(f"{self.path}: {reason}") from error
        except (OverflowError, UnicodeError) as error:
            raise StoreError(f"{self.path}: cannot hold a value: {error}") from error

    def _transact(self, work: Callable[[], object]) -> None:
        """Do all of this or nothing; Ctrl-C may come at any place of it, which a generator would not see at each."""
        with self._named():
            try:
                self._connection.execute("BEGIN IMMEDIATE")
                work()
                self._connection.execute("COMMIT")
            except BaseException:
                if self._connection.in_transaction:
                    self._connection.execute("ROLLBACK")
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(sqlite3.Error):  # somebody reads, or the disk is full: the log stays beside the file
            self._connection.execute("PRAGMA busy_timeout = 0")
            self._connection.execute("PRAGMA journal_mode = DELETE")
        self._opened.close()

    def add(self, run: AnyRun, outcome: Outcome) -> None:
        """Store the outcome of a run; it replaces that of an earlier attempt that failed.

        Raises:
            StoreError: it could not be written.
        """
        finished = datetime.now(UTC).isoformat(timespec="milliseconds")
        labels = run.key, run.case, run.solver, run.seed
        values = *labels, finished, outcome.seconds, outcome.error, outcome.details, outcome.result

        def replace() -> None:
            self._connection.execute("DELETE FROM runs WHERE key = ? AND error <> ''", (run.key,))
            self._connection.execute("INSERT INTO runs VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)", values)

        self._transact(replace)

    def done(self, failed_too: bool = True) -> set[str]:
        """The keys of the stored runs."""
        condition = "" if failed_too else " WHERE error = ''"
        with self._named():
            return {key for (key,) in self._connection.execute(f"SELECT key FROM runs{condition}")}

    def records(self, runs: Iterable[AnyRun]) -> list[RunRecord]:
        """The records of these runs, in their order and with their labels; without those that are not stored.

        Raises:
            StoreError: what is stored is not a record.
        """
        with self._named():
            selected = self._connection.execute(f"SELECT key, {', '.join(COLUMNS)} FROM records")
            rows = {key: row for key, *row in selected}
        return [self._record(run, rows[run.key]) for run in runs if run.key in rows]

    def _record(self, run: AnyRun, row: list[Any]) -> RunRecord:
        labels = {"case": run.case, "solver": run.solver, "seed": run.seed, "search": run.search}
        try:
            return read_record(labels | dict(zip(COLUMNS, row, strict=True)))
        except ValueError as error:
            raise StoreError(f"{self.place(run)}: {error}") from error

    def result(self, run: AnyRun) -> RunResult:
        """The whole ``result.json`` of a run that did not fail.

        Raises:
            KeyError: it is not stored, or failed.
            StoreError: what is stored is not a result.
        """
        [text] = [text for _, text in self.texts([run])] or [None]
        if text is None:
            raise KeyError(run.key)
        try:
            return RunResult.from_json(text)
        except InvalidResult as error:
            raise StoreError(f"{self.place(run)}: {error}") from error

    def texts(self, runs: Iterable[AnyRunT]) -> Iterator[tuple[AnyRunT, str | None]]:
        """The text of the ``result.json`` of each of these runs that is stored, None of one that failed."""
        for run in runs:
            with self._named():
                row = self._connection.execute("SELECT result FROM runs WHERE key = ?", (run.key,)).fetchone()
            if row is not None:
                yield run, row[0]

    def place(self, run: AnyRun) -> str:
        """The place where a run is stored, for messages."""
        return f"{self.path}: result of {run.case}, {run.solver}, seed {run.seed}"

    def measurement(self, name: str) -> Any:
        """The measurement stored under a name; None where there is none.

        Raises:
            StoreError: what is stored is not JSON.
        """
        with self._named():
            row = self._connection.execute("SELECT value FROM measurements WHERE name = ?", (name,)).fetchone()
        try:
            return None if row is None else json.loads(row[0])
        except (TypeError, ValueError, RecursionError) as error:
            raise StoreError(f"{self.path}: measurement {name:.40}: is not JSON") from error

    def keep(self, name: str, value: Any) -> None:
        """Store a measurement, plain data, under a name."""
        row = name, json.dumps(value)
        self._transact(lambda: self._connection.execute("INSERT OR REPLACE INTO measurements VALUES (?, ?)", row))


def _locked(path: Path) -> sqlite3.Connection:
    """A lock on the store for this campaign, released when the process ends, however it does.

    The store itself has to stay open to readers, so the lock is one of SQLite's on an empty file beside it.

    Raises:
        StoreError: another campaign has it.
        sqlite3.Error: the file cannot be made.
    """
    connection = sqlite3.connect(path.with_name(f"{path.name}.lock"), isolation_level=None, timeout=LOCK_SECONDS)
    try:
        connection.execute("BEGIN EXCLUSIVE")
    except sqlite3.OperationalError as error:
        connection.close()
        if error.sqlite_errorname == "SQLITE_BUSY":
            raise StoreError(f"{path}: in use by another campaign") from error
        raise
    return connection
