"""``tpbso robots``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.table import Table

from problems import InvalidProblem
from problems.robots import (
    BUILT_IN,
    POSTURES,
    ChainJoint,
    RobotDescription,
    Sphere,
    built_in,
    most_held,
    read_spheres,
    read_urdf,
)
from tpbso_casadi.cli.command import Exit, OneLineParser, add_verbose, command_parser, run_command
from tpbso_casadi.cli.options import defaulting, listed, path
from tpbso_casadi.display.console import OutputConsole, number, table_of, word
from tpbso_casadi.figures.palette import FORMATS
from tpbso_casadi.scenario import ScenarioError, read_text
from tpbso_casadi.storage import OutputError, check_file, check_writable, writing

NOT_STATED = "-"


def print_list(robots: Sequence[tuple[str, RobotDescription]], console: OutputConsole) -> None:
    """Names of robots and what they are."""
    table = table_of(word("name"), word("robot"), number("joints"), word("tip"), number("spheres"))
    for name, robot in robots:
        table.add_row(name, robot.title, str(len(robot.chain.joints)), robot.chain.tip_link, str(len(robot.spheres)))
    console.print_table("built-in robots", table)


def print_robot(robot: RobotDescription, console: OutputConsole) -> None:
    """Its joints with limits and masses, its reach, its spheres, and what is not known of it."""
    chain = robot.chain
    console.say(
        f"{robot.title or chain.name}: {len(chain.joints)} joints from {chain.base_link} to {chain.tip_link}, "
        f"reach at most {robot.reach:.4g} m"
    )
    console.say("")
    console.print_table("joints; rad, rad/s, N m, of those that slide m, m/s, N", _joints(robot))
    console.say("")
    console.print_table("masses that they move", _masses(chain.joints))
    console.say("")
    title = f"motors, N m, N m s (N, N s/m); held: the most at {POSTURES} random postures"
    console.print_table(title, _motors(robot))
    if robot.spheres:
        console.say("")
        console.print_table("collision spheres, m", _spheres(robot.spheres))
        pairs = robot.own_pairs(robot.drawn).kept
        links = {tuple(sorted((robot.spheres[one].name, robot.spheres[two].name))) for one, two in pairs}
        console.say(f"self-collision: {len(pairs)} pairs of spheres, on {len(links)} pairs of links, can touch")
    else:
        console.say("no collision spheres: nothing is kept clear")
    for note in robot.notes:
        console.say(f"note: {note}")


def _joints(robot: RobotDescription) -> Table:
    table = table_of(
        word("joint"), word("kind"), number("lowest"), number("highest"), number("speed"), number("acc."),
        number("jerk"), number("torque"),
    )  # fmt: skip
    unknown = (None,) * len(robot.chain.joints)
    accelerations, jerks = robot.max_acceleration or unknown, robot.max_jerk or unknown
    for joint, acceleration, jerk in zip(robot.chain.joints, accelerations, jerks, strict=True):
        low, high = joint.position or (None, None)
        values = (low, high, joint.speed, acceleration, jerk, joint.effort)
        table.add_row(joint.name, str(joint.kind), *(_shown(value) for value in values))
    return table


def _masses(joints: Sequence[ChainJoint]) -> Table:
    table = table_of(word("link"), number("mass [kg]"), *(number(f"center {axis} [m]") for axis in "xyz"))
    for joint in joints:
        inertia = joint.inertia
        values = (None,) * 4 if inertia is None else (inertia.mass, *inertia.center)
        table.add_row(joint.link, *(_shown(value) for value in values))
    total = sum(joint.inertia.mass for joint in joints if joint.inertia is not None)
    table.add_row("all", _shown(total), "", "", "")
    return table


def _motors(robot: RobotDescription) -> Table:
    table = table_of(
        word("joint"), number("torque"), number("held"), number("of it"), number("viscous"), number("coulomb")
    )
    joints = robot.chain.joints
    held = most_held(robot.drawn)
    for place, joint in enumerate(joints):
        most = None if held is None else float(held[place])
        part = NOT_STATED if most is None or joint.effort is None else f"{most / joint.effort:.0%}"
        values = (_shown(value) for value in (joint.effort, most))
        table.add_row(joint.name, *values, part, _shown(joint.damping), _shown(joint.friction))
    return table


def _spheres(spheres: Sequence[Sphere]) -> Table:
    table = table_of(word("link"), number("spheres"), number("smallest radius"), number("largest radius"))
    for link in dict.fromkeys(sphere.name for sphere in spheres):
        radii = [sphere.radius for sphere in spheres if sphere.name == link]
        table.add_row(link, str(len(radii)), _shown(min(radii)), _shown(max(radii)))
    return table


def _shown(value: float | None) -> str:
    return NOT_STATED if value is None else f"{value:.5g}"


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
        from tpbso_casadi.figures.space import draw_robot  # noqa: PLC0415 (matplotlib is slow to load)

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
