"""``tpbso robots``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.table import Table

from problems import InvalidProblem
from problems.base import in_words
from problems.geometry import Cover
from problems.limits import touching_links
from problems.robots import (
    BUILT_IN,
    RANDOM_POSTURES,
    ChainJoint,
    OwnContacts,
    RobotDescription,
    Sphere,
    built_in,
    complete_arm,
    largest_holding_torques,
    read_spheres,
    written_spheres,
)
from problems.tasks import check_bodies
from tpbso_casadi.cli.command import Exit, OneLineParser, add_verbose, command_parser, run_command
from tpbso_casadi.cli.inverse import add_inverse, inverse
from tpbso_casadi.cli.options import defaulting, listed, path, positive_number
from tpbso_casadi.display.console import OutputConsole, number, table_of, word
from tpbso_casadi.facade.robots import robot_key
from tpbso_casadi.figures.palette import FORMATS
from tpbso_casadi.scenario import (
    InputFolder,
    ScenarioError,
    SpatialRobotSection,
    read_table,
    read_text,
)
from tpbso_casadi.storage import OutputError, check_file, check_writable, write_text, writing

NOT_STATED = "-"
FOLDER = InputFolder(Path(), outside_allowed=True)


def print_list(robots: Sequence[tuple[str, RobotDescription]], console: OutputConsole) -> None:
    """Names of robots and what they are."""
    table = table_of(word("name"), word("robot"), number("joints"), word("tip"), number("spheres"))
    for name, robot in robots:
        table.add_row(name, robot.title, str(len(robot.chain.joints)), robot.chain.tip_link, str(len(robot.spheres)))
    console.print_table("built-in robots", table)


def print_robot(robot: RobotDescription, console: OutputConsole) -> None:
    """Print the joints of a robot with limits and masses, its reach, its spheres, and what is not known of it."""
    chain = robot.chain
    console.say(
        f"{robot.title or chain.name}: {len(chain.joints)} joints from {chain.base_link} to {in_words(chain.ends)}, "
        f"reach at most {robot.reach:.4g} m"
    )
    console.say("")
    console.print_table("joints; rad, rad/s, N m, of those that slide m, m/s, N", _joints(robot))
    console.say("")
    console.print_table("masses that they move", _masses(chain.joints))
    console.say("")
    title = f"motors, N m, N m s (N, N s/m); held: the most at {RANDOM_POSTURES} random postures"
    console.print_table(title, _motors(robot))
    if robot.spheres:
        console.say("")
        console.print_table("collision spheres, m", _spheres(robot.spheres))
        pairs = OwnContacts(robot, robot.drawn).spheres.kept
        links = {tuple(sorted((robot.spheres[one].name, robot.spheres[two].name))) for one, two in pairs}
        console.say(f"self-collision: {len(pairs)} pairs of spheres, on {len(links)} pairs of links, can touch")
    else:
        console.say("no collision spheres: nothing is kept clear")
    if robot.covers:
        console.say("")
        print_covers(robot, console)
    for name, values in robot.postures.items():
        console.say(f"posture {name!r}: {', '.join(map(_shown, values))}")
    for link, file in robot.unread:
        console.say(f"note: link {link!r}: its mesh {file} is not read")
    for note in (*robot.notes, *robot.gaps):
        console.say(f"note: {note}")


def print_covers(robot: RobotDescription, console: OutputConsole) -> None:
    """Print the spheres that hold the robot's links, and how far they stick out."""
    coarse = [(cover.link, cover.coarse) for cover in robot.covers]
    fine = [(cover.link, cover.fine) for cover in robot.covers]
    console.print_table("spheres that hold meshes, proven, for searches; how far beyond, mm", _overhangs(coarse))
    console.say("")
    console.print_table("spheres that hold meshes, boxes and cylinders, proven, for proofs", _overhangs(fine))


def _overhangs(covers: Sequence[tuple[str, Cover | None]]) -> Table:
    table = table_of(word("link"), number("spheres"), number("95 % within"), number("all within"), number("volume"))
    known = [(link, cover) for link, cover in covers if cover is not None]
    for link, cover in known:
        overhangs = (f"{1e3 * length:.2f}" for length in (cover.usual_overhang, cover.largest_overhang))
        table.add_row(link, str(len(cover.balls)), *overhangs, f"{cover.volume_ratio:.3f}")
    table.add_row("all", str(sum(len(cover.balls) for _, cover in known)), "", "", "")
    return table


