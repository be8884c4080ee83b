"""``tpbso certify``: trajectories of any program, judged for all t."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import get_args

from rich.text import Text

from problems import CertificateStatus
from problems.base import in_words
from problems.motions import RowInterpolation
from tpbso_casadi.cli.command import Exit, OneLineParser, command_parser, run_command
from tpbso_casadi.cli.commands.solve import written
from tpbso_casadi.cli.options import (
    add_payload,
    add_robot,
    add_row_file,
    add_row_interpolation,
    defaulting,
    figure_formats,
    machine_group,
    not_negative,
    path,
    positive_int,
    problem_group,
    row_keys,
)
from tpbso_casadi.cli.output import Output, add_output_options, free_folder
from tpbso_casadi.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.facade.certifying import certified_scenario, surrounding_scenario
from tpbso_casadi.facade.certifying_many import TABLE, Certificate, CertificateTable, Statement, trajectory_files
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.repairing import ACCURACY, repair
from tpbso_casadi.facade.surroundings import given_keys
from tpbso_casadi.plain import as_json
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import READERS, Scenario, ScenarioError, is_folder, named
from tpbso_casadi.storage import OutputError, check_run_folder

LISTED = 40  # certificates on the terminal, those that are not proven first
NOTES = 5  # that are said below them, the most frequent first


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    return run_command(
        parser(), certify, arguments, interrupted="interrupted before the motion was judged; nothing was written"
    )


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "certify",
        "Judge a trajectory that any program made, for all t: every limit of the robot, clearance, own links, "
        "constraints, rest at both ends; each is proven, violated or undecided. Exit status 0: all proven; 1: not; "
        "2: bad input.",
        examples=[
            "plan.yaml --robot panda --scene cell.toml",
            "log.csv --robot ur5e --columns 'clock=t,axis*_deg=q*' --unit deg --time-unit ms",
            "runs/first --payload 2.0 --no-plots --out runs/with-payload",
        ],
    )
    command_line.add_argument(
        "trajectory",
        type=path,
        metavar="TRAJECTORY|RUN_FOLDER|FOLDER",
        help="rows as CSV (t,q1..qk,qd1..,qdd1.., t and the names of joints, or what --columns says) or NPZ; a "
        "JointTrajectory, RobotTrajectory or DisplayTrajectory of ROS as YAML, JSON or in an MCAP bag (extra mcap), or "
        "the JointStates in one; a run folder; or a folder of such files",
    )
    problem = problem_group(command_line)
    add_robot(problem, "the scene's, or the run's own")
    problem.add_argument(
        "--scene",
        type=path,
        metavar="FILE",
        help=defaulting(
            "TOML file with what is around the robot: [[obstacles]], [[carried]], may_touch, [[constraints]], margin "
            "in [model], each in the place of what the robot's file says of it; or a .scene file of MoveIt",
            "none",
        ),
    )
    joined = (
        "auto, as ROS's joint trajectory controller does: linear between positions alone, cubic with velocities, "
        "quintic with accelerations too"
    )
    add_row_interpolation(problem, get_args(RowInterpolation), joined)
    add_payload(problem)
    problem.add_argument(
        "--without",
        action="append",
        default=[],
        metavar="LIMIT",
        help=defaulting(
            "a limit by which it is not judged, such as jerk or 'self clearance'; what was left out stands beside the "
            "status; repeatable",
            "none",
        ),
    )
    add_row_file(problem)
    problem.add_argument(
        "--repair",
        action="store_true",
        help="where it is not proven: run slower by the least factor, or its path timed anew, whichever is shorter and "
        "proven, as a run of its own beside the other, DIR-repaired; else what would have to move; exit status 0 then "
        "means that one of both is proven",
    )
    problem.add_argument(
        "--accuracy",
        type=not_negative,
        default=ACCURACY,
        metavar="TOL",
        help=defaulting("of --repair: how far a smooth path may be from lines between rows, rad", ACCURACY),
    )
    machine_group(command_line).add_argument(
        "--processes",
        type=positive_int,
        default=1,
        metavar="N",
        help=defaulting("that share the trajectories of a folder", 1),
    )
    add_output_options(command_line, "runs/TRAJECTORY-certified, none with --json")
    return command_line


def certify(options: argparse.Namespace) -> int:
    """Judge the trajectory of the options, write and print the verdicts; returns the exit status."""
    trajectory: Path = options.trajectory
    if is_folder(trajectory) and not (trajectory / "result.json").exists():
        return judge_folder(trajectory, options)
    scenario = stated(trajectory, options)
    name = f"{trajectory.resolve().stem}-certified"
    output = Output.of(options, partial(free_folder, name, scenario), title=name)
    output.check()
    if options.repair:
        if output.folder is None:
            raise OutputError("--repair: needs a run folder; say --out DIR too")
        check_run_folder(beside(output.folder()))
    with named(options.trajectory):
        status = written(scenario, plan, output, options)
        if options.repair and output.folder is not None and status == Exit.INFEASIBLE:
            return repaired(scenario, beside(output.folder()), options)
        return status


def beside(folder: Path) -> Path:
    """The folder of the repaired motion of a run folder."""
    return folder.with_name(f"{folder.name}-repaired")


def repaired(scenario: Scenario, place: Path, options: argparse.Namespace) -> int:
    """Repair a motion that is not proven, write and say what came of it; returns the exit status."""
    found = repair(Plan(plan(scenario)), options.accuracy)
    console = OutputConsole(stderr=True, quiet=options.quiet)
    for line in found.words:
        console.say(line)
    if found.plan is None:
        return Exit.INFEASIBLE
    console.say(f"written to {found.plan.save(place, figures=figure_formats(options))}")
    if options.certificate is not None:
        console.say(f"certificate of the repaired motion: {found.plan.certificate(options.certificate)}")
    return Exit.FEASIBLE


def stated(trajectory: Path, options: argparse.Namespace) -> Scenario:
    """The scenario of a motion with the robot and the surroundings of the options."""
    if options.robot is None and options.scene is None and not is_folder(trajectory):
        raise ScenarioError(f"{trajectory}: says nothing of a robot; say --robot panda, ARM.toml or ARM.urdf")
    task = {
        "interpolation": options.interpolation,
        "without": options.without or None,
        **row_keys(options),
    }
    return certified_scenario(trajectory, options.robot, task, scene=options.scene, payload=options.payload)


def judge_folder(folder: Path, options: argparse.Namespace) -> int:
    """Judge all trajectories of a folder, print and write their table; returns the exit status."""
    for option in ("repair", "message", "certificate", "animate", "export"):
        if getattr(options, option):
            raise ScenarioError(f"--{option}: of one trajectory; a folder of them is judged alone")
    if options.robot is None and options.scene is None:
        raise ScenarioError(f"{folder}: says nothing of a robot; say --robot panda, ARM.toml or ARM.urdf")
    place = Path(options.out or Path("runs") / f"{folder.resolve().name}-certified")
    files = [file for file in trajectory_files(folder) if file.resolve() != (place / TABLE).resolve()]
    if not files:
        raise ScenarioError(f"{folder}: holds no result.json, and no {in_words([f'*{ending}' for ending in READERS])}")
    task = given_keys({"interpolation": options.interpolation, "without": options.without or None, **row_keys(options)})
    statement = Statement(surrounding_scenario(options.robot, options.scene, options.payload), task)
    table = CertificateTable(place / TABLE, statement)
    judged = table.judged(files, options.processes)
    if options.json:
        sys.stdout.write(as_json({"certificates": [asdict(each) for each in judged]}))
    elif not options.quiet:
        console = OutputConsole()
        print_certificates(judged, console)
        console.say(f"written to {table.path}")
    proven = all(each.status == CertificateStatus.CERTIFIED for each in judged)
    return Exit.FEASIBLE if proven else Exit.INFEASIBLE


def print_certificates(certificates: Sequence[Certificate], console: OutputConsole) -> None:
    """How many there are of each, and those that are not proven first."""
    table = table_of(word("file"), number("T, s"), number("ms"), word(""), prose("what is not proven"))
    proven_last = sorted(certificates, key=lambda each: (not (each.broken or each.reason), each.file))
    for each in proven_last[:LISTED]:
        times = ["" if value is None else f"{value:.4g}" for value in (each.duration, _milliseconds(each))]
        table.add_row(Text(each.file), *times, Text(each.in_words), Text(each.worst or each.reason))
    counts = Counter(each.in_words for each in certificates)
    console.print_table(", ".join(f"{count} {status}" for status, count in counts.most_common()), table)
    if len(certificates) > LISTED:
        console.say(f"and {len(certificates) - LISTED} more in the table")
    noted = Counter(note for each in certificates for note in each.notes.split("; ") if note)
    for note, count in noted.most_common(NOTES):
        console.say(f"{count} of {len(certificates)}: {note}")


def _milliseconds(certificate: Certificate) -> float | None:
    return None if certificate.seconds is None else 1e3 * certificate.seconds
