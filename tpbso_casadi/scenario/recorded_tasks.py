"""Motions that are stated in time, as tables: they are judged as they are."""

from __future__ import annotations

from dataclasses import asdict, field
from typing import Annotated, Any, ClassVar, Literal, NoReturn, Self

import numpy as np

from problems import InvalidProblem, Obstacle, Robot, Trajectory
from problems.assembly import Criteria, recorded_motion
from problems.base import Count, FloatArray, Range
from problems.motions import MotionRows, RowInterpolation
from problems.tasks import RecordedMotion, Task
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.model import ModelSection, TaskSection, without_empty
from tpbso_casadi.scenario.motion_files import read_recorded
from tpbso_casadi.scenario.path_tasks import MOST_COEFFICIENTS, MOST_PIECES, trajectory_pieces
from tpbso_casadi.scenario.recorded_rows import MOST_MOTION_ROWS, RATES, as_columns, joint_order
from tpbso_casadi.scenario.validation import MOST_EXPRESSIONS, MOST_LINKS, NotNegative, ScenarioError, Word, read_table

MOST_REMARKS, LONGEST_REMARK = 100, 500  # characters
Remark = Annotated[str, Count(0, LONGEST_REMARK)]
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
        return without_empty(without_empty(super().table(), "without"), "message")

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


class MotionRowsTask(StatedMotionTask):
    """Rows: of a file beside the scenario file, or stated."""

    kind: Literal["recorded-motion"]
    file: str | None = None
    message: Annotated[int, Range(least=1)] | None = None
    times: Annotated[list[float], Count(0, MOST_MOTION_ROWS)] = field(default_factory=list)
    positions: Rows = field(default_factory=list)
    velocities: Rows = field(default_factory=list)
    accelerations: Rows = field(default_factory=list)
    joint_names: Annotated[list[Word], Count(0, MOST_LINKS)] = field(default_factory=list)
    interpolation: RowInterpolation = "auto"

    def with_files(self, folder: InputFolder) -> Self:
        if self.file is None:
            return self
        if self.times or self.positions:
            raise ScenarioError("task.file: rows are stated twice, in the file and here")
        try:
            rows = read_recorded(folder, self.file, self.message)
        except ScenarioError as error:
            raise ScenarioError(f"task.file: {error}") from error
        return self.replaced(**rows_table(rows), file=None, message=None)

    def stated(self, robot: Robot, obstacles: tuple[Obstacle, ...]) -> RecordedMotion:
        if self.file is not None:
            raise ScenarioError(f"task.file: {self.file!r} has not been read; only a scenario file can name a file")
        rows = self._rows(robot)
        return self._recorded(robot, rows.trajectory, obstacles, rows.said, rows.times[0])

    def _rows(self, robot: Robot) -> MotionRows:
        widths = {len(row) for row in self.positions}
        if len(widths) > 1:
            raise InvalidProblem("positions", "rows of the same number of joints are needed")
        width = widths.pop() if widths else 0
        if self.joint_names and len(self.joint_names) != width:
            raise InvalidProblem("positions", f"{width} numbers in a row for {len(self.joint_names)} joint_names")
        if width != robot.dof and not self.joint_names:
            raise InvalidProblem("positions", f"rows of {width} joints for a robot of {robot.dof}")
        states = {key: as_columns(getattr(self, key), len(self.times), width, f"task.{key}") for key in RATES}
        order = self._order(robot)
        ordered = {key: None if rates is None else rates[:, order] for key, rates in states.items()}
        positions = np.array(self.positions, dtype=np.float64).reshape(len(self.positions), width)
        return MotionRows(np.array(self.times), positions[:, order], **ordered, interpolation=self.interpolation)

    def _order(self, robot: Robot) -> list[int]:
        if not self.joint_names:
            return list(range(robot.dof))
        known = iter((robot.joints.identifiers, robot.joints.names))
        return joint_order(self.joint_names, known, "task.joint_names")


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
            known = iter((robot.joints.identifiers, robot.joints.names))
            coefficients = coefficients[:, :, joint_order(self.joint_names, known, "task.joint_names")]
        motion = Trajectory(breakpoints - breakpoints[0], coefficients)
        said = f"{breakpoints.size - 1} polynomial pieces"
        return self._recorded(robot, motion, obstacles, said, breakpoints[0])


def rows_table(rows: Any) -> dict[str, Any]:
    """The keys of a [task] table that state rows of a file."""
    return {key: value for key, value in asdict(rows).items() if key not in ("breakpoints", "coefficients")}


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
