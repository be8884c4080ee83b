"""Limits on the hand: orientation, place and speed of the tool.

Each is bounds on an expression of one instant, so that search, program and proof are those of any such limit. Angles
are taken from the chord between what is and what should be, 2 asin(chord / 2): exact near zero, where a cosine has lost
half of its digits, and it tells a direction from its opposite, as no sine does.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Annotated, ClassVar, Self, TypeAlias

import casadi as ca
import numpy as np

from problems.base import Angle as PlainAngle
from problems.base import (
    Coordinate,
    Count,
    FloatArray,
    InvalidProblem,
    Length,
    Quantity,
    check_fields,
    is_of_length_one,
    rotation_of,
)
from problems.limits.expression import ExpressionLimit, StatedExpression
from problems.limits.free_axis import AxisName, FreeAxis
from problems.motions import MotionView, Stated, traced
from problems.robots import Robot
from problems.scene import Obstacle

LEAST_TOLERANCE, MOST_TOLERANCE = 1e-6, 3.0  # rad; beyond, next to nothing is forbidden
Tolerance: TypeAlias = Annotated[float, Quantity((LEAST_TOLERANCE, MOST_TOLERANCE), "rad")]
ToolSpeedBound: TypeAlias = Annotated[float, Quantity((1e-6, 1e6), "m/s")]
Direction: TypeAlias = Annotated[
    tuple[Annotated[float, Quantity((-1e6, 1e6), "1")], ...], Count(2, 3, what="coordinates")
]
Point: TypeAlias = Annotated[tuple[Coordinate, ...], Count(2, 3, what="coordinates")]
Sizes: TypeAlias = Annotated[tuple[Length, ...], Count(2, 3, what="lengths")]
Turn: TypeAlias = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class HandConstraint:
    """A limit on the tool at every time; a kind of limit, like a class of them.

    A subclass is a frozen dataclass whose fields are the keys of a table.
    """

    kind: ClassVar[str]

    name: str = ""

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.name:
            object.__setattr__(self, "name", self.kind)
        self.check()

    @abstractmethod
    def check(self) -> None:
        """Check that the fields fit each other.

        Raises:
            InvalidProblem: naming one that does not.
        """

    @abstractmethod
    def stated(self, robot: Robot) -> StatedExpression:
        """The bounds for a robot.

        Raises:
            InvalidProblem: it has not what they are about.
        """

    def for_robot(self, robot: Robot, obstacles: Sequence[Obstacle]) -> ExpressionLimit:
        """The limit of a robot."""
        return self.stated(robot).for_robot(robot, obstacles)

    def from_posture(self, robot: Robot, theta: FloatArray) -> Self:
        """The constraint of a motion from a posture (dof,) on; itself by default."""
        return self

    def _dimensions(self, robot: Robot, field: str, coordinates: int) -> None:
        if coordinates != robot.dim:
            reason = f"{self.name!r}: {field} has {coordinates} coordinates, for a robot in {robot.dim} dimensions"
            raise InvalidProblem("constraints", reason)

    def _in_space(self, robot: Robot) -> None:
        if robot.dim != 3:
            raise InvalidProblem("constraints", f"{self.name!r}: of robots in space alone")

    def _bounded(
        self,
        robot: Robot,
        unit: str,
        expression: Stated,
        lower: Sequence[float] | None = None,
        upper: Sequence[float] | None = None,
    ) -> StatedExpression:
        function = traced(expression, robot, f"constraint {self.name!r}", differentiates=False)
        sides = (None if side is None else tuple(map(float, side)) for side in (lower, upper))
        return StatedExpression(self.name, unit, function, *sides)


@dataclass(frozen=True, kw_only=True)
class Upright(HandConstraint):
    """An axis of the tool stays within a cone.

    Attributes:
        name: in tables and verdicts; that of the kind if left out.
        axis: of the tool's frame, of any length; in the plane x is along the last link.
        toward: direction in the world, of any length, in the middle of the cone.
        tolerance: largest angle between the two, rad.
    """

    kind: ClassVar[str] = "upright"

    axis: Direction = (0.0, 0.0, 1.0)
    toward: Direction = (0.0, 0.0, -1.0)
    tolerance: Tolerance

    def check(self) -> None:
        for field in ("axis", "toward"):
            _unit(field, getattr(self, field))
        if len(self.axis) != len(self.toward):
            reason = f"{len(self.toward)} coordinates, the axis has {len(self.axis)}"
            raise InvalidProblem("toward", reason)

    def stated(self, robot: Robot) -> StatedExpression:
        self._dimensions(robot, "axis", len(self.axis))
        axis, toward = _unit("axis", self.axis), _unit("toward", self.toward)

        def angle(m: MotionView) -> ca.SX:
            return _angle_of_chord(tool_rotation(m) @ ca.DM(axis) - ca.DM(toward))

        return self._bounded(robot, "rad", angle, upper=[self.tolerance])


@dataclass(frozen=True, kw_only=True)
class ToolOrientation(HandConstraint):
    """The tool stays turned as stated, in space.

    Attributes:
        name: in tables and verdicts; that of the kind if left out.
        quaternion: (x, y, z, w), of the tool in the world, of length 1.
        tolerance: largest angle of the turn from there, rad; of a free axis from its direction.
        free: an axis of the tool, about which any turn will do.
    """

    kind: ClassVar[str] = "tool orientation"

    quaternion: Turn
    tolerance: Tolerance
    free: AxisName | None = None

    def check(self) -> None:
        check_turn(self.quaternion)
        FreeAxis.stated(self.free, None, 0.0)

    def stated(self, robot: Robot) -> StatedExpression:
        """The bound of the angle of the turn, rad, whose chord is the rotations' difference over the root of two."""
        self._in_space(robot)
        wanted = np.array(rotation_of(self.quaternion), dtype=np.float64)
        if self.free is not None:
            axis = FreeAxis(self.free).index
            one, toward = tuple(np.eye(3)[axis].tolist()), tuple(wanted[:, axis].tolist())
            return Upright(name=self.name, axis=one, toward=toward, tolerance=self.tolerance).stated(robot)

        def angle(m: MotionView) -> ca.SX:
            return _angle_of_chord(ca.vec(m.rotation - ca.DM(wanted)) / sqrt(2.0))

        return self._bounded(robot, "rad", angle, upper=[self.tolerance])


