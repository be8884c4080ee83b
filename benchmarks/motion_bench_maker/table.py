"""What planners did on a set of problems, as a table: solved, kept the limits, proven, durations, seconds."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.motion_bench_maker.problem_file import kind_of
from benchmarks.motion_bench_maker.records import Record

HEADER = (
    "planner",
    "solved",
    "clear at samples",
    "limits kept within 0.1 %",
    "certified",
    "duration, s (median)",
    "over the bound: median / 98 % / worst",
    "seconds: median / worst",
    "deepest, mm",
)
TOUCHING, OVER = 1e-6, 1e-3  # m into an obstacle; share of a limit: less is rounding


def rows(records: Sequence[Record]) -> list[list[str]]:
    """One row a planner, in the order of their first records; and, with several seeds, one for the best of them."""
    result = []
    for planner in dict.fromkeys(record.planner for record in records):
        own = [record for record in records if record.planner == planner]
        seeds = {record.seed for record in own}
        result.append(row(planner if len(seeds) == 1 else f"{planner}, each of {len(seeds)} seeds", own))
        if len(seeds) > 1:
            result.append(row(f"{planner}, best of {len(seeds)} seeds", list(best(own))))
    return result


def by_kind(records: Sequence[Record]) -> list[list[str]]:
    """The same rows, and one for each planner and class of scenes."""
    kinds = dict.fromkeys((record.planner, kind_of(record.problem)) for record in records)
    return rows(records) + [
        row(f"{planner}: {kind}", [one for one in records if (one.planner, kind_of(one.problem)) == (planner, kind)])
        for planner, kind in kinds
    ]


def best(records: Iterable[Record]) -> Iterable[Record]:
    """For each problem the quickest motion that is clear, or else any record; its seconds are those of all seeds."""
    by_problem: dict[str, list[Record]] = {}
    for record in records:
        by_problem.setdefault(record.problem, []).append(record)
    for attempts in by_problem.values():
        quickest = min(attempts, key=lambda one: (one.duration is None, not clear(one), one.duration or 0.0))
        yield Record(**{**vars(quickest), "seconds": sum(one.seconds for one in attempts)})


def clear(record: Record) -> bool:
    """Whether a motion touches nothing at the samples."""
    return record.clearance is not None and record.clearance > -TOUCHING


def within_limits(record: Record) -> bool:
    """Whether a motion keeps speed, acceleration and jerk, as far as its planner knows them, and joint ranges."""
    return record.excess is not None and max(record.excess) <= OVER


def row(label: str, records: Sequence[Record]) -> list[str]:
    """Of some records."""
    solved = [record for record in records if record.duration is not None]
    ratios = np.array([record.duration / record.bound for record in solved if record.duration is not None])
    asked = [record for record in solved if record.certified is not None]
    deepest = min((record.clearance for record in solved if record.clearance is not None), default=0.0)
    seconds = [record.seconds for record in records]
    return [
        label,
        f"{len(solved)} of {len(records)}",
        str(sum(map(clear, solved))),
        str(sum(map(within_limits, solved))),
        f"{sum(record.certified is True for record in asked)} of {len(asked)}" if asked else "-",
        f"{np.median([record.duration for record in solved if record.duration is not None]):.3f}" if solved else "-",
        " / ".join(f"{value:.3f}" for value in np.quantile(ratios, [0.5, 0.98, 1.0])) if solved else "-",
        f"{np.median(seconds):.2f} / {max(seconds):.1f}",
        f"{-1e3 * deepest:.2g}" if deepest < -TOUCHING else "0",
    ]


def printed(rows_of_table: Sequence[Sequence[str]], header: Sequence[str] = HEADER) -> str:
    """As Markdown."""
    lines = header, ["---"] * len(header), *rows_of_table
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
