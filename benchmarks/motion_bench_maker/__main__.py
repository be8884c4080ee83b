"""Plan the problems of a file, check what comes out, and print a table; the same command resumes."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import benchmarks.motion_bench_maker
from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of
from benchmarks.motion_bench_maker.ours import Question, judge_all, runs_of
from benchmarks.motion_bench_maker.problem_file import InvalidFile, MotionProblem
from benchmarks.motion_bench_maker.records import Records
from benchmarks.motion_bench_maker.run_limit import limited
from benchmarks.motion_bench_maker.table import by_kind, printed, rows
from problems.evaluation import BACKENDS
from tpbso_casadi.cli.campaign import CAMPAIGN_FAILURES, INTERRUPTED, executors_of
from tpbso_casadi.cli.command import exit_code_of
from tpbso_casadi.judging.campaign import run_campaign
from tpbso_casadi.judging.grid import parse_solvers
from tpbso_casadi.judging.run import Outcome, Run
from tpbso_casadi.judging.store import RunStore


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = argparse.ArgumentParser(
        prog="python -m benchmarks.motion_bench_maker",
        description=benchmarks.motion_bench_maker.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command_line.add_argument("problems", type=Path, metavar="FILE", help="of problems, one JSON object a line")
    add_problem_options(command_line, Path("runs/motion-bench-maker"))
    command_line.add_argument(
        "--goal",
        choices=("joints", "pose"),
        default="joints",
        help="what of the goal is given; a motion to the pose may take another posture, and less than the bound",
    )
    command_line.add_argument("--solvers", default="lshade", metavar="A,B", help="as in tpbso compare")
    command_line.add_argument("--evaluations", type=int, default=20_000, metavar="N", help="of each search")
    command_line.add_argument("--seeds", type=int, default=1, metavar="N", help="of each solver on each problem")
    command_line.add_argument(
        "--run-limit", type=float, default=600.0, metavar="S", help="ends a run of this machine; 600 s by default"
    )
    executors = command_line.add_mutually_exclusive_group()
    executors.add_argument("--workers", type=int, default=1, metavar="N", help="processes; 1 by default")
    executors.add_argument("--dask", metavar="ADDRESS", help="the workers of a Dask scheduler")
    command_line.add_argument("--backend", choices=BACKENDS, help="evaluates populations; auto by default")
    command_line.add_argument("--retry-failed", action="store_true", help="repeat the runs that failed")
    command_line.add_argument("--classes", action="store_true", help="a row for each class of scenes too")
    return command_line


def main() -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args()
    try:
        setting = setting_of(options)
        problems = problems_of(options, options.problems)
    except InvalidFile as error:
        print(f"benchmarks.motion_bench_maker: {error}", file=sys.stderr)
        return 2
    question = Question(setting, options.goal == "pose")
    return exit_code_of(lambda: run(options, question, problems), CAMPAIGN_FAILURES, INTERRUPTED)


def run(options: argparse.Namespace, question: Question, problems: list[MotionProblem]) -> int:
    """Do what has not been done, judge it, and print the table."""
    specs = [replace(spec, table={"evaluations": options.evaluations}) for spec in parse_solvers(options.solvers)]
    runs = runs_of(question, problems, specs, range(1, options.seeds + 1))
    with RunStore.in_folder(options.out) as store:
        done = store.done(failed_too=not options.retry_failed)
        pending = [one for _, one in runs if one.key not in done]
        if pending:
            print(f"{len(pending)} of {len(runs)} runs", file=sys.stderr, flush=True)
            options.quiet, options.verbose = True, 0
            with executors_of(options, len(pending)) as executors:
                own = executors if options.dask else limited(executors, options.run_limit)
                run_campaign(pending, store, own, options.retry_failed, tell)
        records = list(judge_all(question.setting, runs, store, Records(options.out / "records.jsonl")))
    print(printed(by_kind(records) if options.classes else rows(records)))
    return 0


def tell(run: Run, outcome: Outcome) -> None:
    """One line of progress on standard error."""
    print(outcome.error or f"planned in {outcome.seconds:.1f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
