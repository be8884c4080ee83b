"""Motions of other programs as rows: a time and the state of the joints then.

Positions have to be there in every row; velocities and accelerations may be, and say how rows are joined. All is in SI
units: s, rad, rad/s, rad/s^2, m where a joint slides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from problems.base import FloatArray, shown_value
from tpbso_casadi.scenario.validation import ScenarioError

MOST_MOTION_ROWS = 20_000  # of a motion: a minute at 333 Hz
SAME_TIME = 1e-9  # s: rows that are no farther apart are at one time
LARGEST_STATE = 1e9  # of a time, an angle or a rate
LARGEST_COEFFICIENT = 1e100  # of a polynomial piece, rad / s^n
RATES = ("velocities", "accelerations")
STATES = ("positions", *RATES, "measured")  # one row for each time
Row = list[float]


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How a file of rows is read, where it does not say so itself.

    Attributes:
        columns: of a table: its names, and what they hold, as ``timestamp=t,actual_q_*=q*``.
        prefix: of the names of joints: those with it are read, without it.
        time_unit: of the factor ``TIME_UNITS``.
        topic: of a bag: the one that is read.
        message: which trajectory of a bag, from 1 on.
        one_will_do: whether a single row is a motion, as its start is stated elsewhere.
    """

    columns: str = ""
    prefix: str = ""
    time_unit: str = "s"
    topic: str | None = None
    message: int | None = None
    one_will_do: bool = False


AS_IT_IS = Reading()
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}  # s


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
        measured: positions of all joints as they were, where ``positions`` are as they were commanded.
        notes: what was left out of it, a line each.
    """

    times: list[float]
    positions: list[Row]
    velocities: list[Row] = field(default_factory=list)
    accelerations: list[Row] = field(default_factory=list)
    joint_names: list[str] = field(default_factory=list)
    breakpoints: list[float] = field(default_factory=list)
    coefficients: list[list[Row]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    measured: list[Row] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def with_prefix(self, prefix: str) -> Self:
        """The rows of the joints whose names begin with a prefix, without it.

        Raises:
            BadRow: none does.
        """
        kept = [number for number, name in enumerate(self.joint_names) if name.startswith(prefix) and name != prefix]
        if not kept:
            known = ", ".join(map(shown_value, self.joint_names)) or "numbers alone"
            raise BadRow(f"prefix: no joint's name begins with {shown_value(prefix)}; there are {known}")
        names = [self.joint_names[number].removeprefix(prefix) for number in kept]
        states: dict[str, Any] = {
            key: [[row[each] for each in kept] if row else [] for row in getattr(self, key)] for key in STATES
        }
        pieces = [[[row[each] for each in kept] for row in order] for order in self.coefficients]
        return replace(self, joint_names=names, coefficients=pieces, **states)

    def without_repeats(self) -> Self:
        """The rows without those that say at one time what the row before says."""
        states = self._states()
        if {len(rows) for rows in states.values()} != {len(self.times)}:
            return self  # which is refused where they are joined
        rows = list(zip(self.times, *states.values(), strict=True))
        kept = [0] + [
            number
            for number in range(1, len(rows))
            if abs(rows[number][0] - rows[number - 1][0]) > SAME_TIME or rows[number][1:] != rows[number - 1][1:]
        ]
        dropped = len(rows) - len(kept)
        if not dropped:
            return self
        left: dict[str, Any] = {key: [rows[number] for number in kept] for key, rows in states.items()}
        note = f"{dropped} row{'s' * (dropped > 1)} that repeat the row before, time included, left out"
        return replace(self, times=[self.times[number] for number in kept], notes=[*self.notes, note], **left)

    def _states(self) -> Mapping[str, list[Row]]:
        return {key: rows for key in STATES if (rows := getattr(self, key))}


class BadRow(ValueError):
    """Content that is no motion; the message is one line, without the file."""


def check_count(rows: int, most: int = MOST_MOTION_ROWS) -> None:
    """There are rows, and not too many.

    Raises:
        BadRow: there are not.
    """
    if not rows:
        raise BadRow("0 rows; a motion needs two at least")
    if rows > most:
        raise BadRow(f"{rows} rows; at most {most} are read")


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
