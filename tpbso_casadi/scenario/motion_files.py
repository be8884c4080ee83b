"""Motions of other programs as rows: CSV, NPZ, and the messages of ROS as YAML or JSON.

A row is a time and the state of the joints then. Positions have to be there in every row; velocities and accelerations
may be, and say how rows are joined. All is in SI units: s, rad, rad/s, rad/s^2, m where a joint slides.
"""

from __future__ import annotations

import io
import json
import math
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import Any

import numpy as np
import yaml

from problems.base import FloatArray
from tpbso_casadi.plain import one_line
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.validation import MOST_LINKS, ScenarioError, hint, in_words, shown

MOST_MOTION_ROWS = 20_000  # of a motion: a minute at 333 Hz
LARGEST_STATE = 1e9  # of a time, an angle or a rate
LARGEST_ARRAYS = 200_000_000  # bytes of a NPZ's arrays
RATES = ("velocities", "accelerations")
Row = list[float]


@dataclass(frozen=True)
class RecordedRows:
    """Rows as a file has them.

    Attributes:
        times: s.
        positions: of all joints in every row.
        velocities: likewise; an empty row where it states none, no rows at all where none does.
        accelerations: likewise.
        joint_names: of the columns; empty where they are those of the robot, in its order.
        breakpoints: of exact polynomial pieces, where the file has them; s.
        coefficients: of these, (order, pieces, joints), highest power first.
    """

    times: list[float]
    positions: list[Row]
    velocities: list[Row] = field(default_factory=list)
    accelerations: list[Row] = field(default_factory=list)
    joint_names: list[str] = field(default_factory=list)
    breakpoints: list[float] = field(default_factory=list)
    coefficients: list[list[Row]] = field(default_factory=list)


def read_recorded(folder: InputFolder, name: str) -> RecordedRows:
    """The rows of a file, whose ending says what it is.

    Raises:
        ScenarioError: naming the file, the line, row or key, and what is wrong there.
    """
    place, ending = f"{folder.path / name}", PurePath(name).suffix.lower()
    if ending not in READERS:
        known = in_words([f"*{known}" for known in READERS])
        raise ScenarioError(f"{place}: a motion is read from {known}")
    try:
        return READERS[ending](folder, name)
    except BadRow as error:
        raise ScenarioError(f"{place}: {one_line(str(error))}") from error


class BadRow(ValueError):
    """Content that is no motion; the message is one line, without the file."""


TIME_COLUMNS = ("t", "time")
POSITION, VELOCITY, ACCELERATION = "q", "qd", "qdd"
COLUMN = re.compile(r"(qdd|qd|q)([1-9][0-9]{0,3})")
SUFFIXES = {"_velocity": VELOCITY, "_acceleration": ACCELERATION}  # of a joint's name, in the names of columns
IGNORED = re.compile(r"(tau|effort)[1-9][0-9]*|x|y|z|qx|qy|qz|qw")  # columns of a run's table


def _csv(folder: InputFolder, name: str) -> RecordedRows:
    """A table with the header ``t,q1..qk[,qd1..qdk[,qdd1..qddk]]``, or with the names of joints in place of q1..qk."""
    lines = [(n, line) for n, line in enumerate(folder.read_text(name).splitlines(), start=1) if line.strip()]
    if not lines:
        raise BadRow("is empty; the header t,q1,q2,... is needed, or t and the names of joints")
    header = [cell.strip().strip('"') for cell in lines[0][1].split(",")]
    joints, columns = _columns(header, lines[0][0])
    _check_count(len(lines) - 1)
    table = [_cells(line, len(header), number) for number, line in lines[1:]]
    states = {
        symbol: [[row[columns[symbol, joint]] for joint in joints] for row in table]
        for symbol in (POSITION, VELOCITY, ACCELERATION)
        if (symbol, joints[0]) in columns
    }
    own = all(joint.isdigit() for joint in joints)
    return RecordedRows(
        times=[row[0] for row in table],
        positions=states[POSITION],
        velocities=states.get(VELOCITY, []),
        accelerations=states.get(ACCELERATION, []),
        joint_names=[] if own else joints,
    )


