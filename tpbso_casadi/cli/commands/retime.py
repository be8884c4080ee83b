"""``tpbso retime``: the least time along a given path, and its files and figures."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import get_args

from tpbso_casadi.cli.command import OneLineParser, command_parser, run_command
from tpbso_casadi.cli.commands.solve import written
from tpbso_casadi.cli.options import (
    add_payload,
    add_robot,
    add_row_file,
    add_row_interpolation,
    defaulting,
    not_negative,
    problem_group,
    row_keys,
)
from tpbso_casadi.cli.output import Output, add_output_options, free_folder
from tpbso_casadi.facade.retiming import retimed_scenario
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import Interpolation, Scenario, ScenarioError, is_folder, named

TOLERANCES = ("blend", "fit")  # kinds of interpolation with a tolerance, which an option of their name states


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
        metavar="PATH|RUN_FOLDER",
        help="waypoints or a recording with the header q1..qk or t,q1..qk, or what --columns says; a file of another "
        "kind that certify reads; or a run folder, for its motion's path",
    )
    problem = problem_group(command_line)
    add_robot(problem, "a run's own")
    add_payload(problem)
    add_row_interpolation(problem, get_args(Interpolation), "spline; blend with --blend, fit with --fit")
    problem.add_argument(
        "--blend",
        type=not_negative,
        metavar="TOL",
        help=defaulting("straight lines, their corners rounded by at most TOL, in the unit of the robot", "none"),
    )
    problem.add_argument(
        "--fit",
        type=not_negative,
        metavar="TOL",
        help=defaulting(
            "for recordings: a smooth path within TOL of the lines between all rows, noise evened out, in the unit of "
            "the robot",
            "none",
        ),
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
    add_row_file(problem, clock=False)
    add_output_options(command_line, "runs/PATH-retimed, none with --json")
    return command_line


def retime(options: argparse.Namespace) -> int:
    """Time the path of the options, write and print the motion; returns the exit status."""
    folder = Path(options.path)
    scenario = stated(folder, options)
    name = f"{folder.resolve().stem}-retimed"
    output = Output.of(options, partial(free_folder, name, scenario), title=name)
    output.check()
    with named(options.path):
        return written(scenario, plan, output, options)


def stated(path: Path, options: argparse.Namespace) -> Scenario:
    """The scenario of a run's path, with its own robot and obstacles unless others are stated, or of a CSV file."""
    interpolation, is_run = options.interpolation, is_folder(options.path)
    if is_run:
        for option in ("interpolation", *TOLERANCES, *row_keys(options)):
            if getattr(options, option, None) is not None:
                raise ScenarioError(f"--{option}: {path} is a run, whose path is complete")
    elif options.robot is None:
        raise ScenarioError(f"{path}: says nothing of a robot; say --robot ARM.toml")
    else:
        stated = [kind for kind in TOLERANCES if getattr(options, kind) is not None]
        if len(stated) > 1:
            raise ScenarioError("--fit: a path is fitted or blended, not both")
        interpolation = interpolation or (stated[0] if stated else "spline")
    tolerance = next((value for kind in TOLERANCES if (value := getattr(options, kind)) is not None), None)
    speeds = {key: getattr(options, key) for key in ("start_speed", "goal_speed")}
    task = {"interpolation": interpolation, "tolerance": tolerance, **speeds, **row_keys(options)}
    return retimed_scenario(path, options.robot, task, payload=options.payload)
