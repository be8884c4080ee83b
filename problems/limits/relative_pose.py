"""Two arms hold one thing: the tool of one stays where it is as seen from the tool of the other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sin
from typing import Annotated, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, Quantity, rotation_of
from problems.limits.accuracy import rotation_away
from problems.limits.expression import StatedExpression
from problems.limits.hand import HandConstraint, Point, Turn, check_turn
from problems.motions import MotionView
from problems.robots import Robot, SpatialArm, quaternions_of


@dataclass(frozen=True, kw_only=True)
class RelativePose(HandConstraint):
    """The tool of an arm keeps its pose in the frame of another arm's tool, within an accuracy.

    Attributes:
        name: in tables and verdicts; that of the kind if left out.
        of: name of the arm whose tool keeps its pose.
        to: name of the arm in the frame of whose tool it is stated.
        position: of the tool in that frame, m; where a motion begins, as it is there if left out.
        quaternion: (x, y, z, w), how the tool is turned in that frame, of length 1; likewise.
        accuracy: how far the tool may be from there, m.
        tolerance: how far it may be turned from there, rad.
    """

    kind: ClassVar[str] = "relative pose"

    of: str
    to: str
    position: Point | None = None
    quaternion: Turn | None = None
    accuracy: Annotated[float, Quantity((1e-6, 1.0), "m")] = 1e-3
    tolerance: Annotated[float, Quantity((1e-6, 1.5), "rad")] = 0.01

    def check(self) -> None:
        if self.of == self.to:
            raise InvalidProblem("to", f"{self.to!r} is the same arm")
        if (self.position is None) != (self.quaternion is None):
            missing = "position" if self.position is None else "quaternion"
            raise InvalidProblem(missing, "missing beside the other part of the pose")
        if self.position is not None and len(self.position) != 3:
            raise InvalidProblem("position", f"{len(self.position)} coordinates; arms are in space")
        if self.quaternion is not None:
            check_turn(self.quaternion)

    def from_posture(self, robot: Robot, theta: FloatArray) -> Self:
        if self.position is not None:
            return self
        (p, r), (q, s) = (_tool_at(self._arm(robot), arm, theta) for arm in (self.of, self.to))
        (turn,) = quaternions_of((s.T @ r).reshape(1, 9))
        x, y, z, w = turn.tolist()
        return replace(self, position=tuple((s.T @ (p - q)).tolist()), quaternion=(x, y, z, w))

    def stated(self, robot: Robot) -> StatedExpression:
        """The bounds of the distance, m, of the sine of the angle, and of its cosine, which tells half a turn."""
        arm = self._arm(robot)
        if self.position is None or self.quaternion is None:
            raise InvalidProblem("constraints", f"{self.name!r}: say position and quaternion, or joints at the start")
        place, turn = np.array(self.position), np.array(rotation_of(self.quaternion), dtype=np.float64)
        own, other = arm.tip_places(self.of), arm.tip_places(self.to)

        def away(m: MotionView) -> ca.SX:
            (p, r), (q, s) = tool_at_tip(m, own), tool_at_tip(m, other)
            sine, cosine = rotation_away(s @ ca.DM(turn), r)
            return ca.vertcat(ca.norm_2(p - q - s @ ca.DM(place)), ca.norm_2(sine), -cosine)

        return self._bounded(robot, "m, 1", away, None, (self.accuracy, sin(self.tolerance), 0.0))

    def _arm(self, robot: Robot) -> SpatialArm:
        if not isinstance(robot, SpatialArm):
            raise InvalidProblem("constraints", f"{self.name!r}: of arms in space alone")
        for field, arm in (("of", self.of), ("to", self.to)):
            try:
                robot.tip_places(arm)
            except InvalidProblem as error:
                raise InvalidProblem("constraints", f"{self.name!r}: {field}: {error.reason}") from error
        return robot


def tool_at_tip(m: MotionView, places: slice) -> tuple[ca.SX, ca.SX]:
    """Position (3, 1), m, and rotation (3, 3) of the tool at a tip.

    Args:
        m: an instant of a motion.
        places: numbers among the positions of the tip's four points, :meth:`SpatialArm.tip_places`.
    """
    origin, *ends = m.positions[places]
    return origin, ca.horzcat(*(end - origin for end in ends))


def _tool_at(arm: SpatialArm, tip: str, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    position, rotation = arm.at_tips[tip].tool.at(theta[None])
    return position[0], rotation[0]
