"""``tpbso suite``."""

from __future__ import annotations

import argparse
import re
import shlex
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.table import Table

from tpbso_casadi.cli.campaign import (
    CAMPAIGN_FAILURES,
    INTERRUPTED,
    add_campaign_options,
    add_logs,
    failures,
    prepare,
    run_with_progress,
)
from tpbso_casadi.cli.command import Exit, OneLineParser, add_verbose, command_parser, run_command
from tpbso_casadi.cli.options import (
    Group,
    add_no_plots,
    add_solvers,
    defaulting,
    output_group,
    path,
    positive_int,
    problem_group,
    search_group,
)
from tpbso_casadi.cli.progress import phase
from tpbso_casadi.judging.grid import parse_solvers, suite_grid
from tpbso_casadi.judging.logs import check_logs, write_logs
from tpbso_casadi.judging.page import RANKS, RUNS, SUITE_PAGE, SUMMARY, write_recordings, write_suite
from tpbso_casadi.judging.referee import Referee, referee_of
from tpbso_casadi.judging.results import recordings
from tpbso_casadi.judging.store import STORE, RunStore
from tpbso_casadi.suite import SUITE, SUITES, InvalidSuite, Suite, suite

USUAL_SOLVERS = "bso,pso,ga,abso,lshade"
USUAL_BUDGET, USUAL_RUNS = 500, 1
FAILURES = (*CAMPAIGN_FAILURES, InvalidSuite)
RANGE = re.compile(r"([0-9]{1,9})(?:-([0-9]{1,9}))?")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    stated = sys.argv[1:] if arguments is None else arguments
    work = partial(dispatch, command=shlex.join(["tpbso", "suite", *stated]))
    return run_command(parser(), work, arguments, failures=FAILURES)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "suite",
        f"Judge solvers on {SUITE}: real robot motions, frozen, with best known values.",
        examples=["list", "run --solvers pso,lshade --budget 300 --instances 1-3", "report judged"],
    )
    commands = command_line.add_subparsers(dest="command", metavar="COMMAND", parser_class=OneLineParser)
    listing = commands.add_parser("list", help="the functions of the suite; the default")
    checking = commands.add_parser("check", help="whether this machine gives the bits with which the suite was frozen")
    running = commands.add_parser(
        "run",
        help="run solvers on problems, and judge them; the same command resumes",
        examples=["--solvers pso,lshade --functions spline,narrow-3 --instances 1-3"],
    )
    running.set_defaults(interrupted=INTERRUPTED)
    reporting = commands.add_parser(
        "report",
        help="judge the runs of a folder, and anybody's runs in tables",
        examples=["judged", "judged --runs mine.csv"],
    )
    exporting = commands.add_parser(
        "export",
        help="write the problems as C++ with a header of C, for programs in other languages",
        examples=["arm-motions --functions spline,narrow-3"],
    )
    for command in (listing, checking, running, reporting, exporting):
        add_verbose(command, default=argparse.SUPPRESS)
        add_problems(problem_group(command))
    exporting.add_argument("folder", type=path, metavar="DIR", help="new or empty; `make` builds a library there")
    add_search(search_group(running))
    add_no_plots(add_campaign_options(running, Path("runs/suite")))
    reporting.add_argument("folder", type=path, metavar="DIR", help="of `tpbso suite run`, or an empty one")
    reporting.add_argument(
        "--runs",
        type=path,
        action="append",
        default=[],
        metavar="FILE",
        help=defaulting("a table of further runs, CSV: solver,problem,run,evaluations,merit; repeatable", "none"),
    )
    output = output_group(reporting)
    add_logs(output)
    add_no_plots(output)
    return command_line


def add_problems(group: Group) -> None:
    """Add the options that choose problems of a suite."""
    group.add_argument(
        "--suite", choices=SUITES, default=SUITE, help="which version: later ones mend what is wrong in earlier ones"
    )
    group.add_argument(
        "--functions", metavar="A,B,...", help=defaulting("names of functions or of groups of them", "all")
    )
    group.add_argument("--instances", type=numbers, metavar="N,N-N,...", help=defaulting("numbers of instances", "all"))


def add_search(group: Group) -> None:
    """Add the options that choose solvers and budgets."""
    add_solvers(group, USUAL_SOLVERS)
    group.add_argument(
        "--budget",
        type=positive_int,
        default=USUAL_BUDGET,
        metavar="N",
        help="evaluations of a run for each variable of a problem",
    )
    group.add_argument(
        "--repeat", type=positive_int, default=USUAL_RUNS, metavar="N", help="runs of each solver on each problem"
    )


def numbers(text: str) -> tuple[int, ...]:
    """Numbers of a command line, ``1,4-6``.

    Raises:
        ArgumentTypeError: they are not.
    """
    found: list[int] = []
    for part in text.split(","):
        match = RANGE.fullmatch(part)
        first, last = (0, -1) if match is None else (int(match[1]), int(match[2] or match[1]))
        if not first <= last <= first + 1000:
            raise argparse.ArgumentTypeError(f"{part!r:.40} is not a number or a range such as 1-3")
        found += range(first, last + 1)
    return tuple(dict.fromkeys(found))


