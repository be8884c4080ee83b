"""Files with motions of other programs: CSV, NPZ, and the messages of ROS, in bags too."""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import PurePath
from typing import Any

import numpy as np

from problems import Trajectory
from problems.base import did_you_mean, in_words, shown_value
from tpbso_casadi.plain import one_line
from tpbso_casadi.scenario.bags import read_bag
from tpbso_casadi.scenario.columns import ACCELERATION, LOG, MEASURED, MOTION, POSITION, VELOCITY, TableKind, columns_of
from tpbso_casadi.scenario.input_files import LARGEST_TABLE, InputFolder
from tpbso_casadi.scenario.recorded_rows import (
    AS_IT_IS,
    LARGEST_COEFFICIENT,
    LARGEST_STATE,
    TIME_UNITS,
    BadRow,
    Reading,
    RecordedRows,
    check_count,
)
from tpbso_casadi.scenario.ros_messages import read_json, rows_of_message
from tpbso_casadi.scenario.text_tables import TextTable
from tpbso_casadi.scenario.validation import ScenarioError

SAME_MOTION = 1e-6  # rad and s, relative to the largest angle
LARGEST_ARRAYS = 200_000_000  # bytes of a NPZ's arrays


def read_recorded(
    folder: InputFolder, name: str, reading: Reading = AS_IT_IS, kind: TableKind = MOTION
) -> RecordedRows:
    """The rows of a file, whose ending says what it is.

    Args:
        folder: that holds it.
        name: of the file.
        reading: how it is read.
        kind: of what its rows have to hold.

    Raises:
        ScenarioError: naming the file, the line, row or key, and what is wrong there.
    """
    place, ending = f"{folder.path / name}", PurePath(name).suffix.lower()
    if ending not in READERS:
        known = in_words([f"*{known}" for known in READERS])
        raise ScenarioError(f"{place}: a motion is read from {known}")
    try:
        reader = READERS[ending]
        if (reading.message, reading.topic) != (None, None) and reader is not _bag:
            key = "message" if reading.topic is None else "topic"
            raise BadRow(f"{key}: says which trajectory of a bag; this is none")
        if reading.columns and reader is not _csv:
            raise BadRow("columns: says what columns of a table of text hold; this is none")
        return _as_read(reader(folder, name, reading, kind), reading)
    except BadRow as error:
        raise ScenarioError(f"{place}: {one_line(str(error))}") from error


def _as_read(rows: RecordedRows, reading: Reading) -> RecordedRows:
    """The rows in s, of the joints that are read, none of them twice.

    Raises:
        BadRow: they are too few, or there are no such joints.
    """
    factor = TIME_UNITS[reading.time_unit]
    if factor != 1.0:
        if rows.breakpoints:
            raise BadRow("time_unit: is for rows; polynomial pieces are in s")
        rows = replace(rows, times=[factor * time for time in rows.times])
    if reading.prefix:
        rows = rows.with_prefix(reading.prefix)
    if rows.times:
        rows = rows.without_repeats()
    check_count(len(rows.positions), LOG.most)
    if len(rows.positions) < 2 and not reading.one_will_do:
        raise BadRow("1 row; a motion needs two at least; start says where it begins")
    return rows


def _csv(folder: InputFolder, name: str, reading: Reading, kind: TableKind) -> RecordedRows:
    """A table of text."""
    table = TextTable.read(folder.read_text(name, LARGEST_TABLE), kind.header)
    columns = columns_of(table.names, table.line, reading.columns, kind)
    time = [] if columns.time is None else [columns.time]
    chosen = {symbol: columns.of(symbol) for symbol in kind.symbols}
    rows, left_out = table.rows(time, [place for places in chosen.values() for place in places], kind.most)
    states: dict[str, Any] = {}
    begin = len(time)
    for symbol, places in chosen.items():
        states[SYMBOLS[symbol]] = [row[begin : begin + len(places)] for row in rows] if places else []
        begin += len(places)
    first = rows[0][0] if columns.absolute and rows else 0.0
    times = [row[0] - first for row in rows] if time else []
    late = next((number for number, value in enumerate(times) if not abs(value) <= LARGEST_STATE), None)
    if late is not None:
        raise BadRow(f"row {late + 1}: a time is larger than {LARGEST_STATE:g}")
    note = f"{left_out} row{'s' * (left_out > 1)} without a number of these joints left out"
    return RecordedRows(times, **states, joint_names=columns.names, notes=[note] if left_out else [])


SYMBOLS = {POSITION: "positions", VELOCITY: "velocities", ACCELERATION: "accelerations", MEASURED: "measured"}


NPZ_NAMES = {"times": ("t", "times"), "positions": ("q", "positions"), "velocities": ("qd", "velocities"),
             "accelerations": ("qdd", "accelerations")}  # fmt: skip
PIECES = ("breakpoints", "coefficients")
EXPORTED = ("tip", "quaternion", "tau")  # by ourselves, beside the motion that says as much
ARRAYS = (*(name for names in NPZ_NAMES.values() for name in names), *PIECES, *EXPORTED, "joint_names")


def _npz(folder: InputFolder, name: str, reading: Reading, kind: TableKind) -> RecordedRows:
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
    check_count(len(rows["times"]), kind.most)
    pieces = {key: _numbers_of(key, arrays[key]) for key in PIECES if key in arrays}
    if len(pieces) == 1:
        raise BadRow(f"has {next(iter(pieces))} alone; exact pieces are {' and '.join(PIECES)}")
    _check_alike(rows, pieces)
    named = arrays.get("joint_names")
    if named is not None and (named.ndim != 1 or named.dtype.kind != "U"):
        raise BadRow("joint_names: a list of words is needed")
    return RecordedRows(**rows, **pieces, joint_names=[] if named is None else [str(each) for each in named])


def pieces_in(content: bytes) -> dict[str, list[Any]]:
    """Breakpoints and coefficients of a NPZ that holds nothing else.

    Raises:
        ValueError: it is none, or they do not fit each other.
    """
    arrays = _arrays(content)
    if {*arrays} != {*PIECES}:
        raise BadRow(f"is no NPZ of {' and '.join(PIECES)} alone")
    pieces = {key: _numbers_of(key, arrays[key]) for key in PIECES}
    if not arrays["coefficients"].size or arrays["coefficients"].shape[1] != arrays["breakpoints"].size - 1:
        raise BadRow(f"{' and '.join(PIECES)} do not fit each other")
    return pieces


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


def _yaml(folder: InputFolder, name: str, reading: Reading, kind: TableKind) -> RecordedRows:
    from tpbso_casadi.scenario.yaml_text import yaml_document  # noqa: PLC0415 (loads a library for these files alone)

    text = folder.read_text(name)
    try:
        document = yaml_document(text)
    except ValueError as error:
        raise BadRow(str(error)) from error
    return rows_of_message(document)


def _json(folder: InputFolder, name: str, reading: Reading, kind: TableKind) -> RecordedRows:
    return read_json(folder, name)


def _bag(folder: InputFolder, name: str, reading: Reading, kind: TableKind) -> RecordedRows:
    return read_bag(folder, name, reading, of_log=kind is LOG)


READERS: dict[str, Callable[[InputFolder, str, Reading, TableKind], RecordedRows]] = {
    ".csv": _csv,
    ".npz": _npz,
    ".json": _json,
    ".yaml": _yaml,
    ".yml": _yaml,
    ".mcap": _bag,
}
