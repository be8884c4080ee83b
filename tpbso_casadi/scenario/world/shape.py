"""The interface of the [[obstacles]] tables of a scenario file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from problems import InvalidProblem, Obstacle
from problems.scene.moving.constant_velocity import ConstantVelocity
from problems.scene.moving.moving_obstacle import MovingObstacle
from problems.scene.moving.obstacle_motion import ObstacleMotion
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import NotNegative, Number, Section, Word
from tpbso_casadi.scenario.world.obstacle_motions import motion_through, read_motion_rows


class ObstacleSection(Section):
    """One of the [[obstacles]]: the interface of every shape, and how the obstacle moves.

    ``velocity`` is in m/s. ``motion`` names a file with the header ``t,x,y[,angle]`` or ``t,x,y,z[,qx,qy,qz,qw]``:
    where the frame is over time in which the rest of the table is stated; its rows come into ``motion_rows``.
    """

    shape: Word
    velocity: Annotated[list[Number], Field(min_length=2, max_length=3)] | None = None
    motion: Word | None = None
    motion_rows: list[list[Number]] | None = None
    margin_rate: NotNegative = 0.0

    @classmethod
    def variant(cls, table: Mapping[str, Any]) -> type[ObstacleSection]:
        """The section that reads a table of this shape; this one, where the shape is the same in plane and space."""
        return cls

    @property
    def corners(self) -> int:
        """How many corners its clearance is computed from; 1 for what has none."""
        return 1

    def build(self) -> Obstacle:
        """The obstacle itself, standing still.

        Raises:
            InvalidProblem: it cannot be.
        """
        raise NotImplementedError

    @property
    def moves(self) -> bool:
        """Whether anything is said of a motion."""
        return self.velocity is not None or self.motion is not None or self.motion_rows is not None

    def with_files(self, folder: InputFolder) -> ObstacleSection:
        """The same obstacle with the rows of the file that it names.

        Raises:
            ScenarioError: it cannot be read, or may not be.
        """
        if self.motion is None or self.motion_rows is not None:
            return self
        return self.model_copy(update={"motion_rows": read_motion_rows(folder, self.motion)})

    def built(self) -> Obstacle:
        """The obstacle, with its motion where it has one.

        Raises:
            InvalidProblem: it cannot be, or it is said to move in two ways.
        """
        still = self.build()
        if not self.moves:
            if self.margin_rate:
                raise InvalidProblem("margin_rate", "the obstacle stands still; state a velocity, or a motion")
            return still
        return MovingObstacle(still, self._motion(still.dim), self.margin_rate)

    def _motion(self, dim: int) -> ObstacleMotion:
        if self.velocity is not None:
            if self.motion is not None or self.motion_rows is not None:
                raise InvalidProblem("velocity", "the motion says already how the obstacle moves")
            return ConstantVelocity(tuple(self.velocity))
        if self.motion_rows is None:
            raise InvalidProblem("motion", "its file has not been read")
        return motion_through(self.motion_rows, dim)
