"""``tpbso reach``: a map of what an arm reaches."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from problems import InvalidProblem
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, run_command
from tpbso_casadi.cli.options import (
    ROBOT_AND_SURROUNDINGS,
    add_descents,
    add_no_plots,
    add_out,
    add_quiet,
    add_tip,
    defaulting,
    output_group,
    positive_float,
    positive_int,
    problem_group,
)
from tpbso_casadi.display.console import OutputConsole, number, table_of, word
from tpbso_casadi.facade.reaching import ORIENTATIONS, SPACING, mapped
from tpbso_casadi.reaching import STARTS, Reach
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.storage import OutputError, check_file, check_writable

MAP, FIGURE = "reach.npz", "reach.png"
OPTIONS = {"spacing": "--spacing", "orientations": "--orientations", "arm": "--tip"}  # by fields of what is refused
SHARES = {"in any orientation": 1e-9, "in half of them": 0.5, "in every one": 1.0}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(parser(), reach, arguments, interrupted="interrupted; nothing was written")


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "reach",
        "A map of what an arm reaches: the points of a grid, its tool turned in many ways, clear of its surroundings "
        "and of itself.",
        examples=["ur5e", "cell.toml --spacing 0.05 --orientations 50 --out runs/reach"],
    )
    command_line.add_argument("robot", metavar="NAME|FILE", help=ROBOT_AND_SURROUNDINGS)
    problem = problem_group(command_line)
    problem.add_argument(
        "--spacing", type=positive_float, default=SPACING, metavar="METRES", help=defaulting("of the grid", SPACING)
    )
    problem.add_argument(
        "--orientations",
        type=positive_int,
        default=ORIENTATIONS,
        metavar="N",
        help=defaulting("ways to turn the tool, evenly spread", ORIENTATIONS),
    )
    add_descents(problem, STARTS)
    add_tip(problem)
    output = output_group(command_line)
    add_out(output, f"none is written; else {MAP} and {FIGURE}")
    add_no_plots(output)
    add_quiet(output)
    return command_line


def reach(options: argparse.Namespace) -> int:
    """Make the map, write and print it; returns the exit status: 1 where nothing is reached and clear."""
    if options.out is not None:
        check_out(options.out)
    found = found_reach(options)
    if not options.quiet:
        print_reach(found, OutputConsole())
    if options.out is not None:
        found.save(options.out / MAP)
        if not options.no_plots:
            found.show(options.out / FIGURE)
    return Exit.FEASIBLE if found.clear.any() else Exit.INFEASIBLE


def found_reach(options: argparse.Namespace) -> Reach:
    """The map that the options ask for.

    Raises:
        ScenarioError: the robot cannot be, or an option is wrong.
    """
    try:
        return mapped(options.robot, options.spacing, options.orientations, tip=options.tip, starts=options.descents)
    except InvalidProblem as error:
        option = OPTIONS.get(error.field)
        raise ScenarioError(f"{options.robot}: {error}" if option is None else f"{option}: {error.reason}") from error


def check_out(folder: Path) -> None:
    """The files can be written there.

    Raises:
        OutputError: they cannot.
    """
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{folder}: is no folder")
    for name in (MAP, FIGURE):
        if folder.exists():
            check_file(folder / name)
    check_writable(folder)


def print_reach(found: Reach, console: OutputConsole) -> None:
    """Print how much is reached, and how much of it in how many ways."""
    console.say(repr(found)[1:-1])
    extents = (number(f"{axis} [m]") for axis in "xyz")
    table = table_of(word("reached and clear"), number("points"), number("of all"), *extents)
    for words, least in SHARES.items():
        kept = found.share >= least
        points = found.points[kept]
        extent = [f"{min(part):.3g} to {max(part):.3g}" for part in points.T] if len(points) else ["-"] * 3
        table.add_row(words, str(len(points)), f"{kept.mean():.1%}", *extent)
    console.print_table("points of the grid", table)