def print_pairs(robot: RobotDescription, console: OutputConsole) -> None:
    """The pairs of links that touch at almost all postures, and how to say that they may."""
    found = touching_links(replace(robot.drawn, cover=OwnContacts(robot, robot.drawn).cover, self_collision=True))
    if not found:
        console.say("no two links that have to keep apart touch at almost every posture")
        return
    console.say("links that touch at almost every posture; if they are meant to, state")
    console.say("disabled_pairs = [" + ", ".join(f'["{one}", "{two}"]' for one, two in found) + "]")


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
    held = largest_holding_torques(robot.drawn)
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
        "List the robots that are built in, show a robot, or the postures in which it reaches a pose.",
        examples=[
            "list",
            "show arm.urdf --tip-link tool0 --figure arm.png",
            "inverse ur5e --position 0.4 0.2 0.3 --quaternion 1 0 0 0",
        ],
    )
    commands = command_line.add_subparsers(dest="command", metavar="COMMAND", parser_class=OneLineParser)
    listing = commands.add_parser("list", help="the robots that are built in; the default")
    shown = commands.add_parser(
        "show",
        help="joints, limits, masses, reach and spheres of a robot",
        examples=["panda", "arm.urdf --tip-link tool0 --figure arm.png"],
    )
    covering = commands.add_parser(
        "spheres",
        help="cover the meshes of a robot with spheres, proven to hold them",
        examples=["arm.urdf --overhang 0.01 -o arm-spheres.toml"],
    )
    asked = commands.add_parser(
        "inverse",
        help="the postures of a robot with its tool at a pose",
        examples=[
            "ur5e --position 0.4 0.2 0.3 --quaternion 1 0 0 0",
            "panda --position 0.5 0 0.4 --clear-of cell.toml",
        ],
    )
    add_inverse(asked)
    for command in (listing, shown, covering, asked):
        add_verbose(command, default=argparse.SUPPRESS)
    files = "a URDF, an MJCF, or the folder of a configuration of MoveIt"
    shown.add_argument("robot", metavar="NAME|FILE.urdf", help=f"{listed(BUILT_IN)}, {files}")
    covering.add_argument("robot", metavar="FILE.urdf", help=files)
    for command in (shown, covering):
        command.add_argument("--base-link", metavar="LINK", help=defaulting("what stands still", "the root"))
        command.add_argument(
            "--tip-link", metavar="LINK", help=defaulting("the end of the chain", "a robot's usual one")
        )
        command.add_argument(
            "--group", metavar="NAME", help=defaulting("the group of a configuration of MoveIt", "its only arm")
        )
        command.add_argument(
            "--limits", metavar="FILE", help=defaulting("limits of joints, a joint_limits.yaml", "those of the robot")
        )
        command.add_argument(
            "--geometry",
            choices=("collision", "visual"),
            help=defaulting("the geometry of the links that must not touch anything", "collision"),
        )
        command.add_argument(
            "--package",
            action="append",
            default=[],
            metavar="NAME=FOLDER",
            help=defaulting(
                "where package://NAME/ is", "what ROS_PACKAGE_PATH and AMENT_PREFIX_PATH say, or above the file"
            ),
        )
        command.add_argument(
            "--xacro-argument",
            action="append",
            default=[],
            metavar="NAME=VALUE",
            help=defaulting("an argument of a file of xacro", "that of the file"),
        )
        command.add_argument(
            "--overhang",
            type=positive_number(0.1),
            metavar="METRES",
            help=defaulting("how far spheres for searches may stick out", "0.02, or 3 %% of a shorter reach"),
        )
        command.add_argument(
            "--fine-overhang",
            type=positive_number(0.1),
            metavar="METRES",
            help=defaulting("how far spheres for proofs may stick out", "0.002"),
        )
    covering.add_argument(
        "-o", "--out", type=path, metavar="FILE", help=defaulting("write the spheres there, as TOML", "nowhere")
    )
    shown.add_argument("--pairs", action="store_true", help="list links that touch at almost every posture")
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
    if options.command == "spheres":
        return spheres(options)
    if options.command == "inverse":
        return inverse(options)
    print_list([(name, built_in(name)) for name in BUILT_IN], OutputConsole())
    return Exit.FEASIBLE


