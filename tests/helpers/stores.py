"""Looking into a campaign's store while the campaign works on it."""

from __future__ import annotations

import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

from helpers.waiting import wait_until


def stored_rows(path: Path) -> int:
    """How many runs a store holds; 0 where there is none yet."""
    try:
        with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
            return int(connection.execute("SELECT count(*) FROM runs").fetchone()[0])
    except sqlite3.OperationalError:  # no file, or no table in it, yet
        return 0


def wait_for_rows(process: subprocess.Popen[str], path: Path, rows: int) -> None:
    """Return when a store holds so many runs, or the campaign has ended."""
    wait_until(lambda: process.poll() is not None or stored_rows(path) >= rows)
