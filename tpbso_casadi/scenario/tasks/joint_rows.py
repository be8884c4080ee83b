"""Joint angles in a CSV file: waypoints, or a recording."""

from __future__ import annotations

import math
import re

from tpbso_casadi.scenario.csv_rows import numbers_of
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import MOST_LINKS, ScenarioError

MOST_ROWS = 3_000  # of a path; its timing takes a minute
JOINT = re.compile(r"q[1-9][0-9]*")
HEADER = "the header q1,q2,... or t,q1,q2,... is needed"
POSES = ("xy", "xyz", ("x", "y", "z", "qx", "qy", "qz", "qw"))  # of the tool, in a table of a run
LARGEST_ANGLE = 1e6  # rad or degrees


def read_joint_rows(folder: InputFolder, name: str) -> list[list[float]]:
    """The rows of a file with the header ``q1..qk``, or ``t,q1..qk`` with increasing times, which are not used.

    The table of a run, ``trajectory.csv``, is read too. In a recording with times, rows in which nothing has moved are
    left out. Empty lines are skipped.

    Raises:
        ScenarioError: naming the file, the line and what is wrong with it.
    """
    lines = [(n, line) for n, line in enumerate(folder.read_text(name).splitlines(), start=1) if line.strip()]
    place = f"{folder.path / name}"
    if not lines:
        raise ScenarioError(f"{place}: is empty; {HEADER}")
    joints, timed, width = _header(f"{place} line {lines[0][0]}", lines[0][1])
    rows: list[list[float]] = []
    last = -math.inf
    for number, line in lines[1:]:
        time, angles = _row(f"{place} line {number}", line, joints, timed, width)
        if timed and not time > last:
            raise ScenarioError(f"{place} line {number}: times have to increase")
        last = time
        if rows and rows[-1] == angles:
            if timed:
                continue
            raise ScenarioError(f"{place} line {number}: the same joint angles as in the line before")
        if len(rows) == MOST_ROWS:
            raise ScenarioError(f"{place} line {number}: more than {MOST_ROWS} rows")
        rows.append(angles)
    if len(rows) < 2:
        raise ScenarioError(f"{place}: {len(rows)} rows of different joint angles; a path needs two at least")
    return rows


def _header(place: str, line: str) -> tuple[int, bool, int]:
    """The number of joints, whether there are times, and the number of columns."""
    names = [cell.strip() for cell in line.split(",")]
    timed = names[0] == "t"
    joints = sum(1 for name in names if JOINT.fullmatch(name))
    expected = ["t"] * timed + [f"q{joint}" for joint in range(1, joints + 1)]
    rates = [f"{symbol}{joint}" for symbol in ("qd", "qdd") for joint in range(1, joints + 1)]
    torques = [f"tau{joint}" for joint in range(1, joints + 1)]
    own = [[*expected, *rates, *pose] for pose in POSES]
    tables = [expected, *own, *([*table, *torques] for table in own)]
    if not 1 <= joints <= MOST_LINKS or names not in tables:
        raise ScenarioError(f"{place}: {HEADER}")
    return joints, timed, len(names)


def _row(place: str, line: str, joints: int, timed: bool, width: int) -> tuple[float, list[float]]:
    numbers = numbers_of(place, line, width)
    angles = numbers[timed : timed + joints]
    if not all(abs(number) <= LARGEST_ANGLE for number in angles) or not math.isfinite(numbers[0]):
        raise ScenarioError(f"{place}: a number is not finite, or an angle larger than {LARGEST_ANGLE:g}")
    return numbers[0], angles