def _columns(header: list[str], line: int) -> tuple[list[str], dict[tuple[str, str], int]]:
    """The joints, by name or by number, and the column of each symbol of each."""
    if header[0] not in TIME_COLUMNS or len(header) < 2:
        raise BadRow(f"line {line}: the header t,q1,q2,... is needed, or t and the names of joints")
    found: dict[tuple[str, str], int] = {}
    numbered = COLUMN.fullmatch(header[1]) is not None
    for column, name in enumerate(header[1:], start=1):
        if numbered and IGNORED.fullmatch(name):
            continue
        key = _numbered(name, line) if numbered else _named(name)
        if key in found:
            raise BadRow(f"line {line}: the column {shown(name)} is there twice")
        found[key] = column
    joints = [joint for symbol, joint in found if symbol == POSITION]
    if numbered:
        joints = [str(number) for number in range(1, len(joints) + 1)]
    if len(joints) > MOST_LINKS:
        raise BadRow(f"line {line}: {len(joints)} joints; at most {MOST_LINKS}")
    for symbol in dict.fromkeys(symbol for symbol, _ in found):
        missing = [joint for joint in joints if (symbol, joint) not in found]
        extra = [joint for each, joint in found if each == symbol and joint not in joints]
        if missing or extra:
            what = f"{symbol} of {(missing or extra)[0]}"
            raise BadRow(
                f"line {line}: the columns of all joints are needed; {what} is {'missing' if missing else 'of none'}"
            )
    return joints, found


def _numbered(name: str, line: int) -> tuple[str, str]:
    match = COLUMN.fullmatch(name)
    if match is None:
        raise BadRow(f"line {line}: {shown(name)} is no column of t,q1..qk,qd1..qdk,qdd1..qddk")
    return match[1], match[2]


def _named(name: str) -> tuple[str, str]:
    for suffix, symbol in SUFFIXES.items():
        if name.endswith(suffix):
            return symbol, name.removesuffix(suffix)
    return POSITION, name


def _cells(line: str, width: int, number: int) -> Row:
    cells = line.split(",")
    if len(cells) != width:
        raise BadRow(f"line {number}: {len(cells)} numbers where the header has {width} names")
    try:
        row = [float(cell) for cell in cells]
    except ValueError as error:
        raise BadRow(f"line {number}: {width} numbers are needed") from error
    if not all(abs(value) <= LARGEST_STATE for value in row):
        raise BadRow(f"line {number}: a number is not finite, or larger than {LARGEST_STATE:g}")
    return row


def _check_count(rows: int) -> None:
    if rows < 2:
        raise BadRow(f"{rows} row{'s' * (rows != 1)}; a motion needs two at least")
    if rows > MOST_MOTION_ROWS:
        raise BadRow(f"{rows} rows; at most {MOST_MOTION_ROWS} are judged")


NPZ_NAMES = {"times": ("t", "times"), "positions": ("q", "positions"), "velocities": ("qd", "velocities"),
             "accelerations": ("qdd", "accelerations")}  # fmt: skip
PIECES = ("breakpoints", "coefficients")


def _npz(folder: InputFolder, name: str) -> RecordedRows:
    """Arrays ``t`` (n,), ``q`` (n, k), ``qd`` and ``qdd`` where there are; pieces and ``joint_names`` too."""
    arrays = _arrays(folder.read_bytes(name))
    found = {key: next((arrays[each] for each in names if each in arrays), None) for key, names in NPZ_NAMES.items()}
    for key in ("times", "positions"):
        if found[key] is None:
            raise BadRow(f"has no array {' or '.join(map(repr, NPZ_NAMES[key]))}")
    rows = {key: _numbers_of(key, array) for key, array in found.items() if array is not None}
    _check_count(len(rows["times"]))
    pieces = {key: _numbers_of(key, arrays[key]) for key in PIECES} if all(key in arrays for key in PIECES) else {}
    named = arrays.get("joint_names")
    if named is not None and (named.ndim != 1 or named.dtype.kind != "U"):
        raise BadRow("joint_names: a list of words is needed")
    return RecordedRows(**rows, **pieces, joint_names=[] if named is None else [str(each) for each in named])


