"""What a campaign leaves in its folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, astuple, fields
from importlib.util import find_spec
from pathlib import Path

from markupsafe import Markup

from tpbso_casadi.campaign.page import Picture, render
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.results import Best, Results
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.campaign.tables import HEADER, rows
from tpbso_casadi.figures.palette import DEFAULT
from tpbso_casadi.storage import OutputError, check_file, check_writable, write_csv, write_text, write_with, writing

SUFFIXES = (".csv", ".parquet")
PAGE = "comparison.html"
FIGURES = ("comparison", "ecdf", "critical-difference", "effect-sizes")


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


def write_summary(folder: Path, summaries: Sequence[Summary]) -> None:
    """Write ``summary.csv``.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(folder):
        write_csv(folder / "summary.csv", HEADER, rows(summaries))


def write_comparison(
    folder: Path,
    results: Results,
    runs: Sequence[AnyRun],
    best: Sequence[Best],
    command: str = "",
    formats: Sequence[str] = DEFAULT,
) -> None:
    """Write ``summary.csv``, the figures, and ``comparison.html`` with all of them.

    Args:
        folder: to write to; it is made.
        results: of the runs.
        runs: all of the campaign.
        best: run of each case.
        command: that does the same runs again, for the page; empty for none.
        formats: of the figures; none for no figures, on the page neither.

    Raises:
        OutputError: they cannot be written.
    """
    write_summary(folder, results.summaries)
    pictures: list[Picture] = []
    plans: dict[str, Markup] = {}
    with writing(folder):
        if formats:
            from tpbso_casadi.campaign.drawn_figures import pictures_of, plans_of  # noqa: PLC0415 (matplotlib)

            pictures, plans = pictures_of(folder, results, formats), plans_of(best)
        text = render(results, runs, best, command, pictures, plans)
        write_text(folder / PAGE, lambda file: file.write(text))


def files_of(formats: Sequence[str]) -> list[str]:
    """The names of the files that :func:`write_comparison` writes."""
    return ["summary.csv", PAGE, *(f"{name}.{kind}" for name in FIGURES for kind in formats)]
