"""Files with motions of other programs: CSV, NPZ, and the messages of ROS, in bags too."""

from __future__ import annotations

import io
import re
import zipfile
import zlib
from collections.abc import Callable
from pathlib import PurePath
from typing import Any

import numpy as np

from problems import Trajectory
from problems.base import did_you_mean, in_words, number_of, shown_value
from tpbso_casadi.plain import one_line
from tpbso_casadi.scenario.bags import read_bag
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.recorded_rows import (
    LARGEST_COEFFICIENT,
    LARGEST_STATE,
    BadRow,
    RecordedRows,
    Row,
    check_count,
)
from tpbso_casadi.scenario.ros_messages import read_json, rows_of_message
from tpbso_casadi.scenario.validation import MOST_LINKS, ScenarioError

SAME_MOTION = 1e-6  # rad and s, relative to the largest angle
LARGEST_ARRAYS = 200_000_000  # bytes of a NPZ's arrays


def read_recorded(folder: InputFolder, name: str, message: int | None = None) -> RecordedRows:
    """The rows of a file, whose ending says what it is.

    Args:
        folder: that holds it.
        name: of the file.
        message: which trajectory of a bag, from 1 on; None of one that holds one, and of other files.

    Raises:
        ScenarioError: naming the file, the line, row or key, and what is wrong there.
    """
    place, ending = f"{folder.path / name}", PurePath(name).suffix.lower()
    if ending not in READERS:
        known = in_words([f"*{known}" for known in READERS])
        raise ScenarioError(f"{place}: a motion is read from {known}")
    try:
        if message is None:
            return READERS[ending](folder, name)
        if READERS[ending] is not read_bag:
            raise BadRow("message: says which trajectory of a bag; this is none")
        return read_bag(folder, name, message)
    except BadRow as error:
        raise ScenarioError(f"{place}: {one_line(str(error))}") from error


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
    check_count(len(lines) - 1)
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
            raise BadRow(f"line {line}: the column {shown_value(name)} is there twice")
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
        raise BadRow(f"line {line}: {shown_value(name)} is no column of t,q1..qk,qd1..qdk,qdd1..qddk")
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
        row = [number_of(cell) for cell in cells]
    except ValueError as error:
        raise BadRow(f"line {number}: {width} numbers are needed") from error
    if not all(abs(value) <= LARGEST_STATE for value in row):
        raise BadRow(f"line {number}: a number is not finite, or larger than {LARGEST_STATE:g}")
    return row


NPZ_NAMES = {"times": ("t", "times"), "positions": ("q", "positions"), "velocities": ("qd", "velocities"),
             "accelerations": ("qdd", "accelerations")}  # fmt: skip
PIECES = ("breakpoints", "coefficients")
EXPORTED = ("tip", "quaternion", "tau")  # by ourselves, beside the motion that says as much
ARRAYS = (*(name for names in NPZ_NAMES.values() for name in names), *PIECES, *EXPORTED, "joint_names")


def _npz(folder: InputFolder, name: str) -> RecordedRows:
    """Arrays ``t`` (n,), ``q`` (n, k), ``qd`` and ``qdd`` where there are; pieces and ``joint_names`` too."""
    arrays = _arrays(folder.read_bytes(name))
    unknown = next((each for each in arrays if each not in ARRAYS), None)
    if unknown is not None:
        raise BadRow(f"has no use for the array {shown_value(unknown)}{did_you_mean(unknown, ARRAYS)}")
    found = {key: next((arrays[each] for each in names if each in arrays), None) for key, names in NPZ_NAMES.items()}
    for key in ("times", "positions"):
        if found[key] is None:
            raise BadRow(f"has no array {' or '.join(map(repr, NPZ_NAMES[key]))}")
    rows = {key: _numbers_of(key, array) for key, array in found.items() if array is not None}
    check_count(len(rows["times"]))
    pieces = {key: _numbers_of(key, arrays[key]) for key in PIECES if key in arrays}
    if len(pieces) == 1:
        raise BadRow(f"has {next(iter(pieces))} alone; exact pieces are {' and '.join(PIECES)}")
    _check_alike(rows, pieces)
    named = arrays.get("joint_names")
    if named is not None and (named.ndim != 1 or named.dtype.kind != "U"):
        raise BadRow("joint_names: a list of words is needed")
    return RecordedRows(**rows, **pieces, joint_names=[] if named is None else [str(each) for each in named])


def _check_alike(rows: dict[str, list[Any]], pieces: dict[str, list[Any]]) -> None:
    """Rows and pieces of one file are of one motion; how pieces have to fit each other is said where they are used."""
    breakpoints, coefficients = (np.array(pieces.get(key, [])) for key in PIECES)
    times, positions = np.array(rows["times"]), np.array(rows["positions"])
    if coefficients.shape[1:] != (breakpoints.size - 1, *positions.shape[1:]) or len(times) != len(positions):
        return
    if np.abs(times[[0, -1]] - breakpoints[[0, -1]]).max() > SAME_MOTION:
        rows_of, pieces_of = (f"from {each[0]:g} to {each[-1]:g} s" for each in (times, breakpoints))
        raise BadRow(f"times: {rows_of} where breakpoints are {pieces_of}; they are two motions")
    away = np.abs(Trajectory(breakpoints, coefficients).at(times) - positions).max(axis=1)
    if away.max() > SAME_MOTION * (1.0 + np.abs(positions).max()):
        row = int(away.argmax())
        raise BadRow(f"positions: row {row} is not on the pieces of breakpoints and coefficients; they are two motions")


def _numbers_of(key: str, array: Any) -> list[Any]:
    dimensions = {"times": 1, "breakpoints": 1, "coefficients": 3}.get(key, 2)
    if array.dtype.kind not in "fiu" or array.ndim != dimensions:
        raise BadRow(
            f"{key}: an array of numbers of {dimensions} dimensions is needed, not {array.dtype} {array.shape}"
        )
    if not (
        np.abs(array.astype(np.float64)) <= (largest := LARGEST_COEFFICIENT if key == "coefficients" else LARGEST_STATE)
    ).all():
        raise BadRow(f"{key}: a number is not finite, or larger than {largest:g}")
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


def _yaml(folder: InputFolder, name: str) -> RecordedRows:
    from tpbso_casadi.scenario.yaml_text import yaml_document  # noqa: PLC0415 (loads a library for these files alone)

    text = folder.read_text(name)
    try:
        document = yaml_document(text)
    except ValueError as error:
        raise BadRow(str(error)) from error
    return rows_of_message(document)


READERS: dict[str, Callable[[InputFolder, str], RecordedRows]] = {
    ".csv": _csv,
    ".npz": _npz,
    ".json": read_json,
    ".yaml": _yaml,
    ".yml": _yaml,
    ".mcap": read_bag,
}
