"""``python -m tpbso_casadi.pareto``: a front of certified plans between two objectives."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

from problems import OBJECTIVES
from problems.evaluation import EvaluationOptions, InvalidEvaluation
from solvers.driver.interruption import Interruption, deferred_interrupt
from tpbso_casadi.cli.command import run_command
from tpbso_casadi.cli.commands.solve import evaluation_options, stated
from tpbso_casadi.cli.common import Exit, print_error, whole_number, word
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.cli.display.front_tables import print_trade_off, say_point
from tpbso_casadi.cli.display.planning_progress import planning_progress
from tpbso_casadi.cli.figure_formats import add_figures_option, figure_formats
from tpbso_casadi.cli.options import (
    SCENARIO,
    add_backend,
    add_evaluations,
    add_no_plots,
    add_out,
    add_outside_files,
    add_quiet,
    add_seed,
    add_threads,
    is_silent,
    listed,
    machine_group,
    output_group,
    problem_group,
    search_group,
)
from tpbso_casadi.cli.parser import OneLineParser, command_parser
from tpbso_casadi.cli.run_name import RUNS
from tpbso_casadi.scenario import overriding
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.scenario import Scenario, plugin_failures_named
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.trade_off.methods import EPSILON_CONSTRAINT, METHODS, WEIGHTED_SUM, method_named
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.placement import ENDS
from tpbso_casadi.trade_off.point import Point
from tpbso_casadi.trade_off.store import Store
from tpbso_casadi.trade_off.table import TradeOff
from tpbso_casadi.trade_off.work import Work

DEFAULT_POINTS = 12
MOST_PLANS = 1000


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
        type=whole_number(len(ENDS), MOST_PLANS),
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
    add_evaluations(search)
    add_seed(search)
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
    return tuple(word(name.strip()) for name in text.split(","))


def pareto(options: argparse.Namespace) -> int:
    """Make the front of the options; returns the exit status."""
    given, evaluation = load(options.scenario, options.allow_outside_files), evaluation_options(options)
    scenario = overridden(given, options)
    try:
        with plugin_failures_named(scenario, OutputError, InvalidEvaluation):
            return written(Objectives(scenario, options.objectives), evaluation, options)
    except ScenarioError as error:
        raise ScenarioError(f"{options.scenario}: {error}") from error


def overridden(scenario: Scenario, options: argparse.Namespace) -> Scenario:
    """The scenario with the values of the command line in place of its own, and a solver where it names none."""
    return overriding.overridden(scenario, solver=stated(options, "evaluations", "seed"))


def written(objectives: Objectives, evaluation: EvaluationOptions, options: argparse.Namespace) -> int:
    """Make the points, write and print the front; returns the exit status."""
    folder = options.out or default_folder(options)
    method = method_named(options.method, objectives, options.points)
    asked = {"scenario": objectives.scenario.model_dump(), "objectives": objectives.names}
    store = Store.open(folder, asked, method.name, method.settings, options.overwrite)
    objectives.problems()  # what cannot be planned is said before anything is
    console, errors = OutputConsole(quiet=options.quiet), OutputConsole(stderr=True, quiet=options.quiet)
    with deferred_interrupt() as interruption:
        with redirect_stdout(sys.stderr), planning_progress(None, is_silent(options)) as progress:
            work = Work(
                objectives=objectives,
                store=store,
                plots=not options.no_plots,
                formats=options.figures,
                evaluation=evaluation,
                progress=progress,
                interruption=interruption,
                told=lambda point: say_point(objectives.headings, point, errors),
            )
            method.run(work)
            trade_off = TradeOff(objectives.headings, {name: store.points(name) for name in store.methods})
            if trade_off.points:
                trade_off.write(folder)
                draw(folder, trade_off, figure_formats(options))
        if trade_off.points:
            print_trade_off(trade_off, console)
            console.say(f"written to {folder}")
        return exit_status(trade_off.points.get(method.name, []), folder, interruption)


def default_folder(options: argparse.Namespace) -> Path:
    """``runs/SCENARIO-A-B``."""
    parts = [Path(options.scenario).stem, *(name.rsplit(":")[-1] for name in options.objectives)]
    return RUNS / "-".join(parts)


def draw(folder: Path, trade_off: TradeOff, formats: Sequence[str]) -> None:
    """The figure, unless there is to be none."""
    if not formats:
        return
    from tpbso_casadi.trade_off.figures import draw_front  # noqa: PLC0415 (matplotlib is slow to load)

    draw_front(folder, trade_off, formats)


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
