"""What the command lines on problem files share."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path

from benchmarks.motion_bench_maker.motors import Payload
from benchmarks.motion_bench_maker.problem_file import InvalidFile, MotionProblem, chosen, read_problems
from benchmarks.motion_bench_maker.records import Record
from benchmarks.motion_bench_maker.setting import Setting


def add_problem_options(parser: argparse.ArgumentParser, folder: Path) -> None:
    """Robot, limits, which problems, and where the answers go."""
    parser.add_argument("--robot-urdf", type=Path, metavar="URDF", help="of the robot")
    parser.add_argument("--spheres", type=Path, metavar="TOML", help="the robot's collision spheres")
    for option, letter, unit in (("acceleration", "A", "rad/s^2"), ("jerk", "J", "rad/s^3")):
        words = f"{unit}, one or one a joint, with commas; the data sheet's by default"
        parser.add_argument(f"--max-{option}", type=_numbers, metavar=letter, help=words)
    parser.add_argument("--tip", help="link that carries the payload, and whose pose may be the goal")
    words = "of what the tool carries, and its centre of mass in the tool's frame, m; none by default"
    parser.add_argument("--payload", metavar="KG[,X,Y,Z]", help=words)
    words = "keep the motors' efforts, where the URDF states them and masses; by default it does"
    parser.add_argument("--torque", action=argparse.BooleanOptionalAction, default=True, help=words)
    parser.add_argument("--first", type=int, metavar="N", help="only the first N of each class")
    parser.add_argument("--only", metavar="TEXT", help="only problems with this in their name")
    parser.add_argument(
        "--out", type=Path, default=folder, metavar="DIR", help=f"of the answers; {folder} by default; resumes"
    )


def setting_of(options: argparse.Namespace) -> Setting:
    """Robot and limits as stated.

    Raises:
        InvalidFile: a file or a limit that cannot be used.
    """
    for option, file in (("--robot-urdf", options.robot_urdf), ("--spheres", options.spheres)):
        if file is None:
            raise InvalidFile(f"{option}: is needed")
    if options.payload is not None and not options.torque:
        raise InvalidFile("--payload: means nothing where torques are not kept")
    setting = Setting(
        options.robot_urdf,
        options.spheres,
        options.max_acceleration,
        options.max_jerk,
        tip=options.tip,
        payload=None if options.payload is None else payload_of(options.payload),
        keeps_torques=options.torque,
    )
    _ = setting.spheres, setting.limits, setting.motors
    return setting


def payload_of(text: str) -> Payload:
    """A mass, kg, and, with commas, its centre, m.

    Raises:
        InvalidFile: it is none.
    """
    try:
        mass, *center = _numbers(text)
    except ValueError:
        mass, center = 0.0, []
    if not (0.0 < mass < math.inf and len(center) in (0, 3) and all(map(math.isfinite, center))):
        raise InvalidFile(f"--payload: {text!r} is not a positive mass, or one and three coordinates")
    return Payload(mass, (center[0], center[1], center[2])) if center else Payload(mass)


def problems_of(options: argparse.Namespace, file: Path) -> list[MotionProblem]:
    """The problems as stated.

    Raises:
        InvalidFile: the file cannot be used.
    """
    return chosen(read_problems(file), options.first, options.only)


def tell(record: Record) -> None:
    """One line of progress on standard error."""
    found = record.error
    if record.duration is not None:
        found = f"{record.duration:.3f} s, {record.duration / record.bound:.3f} of the bound"
    words = f"{record.problem} {record.planner} {record.seed}: {found} ({record.seconds:.1f} s)"
    print(words, file=sys.stderr, flush=True)


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(float(part) for part in text.split(","))
