"""Tasks whose rows of joints a file holds: how it is read, and what its columns are to a robot."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import degrees, pi, radians
from typing import Annotated, Any, Literal, Self

import numpy as np

from problems import InvalidProblem, Robot
from problems.base import Count, FloatArray, Range, did_you_mean, shown_value
from tpbso_casadi.scenario.columns import PATH
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.model import TaskSection, without_empty
from tpbso_casadi.scenario.motion_files import read_recorded
from tpbso_casadi.scenario.recorded_rows import AS_IT_IS, TIME_UNITS, Reading, RecordedRows
from tpbso_casadi.scenario.validation import ANGULAR, MOST_LINKS, Number, ScenarioError, Word

LONGEST_MAPPING = 2_000  # characters
MOST_REMARKS, LONGEST_REMARK = 100, 500  # characters
Remark = Annotated[str, Count(0, LONGEST_REMARK)]
SAME_STATE = 1e-3  # rad or m: what a joint that stands may be recorded away from where it is locked
FAR_BEYOND = 3.0  # ranges: no motion in rad is so far beyond all of them
TURNS = 2.0 * pi  # rad: the range of a joint that has none, for that
SLOW_ROWS = 0.5  # s: between the rows of a recording in ms, which is of 2 kHz at most


class RowFileTask(TaskSection):
    """[task] with rows of joints: how a file of them is read, in which unit they are, and where the motion begins."""

    columns: Annotated[str, Count(0, LONGEST_MAPPING)] = ""
    prefix: Word = ""
    time_unit: Literal["s", "ms", "us", "ns"] = "s"
    topic: Word | None = None
    message: Annotated[int, Range(least=1)] | None = None
    unit: Literal["rad", "deg"] | None = None
    start: Annotated[list[Number], Count(0, MOST_LINKS), ANGULAR] = field(default_factory=list)
    joint_names: Annotated[list[Word], Count(0, MOST_LINKS)] = field(default_factory=list)
    notes: Annotated[list[Remark], Count(0, MOST_REMARKS)] = field(default_factory=list)

    def table(self) -> dict[str, Any]:
        table = super().table()
        for key in (*OF_A_FILE, "unit", "start", "notes"):
            table = without_empty(table, key)
        return table if table.get("time_unit") != "s" else {k: v for k, v in table.items() if k != "time_unit"}

    @property
    def reading(self) -> Reading:
        """How the file is read."""
        return reading_of(self.part(OF_A_FILE) | {"start": self.start})

    def read(self, **values: Any) -> Self:
        """The task with what its file holds, which is not read again."""
        usual = {key: getattr(AS_IT_IS, key) for key in OF_A_FILE}
        return self.replaced(**values, **usual)

    def joined(self, robot: Robot, positions: FloatArray, times: FloatArray | None = None) -> JoinedColumns:
        """The columns of a robot's joints, in its order.

        Args:
            robot: that moves.
            positions: of all columns, (n, k).
            times: of the rows, s; None where there are none.

        Raises:
            InvalidProblem: they are not those of its joints.
            ScenarioError: likewise, of columns with names.
        """
        if self.joint_names and len(self.joint_names) != positions.shape[1]:
            count = f"{positions.shape[1]} numbers in a row for {len(self.joint_names)} joint_names"
            raise InvalidProblem("positions", count)
        if positions.shape[1] != robot.dof and not self.joint_names:
            raise InvalidProblem("positions", f"rows of {positions.shape[1]} joints for a robot of {robot.dof}")
        order, standing = list(range(robot.dof)), list[str]()
        if self.joint_names:
            known = (robot.joints.identifiers, robot.joints.names)
            order, standing = joint_order(self.joint_names, known, positions, dict(robot.locked))
        turning = np.array([unit == "rad" for unit in robot.joints.units])
        factors = np.where(turning & (self.unit == "deg"), radians(1.0), 1.0)
        if self.start and len(self.start) != robot.dof:
            raise InvalidProblem("start", f"{len(self.start)} numbers for {robot.dof} joints")
        joined = JoinedColumns(order, factors, np.array(self.start) * factors if self.start else None, ())
        hints = [] if self.unit is not None else degree_hints(joined.of(positions), robot)
        if times is not None and self.time_unit == "s":
            as_read = joined.of(positions) * (radians(1.0) if hints else 1.0)
            hints += millisecond_hints(times, as_read, robot)
        return replace(joined, notes=(*self.notes, *standing, *hints))


OF_A_FILE = ("columns", "prefix", "time_unit", "topic", "message")


def reading_of(keys: dict[str, Any]) -> Reading:
    """How a file is read, by keys of a [task] table; those that say something else are left alone."""
    stated = {key: keys[key] for key in OF_A_FILE if keys.get(key) is not None}
    return Reading(**stated, one_will_do=bool(keys.get("start")))


def joint_table(rows: list[list[float]], key: str) -> FloatArray:
    """Rows of positions as an array (n, k).

    Raises:
        InvalidProblem: they are of different numbers of joints.
    """
    if len({len(row) for row in rows}) > 1:
        raise InvalidProblem(key, "rows of the same number of joints are needed")
    return np.array(rows, dtype=np.float64).reshape(len(rows), -1 if rows else 0)


@dataclass(frozen=True, eq=False)
class JoinedColumns:
    """The columns of rows that hold the joints of a robot.

    Attributes:
        order: the column of each joint.
        factors: from the unit of the rows to rad, or m.
        start: where the motion begins before the first row, (k,), rad or m; None where that is not stated.
        notes: on what was left out, and what numbers look like, a line each.
    """

    order: list[int]
    factors: FloatArray
    start: FloatArray | None
    notes: tuple[str, ...]

    def of(self, rows: FloatArray) -> FloatArray:
        """Rows of the robot's joints, in rad or m, and of their rates."""
        return np.asarray(rows[:, self.order] * self.factors)


