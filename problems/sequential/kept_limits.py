"""All limits of the joints that sequential programs keep at samples: of derivatives of the angles, and of torques."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits
from problems.sequential.joint_torques import JointTorques
from problems.sequential.limit_rows import LimitRows, limit_rows
from problems.sequential.path_speed import Grid, PathSpeed
from problems.sequential.torque_rows import TorqueRows, torque_rows


@dataclass(frozen=True)
class LinearLimits:
    """Shares of limits to first order.

    Attributes:
        parts: of one kind each.
    """

    parts: tuple[LimitRows | TorqueRows, ...]

    @property
    def values(self) -> FloatArray:
        """(rows,)."""
        return np.concatenate([part.values for part in self.parts])

    @property
    def by_speeds(self) -> FloatArray:
        """Slopes with respect to the speeds, (rows, M)."""
        return np.concatenate([part.by_speeds for part in self.parts])

    def slopes(self, moves: FloatArray) -> FloatArray:
        """With respect to moves (N k, free) of all control points, and to the speeds: (rows, free + M)."""
        return np.concatenate([part.slopes(moves) for part in self.parts])


@dataclass(frozen=True)
class KeptLimits:
    """The limits of a robot.

    Args:
        joints: of velocities, accelerations and jerks, and the joints' ranges.
        torques: None where they are not limited.
    """

    joints: JointLimits
    torques: JointTorques | None = None

    def stretch(self, motion: PathSpeed, grid: Grid) -> float:
        """The factor by which a motion has to be slowed to keep them on a grid; below 1 where time can be saved."""
        factor = motion.stretch(grid, self.joints)
        return factor if self.torques is None else max(factor, self.torques.time_scale(motion.state(grid)))

    def linear(self, motion: PathSpeed, grid: Grid, every: int) -> LinearLimits:
        """Around a motion, at every so many samples of a grid and wherever something is extreme."""
        rows = limit_rows(motion, grid, every, self.joints)
        return LinearLimits((rows,) if self.torques is None else (rows, torque_rows(motion, grid, every, self.torques)))
