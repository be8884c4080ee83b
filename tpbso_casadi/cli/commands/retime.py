"""``python -m tpbso_casadi.retime``: the least time along a given path, and its files and figures."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, get_args

from problems.evaluation import InvalidEvaluation
from tpbso_casadi.cli.commands.solve import written
from tpbso_casadi.cli.common import Exit, OneLineParser, not_negative, path, print_error
from tpbso_casadi.cli.output import Output, add_output_options
from tpbso_casadi.cli.run_name import free_folder
from tpbso_casadi.scenario.input_files import InputFolder, is_folder, read_toml
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.tasks.joint_path import Interpolation
from tpbso_casadi.scenario.tasks.joint_rows import read_joint_rows
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.storage.stored_run import InvalidRun, path_of, read_run

ROBOT_TABLES = ("unit", "arm", "robot", "obstacles", "model")  # of the file that states the robot
MODEL_KEYS = ("limits", "margin", "self_collision")  # of [model], that say something of any motion


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    options = parser().parse_args(arguments)
    try:
        return retime(options)
    except (ScenarioError, OutputError, InvalidRun, InvalidEvaluation) as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error("interrupted before there was a motion; nothing was written")
        return Exit.INTERRUPTED


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser(
        "python -m tpbso_casadi.retime",
        description="Run a path in joint space as fast as a robot's limits allow: speed, acceleration and, where it "
        "has them, jerk and torque; proven for all t.",
    )
    command_line.add_argument(
        "path",
        metavar="PATH.csv|RUN_FOLDER",
        help="waypoints or a recording with the header q1..qk or t,q1..qk; or a run folder, for its motion's path",
    )
    command_line.add_argument(
        "--robot",
        type=path,
        metavar="ARM.toml",
        help="a file with an [arm] or a [robot] table; its [[obstacles]] and the margin in [model] are judged too. "
        "A run folder has its own",
    )
    command_line.add_argument(
        "--payload",
        type=not_negative,
        metavar="KG",
        help="what the tool carries, a mass at its own origin, in place of what the robot's table says; 0 for none",
    )
    given = command_line.add_argument_group("the path, in the unit of ARM.toml")
    given.add_argument("--interpolation", choices=get_args(Interpolation), help="of waypoints; spline by default")
    given.add_argument(
        "--blend", type=not_negative, metavar="TOL", help="straight lines, their corners rounded by at most TOL rad"
    )
    given.add_argument(
        "--start-speed",
        type=not_negative,
        metavar="V",
        help="|dq/dt| along the path at its start, rad/s; 0 if none",
    )
    given.add_argument("--goal-speed", type=not_negative, metavar="V", help="at its end")
    add_output_options(command_line, "runs/PATH-retimed")
    return command_line


def retime(options: argparse.Namespace) -> int:
    """Time the path of the options, write and print the motion; returns the exit status."""
    folder = Path(options.path)
    scenario = of_run(folder, options) if is_folder(options.path) else of_file(folder, options)
    name = f"{folder.resolve().stem}-retimed"
    output = Output.of(options, partial(free_folder, name, scenario), title=name)
    output.check()
    try:
        return written(scenario, None, output, options)
    except ScenarioError as error:
        raise ScenarioError(f"{options.path}: {error}") from error


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
    given_path, (start, goal) = path_of(run), run.motion.criteria.task.end_velocities
    if run.motion.criteria.task.end_accelerations.any():
        raise ScenarioError(f"{folder}: leaves with an acceleration, which the timing of a path does not keep")
    given = {
        "kind": "joint-path",
        "shape": "pieces",
        "breakpoints": given_path.breakpoints.tolist(),
        "coefficients": given_path.coefficients.tolist(),
    }
    if options.robot is not None:
        return _parsed(_surroundings(options.robot), given, options, options.robot)
    speeds = {"start_speed": float((start @ start) ** 0.5), "goal_speed": float((goal @ goal) ** 0.5)}
    content = run.scenario.model_dump()
    return _parsed({key: content[key] for key in ROBOT_TABLES}, given | speeds, options)


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
    speeds = {key: getattr(options, key) for key in ("start_speed", "goal_speed")}
    task = given | {key: value for key, value in speeds.items() if value is not None}
    content = {**_carrying(surroundings, options.payload), "task": task}
    model = content.get("model")
    if isinstance(model, dict):
        content["model"] = {key: model[key] for key in MODEL_KEYS if key in model}
    try:
        return parse_scenario(content, None if file is None else InputFolder(file.parent, outside_allowed=True))
    except ScenarioError as error:
        raise ScenarioError(str(error) if file is None else f"{file}: {error}") from error
