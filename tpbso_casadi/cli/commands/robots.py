"""``python -m tpbso_casadi.robots``: lists the robots that are built in, shows one of them or that of a URDF."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from problems import InvalidProblem
from problems.robots.spatial.collision.spheres_file import read_spheres
from problems.robots.spatial.description import RobotDescription
from problems.robots.spatial.models import BUILT_IN, built_in
from problems.robots.spatial.urdf import read_urdf
from tpbso_casadi.cli.command import run_command
from tpbso_casadi.cli.common import Exit, path
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.cli.display.robot_tables import print_list, print_robot
from tpbso_casadi.cli.options import defaulting, listed
from tpbso_casadi.cli.parser import OneLineParser, add_verbose, command_parser
from tpbso_casadi.figures.style.formats import FORMATS
from tpbso_casadi.scenario.input_files import read_text
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import OutputError, check_file, check_writable, writing


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(parser(), robots, arguments)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "robots",
        "List the robots that are built in, or show a robot.",
        examples=["list", "show panda", "show arm.urdf --tip-link tool0 --figure arm.png"],
    )
    commands = command_line.add_subparsers(dest="command", metavar="COMMAND", parser_class=OneLineParser)
    listing = commands.add_parser("list", help="the robots that are built in; the default")
    shown = commands.add_parser(
        "show",
        help="joints, limits, masses, reach and spheres of a robot",
        examples=["panda", "arm.urdf --tip-link tool0 --figure arm.png"],
    )
    for command in (listing, shown):
        add_verbose(command, default=argparse.SUPPRESS)
    shown.add_argument("robot", metavar="NAME|FILE.urdf", help=f"{listed(BUILT_IN)}, or a file")
    shown.add_argument("--base-link", metavar="LINK", help=defaulting("what stands still", "the root"))
    shown.add_argument("--tip-link", metavar="LINK", help=defaulting("the end of the chain", "a robot's usual one"))
    shown.add_argument(
        "--spheres", type=path, metavar="FILE", help=defaulting("collision spheres, a TOML file", "the robot's own")
    )
    shown.add_argument(
        "--figure",
        type=path,
        metavar="FILE",
        help=defaulting(f"draw it there ({listed(FORMATS)}), in three views and in perspective", "none"),
    )
    return command_line


def robots(options: argparse.Namespace) -> int:
    """Do what the options ask for; returns the exit status."""
    if options.command == "show":
        return show(options)
    print_list([(name, built_in(name)) for name in BUILT_IN], OutputConsole())
    return Exit.FEASIBLE


def show(options: argparse.Namespace) -> int:
    """Print a robot, and draw it if that is wished; returns the exit status."""
    if options.figure is not None:
        check_figure(options.figure)
    try:
        description = described(options)
        print_robot(description, OutputConsole())
    except InvalidProblem as error:
        raise ScenarioError(f"{options.robot}: {error}") from error
    if options.figure is not None:
        if not description.spheres and description.reach == 0.0:
            raise ScenarioError(f"{options.robot}: there is nothing to draw: all of it is in one point")
        from tpbso_casadi.figures.space.robot import draw_robot  # noqa: PLC0415 (matplotlib is slow to load)

        with writing(options.figure.parent):
            draw_robot(options.figure, description)
    return Exit.FEASIBLE


def check_figure(file: Path) -> None:
    """A figure can be written there.

    Raises:
        OutputError: it cannot.
    """
    if file.suffix[1:] not in FORMATS:
        raise OutputError(f"{file}: the name of a figure ends with {', '.join(f'.{kind}' for kind in FORMATS)}")
    check_file(file)
    check_writable(file.parent)


def described(options: argparse.Namespace) -> RobotDescription:
    """The robot of the options.

    Raises:
        InvalidProblem: it cannot be.
        ScenarioError: a file cannot be read.
    """
    if options.robot in BUILT_IN:
        if options.base_link is not None:
            raise InvalidProblem("base_link", "a robot that is built in has its own")
        description = built_in(options.robot, options.tip_link)
    else:
        description = read_urdf(read_text(Path(options.robot)), options.base_link, options.tip_link)
    if options.spheres is None:
        return description
    try:
        return replace(description, spheres=read_spheres(read_text(options.spheres), description.links))
    except InvalidProblem as error:
        raise ScenarioError(f"{options.spheres}: {error}") from error
