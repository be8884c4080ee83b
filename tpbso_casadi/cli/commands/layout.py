"""``tpbso layout``: where the robot, bins and fixtures of a cell stand so that its cycle is short."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import redirect_stdout
from pathlib import Path

from problems.evaluation import processors
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, print_error, run_command
from tpbso_casadi.cli.options import (
    add_key,
    add_no_plots,
    add_out,
    add_outside_files,
    add_quiet,
    add_search_keys,
    add_workers,
    defaulting,
    is_silent,
    machine_group,
    output_group,
    printable_name,
    problem_group,
    search_group,
)
from tpbso_casadi.cli.output import RUNS
from tpbso_casadi.cli.progress import planning_progress
from tpbso_casadi.display.console import OutputConsole, number, table_of, word
from tpbso_casadi.facade.laying_out import laid_out
from tpbso_casadi.facade.layouts import EVALUATIONS, MAP_POINTS, Layouts
from tpbso_casadi.layouts import LayoutTemplate
from tpbso_casadi.planning import Progress
from tpbso_casadi.scenario import LayoutSection, Scenario, named, stated_scenario
from tpbso_casadi.storage import OutputError

OWN_KEYS = {
    "restarts": "searches, each with a seed of its own",
    "finalists": "layouts of which certified plans are made",
    "spare": "kept in the search beyond what certificates need, m",
}
KEYS = ("evaluations", "time_limit", "seed", *OWN_KEYS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    told = "interrupted; the evaluations are kept where --out says, and --resume goes on"
    return run_command(parser(), layout, arguments, interrupted=told)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "layout",
        "Where the robot, bins and fixtures of a cell stand so that its cycle is short; [layout] in a scenario says "
        "what is free. The best layouts are planned and certified.",
        examples=["cell.toml", "cell.toml --evaluations 500 --finalists 3 --out runs/cell", "cell.toml --map robot"],
    )
    command_line.add_argument("scenario", metavar="FILE", help="TOML file of a sequence, with [[frames]] and [layout]")
    add_outside_files(problem_group(command_line))
    search = search_group(command_line)
    add_search_keys(search, "evaluations", "time_limit", "seed")
    for key, text in OWN_KEYS.items():
        add_key(search, LayoutSection, key, text)
    add_workers(machine_group(command_line))
    output = output_group(command_line)
    add_out(output, "runs/FILE-layout")
    output.add_argument("--resume", action="store_true", help="go on with the evaluations that the folder has")
    output.add_argument(
        "--map",
        type=printable_name,
        metavar="PLACE",
        help=defaulting("a map of the cycle over the x and y of a frame, or of the robot", "none"),
    )
    add_no_plots(output)
    add_quiet(output)
    return command_line


def layout(options: argparse.Namespace) -> int:
    """Search the layouts, write and print them; returns the exit status: 1 where none is certified."""
    with named(options.scenario):
        template = LayoutTemplate(_stated(options))
        if options.map is not None:
            template.across(options.map)
        folder = options.out or RUNS / f"{Path(options.scenario).stem}-layout"
        if (folder / EVALUATIONS).exists() and not options.resume:
            raise OutputError(f"{folder}: holds the evaluations of a search: --resume goes on, or name another folder")
        with redirect_stdout(sys.stderr), planning_progress(None, is_silent(options)) as progress:
            found = laid_out(template, options.workers or processors(), folder, progress)
            found.save(folder, figures=not options.no_plots)
            if options.map is not None and found.finalists and not options.no_plots:
                draw_map(found, options.map, folder, progress)
    print_layouts(found, folder, OutputConsole(quiet=options.quiet))
    if not found.is_certified:
        print_error(f"{options.scenario}: no layout is certified; {found.why}")
    return Exit.FEASIBLE if found.is_certified else Exit.INFEASIBLE


def _stated(options: argparse.Namespace) -> Scenario:
    """The scenario with the keys that the options state."""
    scenario = stated_scenario(options.scenario, options.allow_outside_files)
    stated = {key: getattr(options, key) for key in KEYS if getattr(options, key) is not None}
    if scenario.layout is None or not stated:
        return scenario
    return scenario.replaced(layout=scenario.layout.replaced(**stated))


def draw_map(found: Layouts, place: str, folder: Path, progress: Progress) -> None:
    """Draw the map of a place."""
    progress.phase(f"a map of {MAP_POINTS} x {MAP_POINTS} layouts")
    found.show_map(found.map(place), folder / "map.png")


def print_layouts(found: Layouts, folder: Path, console: OutputConsole) -> None:
    """Print the finalists, and how many layouts were looked at."""
    table = table_of(number("certified [s]"), number("search [s]"), word("layout"), word("remark"))
    for row in found.table:
        table.add_row(*row)
    console.print_table("layouts", table)
    console.say(f"best of {len(found.records)} layouts, of which {found.feasible} can be; {found.seconds:.1f} s")
    console.say(f"written to {folder}")
