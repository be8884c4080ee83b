"""``tpbso tracking``: the least tracking error that bounds logs of a robot, as a line of TOML."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from problems.base import InvalidProblem, rounded_up
from problems.robots import TrackingError, least_tracking_error
from tpbso_casadi.cli.command import OneLineParser, command_parser, run_command
from tpbso_casadi.cli.options import add_row_file, path, positive_number, row_keys
from tpbso_casadi.scenario import InputFolder, ScenarioError, TrackingLog, read_tracking_log, reading_of

LEAST = 1e-12  # rad, m, s or s^2: no robot follows as closely
DIGITS = 4  # of what is printed, rounded up


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(parser(), fit, arguments, interrupted="interrupted; nothing was written")


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "tracking",
        "The least tracking_error that bounds how far joints were from where they were commanded, as a line for the "
        "[robot] table.",
        examples=[
            "log.csv",
            "monday.csv tuesday.csv --margin 1.2",
            "log.csv --columns 'clock=t,ref_*=q*,pos_*=m*' --unit deg",
        ],
    )
    command_line.add_argument(
        "logs",
        nargs="+",
        type=path,
        metavar="LOG",
        help="CSV with the header t,q1..qk,m1..mk: commanded, then measured; a recording of a UR with target_q and "
        "actual_q; what --columns says; or an MCAP bag with the states of a joint trajectory controller (extra mcap)",
    )
    add_row_file(command_line, messages=False, start=False)
    command_line.add_argument(
        "--margin",
        type=positive_number(100.0),
        default=1.0,
        metavar="X",
        help="multiply the bound by X: what comes is not all in a log",
    )
    command_line.add_argument(
        "--constant", action="store_true", help="a constant of each joint alone, no shares of speed and acceleration"
    )
    return command_line


def fit(options: argparse.Namespace) -> int:
    """Fit the bound, print it; returns the exit status."""
    reading, folder = reading_of(row_keys(options)), InputFolder(Path(), outside_allowed=True)
    logs = [read_tracking_log(folder, str(name), reading, options.unit == "deg") for name in options.logs]
    joints = [log.errors.shape[1] for log in logs]
    for name, count in zip(options.logs, joints, strict=True):
        if count != joints[0]:
            raise ScenarioError(f"{name}: {count} joints, {options.logs[0]} has {joints[0]}")
    log = TrackingLog.joined(logs)
    try:
        found = least_tracking_error(log.errors, log.speed, log.acceleration, options.constant, options.margin)
    except InvalidProblem as error:
        raise ScenarioError(f"{options.logs[0]}: {error.reason}") from error
    used = (np.abs(log.errors) / np.maximum(found.at(log.speed, log.acceleration), np.finfo(float).tiny)).max()
    print(toml_line(found))
    if logs[0].joint_names:
        print(f"# of {', '.join(logs[0].joint_names)}, in this order")
    for note in (note for log in logs for note in log.notes):
        print(f"# {note}")
    most, mean = np.abs(log.errors).max(), np.abs(log.errors).mean()
    print(f"# {len(log.errors)} rows, {joints[0]} joints; largest error {most:.3g}, mean {mean:.3g}")
    print(f"# at most {used:.1%} of the bound is used; its mean is {found.at(log.speed, log.acceleration).mean():.3g}")
    return 0


def toml_line(error: TrackingError) -> str:
    """The key of the [robot] table, numbers rounded up."""
    parts = {part.name: [_up(value) for value in getattr(error, part.name)] for part in fields(error)}
    stated = {name: values[0] if len(set(values)) == 1 else values for name, values in parts.items() if any(values)}
    if set(stated) == {"constant"}:
        return f"tracking_error = {json.dumps(stated['constant'])}"
    return f"tracking_error = {{ {', '.join(f'{name} = {json.dumps(values)}' for name, values in stated.items())} }}"


def _up(value: float) -> float:
    return rounded_up(max(value, LEAST) if value else 0.0, DIGITS)
