"""``tpbso pareto``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

from rich.text import Text

from problems import OBJECTIVES
from problems.evaluation import EvaluationOptions, InvalidEvaluation
from solvers import Interruption, deferred_interrupt
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, print_error, run_command
from tpbso_casadi.cli.commands.solve import evaluation_options
from tpbso_casadi.cli.options import (
    SCENARIO,
    add_backend,
    add_figures_option,
    add_no_plots,
    add_out,
    add_outside_files,
    add_quiet,
    add_search_keys,
    add_threads,
    figure_formats,
    is_silent,
    listed,
    machine_group,
    output_group,
    printable_name,
    problem_group,
    search_group,
    whole_number,
)
from tpbso_casadi.cli.output import RUNS
from tpbso_casadi.cli.progress import planning_progress
from tpbso_casadi.display.console import OutputConsole, number, table_of, word
from tpbso_casadi.facade.statement import scenario_of
from tpbso_casadi.facade.trading_off import FEWEST, MOST, completed
from tpbso_casadi.scenario import load, named, plugin_failures_named
from tpbso_casadi.storage import OutputError
from tpbso_casadi.trade_off import (
    ENDS,
    EPSILON_CONSTRAINT,
    METHODS,
    WEIGHTED_SUM,
    FrontWork,
    Objectives,
    Point,
    Standing,
    TradeOff,
    open_front,
)

COLOURS = {Standing.FRONT: "green", Standing.NOT_CERTIFIED: "red"}


def say_point(headings: tuple[str, str], point: Point, console: OutputConsole) -> None:
    """A line of a point that is complete."""
    values = ", ".join(f"{heading} {value:.5g}" for heading, value in zip(headings, point.values, strict=True))
    console.say(f"point {point.number}: {values}{'' if point.certified else ', not certified'}")


def print_trade_off(trade_off: TradeOff, console: OutputConsole) -> None:
    """The plans of each method by the first objective, then what all methods' fronts are worth."""
    fronts = trade_off.fronts
    planned = {m: [p for p in points if p.request is not None] for m, points in trade_off.points.items()}
    for method, points in ((method, points) for method, points in planned.items() if points):
        first, second = trade_off.headings
        table = table_of(number("point"), number(first), number(second), number("T [s]"), word("is"))
        for point in sorted(points, key=lambda each: each.values):
            standing = fronts[method].standings[point.number]
            cells = [str(point.number), *(f"{value:.5g}" for value in (*point.values, point.duration))]
            table.add_row(*cells, Text(standing, COLOURS.get(standing, "yellow")))
        console.print_table(method, table)
    table = table_of(word("method"), number("on front"), number("hypervolume"), number("evaluations"), number("s"))
    for s in trade_off.summaries:
        counts = f"{s.on_front} of {s.points}", f"{s.hypervolume:.6g}", str(s.evaluations), f"{s.seconds:.1f}"
        table.add_row(s.method, *counts)
    console.print_table("fronts", table)


DEFAULT_POINTS = 12


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(
        parser(), pareto, arguments, interrupted="interrupted before there was a plan; nothing was written"
    )


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "pareto",
        "How much of one objective another one costs: a front of plans, each certified and in a run folder of its own. "
        "The same command resumes where it was interrupted.",
        examples=["time-3 --objectives time,length", "obstacle-3 --objectives time,rotation --points 6 --out front"],
    )
    command_line.add_argument("scenario", metavar=SCENARIO, help="TOML file or built-in name")
    problem = problem_group(command_line)
    add_outside_files(problem)
    problem.add_argument(
        "--objectives",
        type=names,
        required=True,
        metavar="A,B",
        help=f"two of {listed(OBJECTIVES)}, or plug-ins; always needed",
    )
    problem.add_argument(
        "--points",
        type=whole_number(FEWEST, MOST),
        default=DEFAULT_POINTS,
        metavar="N",
        help="plans to place, both ends among them; one near each end, and second attempts at what comes out "
        "dominated, come on top",
    )
    search = search_group(command_line)
    search.add_argument(
        "--method",
        choices=METHODS,
        metavar="NAME",
        help=f"{listed(METHODS)}: bound the duration and minimise the other objective; weighted sums; or one run of "
        "pymoo's NSGA-II with the evaluations of all points, to compare with "
        f"[default: {EPSILON_CONSTRAINT} where one objective is time, else {WEIGHTED_SUM}]",
    )
    add_search_keys(search, "evaluations", "seed")
    machine = machine_group(command_line)
    add_backend(machine)
    add_threads(machine)
    output = output_group(command_line)
    add_out(output, "runs/SCENARIO-A-B")
    output.add_argument("--overwrite", action="store_true", help="drop what another scenario or setting left there")
    add_no_plots(output)
    add_figures_option(output)
    add_quiet(output)
    return command_line


def names(text: str) -> tuple[str, ...]:
    """Names with commas between them, for argparse."""
    return tuple(printable_name(name.strip()) for name in text.split(","))


def pareto(options: argparse.Namespace) -> int:
    """Make the front of the options; returns the exit status."""
    given, evaluation = load(options.scenario, options.allow_outside_files), evaluation_options(options)
    scenario = scenario_of(given, evaluations=options.evaluations, seed=options.seed)
    with named(options.scenario), plugin_failures_named(scenario, OutputError, InvalidEvaluation):
        return written(Objectives(scenario, options.objectives), evaluation, options)


def written(objectives: Objectives, evaluation: EvaluationOptions, options: argparse.Namespace) -> int:
    """Make the points, write and print the front; returns the exit status."""
    parts = [Path(options.scenario).stem, *(name.rsplit(":")[-1] for name in options.objectives)]
    folder = options.out or RUNS / "-".join(parts)
    method, store = open_front(objectives, options.method, options.points, folder, options.overwrite)
    console, errors = OutputConsole(quiet=options.quiet), OutputConsole(stderr=True, quiet=options.quiet)
    with deferred_interrupt() as interruption:
        with redirect_stdout(sys.stderr), planning_progress(None, is_silent(options)) as progress:
            work = FrontWork(
                objectives=objectives,
                store=store,
                formats=figure_formats(options),
                evaluation=evaluation,
                progress=progress,
                interruption=interruption,
                told=lambda point: say_point(objectives.headings, point, errors),
            )
            trade_off = completed(method, work, figure_formats(options))
        if trade_off.points:
            print_trade_off(trade_off, console)
            console.say(f"written to {folder}")
        return exit_status(trade_off.points.get(method.name, []), folder, interruption)


def exit_status(points: Sequence[Point], folder: Path, interruption: Interruption) -> int:
    """0 with a front; 1 without a certified end, or any; 130 interrupted; the last two with a line."""
    if interruption.requested:
        count = f"{len(points)} point{'s' * (len(points) != 1)}"
        print_error(f"interrupted; {count} complete, in {folder}, and the same command resumes")
        return Exit.INTERRUPTED
    if not points or not all(point.certified for point in points[: len(ENDS)] if point.request is not None):
        print_error("no certified plan for an end of the front (try more evaluations or another seed)")
        return Exit.INFEASIBLE
    return Exit.FEASIBLE