def joint_order(
    names: list[str], known: tuple[tuple[str, ...], ...], positions: FloatArray, locked: dict[str, float]
) -> tuple[list[int], list[str]]:
    """The column of each joint of a robot, and a line on columns of joints that stand.

    Args:
        names: of the columns.
        known: names of the robot's joints, in its order; the first that share any with the columns count.
        positions: of the columns, (n, k), rad or m.
        locked: joints that the robot has besides, and where they stand.

    Raises:
        ScenarioError: a joint is missing, there twice, unknown, or moves though it is locked.
    """
    place = "joint_names"
    twice = next((name for number, name in enumerate(names) if name in names[:number]), None)
    if twice is not None:
        raise ScenarioError(f"{place}: {shown_value(twice)} is there twice")
    own = next((joints for joints in known if set(joints) & set(names)), known[0])
    others = [name for name in names if name not in own]
    unknown = next((name for name in others if name not in locked), None)
    if unknown is not None:
        raise ScenarioError(
            f"{place}: the robot has no joint {shown_value(unknown)}; "
            f"it has {', '.join(own)}{did_you_mean(unknown, own)}"
        )
    missing = next((name for name in own if name not in names), None)
    if missing is not None:
        raise ScenarioError(f"{place}: {shown_value(missing)} is missing")
    for name in others:
        values = positions[:, names.index(name)]
        if np.abs(values - locked[name]).max() > SAME_STATE:
            span = f"{values.min():.6g} to {values.max():.6g}"
            reason = (
                f"{shown_value(name)} goes from {span} and is locked at {locked[name]:.6g}; locked says where it is"
            )
            raise ScenarioError(f"{place}: {reason}")
    standing = [f"joints that stay where they are locked are left out: {', '.join(others)}"] if others else []
    return [names.index(name) for name in own], standing


def degree_hints(positions: FloatArray, robot: Robot) -> list[str]:
    """A line where positions look like degrees: far beyond the ranges, and within them as degrees."""
    turning = [joint for joint, unit in enumerate(robot.joints.units) if unit == "rad"]
    ranges = robot.limits.position
    low, high = (
        np.array([(ranges[joint] if ranges is not None else (-TURNS, TURNS))[end] for joint in turning])
        for end in (0, 1)
    )
    values = positions[:, turning]
    largest = np.abs(values) / np.maximum(np.abs(low), np.abs(high))
    inside = (np.radians(values) >= low - SAME_STATE) & (np.radians(values) <= high + SAME_STATE)
    if not values.size or largest.max() < FAR_BEYOND or not inside.all():
        return []
    number = int(largest.max(axis=0).argmax())
    name, most = robot.joints.names[turning[number]], np.abs(values[:, number]).max()
    looks = f"{name} up to {most:.4g}, with a range up to {degrees(high[number]):.4g} degrees"
    return [f"positions look like degrees ({looks}): unit deg reads them so"]


def millisecond_hints(times: FloatArray, positions: FloatArray, robot: Robot) -> list[str]:
    """A line where times look like milliseconds: rows far apart, and speeds within the limits a thousandfold."""
    steps = np.diff(times)
    if len(steps) < 2 or np.median(steps) < SLOW_ROWS or not (steps > 0.0).all():
        return []
    share = (np.abs(np.diff(positions, axis=0)) / steps[:, None] / np.array(robot.limits.speed)).max()
    if not 0.0 < share <= TIME_UNITS["ms"]:
        return []
    looks = f"rows {np.median(steps):.4g} s apart, speeds at most {share:.1g} of the limits"
    return [f"times look like milliseconds ({looks}): time_unit ms reads them so"]


LARGEST_ANGLE = 1e6  # rad or degrees


def read_joint_rows(folder: InputFolder, name: str, reading: Reading = AS_IT_IS) -> RecordedRows:
    """The rows of a path: those of a motion, whose times are not used, or of a table without times.

    In a recording with times, rows in which nothing has moved are left out.

    Raises:
        ScenarioError: naming the file, and what is wrong with it.
    """
    place, rows = f"{folder.path / name}", read_recorded(folder, name, reading, PATH)
    table = np.array(rows.positions)
    if not (np.abs(table) <= LARGEST_ANGLE).all():
        raise ScenarioError(f"{place}: an angle is larger than {LARGEST_ANGLE:g}")
    if rows.times and not (np.diff(rows.times) > 0.0).all():
        late = int(np.argmin(np.diff(rows.times) > 0.0)) + 2
        raise ScenarioError(f"{place}: row {late}: times have to increase")
    moved = np.append(True, (np.diff(table, axis=0) != 0.0).any(axis=1))
    if not rows.times and not moved.all():
        raise ScenarioError(f"{place}: row {int(np.argmin(moved)) + 1}: the same joint angles as in the row before")
    if np.count_nonzero(moved) < 2 and not reading.one_will_do:
        raise ScenarioError(f"{place}: 1 row of different joint angles; a path needs two at least")
    return replace(rows, positions=table[moved].tolist())
