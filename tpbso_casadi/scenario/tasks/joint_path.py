"""The [task] tables of paths in joint space, which are timed: there is nothing to search for."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal, NoReturn, Self

import numpy as np
from pydantic import Field

from problems import InvalidProblem, Robot
from problems.assembly.criteria import Criteria
from problems.assembly.joint_path import joint_following
from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.scene.obstacle import Obstacle
from problems.tasks.paths.joint_path import JointFollowing
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import ANGULAR, MOST_LINKS, Angle, NotNegative, Number, Positive, ScenarioError
from tpbso_casadi.scenario.task import ModelSection, TaskSection
from tpbso_casadi.scenario.tasks.joint_rows import MOST_ROWS, read_joint_rows

Interpolation = Literal["spline", "blend"]
FIELDS = {"waypoints": "joints", "path": "joints", "rates": "start_speed"}  # keys of ours by those of a path
MOST_PIECES = 100_000
MOST_COEFFICIENTS = 50  # of a piece


class GivenPathTask(TaskSection):
    """[task] of a path in joint space: speeds at its ends in rad/s, along it; times in s."""

    is_searched: ClassVar[bool] = False
    motions: ClassVar[tuple[str, ...]] = ("spline",)

    start_speed: Annotated[NotNegative, ANGULAR] = 0.0
    goal_speed: Annotated[NotNegative, ANGULAR] = 0.0
    total_time: tuple[Positive, Positive] | None = None

    def path(self) -> JointPath:
        """The path itself.

        Raises:
            InvalidProblem: it is none.
        """
        raise NotImplementedError

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> NoReturn:
        """Nothing: there is no search.

        Raises:
            ScenarioError: always.
        """
        raise ScenarioError(f"task.kind: {self.kind!r} is timed; there is nothing to search for")

    def criteria(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        """What the motion is judged by, and how it is made."""
        try:
            speeds = self.start_speed, self.goal_speed
            task = JointFollowing(robot, self.path(), obstacles, *speeds, self.total_time)
        except InvalidProblem as error:
            raise InvalidProblem(FIELDS.get(error.field, error.field), error.reason) from error
        return joint_following(task, model.further_limits)


class JointPathTask(GivenPathTask):
    """The rows of a CSV file beside the scenario file, or a list: waypoints, or a recording; angles in rad."""

    kind: Literal["joint-path"]
    joints: Annotated[
        str
        | Annotated[
            list[Annotated[list[Number], Field(min_length=1, max_length=MOST_LINKS)]],
            Field(min_length=2, max_length=MOST_ROWS),
        ],
        ANGULAR,
    ]
    interpolation: Interpolation = "spline"
    tolerance: Angle | None = Field(default=None, ge=0.0)

    def with_files(self, folder: InputFolder) -> Self:
        """The same with the rows of its CSV file, if it names one."""
        if not isinstance(self.joints, str):
            return self
        try:
            rows = read_joint_rows(folder, self.joints)
        except ScenarioError as error:
            raise ScenarioError(f"task.joints: {error}") from error
        return self.model_copy(update={"joints": rows})

    def path(self) -> JointPath:
        """A spline through the rows, or straight lines with blends."""
        if isinstance(self.joints, str):
            raise ScenarioError(f"task.joints: {self.joints!r} has not been read; only a scenario file can name a CSV")
        if len({len(row) for row in self.joints}) > 1:
            raise InvalidProblem("joints", "rows of the same number of joints are needed")
        return PATHS[self.interpolation](np.array(self.joints), self.tolerance)


def _spline(rows: FloatArray, tolerance: float | None) -> JointPath:
    if tolerance is not None:
        raise InvalidProblem("tolerance", "a spline runs through its points; say interpolation = 'blend'")
    return JointPath.through(rows)


def _blend(rows: FloatArray, tolerance: float | None) -> JointPath:
    if tolerance is None:
        raise InvalidProblem(
            "tolerance", "missing key: how far a blend may leave the lines, rad; with 0 corners are stops"
        )
    return JointPath.blended(rows, tolerance)


PATHS: dict[str, Callable[[FloatArray, float | None], JointPath]] = {"spline": _spline, "blend": _blend}


class JointPiecesTask(GivenPathTask):
    """Polynomial pieces, as a run stores its motion; rad, whatever the parameter."""

    kind: Literal["joint-path"]
    shape: Literal["pieces"]
    breakpoints: Annotated[list[float], Field(min_length=2, max_length=MOST_PIECES)]
    coefficients: Annotated[list[list[list[float]]], Field(min_length=2, max_length=MOST_COEFFICIENTS)]

    def path(self) -> JointPath:
        """The pieces themselves."""
        sizes = {(len(pieces), len(row)) for pieces in self.coefficients for row in pieces}
        if len(sizes) != 1 or next(iter(sizes))[0] != len(self.breakpoints) - 1:
            raise InvalidProblem(
                "coefficients", "an array (order, pieces, joints) is needed, one breakpoint more than pieces"
            )
        breakpoints = np.array(self.breakpoints)
        if not (np.diff(breakpoints) > 0.0).all():
            raise InvalidProblem("breakpoints", "increasing parameters are needed")
        return JointPath(breakpoints, np.array(self.coefficients))


def pieces_table(path: JointPath) -> dict[str, Any]:
    """The [task] table of a path in joint space, exactly; plain data."""
    pieces = {"breakpoints": path.breakpoints.tolist(), "coefficients": path.coefficients.tolist()}
    return {"kind": "joint-path", "shape": "pieces", **pieces}
