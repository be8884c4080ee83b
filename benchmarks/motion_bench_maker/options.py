"""What the command lines on problem files share."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

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
    setting = Setting(options.robot_urdf, options.spheres, options.max_acceleration, options.max_jerk)
    _ = setting.spheres, setting.limits
    return setting


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
