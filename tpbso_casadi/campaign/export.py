"""The files of a campaign: its runs as CSV or Parquet, the summary table and its figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, astuple, fields
from importlib.util import find_spec
from pathlib import Path

from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.campaign.table import HEADER, rows
from tpbso_casadi.storage.files import OutputError, check_file, check_writable, write_csv, write_with, writing

SUFFIXES = (".csv", ".parquet")


def check_export(path: Path) -> None:
    """Make sure before the work that a table can be written there.

    Raises:
        OutputError: an unknown suffix, a missing library, or a folder that cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise OutputError(f"--table {path}: the name must end with {' or '.join(SUFFIXES)}")
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        raise OutputError(f"--table {path}: needs the package pyarrow: pip install 'tpbso-casadi[parquet]'")
    check_writable(path.parent)
    check_file(path)


def export(records: Sequence[Record], path: Path) -> None:
    """Write one row a run.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(path.parent):
        if path.suffix == ".csv":
            write_csv(path, [field.name for field in fields(Record)], [astuple(record) for record in records])
        else:
            _write_parquet(path, records)


def _write_parquet(path: Path, records: Sequence[Record]) -> None:
    import pyarrow  # noqa: PLC0415 (optional)
    from pyarrow import parquet  # noqa: PLC0415

    table = pyarrow.Table.from_pylist([asdict(record) for record in records])
    write_with(path, lambda temporary: parquet.write_table(table, temporary))


def write_summary(folder: Path, summaries: Sequence[Summary], plots: bool) -> None:
    """Write ``summary.csv`` and, with plots, ``comparison.png``.

    Raises:
        OutputError: they cannot be written.
    """
    with writing(folder):
        write_csv(folder / "summary.csv", HEADER, rows(summaries))
        if plots:
            from tpbso_casadi.campaign.figures import draw_comparison  # noqa: PLC0415 (matplotlib is slow to load)

            draw_comparison(folder / "comparison.png", summaries)
