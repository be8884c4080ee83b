"""Robots in the terminal: joints, limits, masses, spheres."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from problems.robots.spatial.chain import ChainJoint
from problems.robots.spatial.collision.sphere import Sphere
from problems.robots.spatial.description import RobotDescription
from problems.robots.spatial.holding import POSTURES, most_held
from tpbso_casadi.cli.display.console import OutputConsole, number, table_of, word

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
        pairs = robot.self_pairs(robot.drawn)
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
