"""Motions that are stated in time, as tables: they are judged as they are."""

from __future__ import annotations

from dataclasses import asdict, field, replace
from typing import Annotated, Any, ClassVar, Literal, NoReturn, Self

import numpy as np

from problems import InvalidProblem, Obstacle, Robot, Trajectory
from problems.assembly import Criteria, recorded_motion
from problems.base import Count, FloatArray
from problems.motions import MotionRows, RowInterpolation
from problems.tasks import RecordedMotion, Task
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.model import ModelSection, TaskSection, without_empty
from tpbso_casadi.scenario.motion_files import read_recorded
from tpbso_casadi.scenario.path_tasks import MOST_COEFFICIENTS, MOST_PIECES, trajectory_pieces
from tpbso_casadi.scenario.recorded_rows import MOST_MOTION_ROWS, RATES, as_columns
from tpbso_casadi.scenario.row_tasks import (
    MOST_REMARKS,
    JoinedColumns,
    Remark,
    RowFileTask,
    joint_order,
    joint_table,
)
from tpbso_casadi.scenario.validation import MOST_EXPRESSIONS, MOST_LINKS, NotNegative, ScenarioError, Word, read_table

Row = Annotated[list[float], Count(0, MOST_LINKS)]
Rows = Annotated[list[Row], Count(0, MOST_MOTION_ROWS)]


