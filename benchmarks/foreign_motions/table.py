"""What was said of motions, as a table: of one robot, or of several together.

python -m benchmarks.foreign_motions.table panda/outcomes.jsonl ur5/outcomes.jsonl
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.foreign_motions.judging import FORMS, Outcome, stored_outcomes
from benchmarks.foreign_motions.planners import FOREIGN
from problems import CertificateStatus

LIMITS: dict[str, tuple[tuple[str, ...], float, str]] = {
    "speed": (("speed",), 0.01, "%"),
    "acceleration": (("acceleration",), 0.01, "%"),
    "jerk": (("jerk",), 0.01, "%"),
    "joint range": (("joint range",), 1e-3, "mrad"),
    "touch": (("clearance", "self clearance"), 1e-3, "mm"),
}  # names of verdicts, what is worth a word, and its unit
HEADER = ("made by", "motions", "proven", *LIMITS, "undecided", "ms")


def table(outcomes: list[Outcome]) -> Iterator[str]:
    """Markdown, a line each; a table for each form.

    Of each limit: how many break it / by more than 1 %, 1 mrad or 1 mm / at none of their rows, and the worst. CPU
    milliseconds of a certificate: median and 95 %.
    """
    for form, words in FORMS.items():
        given = [each for each in outcomes if each.form == form]
        broken = [each for each in given if each.status == CertificateStatus.VIOLATED]
        unseen = sum(not set(each.over) & set(each.at_rows) for each in broken)
        yield f"{words}: {len(given)} motions, {len(broken)} broken, {unseen} of these in nothing that their rows show"
        yield f"\n| {' | '.join(HEADER)} |"
        yield "|---" * len(HEADER) + "|"
        for name, planner in FOREIGN.items():
            some = [each for each in given if each.planner == name]
            if some:
                yield f"| {' | '.join([planner.words, *_cells(some)])} |"
        yield ""


def _cells(some: list[Outcome]) -> list[str]:
    times = np.array([each.milliseconds for each in some])
    return [
        str(len(some)),
        str(sum(each.status == CertificateStatus.CERTIFIED for each in some)),
        *(_broken(some, *limit) for limit in LIMITS.values()),
        str(sum(each.status == CertificateStatus.UNDECIDED for each in some)),
        f"{np.median(times):.0f} / {np.percentile(times, 95):.0f}",
    ]


def _broken(some: list[Outcome], names: tuple[str, ...], notable: float, unit: str) -> str:
    broken = [each for each in some if set(names) & each.over.keys()]
    if not broken:
        return "0"
    unseen = sum(not set(names) & set(each.at_rows) for each in broken)
    much = np.array([max(each.over.get(name, 0.0) for name in names) for each in broken])
    worst = f"{much.max() * (100.0 if unit == '%' else 1e3):.2g} {unit}" if np.isfinite(much.max()) else "jumps"
    return f"{len(broken)} / {(much > notable).sum()} / {unseen}; {worst}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="outcomes.jsonl of a folder of motions")
    files = parser.parse_args().files
    print("\n".join(table([outcome for file in files for outcome in stored_outcomes(file)])))


if __name__ == "__main__":
    main()
