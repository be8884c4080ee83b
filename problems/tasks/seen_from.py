"""Places of a tool in the frame of a tip that moves, such as a workpiece on a turntable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem, Matrix, Operand
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle
from problems.tasks.place import Choice, Place
from problems.tasks.pose import Pose, middle_of, separate_postures, usable_postures


@dataclass(frozen=True)
class SeenFrom(Place):
    """A pose of the tool in the frame of another tip of the robot.

    Args:
        frame: name of the tip in whose frame it is stated.
        pose: of the tool.
    """

    chosen_by_inverse_kinematics: ClassVar[bool] = False
    always_reached: ClassVar[bool] = False
    within: ClassVar[float] = 0.0  # type: ignore[misc]
    cost: ClassVar[float] = 0.0  # type: ignore[misc]

    frame: str
    pose: Pose

    def _view(self, robot: Robot, field: str = "goal") -> SpatialArm:
        """The robot as seen from the frame."""
        if not isinstance(robot, SpatialArm):
            raise InvalidProblem(field, f"{type(robot).__name__} has no frame that moves")
        return robot.seen_from(self.frame)

    @property
    def unit(self) -> str:
        return self.pose.unit

    def check(self, robot: Robot, obstacles: Sequence[Obstacle], field: str, name: str = "") -> None:
        """Check the pose in the frame."""
        self.pose.check(self._view(robot, field), (), field, name)

    def choices(self, robot: Robot) -> tuple[Choice, ...]:
        return self.pose.choices(robot)

    def branches(
        self, robot: Robot, obstacles: Sequence[Obstacle], near: FloatArray | None, field: str
    ) -> tuple[Place, ...]:
        found = self.pose.postures_there(self._view(robot, field), near, field)
        usable = usable_postures(robot, obstacles, found, f"with the tool there as seen from {self.frame!r}", field)
        return tuple(map(self.on_branch, separate_postures(usable, middle_of(robot) if near is None else near)))

    def on_branch(self, theta: FloatArray) -> Place:
        return replace(self, pose=replace(self.pose, branch=tuple(theta.tolist())))

    @property
    def branch_angles(self) -> tuple[float, ...]:
        return self.pose.branch_angles

    def posture(
        self, robot: Robot, chosen: Matrix, elbow: Operand, near: Matrix | None
    ) -> tuple[Matrix, Matrix | None]:
        return self.pose.posture(self._view(robot), chosen, elbow, near)

    def postures(self, robot: Robot, chosen: FloatArray, elbow: float = 1.0) -> tuple[FloatArray, NDArray[np.bool_]]:
        return self.pose.postures(self._view(robot), chosen, elbow)

    def near(self, robot: Robot, theta: FloatArray) -> tuple[FloatArray, bool]:
        return self.pose.near(self._view(robot), theta)

    def projected(self, robot: Robot, theta: FloatArray) -> FloatArray:
        return self.pose.projected(self._view(robot), theta)

    def miss(self, robot: Robot, theta: Matrix) -> Matrix:
        return self.pose.miss(self._view(robot), theta)

    def tolerance(self, robot: Robot) -> float:
        return self.pose.tolerance(robot)

    def position(self, robot: Robot) -> FloatArray:
        """The position of the tool at the branch's posture in the world, (3,), m; in the frame where there is none."""
        branch = self.branch_angles
        if not branch or not isinstance(robot, SpatialArm):
            return self.pose.position(robot)
        return np.asarray(robot.tool.at(np.array([branch]))[0][0])

    def taken(self, robot: Robot, theta: FloatArray) -> str:
        return self.pose.taken(self._view(robot), theta)

    def table(self) -> dict[str, Any]:
        return {"frame": self.frame, **self.pose.table()}