class StatedMotionTask(TaskSection):
    """[task] of a motion in time: s, rad, m where a joint slides, whatever the file's unit."""

    is_searched: ClassVar[bool] = False
    has_solver: ClassVar[bool] = False
    motions: ClassVar[tuple[str, ...]] = ("spline",)
    remarks: Annotated[list[Remark], Count(0, MOST_REMARKS)] = field(default_factory=list)
    stay: NotNegative = 0.0
    without: Annotated[list[Word], Count(0, MOST_EXPRESSIONS)] = field(default_factory=list)

    def table(self) -> dict[str, Any]:
        return without_empty(super().table(), "without")

    def stated(self, robot: Robot, obstacles: tuple[Obstacle, ...]) -> RecordedMotion:
        """The motion of a robot's joints among obstacles.

        Raises:
            InvalidProblem: it is none.
        """
        raise NotImplementedError

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> NoReturn:
        """Refuse to build a problem: a recorded motion is judged, not searched.

        Raises:
            ScenarioError: always.
        """
        raise ScenarioError(f"task.kind: {self.kind!r} is judged as it is; there is nothing to search for")

    def criteria(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        return recorded_motion(self.stated(robot, obstacles), model.further_limits)

    def _recorded(
        self, robot: Robot, motion: Trajectory, obstacles: tuple[Obstacle, ...], joined: str, begins: float
    ) -> RecordedMotion:
        """A motion, and what is left open: how the arm gets to one that does not begin at t = 0, nobody knows."""
        late = [f"how the arm gets to where the motion begins, at {begins:.6g} s"] if begins else []
        return RecordedMotion(
            robot, motion, obstacles, joined, (*self.remarks, *late), self.stay, without=tuple(self.without)
        )


class MotionRowsTask(RowFileTask, StatedMotionTask):
    """Rows: of a file beside the scenario file, or stated."""

    kind: Literal["recorded-motion"]
    file: str | None = None
    times: Annotated[list[float], Count(0, MOST_MOTION_ROWS)] = field(default_factory=list)
    positions: Rows = field(default_factory=list)
    velocities: Rows = field(default_factory=list)
    accelerations: Rows = field(default_factory=list)
    interpolation: RowInterpolation = "auto"

    def with_files(self, folder: InputFolder) -> Self:
        if self.file is None:
            return self
        if self.times or self.positions:
            raise ScenarioError("task.file: rows are stated twice, in the file and here")
        try:
            rows = read_recorded(folder, self.file, self.reading)
        except ScenarioError as error:
            raise ScenarioError(f"task.file: {error}") from error
        names = {"joint_names": self.joint_names} if self.joint_names else {}
        return self.read(**rows_table(rows) | names, file=None)

    def in_radians(self) -> Self:
        """The rows are in the unit that the task states, whatever the file's."""
        return self

    def stated(self, robot: Robot, obstacles: tuple[Obstacle, ...]) -> RecordedMotion:
        if self.file is not None:
            raise ScenarioError(f"task.file: {self.file!r} has not been read; only a scenario file can name a file")
        positions = joint_table(self.positions, "positions")
        joined = self.joined(robot, positions, np.array(self.times))
        rows = self._rows(joined, positions)
        motion = self._recorded(robot, rows.trajectory, obstacles, rows.said, rows.times[0])
        return replace(motion, notes=joined.notes)

    def _rows(self, joined: JoinedColumns, positions: FloatArray) -> MotionRows:
        """The rows of the robot's joints, the one in which it stands before the first of them too."""
        width = positions.shape[1]
        stated = {key: as_columns(getattr(self, key), len(self.times), width, f"task.{key}") for key in RATES}
        velocities, accelerations = (None if table is None else joined.of(table) for table in stated.values())
        times, table = np.array(self.times), joined.of(positions)
        if joined.start is None:
            return MotionRows(times, table, velocities, accelerations, self.interpolation)
        if not times.size or times[0] <= 0.0:
            raise InvalidProblem("start", "the first row is at t = 0 or before: it is where the motion begins")
        times, table, rest = np.append(0.0, times), np.vstack([joined.start, table]), np.zeros_like(joined.start)
        velocities, accelerations = (
            None if rates is None else np.vstack([rest, rates]) for rates in (velocities, accelerations)
        )
        return MotionRows(times, table, velocities, accelerations, self.interpolation)


class MotionPiecesTask(StatedMotionTask):
    """Polynomial pieces, exactly: rad / s^n."""

    kind: Literal["recorded-motion"]
    shape: Literal["pieces"]
    breakpoints: Annotated[list[float], Count(2, MOST_PIECES)]
    coefficients: Annotated[list[list[list[float]]], Count(1, MOST_COEFFICIENTS)]
    joint_names: Annotated[list[Word], Count(0, MOST_LINKS)] = field(default_factory=list)

    def stated(self, robot: Robot, obstacles: tuple[Obstacle, ...]) -> RecordedMotion:
        """The pieces themselves, from t = 0."""
        breakpoints, coefficients = trajectory_pieces(self.breakpoints, self.coefficients)
        if self.joint_names:
            known = (robot.joints.identifiers, robot.joints.names)
            ends = Trajectory(breakpoints, coefficients).at(breakpoints)
            coefficients = coefficients[:, :, joint_order(self.joint_names, known, ends, {})[0]]
        motion = Trajectory(breakpoints - breakpoints[0], coefficients)
        said = f"{breakpoints.size - 1} polynomial pieces"
        return self._recorded(robot, motion, obstacles, said, breakpoints[0])


def rows_table(rows: Any) -> dict[str, Any]:
    """The keys of a [task] table that state rows of a file."""
    return {key: value for key, value in asdict(rows).items() if key not in ("breakpoints", "coefficients", "measured")}


def read_motion(table: dict[str, Any]) -> StatedMotionTask:
    """The section of a [task] table of a motion.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    section: type[StatedMotionTask] = MotionPiecesTask if "shape" in table else MotionRowsTask
    return read_table(section, "task", table)


def motion_table(trajectory: Trajectory, begins: float = 0.0, task: Task | None = None) -> dict[str, Any]:
    """The [task] table of a motion, exactly; plain data.

    Args:
        trajectory: the motion.
        begins: when it does by the clock of whoever made it, s.
        task: that it is of: what it says besides of any motion is kept.
    """
    pieces: dict[str, FloatArray] = {
        "breakpoints": trajectory.breakpoints + begins,
        "coefficients": trajectory.coefficients,
    }
    table = {"kind": "recorded-motion", "shape": "pieces", **{key: array.tolist() for key, array in pieces.items()}}
    if task is not None and task.stay:
        table["stay"] = task.stay
    if isinstance(task, RecordedMotion) and task.remarks:
        table["remarks"] = list(task.remarks)
    return table