def dispatch(options: argparse.Namespace, command: str) -> int:
    """Do what the options ask for; returns the exit status.

    Args:
        options: of the command line.
        command: the whole of it, for the page.
    """
    if options.command == "run":
        return run(options, command)
    if options.command == "report":
        return report(options, command)
    if options.command == "export":
        return export(options)
    return check(options) if options.command == "check" else list_functions(options)


def chosen(options: argparse.Namespace) -> Suite:
    """The problems that the options state.

    Raises:
        InvalidSuite: there is no such function or instance.
    """
    stated = getattr(options, "functions", None)
    name, instances = getattr(options, "suite", SUITE), getattr(options, "instances", None)
    return suite(name, None if stated is None else stated.split(","), instances)


def list_functions(options: argparse.Namespace) -> int:
    """Print the functions; returns the exit status."""
    problems = chosen(options)
    table = Table(
        "function", "variables", "best known", "what it is", title=f"{problems.name}: {len(problems)} problems"
    )
    table.columns[0].no_wrap = True
    for group in dict.fromkeys(function.group for function in problems.functions):
        table.add_section()
        table.add_row(group, style="bold")
        for function in (each for each in problems.functions if each.group == group):
            of_function = [problem for problem in problems if problem.function is function]
            known = sum(problem.best_merit is not None for problem in of_function)
            table.add_row(function.name, str(function.dimension), f"{known} of {len(of_function)}", function.title)
    Console().print(table)
    return Exit.FEASIBLE


def check(options: argparse.Namespace) -> int:
    """Compare values with those that the suite was frozen with; returns the exit status."""
    problems = chosen(options)
    wrong = [problem.name for problem in problems if not problem.is_intact()]
    for name in wrong:
        print(f"{name}: other values than those of the suite")
    print(f"{len(problems) - len(wrong)} of {len(problems)} problems give the bits of {problems.name}")
    return Exit.INFEASIBLE if wrong else Exit.FEASIBLE


def run(options: argparse.Namespace, command: str) -> int:
    """Run the campaign of the options and judge it; returns the exit status."""
    prepare(options, SUITE_PAGE, RUNS, SUMMARY, RANKS)
    problems = chosen(options).problems
    runs = suite_grid(problems, parse_solvers(options.solvers), options.repeat, options.budget)
    with phase("building the kernels", options.quiet):
        for problem in {problem.function.name: problem for problem in problems}.values():
            problem.is_intact()
    with RunStore.in_folder(options.out) as store:
        run_with_progress(runs, store, options)
        records, found = store.records(runs), list(recordings(runs, store))
    if found:
        write_recordings(options.out, found)
        judge(Referee(found), options.out, options, command)
    return failures(records)


def report(options: argparse.Namespace, command: str) -> int:
    """Judge the runs of a folder and of tables; returns the exit status."""
    own = options.folder / RUNS
    files = [*([own] if own.exists() else []), *options.runs]
    if not files:
        if (options.folder / STORE).exists():
            raise InvalidSuite(
                f"{options.folder}: its runs have not ended; the `tpbso suite run` of it goes on with them"
            )
        raise InvalidSuite(f"{own}: there are no runs; say --runs FILE, or the folder of `tpbso suite run`")
    referee, left_out = referee_of(files, {problem.name for problem in chosen(options)})
    check_logs(options.format, options.folder, len({problem.function.name for problem in referee.problems}))
    if left_out:
        print(f"{len(left_out)} problems are left out, which not all of the solvers have searched, as {left_out[0]}")
    judge(referee, options.folder, options, command)
    write_logs(options.format, options.folder, referee.logged)
    return Exit.FEASIBLE


def export(options: argparse.Namespace) -> int:
    """Write the sources of a library; returns the exit status."""
    problems = chosen(options)
    with phase("computing what the suite's values are", quiet=False):
        problems.export(options.folder)
    make = f"make -C {shlex.quote(str(options.folder))}"
    told = f"written: {', '.join(problem.name for problem in problems[:3])}"
    told += f" and {len(problems) - 3} more" if len(problems) > 3 else ""
    Console().print(f"{told}; `{make}` builds a library", highlight=False, soft_wrap=True)
    return Exit.FEASIBLE


def judge(referee: Referee, folder: Path, options: argparse.Namespace, command: str) -> None:
    """Write the page and print the ranks."""
    quiet = getattr(options, "quiet", False)
    with phase("writing the page", quiet):
        write_suite(folder, referee, command, pictures=not options.no_plots)
    if quiet:
        return
    table = Table(title=f"{len(referee.runs)} runs on {len(referee.problems)} problems")
    for heading in ("solver", "mean rank", "joined with", "targets reached", "runs"):
        table.add_column(heading)
    for rank, of in referee.overall:
        table.add_row(of.solver, f"{rank:.2f}", referee.joined[of.solver], f"{100.0 * of.reached:.0f} %", str(of.runs))
    Console().print(table)
    if referee.unequal:
        print(f"evaluations for each variable differ, and ranks compare budgets too: {referee.unequal}")
    Console().print(f"written to {folder}", highlight=False, soft_wrap=True)
