"""The tool of a robot: where it is, and how far from the joints it can be."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array, cached_function, structure_key
from problems.robots.chain import Chain
from problems.robots.transform import Transform, as_rows, quaternions_of

POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")


class Tool(ABC):
    """The tool of a robot."""

    @abstractmethod
    def position(self, theta: Matrix) -> Matrix:
        """Positions of the tool, (n, dim), m, in n postures (n, dof), rad."""

    def coordinates(self, theta: FloatArray) -> dict[str, FloatArray]:
        """The tool's coordinates in n postures (n, dof), rad: columns (n,) by name; x, y and, in space, z, m."""
        place = as_array(self.position(ca.DM(theta)))
        return dict(zip("xyz", place.T, strict=False))


@dataclass(frozen=True, eq=False)
class LastFrame(Tool):
    """A tool in the last of a robot's frames.

    Args:
        positions: of all frames, each (n, dim), m, in postures (n, dof), rad.
    """

    positions: Callable[[Matrix], tuple[Matrix, ...]]

    def position(self, theta: Matrix) -> Matrix:
        return self.positions(theta)[-1]


@dataclass(frozen=True, eq=False)
class ArmTool(Tool):
    """The tool on a body of an arm in space.

    Args:
        chain: of the joints.
        base: the pose of the chain's base.
        frame: the transform from the tool's frame to that of its body.
    """

    chain: Chain
    base: Transform
    frame: Transform

    def position(self, theta: Matrix) -> Matrix:
        return self.pose(theta)[0]

    def pose(self, theta: Matrix) -> tuple[Matrix, Matrix]:
        """Position (n, 3), m, and rotation matrix row by row (n, 9) of the tool in n postures (n, dof)."""
        if self._function is not None:
            position, rotation = self._function(theta.T)
            return position.T, rotation.T
        return self._symbolic(theta)

    def _symbolic(self, theta: Matrix) -> tuple[Matrix, Matrix]:
        pose, rows = self.chain.frames(theta, self.base)[self.chain.carrier] @ self.frame, theta.shape[0]
        return as_rows(pose.translation, rows), as_rows([entry for row in pose.rotation for entry in row], rows)

    @cached_property
    def _function(self) -> ca.Function | None:
        """The function of n postures (dof, n) to position (3, n) and rotation (9, n); None with symbols in it."""
        parts = (self.chain, self.base, self.frame)
        if structure_key(*parts) is None:
            return None
        theta = ca.SX.sym("theta", len(self.chain.joints))

        def make() -> ca.Function:
            return ca.Function("tool", [theta], [ca.densify(part.T) for part in self._symbolic(theta.T)])

        return cached_function(make, "tool", *parts)

    def at(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The tool's poses in numbers: positions (n, 3), m, and rotation matrices (n, 3, 3)."""
        position, rotation = (as_array(part) for part in self.pose(ca.DM(theta)))
        return position, rotation.reshape(-1, 3, 3)

    def coordinates(self, theta: FloatArray) -> dict[str, FloatArray]:
        """The tool's position x, y, z, m, and its orientation, the unit quaternion qx, qy, qz, qw."""
        place, rotation = (as_array(part) for part in self.pose(ca.DM(theta)))
        return dict(zip(POSE, [*place.T, *quaternions_of(rotation).T], strict=True))

    @property
    def distance(self) -> float:
        """The distance of the tool from the frame of its body, m."""
        return float(np.linalg.norm([float(part) for part in self.frame.translation]))

    @cached_property
    def levers(self) -> FloatArray:
        """The largest distance of the tool from each joint's axis, (dof,), m; 1 for a joint that slides."""
        place = np.array([[float(part) for part in self.frame.translation]])
        return np.asarray(self.chain.levers(self.chain.carrier, place)[0])