@dataclass(frozen=True, kw_only=True)
class ToolRegion(HandConstraint):
    """The tool's point stays within a box, on one side of a plane, or both.

    Attributes:
        name: in tables and verdicts; that of the kind if left out.
        center: of a box, m.
        size: of the box along its own axes, m.
        quaternion: (x, y, z, w), how the box is turned, in space; not at all if left out.
        angle: likewise in the plane, rad.
        point: of a plane, m.
        normal: of the plane, of any length: the tool stays on the side to which it points.
    """

    kind: ClassVar[str] = "tool region"

    center: Point | None = None
    size: Sizes | None = None
    quaternion: Turn | None = None
    angle: PlainAngle = 0.0
    point: Point | None = None
    normal: Direction | None = None

    def check(self) -> None:
        for one, other in (("center", "size"), ("size", "center"), ("point", "normal"), ("normal", "point")):
            if getattr(self, one) is not None and getattr(self, other) is None:
                raise InvalidProblem(other, f"missing beside {one}")
        if self.center is None and self.point is None:
            raise InvalidProblem("center", "say a box (center, size), or one side of a plane (point, normal)")
        if self.quaternion is not None:
            check_turn(self.quaternion)
        for key in ("quaternion", "angle"):
            if getattr(self, key) and self.center is None:
                raise InvalidProblem(key, "only a box is turned: say center and size")
        if self.normal is not None:
            _unit("normal", self.normal)
        stated = {key: len(value) for key in ("center", "size", "point", "normal") if (value := getattr(self, key))}
        first, coordinates = next(iter(stated.items()))
        for field, count in stated.items():
            if count != coordinates:
                raise InvalidProblem(field, f"{count} numbers, {first} has {coordinates}")
        if coordinates == 2 and self.quaternion is not None:
            raise InvalidProblem("quaternion", "of a box in space; say angle in the plane")
        if coordinates == 3 and self.angle:
            raise InvalidProblem("angle", "of a box in the plane; say quaternion in space")

    def stated(self, robot: Robot) -> StatedExpression:
        """The bounds of the tool's place along the axes of the box, and of its distance from the plane, m."""
        field = "point" if self.center is None else "center"
        self._dimensions(robot, field, len(getattr(self, field)))
        axes, middle, half = [], [], []
        if self.center is not None and self.size is not None:
            axes += list(self._axes.T)
            middle += list(self._axes.T @ np.array(self.center))
            half += [length / 2.0 for length in self.size]
        least, most = [-value for value in half], [*half]
        if self.point is not None and self.normal is not None:
            normal = _unit("normal", self.normal)
            axes.append(normal)
            middle.append(float(normal @ np.array(self.point)))
            least, most = [*least, 0.0], [*most, np.inf]

        def place(m: MotionView) -> ca.SX:
            return ca.DM(np.array(axes)) @ m.tool - ca.DM(middle)

        return self._bounded(robot, "m", place, least, None if self.center is None else most)

    @property
    def _axes(self) -> FloatArray:
        """The axes of the box as columns, (dim, dim)."""
        if self.center is not None and len(self.center) == 2:
            cosine, sine = np.cos(self.angle), np.sin(self.angle)
            return np.array([[cosine, -sine], [sine, cosine]])
        return np.eye(3) if self.quaternion is None else np.array(rotation_of(self.quaternion), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class ToolSpeed(HandConstraint):
    """The tool's point is no faster than stated.

    Attributes:
        name: in tables and verdicts; that of the kind if left out.
        max: largest speed, m/s.
    """

    kind: ClassVar[str] = "tool speed"

    max: ToolSpeedBound

    def check(self) -> None:
        """Check nothing, as no field depends on another."""

    def stated(self, robot: Robot) -> StatedExpression:
        return self._bounded(robot, "m/s", lambda m: ca.norm_2(m.tool_velocity), upper=[self.max])


def tool_rotation(m: MotionView) -> ca.SX:
    """The matrix of the tool's axes, (dim, dim); in the plane x is along the last link."""
    if m.robot.dim == 3:
        return m.rotation
    joint, end = m.positions[m.robot.dof - 1 : m.robot.dof + 1]
    along = (end - joint) / ca.norm_2(end - joint)
    return ca.horzcat(along, ca.vertcat(-along[1], along[0]))


def _angle_of_chord(chord: ca.SX) -> ca.SX:
    """The angle between two directions from their difference; no more than half a turn whatever the rounding."""
    return 2.0 * ca.asin(ca.fmin(1.0, ca.norm_2(chord) / 2.0))


def _unit(field: str, direction: Sequence[float]) -> FloatArray:
    length = float(np.linalg.norm(direction))
    if not length > 0.0:
        raise InvalidProblem(field, "a direction is needed, not zero")
    return np.array(direction) / length


def check_turn(quaternion: Turn) -> None:
    """Check that four numbers are a quaternion of length 1.

    Raises:
        InvalidProblem: they are not.
    """
    if not is_of_length_one(quaternion):
        raise InvalidProblem("quaternion", f"{quaternion} is not of length 1")
