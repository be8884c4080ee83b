"""What was said of motions, as a table: of one robot, or of several together.

python -m benchmarks.foreign_motions.table panda/outcomes.jsonl ur5/outcomes.jsonl
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.foreign_motions.judging import FORMS, SHARES, Outcome, stored_outcomes
from benchmarks.foreign_motions.planners import FOREIGN
from problems import CertificateStatus

CLEARANCES = ("clearance", "self clearance")
MEASURES = ("speed", "acceleration", "jerk", "joint range", "touch", "undecided", "ms")
HEADER = ("made by", "given as", "motions", "proven", *MEASURES)


def table(outcomes: list[Outcome]) -> Iterator[str]:
    """Markdown, a line each.

    Of each limit: how many break it, and in brackets how many of these at none of their rows; by how much in the
    median and at most, or how many jump. Milliseconds of the processor for a certificate: median and 95 %.
    """
    yield f"| {' | '.join(HEADER)} |"
    yield "|---" * len(HEADER) + "|"
    for name, planner in FOREIGN.items():
        for form, words in FORMS.items():
            some = [each for each in outcomes if (each.planner, each.form) == (name, form)]
            if some:
                yield f"| {' | '.join([planner.words, words, *_cells(some)])} |"
    violated = [each for each in outcomes if each.status == CertificateStatus.VIOLATED]
    yield f"{len({(each.planner, each.problem) for each in outcomes})} motions, {len(outcomes)} certificates"
    yield f"{len(violated)} violated, {sum(not each.at_rows for each in violated)} of them at none of their rows"


def _cells(some: list[Outcome]) -> list[str]:
    times = np.array([each.milliseconds for each in some])
    return [
        str(len(some)),
        str(sum(each.status == CertificateStatus.CERTIFIED for each in some)),
        *(_broken(some, (name,), 100.0, "%") for name in SHARES),
        _broken(some, ("joint range",), 1e3, "mrad"),
        _broken(some, CLEARANCES, 1e3, "mm"),
        str(sum(each.status == CertificateStatus.UNDECIDED for each in some)),
        f"{np.median(times):.0f} / {np.percentile(times, 95):.0f}",
    ]


def _broken(some: list[Outcome], names: tuple[str, ...], factor: float, unit: str) -> str:
    """How many break one of some limits, how many of these at none of their rows, and by how much."""
    broken = [each for each in some if set(names) & each.over.keys()]
    if not broken:
        return "0"
    unseen = sum(not set(names) & set(each.at_rows) for each in broken)
    much = factor * np.array([max(each.over.get(name, 0.0) for name in names) for each in broken])
    finite = much[np.isfinite(much)]
    spread = f"{np.median(finite):.2g} / {finite.max():.3g} {unit}" if finite.size else ""
    jumps = f"{much.size - finite.size} jump" if finite.size < much.size else ""
    return f"{len(broken)} ({unseen}): {', '.join(filter(None, (spread, jumps)))}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="outcomes.jsonl of a folder of motions")
    files = parser.parse_args().files
    print("\n".join(table([outcome for file in files for outcome in stored_outcomes(file)])))


if __name__ == "__main__":
    main()
