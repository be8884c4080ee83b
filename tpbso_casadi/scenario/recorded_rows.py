"""Motions of other programs as rows: a time and the state of the joints then.

Positions have to be there in every row; velocities and accelerations may be, and say how rows are joined. All is in SI
units: s, rad, rad/s, rad/s^2, m where a joint slides.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from problems.base import FloatArray, did_you_mean, shown_value
from tpbso_casadi.scenario.validation import ScenarioError

MOST_MOTION_ROWS = 20_000  # of a motion: a minute at 333 Hz
LARGEST_STATE = 1e9  # of a time, an angle or a rate
LARGEST_COEFFICIENT = 1e100  # of a polynomial piece, rad / s^n
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
        remarks: what the file says besides, and a motion does not, a line each.
    """

    times: list[float]
    positions: list[Row]
    velocities: list[Row] = field(default_factory=list)
    accelerations: list[Row] = field(default_factory=list)
    joint_names: list[str] = field(default_factory=list)
    breakpoints: list[float] = field(default_factory=list)
    coefficients: list[list[Row]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


class BadRow(ValueError):
    """Content that is no motion; the message is one line, without the file."""


def check_count(rows: int) -> None:
    """There are enough rows of a motion, and not too many.

    Raises:
        BadRow: there are not.
    """
    if rows < 2:
        raise BadRow(f"{rows} row{'s' * (rows != 1)}; a motion needs two at least")
    if rows > MOST_MOTION_ROWS:
        raise BadRow(f"{rows} rows; at most {MOST_MOTION_ROWS} are judged")


def joint_order(names: list[str], known: Iterator[tuple[str, ...]], place: str = "joint_names") -> list[int]:
    """The column of each joint of a robot.

    Args:
        names: of the columns.
        known: names of the robot's joints, in its order; the first that share any with the columns count.
        place: for messages.

    Raises:
        ScenarioError: a joint is missing, there twice, or unknown.
    """
    twice = next((name for number, name in enumerate(names) if name in names[:number]), None)
    if twice is not None:
        raise ScenarioError(f"{place}: {shown_value(twice)} is there twice")
    listed = list(known)
    own = next((joints for joints in listed if set(joints) & set(names)), listed[0])
    unknown = next((name for name in names if name not in own), None)
    if unknown is not None:
        raise ScenarioError(
            f"{place}: the robot has no joint {shown_value(unknown)}; "
            f"it has {', '.join(own)}{did_you_mean(unknown, own)}"
        )
    missing = next((name for name in own if name not in names), None)
    if missing is not None:
        raise ScenarioError(f"{place}: {shown_value(missing)} is missing")
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
