"""Make motions with planners of today, or judge those that were made."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import benchmarks.foreign_motions
from benchmarks.foreign_motions.files import Shelf, make_all
from benchmarks.foreign_motions.judging import outcomes_of
from benchmarks.foreign_motions.planners import FOREIGN
from benchmarks.foreign_motions.table import table
from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of
from benchmarks.motion_bench_maker.problem_file import InvalidFile


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.foreign_motions",
        description=benchmarks.foreign_motions.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("step", choices=("make", "judge"))
    parser.add_argument("problems", type=Path, metavar="FILE", help="of MotionBenchMaker")
    parser.add_argument("--planners", default=",".join(FOREIGN), help="with commas; all by default")
    parser.add_argument("--random", type=int, default=300, metavar="N", help="problems of random waypoints")
    parser.add_argument("--seconds", type=float, default=10.0, help="that a planner has for a problem")
    add_problem_options(parser, Path("foreign-motions"))
    options = parser.parse_args()
    try:
        setting, scenes = setting_of(options), problems_of(options, options.problems)
        planners = options.planners.split(",")
        unknown = next((name for name in planners if name not in FOREIGN), None)
        if unknown is not None:
            raise InvalidFile(f"--planners: {unknown!r} is not one of {', '.join(FOREIGN)}")
    except InvalidFile as error:
        print(f"benchmarks.foreign_motions: {error}", file=sys.stderr)
        return 2
    shelf = Shelf(options.out)
    if options.step == "make":
        for line in make_all(shelf, setting, scenes, planners, options.random, options.seconds):
            print(line, flush=True)
    else:
        known = options.out / "outcomes.jsonl"
        print("\n".join(table(list(outcomes_of(shelf, known, setting, scenes, planners, options.random)))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
