"""``python -m tpbso_casadi.retime``: the least time along a given path, and its files and figures."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, get_args

from tpbso_casadi.cli.command import OneLineParser, command_parser, named, run_command
from tpbso_casadi.cli.commands.solve import written
from tpbso_casadi.cli.options import defaulting, listed, not_negative, path, problem_group
from tpbso_casadi.cli.output import Output, add_output_options, free_folder
from tpbso_casadi.scenario import (
    InputFolder,
    Interpolation,
    Scenario,
    ScenarioError,
    is_folder,
    parse_scenario,
    read_joint_rows,
    read_toml,
)
from tpbso_casadi.storage import path_table, read_run

ROBOT_TABLES = ("unit", "arm", "robot", "obstacles", "model")  # of the file that states the robot
SPEEDS = ("start_speed", "goal_speed")
MODEL_KEYS = ("limits", "margin", "self_collision")  # of [model], that say something of any motion


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(
        parser(), retime, arguments, interrupted="interrupted before there was a motion; nothing was written"
    )


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "retime",
        "Run a path in joint space as fast as a robot's limits allow: speed, acceleration and, where it has them, "
        "jerk and torque; proven for all t.",
        examples=[
            "waypoints.csv --robot arm.toml --out runs/fast",
            "waypoints.csv --robot arm.toml --blend 0.05",
            "runs/first --export csv --no-plots --out runs/faster",
        ],
    )
    command_line.add_argument(
        "path",
        metavar="PATH.csv|RUN_FOLDER",
        help="waypoints or a recording with the header q1..qk or t,q1..qk; or a run folder, for its motion's path",
    )
    problem = problem_group(command_line)
    problem.add_argument(
        "--robot",
        type=path,
        metavar="FILE",
        help="TOML file with an [arm] or a [robot] table; its [[obstacles]] and the margin in [model] are judged too "
        "[default: a run's own]",
    )
    problem.add_argument(
        "--payload",
        type=not_negative,
        metavar="KG",
        help=defaulting("what the tool carries, a mass at its own origin; 0 for none", "the robot's"),
    )
    problem.add_argument(
        "--interpolation",
        choices=get_args(Interpolation),
        metavar="KIND",
        help=defaulting(f"of waypoints: {listed(get_args(Interpolation))}", "spline, or blend with --blend"),
    )
    problem.add_argument(
        "--blend",
        type=not_negative,
        metavar="TOL",
        help=defaulting("straight lines, their corners rounded by at most TOL, in the unit of the robot", "none"),
    )
    problem.add_argument(
        "--start-speed",
        type=not_negative,
        metavar="V",
        help=defaulting("|dq/dt| along the path at its start, in the unit of the robot per s", "0, or the run's"),
    )
    problem.add_argument(
        "--goal-speed", type=not_negative, metavar="V", help=defaulting("the same at its end", "0, or the run's")
    )
    add_output_options(command_line, "runs/PATH-retimed, none with --json")
    return command_line


def retime(options: argparse.Namespace) -> int:
    """Time the path of the options, write and print the motion; returns the exit status."""
    folder = Path(options.path)
    scenario = of_run(folder, options) if is_folder(options.path) else of_file(folder, options)
    name = f"{folder.resolve().stem}-retimed"
    output = Output.of(options, partial(free_folder, name, scenario), title=name)
    output.check()
    with named(options.path):
        return written(scenario, None, output, options)


def of_file(path: Path, options: argparse.Namespace) -> Scenario:
    """The scenario of a CSV file and a robot."""
    if options.robot is None:
        raise ScenarioError(f"{path}: says nothing of a robot; say --robot ARM.toml")
    rows = read_joint_rows(InputFolder(path.parent, outside_allowed=True), path.name)
    interpolation = options.interpolation or ("spline" if options.blend is None else "blend")
    given = {"kind": "joint-path", "joints": rows, "interpolation": interpolation, "tolerance": options.blend}
    return _parsed(_surroundings(options.robot), given, options, options.robot)


def of_run(folder: Path, options: argparse.Namespace) -> Scenario:
    """The scenario of a run's path, with its own robot and obstacles unless others are stated."""
    for option in ("interpolation", "blend"):
        if getattr(options, option) is not None:
            raise ScenarioError(f"--{option}: {folder} is a run, whose path is complete")
    run = read_run(folder)
    with named(folder):
        given = path_table(run)
    if options.robot is not None:
        at_rest = {key: value for key, value in given.items() if key not in SPEEDS}
        return _parsed(_surroundings(options.robot), at_rest, options, options.robot)
    content = run.scenario.model_dump()
    return _parsed({key: content[key] for key in ROBOT_TABLES}, given, options)


def _surroundings(file: Path) -> dict[str, Any]:
    """The tables of a file that state a robot and what is around it; a task and a solver in it are none of ours."""
    content = read_toml(file)
    return {key: content[key] for key in ROBOT_TABLES if key in content}


def _carrying(surroundings: dict[str, Any], mass: float | None) -> dict[str, Any]:
    """The same with another payload, kg, if one is stated."""
    tables = [table for table in ("arm", "robot") if mass is not None and isinstance(surroundings.get(table), dict)]
    return surroundings | {table: _loaded(surroundings[table], mass) for table in tables}


def _loaded(table: dict[str, Any], mass: float | None) -> dict[str, Any]:
    """A robot's table with a payload, kg; it is one of the settings where the robot has those."""
    if isinstance(table.get("settings"), dict):
        return table | {"settings": _loaded(table["settings"], mass)}
    unloaded = {key: value for key, value in table.items() if key != "payload"}
    return unloaded | ({"payload": {"mass": mass}} if mass else {})


def _parsed(
    surroundings: dict[str, Any], given: dict[str, Any], options: argparse.Namespace, file: Path | None = None
) -> Scenario:
    speeds = {key: getattr(options, key) for key in SPEEDS}
    task = given | {key: value for key, value in speeds.items() if value is not None}
    content = {**_carrying(surroundings, options.payload), "task": task}
    model = content.get("model")
    if isinstance(model, dict):
        content["model"] = {key: model[key] for key in MODEL_KEYS if key in model}
    if file is None:
        return parse_scenario(content)
    with named(file):
        return parse_scenario(content, InputFolder(file.parent, outside_allowed=True))
