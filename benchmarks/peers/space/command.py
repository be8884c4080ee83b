"""``python -m benchmarks.peers --space FILE.jsonl ...``: the others, and ours, on problems of MotionBenchMaker."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of, tell
from benchmarks.motion_bench_maker.problem_file import InvalidFile
from benchmarks.motion_bench_maker.records import Records
from benchmarks.motion_bench_maker.runs import Run, run_all
from benchmarks.motion_bench_maker.table import printed, rows
from benchmarks.peers.space.planners import PLANNERS, record

SEEDS = {"ompl": 3, "roboplan": 3, "drake": 1, "direct": 3}
SECONDS = {"ompl": 10.0, "roboplan": 10.0, "drake": 30.0, "direct": 30.0}


def add_space_options(parser: argparse.ArgumentParser) -> None:
    """Those of robots in space."""
    group = parser.add_argument_group("robots in space")
    group.add_argument("--space", type=Path, metavar="FILE", help="compare on these problems of MotionBenchMaker")
    words = "instead compare what torque limits cost with these payloads, kg, with commas, on five of the problems"
    group.add_argument("--payloads", metavar="KG,KG", help=words)
    group.add_argument("--planners", default=",".join(PLANNERS), help="all by default")
    add_problem_options(parser, Path("peers-space"))


def compare_in_space(options: argparse.Namespace) -> int:
    """Run what is missing and print the table; the exit status."""
    try:
        if options.payloads is not None:
            return _compare_payloads(options)
        planners = options.planners.split(",")
        unknown = next((name for name in planners if name not in PLANNERS), None)
        if unknown is not None:
            raise InvalidFile(f"--planners: {unknown!r} is not one of {', '.join(PLANNERS)}")
        setting, problems = setting_of(options), problems_of(options, options.space)
        options.out.mkdir(parents=True, exist_ok=True)
        records = Records(options.out / "records.jsonl")
        runs = [
            Run(planner, seed, setting, problem, SECONDS[planner], record)
            for planner in planners
            for seed in range(1, SEEDS[planner] + 1)
            for problem in problems
        ]
        run_all(runs, records, options.workers, tell)
    except (InvalidFile, OSError) as error:
        print(f"benchmarks.peers: {error}", file=sys.stderr)
        return 2
    keys = {run.key for run in runs}
    print(printed(rows([one for one in records.every if one.key in keys])))
    return 0


def _compare_payloads(options: argparse.Namespace) -> int:
    from benchmarks.peers.space.payloads import PROBLEMS, compare_payloads  # noqa: PLC0415 (extras)

    try:
        masses = [float(part) for part in options.payloads.split(",")]
    except ValueError:
        masses = []
    if not masses or not all(0.0 <= mass < math.inf for mass in masses):
        raise InvalidFile(f"--payloads: {options.payloads!r} is no list of masses")
    problems = [problem for problem in problems_of(options, options.space) if problem.name in PROBLEMS]
    if not problems:
        raise InvalidFile(f"--space: {options.space} has none of {', '.join(PROBLEMS)}")
    compare_payloads(setting_of(options), problems, masses, options.workers).print()
    return 0
