"""Joint position limits: ours, the paper has none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca

from problems.limits.constraint import Constraint
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle


@dataclass(frozen=True)
class JointRange(Limit):
    """``lowest_i <= theta_i <= highest_i`` for every joint i.

    Args:
        robot: whose joints; it has position limits.
    """

    name: ClassVar[str] = "joint range"
    order: ClassVar[int | None] = 0

    robot: Robot

    @classmethod
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where the robot has one."""
        return None if robot.limits.position is None else cls(robot)

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The ranges, kept by a share ``margin`` of each."""
        ranges = self.robot.limits.position
        assert ranges is not None
        lowest, highest = (ca.horzcat(*bound) for bound in zip(*ranges, strict=True))
        spare = margin * (highest - lowest)
        return [
            Constraint(
                name=self.name,
                unit="rad",
                expression=samples.theta,
                lower=lowest + spare,
                upper=highest - spare,
                columns=self.robot.joint_names,
                formula="lowest_i <= theta_i(t_j) <= highest_i, at every sample t_j",
            )
        ]