def show(options: argparse.Namespace) -> int:
    """Print a robot, and draw it if that is wished; returns the exit status: 1 if obstacles are refused for it."""
    if options.figure is not None:
        check_figure(options.figure)
    try:
        description = described(options)
        print_robot(description, OutputConsole())
        if options.pairs:
            print_pairs(description, OutputConsole())
    except InvalidProblem as error:
        raise ScenarioError(f"{options.robot}: {error}") from error
    reason = refusal(description)
    if reason is not None:
        OutputConsole().say(f"a plan among obstacles is refused: {reason}")
    if options.figure is not None:
        if not description.spheres and description.reach == 0.0:
            raise ScenarioError(f"{options.robot}: there is nothing to draw: all of it is in one point")
        from tpbso_casadi.figures.space import draw_robot  # noqa: PLC0415 (matplotlib is slow to load)

        with writing(options.figure.parent):
            draw_robot(options.figure, description)
    return Exit.FEASIBLE if reason is None else Exit.INFEASIBLE


def refusal(description: RobotDescription) -> str | None:
    """The reason why no plan among obstacles is made for the robot as it is; None where there is none."""
    try:
        check_bodies(complete_arm(description, description.drawn))
    except InvalidProblem as error:
        return error.reason
    return None


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
    table = robot_table(options)
    description = table.description()
    if options.spheres is None:
        return description if table.urdf is None else with_covers(description, table, options)
    try:
        return description.with_spheres(read_spheres(read_text(options.spheres), description.links))
    except InvalidProblem as error:
        raise ScenarioError(f"{options.spheres}: {error}") from error


def robot_table(options: argparse.Namespace) -> SpatialRobotSection:
    """The table of the robot of the options, with the texts of its files.

    Raises:
        ScenarioError: it cannot be, or a file cannot be read.
    """
    keys = {key: getattr(options, key) for key in ("base_link", "tip_link", "group", "limits", "geometry")}
    stated = {key: value for key, value in keys.items() if value is not None}
    stated |= {"packages": pairs_of("--package", options.package, "FOLDER")}
    stated |= {"xacro_arguments": pairs_of("--xacro-argument", options.xacro_argument, "VALUE")}
    return read_table(SpatialRobotSection, "robot", robot_key(options.robot) | stated).with_texts(FOLDER)


def with_covers(
    description: RobotDescription, table: SpatialRobotSection, options: argparse.Namespace
) -> RobotDescription:
    """A robot with covers of its links; without, and a note that says why, where a mesh is not read."""
    try:
        covers, notes = description.new_covers(table.meshes(FOLDER), *overhangs(options))
    except InvalidProblem as error:
        return replace(description, notes=(*description.notes, error.reason))
    more = (f"link {note.link!r}: mesh {note.file} {note.note}" for note in notes)
    return replace(description.with_covers(covers), notes=(*description.notes, *more))


def overhangs(options: argparse.Namespace) -> tuple[float | None, float | None]:
    """How far spheres for searches and for proofs may stick out, m."""
    return options.overhang, options.fine_overhang


def pairs_of(option: str, stated: Sequence[str], value: str) -> dict[str, str]:
    """Split the words NAME=VALUE of an option that may be repeated.

    Args:
        option: its name.
        stated: what follows it, each time.
        value: what it states of a name, in a word.

    Raises:
        ScenarioError: one is not stated as NAME=VALUE.
    """
    pairs = [each.partition("=") for each in stated]
    wrong = next((each for each, pair in zip(stated, pairs, strict=True) if not all(pair)), None)
    if wrong is not None:
        raise ScenarioError(f"{option} {wrong}: NAME={value} is needed")
    return {name: meant for name, _, meant in pairs}


def spheres(options: argparse.Namespace) -> int:
    """Cover a robot's links, and write the spheres if that is wished; returns the exit status."""
    if options.out is not None:
        check_file(options.out)
        check_writable(options.out.parent)
    try:
        table = robot_table(options)
        description = table.description()
        covers, _ = description.new_covers(table.meshes(FOLDER), *overhangs(options))
        description = description.with_covers(covers)
    except InvalidProblem as error:
        raise ScenarioError(f"{options.robot}: {error}") from error
    if not description.spheres:
        raise ScenarioError(f"{options.robot}: no link has collision geometry")
    console = OutputConsole()
    if description.covers:
        print_covers(description, console)
    if options.out is not None:
        with writing(options.out.parent):
            write_text(options.out, lambda file: file.write(written_spheres(description.balls)))
        console.say(f"{options.out}: {len(description.spheres)} spheres")
    return Exit.FEASIBLE
