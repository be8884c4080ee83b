"""What every table of an obstacle says: a shape, a name, and how it moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Self

from problems import ConstantVelocity, InvalidProblem, MovingObstacle, Obstacle
from problems.base import Checked, Count, InvalidTable, at
from problems.robots import Point3
from problems.scene import ObstacleMotion
from tpbso_casadi.scenario.frames import FRAME, FramedSection, StandingFrame
from tpbso_casadi.scenario.input_files import (
    MOST_MOTION_ROWS,
    InputFolder,
    in_radians,
    motion_through,
    read_motion_rows,
)
from tpbso_casadi.scenario.validation import NotNegative, Number, Quaternion, ScenarioError, Word

MOST_NUMBERS = 8  # of a row
SLIDING_ROW, TURNING_ROW = 4, 8  # numbers of a row in space, without a quaternion and with one
MotionRow = Annotated[list[Number], Count(0, MOST_NUMBERS)]


def _printable(name: str) -> str:
    if not name.isprintable():
        raise ValueError("a name of one line is needed")
    return name


class ObstacleSection(FramedSection):
    """A table of [[obstacles]]: the interface of every shape, and how the obstacle moves.

    ``velocity`` is in m/s. ``motion`` names a file with the header ``t,x,y[,angle]`` or ``t,x,y,z[,qx,qy,qz,qw]``: s, m
    and the unit of the file's angles; where the frame is over time in which the rest of the table is stated. Once it is
    read its rows stand in ``motion_rows``, so that a result is complete without the file.
    """

    left_out: ClassVar[tuple[str, ...]] = ("name", "velocity", "motion", "motion_rows", "margin_rate")  # where empty

    shape: Word
    name: Annotated[Word, Checked(_printable)] = ""
    velocity: Annotated[list[Number], Count(2, 3)] | None = None
    motion: Word | None = None
    motion_rows: Annotated[list[MotionRow], Count(0, MOST_MOTION_ROWS)] | None = None
    margin_rate: NotNegative = 0.0

    def table(self) -> dict[str, Any]:
        """The keys as plain data, without a name, a motion or a file where there is none."""
        content = super().table()
        return {
            key: value for key, value in content.items() if key not in self.left_out or value not in (None, 0.0, "")
        }

    @property
    def corners(self) -> int:
        """How much the shape adds to a model, in corners of a polygon."""
        return 1

    @property
    def rows(self) -> int:
        """The number of rows in the table of motion."""
        return len(self.motion_rows or ())

    def build(self) -> Obstacle:
        """The obstacle itself, standing still.

        Raises:
            InvalidProblem: it cannot be.
        """
        raise NotImplementedError

    def parts(self) -> tuple[Obstacle, ...]:
        """The obstacles that it is made of, standing still: itself by default.

        Raises:
            InvalidProblem: it cannot be.
        """
        return (self.build(),)

    @property
    def pose(self) -> tuple[Sequence[float], Sequence[float] | None]:
        """The centre of a body in space, m, and its quaternion (x, y, z, w); None where it is not turned.

        Raises:
            ScenarioError: it has no pose.
        """
        raise ScenarioError(f"name: {self.name!r} is no solid in space")

    def posed(self, center: Point3, quaternion: Quaternion | None) -> Self:
        """The section of a body that has a pose, elsewhere."""
        raise NotImplementedError

    def in_world(self, frame: StandingFrame) -> Self:
        try:
            center, quaternion = self.pose
        except ScenarioError as error:
            raise InvalidTable(f"{self.shape!r} is no solid in space: state it without a frame", FRAME) from error
        rows = self.motion_rows or []
        widths = {len(row) for row in rows}  # of others it is said later what is needed
        if widths == {TURNING_ROW}:  # which say where all else is, and how it is turned
            moved = frame.rows([row[1:] for row in rows])
            return self.replaced(motion_rows=[[row[0], *new] for row, new in zip(rows, moved, strict=True)])
        motion: dict[str, Any] = {}
        if widths == {SLIDING_ROW}:
            motion["motion_rows"] = [[row[0], *frame.vector(row[1:])] for row in rows]
        if self.velocity is not None:
            with at("velocity"):
                motion["velocity"] = [*frame.vector(self.velocity)]
        return self.posed(frame.point(center), frame.turned(quaternion)).replaced(**motion)

    def check_of_tool(self) -> None:
        """Refuse a frame of a body that the tool holds.

        Raises:
            InvalidTable: it states one.
        """
        if self.frame is not None:
            raise InvalidTable("what is carried is stated in the tool's frame; leave it out", FRAME)

    @property
    def moves(self) -> bool:
        """Whether anything is said of a motion."""
        return self.velocity is not None or self.motion is not None or self.motion_rows is not None

    def with_files(self, folder: InputFolder) -> Self:
        """The obstacle with the content of the files that it names.

        Raises:
            InvalidProblem: it cannot be.
            ScenarioError: a file cannot be read, may not be, or does not say what it should.
        """
        shaped = self._with_shape(folder)
        if shaped.motion is None or shaped.motion_rows is not None:
            return shaped
        try:
            rows = read_motion_rows(folder, shaped.motion, shaped.parts()[0].dim)
        except ScenarioError as error:
            raise ScenarioError(f"motion: {error}") from error
        return shaped.replaced(motion_rows=rows)

    def _with_shape(self, folder: InputFolder) -> Self:
        """The obstacle with the shape that a file has; itself by default."""
        return self

    def in_radians(self) -> Self:
        """The table read as one in degrees, the angle of a table of motion included."""
        converted = super().in_radians()
        if self.motion_rows is None or not self._is_planar:
            return converted
        return converted.replaced(motion_rows=in_radians(self.motion_rows))

    @property
    def _is_planar(self) -> bool:
        try:
            return self.parts()[0].dim == 2
        except InvalidProblem:  # said when it is built
            return False

    def built(self, number: int) -> tuple[Obstacle, ...]:
        """The obstacles that it is made of, with its motion where it has one.

        Args:
            number: of the table, from 1, which stands in for a name where it has several parts.

        Raises:
            InvalidProblem: it cannot be, it is said to move in two ways, or its frame is still to be resolved.
        """
        self.check_in_world()
        still = self.parts()
        name = self.name or ("" if len(still) == 1 else f"obstacle {number}")
        still = tuple(part if part.name == name else replace(part, name=name) for part in still)
        if not self.moves:
            if self.margin_rate:
                raise InvalidProblem("margin_rate", "the obstacle stands still; state a velocity, or a motion")
            return still
        motion = self._motion(still[0].dim)
        return tuple(MovingObstacle(part, motion, self.margin_rate) for part in still)

    def _motion(self, dim: int) -> ObstacleMotion:
        if self.velocity is not None:
            if self.motion is not None or self.motion_rows is not None:
                raise InvalidProblem(
                    "velocity", "the motion says already how the obstacle moves; leave one of them out"
                )
            if len(self.velocity) != dim:
                reason = f"{len(self.velocity)} numbers of an obstacle in {dim} dimensions"
                raise InvalidProblem("velocity", reason)
            return ConstantVelocity(tuple(self.velocity))
        if self.motion_rows is None:
            raise InvalidProblem("motion", f"{self.motion!r} has not been read; only a scenario file can name a CSV")
        return motion_through(self.motion_rows, dim)
