"""Looking into a campaign's store while the campaign works on it."""

from __future__ import annotations

import sqlite3
import subprocess
import time
from contextlib import closing
from pathlib import Path

PATIENCE = 300.0  # s, on a machine that has much else to do


def stored_rows(path: Path) -> int:
    """How many runs a store holds; 0 where there is none yet."""
    try:
        with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as connection:
            return int(connection.execute("SELECT count(*) FROM runs").fetchone()[0])
    except sqlite3.OperationalError:  # no file, or no table in it, yet
        return 0


def wait_for_rows(process: subprocess.Popen[str], path: Path, rows: int) -> None:
    """Return when a store holds so many runs, or the campaign has ended."""
    deadline = time.monotonic() + PATIENCE
    while process.poll() is None and stored_rows(path) < rows:
        assert time.monotonic() < deadline
        time.sleep(0.02)
