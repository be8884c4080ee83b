"""Tables of a campaign, on a screen and in files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import asdict, astuple, fields
from importlib.util import find_spec
from math import isfinite
from pathlib import Path

import numpy as np
from rich.box import SIMPLE
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from tpbso_casadi.judging.results import PolishGain, references
from tpbso_casadi.judging.run import RunRecord
from tpbso_casadi.judging.statistics import Judgement, Relation, Summary, against_first, p_text
from tpbso_casadi.judging.targets import gaps_of, percent
from tpbso_casadi.storage import OutputError, check_file, check_writable, write_csv, write_with, writing

COUNTS = ("runs", "failed", "infeasible")
NUMBERS = ("mean", "std", "best", "median", "evaluations")
AGAINST_FIRST = ("a12", "p", "p_corrected", "against_first", "test")
SPREAD = ("lower_quartile", "upper_quartile", "median_gap", "expected_running_time")
HEADER = ("case", "solver", "unit", *COUNTS, *NUMBERS, *AGAINST_FIRST, *SPREAD)
WIDEST = 10_000  # columns, more than any table needs
LABEL_WIDTH = 22  # columns of a solver's label, which goes on in the next line after a bracket, comma or plus


def rows(summaries: Sequence[Summary]) -> list[list[object]]:
    """The whole table, under ``HEADER``, without times: the same however many workers there are."""
    judgements, lowest = against_first(summaries), references(summaries)
    table: list[list[object]] = []
    for s in summaries:
        counts = s.objectives.size + s.failed, s.failed, s.infeasible
        numbers = [_cell(number) for number in (s.mean, s.std, s.best, s.median, s.evaluations)]
        gap = float(gaps_of(np.array(s.median), lowest[s.case]))
        spread = [_cell(number) for number in (*s.quartiles, gap, s.expected_running_time)]
        test = _test(judgements.get((s.case, s.solver)))
        table.append([s.case, s.solver, s.unit, *counts, *numbers, *test, *spread])
    return table


def _test(judgement: Judgement | None) -> tuple[float | str | None, ...]:
    if judgement is None:
        return (None,) * len(AGAINST_FIRST)
    comparison = judgement.comparison
    return comparison.a12, comparison.p, judgement.p, str(judgement.relation), comparison.test


def _cell(number: float) -> float | None:
    return number if isfinite(number) else None


COLOURS = {Relation.BETTER: "green", Relation.WORSE: "red"}


def print_tables(summaries: Sequence[Summary], console: Console) -> None:
    """Print the tables of every case. A console too narrow for one wraps its lines; no cell is ever cut."""
    judgements = against_first(summaries)
    for case in dict.fromkeys(summary.case for summary in summaries):
        of_case = [summary for summary in summaries if summary.case == case]
        _print(_numbers(of_case), console)
        if len(of_case) > 1:
            _print(_tests(of_case, judgements), console)


def print_polish_gains(gains: Sequence[PolishGain], console: Console) -> None:
    """Print what polishing gains, seed by seed; nothing where nothing was polished."""
    for case in dict.fromkeys(gain.case for gain in gains):
        of_case = [gain for gain in gains if gain.case == case]
        title = f"the polish by IPOPT, seed by seed: {case} [{of_case[0].unit}]"
        table = _table(title, ("before", "after", "gain", "quartiles", "kept", "seconds"))
        for each in of_case:
            lower, median, upper = each.gains
            objectives = (_short(median_objective, ".5g") for median_objective in each.medians)
            kept = f"{each.kept.sum()} of {each.kept.size}"
            spread = f"{percent(lower)} to {percent(upper)}"
            table.add_row(_label(each.solver), *objectives, percent(median), spread, kept, f"{each.median_seconds:.2f}")
        _print(table, console)


def _print(table: RenderableType, console: Console) -> None:
    width = console.width
    console.width = max(width, Measurement.get(console, console.options.update(max_width=WIDEST), table).maximum)
    console.print(table)
    console.width = width


def _numbers(summaries: Sequence[Summary]) -> Table:
    """The table of what the runs of each solver on one case gave."""
    unit = next((summary.unit for summary in summaries if summary.unit), "")
    measure = summaries[0].measure
    table = _table(f"{summaries[0].case} [{unit}]", ("median", f"{measure.result}s", "evals", "ERT", "seconds"))
    table.caption = f"ERT: evaluations until a {measure.result} within {measure.written(measure.aim)} is expected"
    table.caption_justify, table.caption_style = "left", "dim"
    for s in summaries:
        plans = f"{s.feasible_objectives.size} of {s.objectives.size + s.failed}"
        effort = (f"{number:.0f}" if isfinite(number) else "-" for number in (s.evaluations, s.expected_running_time))
        table.add_row(_label(s.solver), _short(s.median, ".5g"), plans, *effort, _short(s.seconds, ".2f"))
    return table


def _tests(summaries: Sequence[Summary], judgements: dict[tuple[str, str], Judgement]) -> Table:
    """How each solver on one case compares with the first."""
    table = _table(f"against {summaries[0].solver}", ("A12", "p"))
    table.add_column("is", no_wrap=True)
    table.add_column("test", no_wrap=True)
    for s in summaries[1:]:
        judgement = judgements[s.case, s.solver]
        colour = COLOURS.get(judgement.relation, "default")
        relation = f"[{colour}]{judgement.relation}[/]"
        comparison = judgement.comparison
        table.add_row(_label(s.solver), f"{comparison.a12:.2f}", p_text(judgement.p), relation, comparison.test)
    return table


def _table(title: str, headings: Iterable[str]) -> Table:
    table = Table(title=escape(title), title_justify="left", title_style="bold", box=SIMPLE)
    table.add_column("solver", no_wrap=True)
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    return table


def _label(solver: str) -> str:
    """A solver's label on lines of at most ``LABEL_WIDTH`` columns, where its parts allow that."""
    lines = [""]
    for part in re.findall(r"[^(,+]+[(,]?|\+[^(,+]+|[(,+]", solver):
        if lines[-1] and len(lines[-1]) + len(part) > LABEL_WIDTH:
            lines.append(" ")
        lines[-1] += part
    return escape("\n".join(lines))


def _short(number: float, digits: str) -> str:
    return format(number, digits) if isfinite(number) else "-"


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


def export(records: Sequence[RunRecord], path: Path) -> None:
    """Write one row a run.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(path.parent):
        if path.suffix == ".csv":
            write_csv(path, [field.name for field in fields(RunRecord)], [astuple(record) for record in records])
        else:
            _write_parquet(path, records)


def _write_parquet(path: Path, records: Sequence[RunRecord]) -> None:
    import pyarrow  # noqa: PLC0415 (optional)
    from pyarrow import parquet  # noqa: PLC0415

    table = pyarrow.Table.from_pylist([asdict(record) for record in records])
    write_with(path, lambda temporary: parquet.write_table(table, temporary))