def _numbers_of(key: str, array: Any) -> list[Any]:
    dimensions = {"times": 1, "breakpoints": 1, "coefficients": 3}.get(key, 2)
    if array.dtype.kind not in "fiu" or array.ndim != dimensions:
        raise BadRow(
            f"{key}: an array of numbers of {dimensions} dimensions is needed, not {array.dtype} {array.shape}"
        )
    if not (np.abs(array.astype(np.float64)) <= (np.inf if key == "coefficients" else LARGEST_STATE)).all():
        raise BadRow(f"{key}: a number is not finite, or larger than {LARGEST_STATE:g}")
    return list(array.astype(np.float64).tolist())


NO_ARRAYS = (
    ValueError,
    OSError,
    KeyError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    RuntimeError,
    MemoryError,
)  # what NumPy raises of files that are none; an encrypted one is a RuntimeError


def _arrays(content: bytes) -> dict[str, Any]:
    """The arrays of a NPZ, without anything that could run code."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > LARGEST_ARRAYS:
            raise BadRow(f"its arrays are larger than {LARGEST_ARRAYS / 1e6:g} MB")
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            found = {name: arrays[name] for name in arrays.files}
        if not all(isinstance(each, np.ndarray) for each in found.values()):
            raise BadRow("is no NPZ of arrays of numbers")
        return found
    except BadRow:
        raise
    except NO_ARRAYS as error:
        raise BadRow(f"is no NPZ of arrays of numbers: {error}") from error


class _SafeLoader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """Plain data alone; no merge keys, which a short text can make endless."""

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        if any(key.tag == "tag:yaml.org,2002:merge" for key, _ in node.value):
            raise yaml.constructor.ConstructorError(None, None, "merge keys (<<) are not read", node.start_mark)


def _yaml(folder: InputFolder, name: str) -> RecordedRows:
    text = folder.read_text(name)
    try:
        documents = [each for each in yaml.load_all(text, Loader=_SafeLoader) if each is not None]
    except yaml.MarkedYAMLError as error:
        mark = "" if error.problem_mark is None else f" in line {error.problem_mark.line + 1}"
        raise BadRow(f"not YAML{mark}: {error.problem}") from error
    except (yaml.YAMLError, ValueError, RecursionError, TypeError, OverflowError) as error:
        raise BadRow(f"not YAML: {type(error).__name__}, {error}") from error
    if len(documents) != 1:
        raise BadRow(f"one document is needed, not {len(documents)}")
    return _of_message(documents[0])


def _json(folder: InputFolder, name: str) -> RecordedRows:
    text = folder.read_text(name)
    try:
        return _of_message(json.loads(text))
    except BadRow:
        raise
    except json.JSONDecodeError as error:
        raise BadRow(f"not JSON in line {error.lineno}: {error.msg}") from error
    except (ValueError, RecursionError) as error:
        raise BadRow(f"not JSON: {error or 'nested too deeply'}") from error


WRAPPERS = ("joint_trajectory", "trajectory", "planned_trajectory", "goal", "motion_plan_response", "solution")
MOST_WRAPPERS = 8  # within each other


def _of_message(document: Any) -> RecordedRows:
    """The rows of a JointTrajectory, or of a message that holds one."""
    key, message = _joint_trajectory(document)
    names = message["joint_names"]
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise BadRow(f"{key}joint_names: a list of words is needed")
    if len(names) > MOST_LINKS:
        raise BadRow(f"{key}joint_names: {len(names)} joints; at most {MOST_LINKS}")
    points = message["points"]
    if not isinstance(points, list):
        raise BadRow(f"{key}points: a list is needed")
    _check_count(len(points))
    times: list[float] = []
    states: dict[str, list[Row]] = {state: [] for state in ("positions", *RATES)}
    for number, point in enumerate(points):
        place = f"{key}points[{number}]"
        if not isinstance(point, dict):
            raise BadRow(f"{place}: a table is needed, not {shown(point)}")
        times.append(_seconds(point.get("time_from_start"), f"{place}.time_from_start"))
        for state, rows in states.items():
            rows.append(_values(point.get(state), len(names), f"{place}.{state}", state == "positions"))
    stated = {state: rows if any(rows) else [] for state, rows in states.items()}
    return RecordedRows(times, stated["positions"], stated["velocities"], stated["accelerations"], names)


def _joint_trajectory(document: Any) -> tuple[str, dict[str, Any]]:
    """The message with ``joint_names`` and ``points``, and the key under which it is."""
    key = ""
    for _ in range(MOST_WRAPPERS):
        if isinstance(document, list) and len(document) == 1:
            key, document = f"{key[:-1]}[0].", document[0]
        if isinstance(document, list):
            raise BadRow(f"{key[:-1] or 'the file'}: {len(document)} trajectories; one is judged at a time")
        if not isinstance(document, dict):
            break
        others = document.get("multi_dof_joint_trajectory")
        if isinstance(others, dict) and others.get("points"):
            raise BadRow(f"{key}multi_dof_joint_trajectory: joints of several degrees of freedom are not judged")
        if {"joint_names", "points"} <= document.keys():
            return key, document
        inner = next((name for name in WRAPPERS if name in document), None)
        if inner is None:
            break
        key, document = f"{key}{inner}.", document[inner]
    raise BadRow("no JointTrajectory with joint_names and points is in it, nor a message of MoveIt that holds one")


def _seconds(value: Any, place: str) -> float:
    if isinstance(value, dict):
        parts = [
            next((value[name] for name in names if name in value), None)
            for names in (("sec", "secs"), ("nanosec", "nsecs", "nsec"))
        ]
        if None in parts:
            raise BadRow(f"{place}: sec and nanosec are needed")
        seconds, nanoseconds = (_number(part, place) for part in parts)
        return seconds + 1e-9 * nanoseconds
    if value is None:
        raise BadRow(f"{place}: missing key")
    return _number(value, place)


def _values(value: Any, width: int, place: str, needed: bool) -> Row:
    if value is None or value == []:
        if needed:
            raise BadRow(f"{place}: {width} numbers are needed")
        return []
    if not isinstance(value, list) or len(value) != width:
        count = len(value) if isinstance(value, list) else shown(value)
        raise BadRow(f"{place}: {width} numbers are needed, one for each of joint_names, not {count}")
    return [_number(each, place) for each in value]


def _number(value: Any, place: str) -> float:
    """A number; YAML takes 1e-05 for a word."""
    try:
        number = math.nan if isinstance(value, bool | list | dict) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not abs(number) <= LARGEST_STATE:
        raise BadRow(f"{place}: a number of at most {LARGEST_STATE:g} is needed, not {shown(value)}")
    return number


READERS: dict[str, Callable[[InputFolder, str], RecordedRows]] = {
    ".csv": _csv,
    ".npz": _npz,
    ".json": _json,
    ".yaml": _yaml,
    ".yml": _yaml,
}


def joint_order(names: list[str], known: Iterator[tuple[str, ...]], place: str = "joint_names") -> list[int]:
    """For each joint of a robot the column that has it.

    Args:
        names: of the columns.
        known: names of the robot's joints, in its order; the first that share any with the columns count.
        place: for messages.

    Raises:
        ScenarioError: a joint is missing, there twice, or unknown.
    """
    twice = next((name for number, name in enumerate(names) if name in names[:number]), None)
    if twice is not None:
        raise ScenarioError(f"{place}: {shown(twice)} is there twice")
    listed = list(known)
    own = next((joints for joints in listed if set(joints) & set(names)), listed[0])
    unknown = next((name for name in names if name not in own), None)
    if unknown is not None:
        raise ScenarioError(
            f"{place}: the robot has no joint {shown(unknown)}; it has {', '.join(own)}{hint(unknown, own)}"
        )
    missing = next((name for name in own if name not in names), None)
    if missing is not None:
        raise ScenarioError(f"{place}: {shown(missing)} is missing")
    return [names.index(name) for name in own]


def as_columns(rows: list[Row], count: int, width: int, key: str) -> FloatArray | None:
    """Rows (n, k) of rates; not a number in those that state none, None where none does.

    Raises:
        ScenarioError: they are not as many as there are times, or one has another number of joints.
    """
    if not rows:
        return None
    if len(rows) != count:
        raise ScenarioError(f"{key}: {len(rows)} rows for {count} times")
    for number, row in enumerate(rows, start=1):
        if row and len(row) != width:
            raise ScenarioError(f"{key}: row {number} has {len(row)} numbers for {width} joints")
    return np.array([row or [np.nan] * width for row in rows])
