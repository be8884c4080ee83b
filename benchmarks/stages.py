"""Where each millisecond of a plan goes: the stages of direct planning on MotionBenchMaker problems, in one process.

    python -m benchmarks.stages panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml

What the program's own log says of each stage, on the wall; problems without a solution are left out, as is the first
plan, which makes what the others use.
"""

from __future__ import annotations

import argparse
import logging
import re
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of
from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.problem_file import InvalidFile, MotionProblem
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import ScenarioError, overridden

STAGES = {
    "statement": "tables read and checked",
    "model": "robot, task and limits as one problem, branches of a pose included",
    "bound": "motions at the bound: drawn, looked at, clear for all t",
    "direct": "ways and their polish",
    "certificate": "all verdicts",
    "rest": "what is left",
}
SAID = re.compile(r"^(model|bound|direct|certificate): .*in ([\d.]+) s")


class Heard(logging.Handler):
    """Adds up the seconds of what is logged, by stage."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.seconds: defaultdict[str, float] = defaultdict(float)

    def emit(self, record: logging.LogRecord) -> None:
        """Take a record that tells of a stage."""
        if (said := SAID.match(record.getMessage())) is not None:
            self.seconds[said[1]] += float(said[2])


def stages_of(question: Question, problem: MotionProblem, heard: Heard) -> list[float]:
    """Seconds of each stage of a plan, and of all.

    Raises:
        ScenarioError: it has no solution.
    """
    heard.seconds.clear()
    began = time.perf_counter()
    scenario = overridden(question.scenario(problem), solver={"name": "direct"})
    stated = time.perf_counter() - began
    plan(scenario)
    whole, found = time.perf_counter() - began, heard.seconds
    verdicts, at_bound = found["certificate"], found["bound"]
    inside = "direct" if found["direct"] else "bound"  # where motions are judged
    known = {"statement": stated, "model": found["model"], "bound": at_bound, "direct": found["direct"]}
    known[inside] = max(known[inside] - verdicts, 0.0)
    known["certificate"] = verdicts
    return [*known.values(), max(whole - sum(known.values()), 0.0), whole]


def measured(question: Question, problems: list[MotionProblem]) -> Iterator[list[float]]:
    """Of each problem that has a solution, after the first."""
    heard = Heard()
    logger = logging.getLogger("tpbso_casadi")
    logger.addHandler(heard)
    logger.setLevel(logging.INFO)
    for number, problem in enumerate([problems[0], *problems]):
        try:
            found = stages_of(question, problem, heard)
        except ScenarioError:
            continue
        if number:
            yield found


def main() -> int:
    """Run the command line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", type=Path, metavar="FILE", help="of problems, one JSON object a line")
    add_problem_options(parser, Path("runs/stages"))
    parser.add_argument("--pose", action="store_true", help="the goal is the pose of the tool there")
    options = parser.parse_args()
    try:
        question, problems = Question(setting_of(options), options.pose), problems_of(options, options.problems)
    except InvalidFile as error:
        print(f"benchmarks.stages: {error}", file=sys.stderr)
        return 2
    milliseconds = 1e3 * np.array(list(measured(question, problems)))
    print("| ms | median | mean | 98 % |\n|---|---|---|---|")
    for name, column in zip([*STAGES.values(), "whole plan"], milliseconds.T, strict=True):
        print(f"| {name} | {np.median(column):.1f} | {column.mean():.1f} | {np.quantile(column, 0.98):.0f} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
