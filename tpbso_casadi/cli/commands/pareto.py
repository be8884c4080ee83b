"""``python -m tpbso_casadi.pareto``: a front of certified plans between two objectives."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

from problems import OBJECTIVES
from problems.evaluation import BACKENDS, EvaluationOptions, InvalidEvaluation
from solvers.driver.interruption import Interruption, deferred_interrupt
from tpbso_casadi.cli.commands.solve import evaluation_options, stated
from tpbso_casadi.cli.common import (
    Exit,
    OneLineParser,
    add_input_options,
    natural,
    path,
    print_error,
    whole_number,
    word,
)
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.cli.display.front_tables import print_trade_off, say_point
from tpbso_casadi.cli.display.planning_progress import planning_progress
from tpbso_casadi.cli.figure_formats import add_figures_option, figure_formats
from tpbso_casadi.cli.run_name import RUNS
from tpbso_casadi.scenario import overriding
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.scenario import Scenario, plugin_failures_named
from tpbso_casadi.scenario.section import MOST_EVALUATIONS, ScenarioError
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.trade_off.methods import METHODS, method_named
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.placement import ENDS
from tpbso_casadi.trade_off.point import Point
from tpbso_casadi.trade_off.store import Store
from tpbso_casadi.trade_off.table import TradeOff
from tpbso_casadi.trade_off.work import Work

DEFAULT_POINTS = 12
MOST_THREADS = 256
MOST_PLANS = 1000


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    try:
        return pareto(options)
    except (ScenarioError, OutputError, InvalidEvaluation) as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error("interrupted before there was a plan; nothing was written")
        return Exit.INTERRUPTED


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser(
        "python -m tpbso_casadi.pareto",
        description="How much of one objective another one costs: a front of plans, each certified and in a run folder "
        "of its own. The same command resumes where it was interrupted.",
    )
    command_line.add_argument("scenario", help="TOML file or built-in name; its objective does not matter")
    add_input_options(command_line)
    command_line.add_argument(
        "--objectives", type=names, required=True, metavar="A,B", help=f"two of {', '.join(OBJECTIVES)}, or plug-ins"
    )
    command_line.add_argument(
        "--points",
        type=whole_number(len(ENDS), MOST_PLANS),
        default=DEFAULT_POINTS,
        metavar="N",
        help=f"plans to place, both ends among them; {DEFAULT_POINTS} by default. One near each end, and second "
        "attempts at what comes out dominated, come on top",
    )
    command_line.add_argument(
        "--method",
        choices=METHODS,
        help="bound the duration and minimise the other objective, where one of them is time (the default there); "
        "weighted sums; or one run of pymoo's NSGA-II with the evaluations of all points, to compare with",
    )
    command_line.add_argument(
        "--evaluations", type=whole_number(1, MOST_EVALUATIONS), metavar="N", help="of the search of each point"
    )
    command_line.add_argument("--seed", type=natural, help="same seed, same result")
    speed = command_line.add_argument_group("the machine; these change how long it takes, not the result")
    speed.add_argument("--backend", choices=BACKENDS, help="evaluates populations; auto by default")
    speed.add_argument(
        "--threads", type=whole_number(1, MOST_THREADS), default=1, metavar="N", help="for populations of thousands"
    )
    output = command_line.add_argument_group("the output")
    output.add_argument("--out", type=path, metavar="DIR", help="folder; runs/SCENARIO-A-B by default")
    output.add_argument("--overwrite", action="store_true", help="drop what another scenario or setting left there")
    output.add_argument("--no-plots", action="store_true", help="draw no figures")
    add_figures_option(output)
    output.add_argument("--quiet", action="store_true", help="no progress, no table")
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
        with redirect_stdout(sys.stderr), planning_progress(None, options.quiet) as progress:
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
