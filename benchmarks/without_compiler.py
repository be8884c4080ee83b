"""What plans cost with the compiled core, and in NumPy: processor seconds of direct plans of MotionBenchMaker problems.

    python -m benchmarks.without_compiler panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml --first 3
    TPBSO_CASADI_CORE=off python -m benchmarks.without_compiler panda.jsonl ...

One process, one plan after another; robot and scene are read before.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of
from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.problem_file import InvalidFile
from problems.core import core
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import Scenario, ScenarioError, overridden


def planned(scenario: Scenario) -> tuple[float, float]:
    """Processor seconds, and the duration of the certified plan, s; infinite where there is none."""
    began = time.process_time()
    try:
        motion = plan(overridden(scenario, solver={"name": "direct"})).motion
    except ScenarioError:  # it has no solution
        return time.process_time() - began, np.inf
    return time.process_time() - began, motion.trajectory.duration if motion.feasible else np.inf


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", type=Path, metavar="FILE", help="of problems, one JSON object a line")
    add_problem_options(parser, Path("runs/without-compiler"))
    options = parser.parse_args()
    try:
        question, problems = Question(setting_of(options), False), problems_of(options, options.problems)
    except InvalidFile as error:
        print(f"benchmarks.without_compiler: {error}", file=sys.stderr)
        return 2
    found = np.array([planned(question.scenario(problem)) for problem in problems])
    seconds, durations = found[np.isfinite(found[:, 1])].T
    median, large, worst = np.quantile(seconds, [0.5, 0.9, 1.0])
    print("| core | certified | duration, median | CPU seconds: median / 90 % / worst |\n|---|---|---|---|")
    print(
        f"| {core().name} | {len(seconds)} | {np.median(durations):.3f} s | {median:.2f} / {large:.2f} / {worst:.1f} |"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
