"""Curves of the tool, straight, along an arc or with corners; its orientation there; joints that follow."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from itertools import pairwise

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray, InvalidProblem, as_array
from problems.limits import Bound, StatedExpression, rotation_away
from problems.motions import JointPath, MotionView, Stated, traced
from problems.robots import Robot, SpatialArm, geometry_of
from problems.tasks.place import Place, Position
from problems.tasks.pose import Pose

STRAIGHT = 1e-7  # sine of an angle between lines, below which they are one


@dataclass(frozen=True, kw_only=True)
class FollowingSettings:
    """Settings of joints that follow a curve of the tool.

    Values are chosen.

    Attributes:
        first_points: points of the curve at the beginning.
        most_points: points of the curve after all halvings.
        spline_share: share of the accuracy that a spline through followed points may use.
        farthest: rad or m: joints that go farther from one point to the next have jumped.
    """

    first_points: int = 9
    most_points: int = 513
    spline_share: float = 0.1
    farthest: float = 0.3


SETTINGS = FollowingSettings()


ALIKE = 1e-9  # rad: rotations that differ by less are the same
TURNED_BACK = -0.99  # cosine of an angle between two lines, beyond which a corner is not rounded
PARABOLA = 17  # points of one
LEAST = 2.0  # no sine or cosine is below its negative


class ToolCurve(ABC):
    """A curve that the tool follows. A subclass is a frozen dataclass; lengths in m, s is the share of the length."""

    @property
    @abstractmethod
    def length(self) -> float:
        """The length of the whole curve."""

    @property
    def slack(self) -> float:
        """The distance of its own points from what is asked for, m; 0 by default."""
        return 0.0

    @abstractmethod
    def points(self, s: FloatArray) -> FloatArray:
        """Positions of the tool, (n, dim), at shares (n,) from 0 to 1."""

    @abstractmethod
    def away(self, tool: ca.SX) -> ca.SX:
        """The distance of a point (dim, 1) from the curve, prolonged beyond its ends."""

    @abstractmethod
    def along(self, tool: ca.SX) -> ca.SX:
        """The length along the curve of a point near it, from 0 to the whole length."""


@dataclass(frozen=True, eq=False)
class StraightLine(ToolCurve):
    """The straight line from a point (dim,) to another.

    Raises:
        InvalidProblem: they are the same.
    """

    start: FloatArray
    goal: FloatArray

    def __post_init__(self) -> None:
        if not self.length > 0.0:
            raise InvalidProblem("goal", "the tool is there already")

    @property
    def length(self) -> float:
        return float(np.linalg.norm(self.goal - self.start))

    @property
    def _direction(self) -> FloatArray:
        return np.asarray((self.goal - self.start) / self.length)

    def points(self, s: FloatArray) -> FloatArray:
        return np.asarray(self.start + s[:, None] * (self.goal - self.start))

    def away(self, tool: ca.SX) -> ca.SX:
        sideways = scipy.linalg.null_space(self._direction[None]).T
        return ca.sqrt(ca.sumsqr(ca.DM(sideways) @ (tool - ca.DM(self.start))))

    def along(self, tool: ca.SX) -> ca.SX:
        return ca.dot(ca.DM(self._direction), tool - ca.DM(self.start))


@dataclass(frozen=True, eq=False)
class Arc(ToolCurve):
    """The arc of a circle from a point (dim,) through another to a third, less than a whole turn.

    Raises:
        InvalidProblem: no circle goes through the three.
    """

    start: FloatArray
    through: FloatArray
    goal: FloatArray

    def __post_init__(self) -> None:
        one, two = self.through - self.start, self.goal - self.start
        lengths = float(np.linalg.norm(one)) * float(np.linalg.norm(two))
        cosine = float(one @ two) / lengths if lengths else 1.0
        if not 1.0 - cosine**2 > STRAIGHT**2:
            raise InvalidProblem("through", "the three points are on a line, or two are the same; leave it out")

    @cached_property
    def _circle(self) -> tuple[FloatArray, float, FloatArray, float]:
        """Center (dim,), radius, directions (2, dim) to the middle of the arc and from there on, half of its angle."""
        one, two = self.through - self.start, self.goal - self.start
        normal = np.array([[one @ one, one @ two], [one @ two, two @ two]])
        shares = np.linalg.solve(normal, np.diag(normal) / 2.0)
        center = self.start + shares[0] * one + shares[1] * two
        radius = float(np.linalg.norm(self.start - center))
        first = (self.start - center) / radius
        across = [leg - first * (leg @ first) for leg in (one, two)]  # one of which may be a diameter
        second = max(across, key=np.linalg.norm)
        second /= np.linalg.norm(second)
        x, y = (self.goal - center) @ np.array([first, second]).T
        passed = np.arctan2(*((self.through - center) @ np.array([second, first]).T)) % (2.0 * np.pi)
        angle = float(np.arctan2(y, x) % (2.0 * np.pi))
        if passed > angle:  # the other way round
            second, angle = -second, 2.0 * np.pi - angle
        half = angle / 2.0
        middle = np.cos(half) * first + np.sin(half) * second
        return center, radius, np.array([middle, np.cos(half) * second - np.sin(half) * first]), half

    @property
    def length(self) -> float:
        _, radius, _, half = self._circle
        return 2.0 * radius * half

    def points(self, s: FloatArray) -> FloatArray:
        center, radius, (middle, onward), half = self._circle
        angle = (2.0 * s[:, None] - 1.0) * half
        return np.asarray(center + radius * (np.cos(angle) * middle + np.sin(angle) * onward))

    def _seen(self, tool: ca.SX) -> tuple[ca.SX, ca.SX]:
        center, _, (middle, onward), _ = self._circle
        since = tool - ca.DM(center)
        return ca.dot(ca.DM(middle), since), ca.dot(ca.DM(onward), since)

    def away(self, tool: ca.SX) -> ca.SX:
        center, radius, directions, _ = self._circle
        x, y = self._seen(tool)
        within = ca.sqrt(x**2 + y**2) - radius
        if tool.numel() == 2:
            return ca.fabs(within)
        beside = ca.dot(ca.DM(np.cross(*directions)), tool - ca.DM(center))
        return ca.sqrt(beside**2 + within**2)

    def along(self, tool: ca.SX) -> ca.SX:
        _, radius, _, half = self._circle
        x, y = self._seen(tool)
        return radius * (ca.atan2(y, x) + half)


@dataclass(frozen=True, eq=False)
class Corners(ToolCurve):
    """Straight lines from point to point (n, dim), with corners rounded by parabolas.

    Attributes:
        stops: the points, m.
        rounding: how far the curve is from a corner, m; less where a line is too short for that.

    Raises:
        InvalidProblem: two points in a row are the same, or the way turns back on itself.
    """

    stops: FloatArray
    rounding: float

    def __post_init__(self) -> None:
        legs = np.diff(self.stops, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        if not len(legs) or not (lengths > 0.0).all():
            raise InvalidProblem("points", "two of them in a row are the same, or there is none")
        units = legs / lengths[:, None]
        back = np.flatnonzero((units[1:] * units[:-1]).sum(axis=1) < TURNED_BACK)
        if back.size:
            raise InvalidProblem("points", f"the way turns back at {tuple(self.stops[back[0] + 1].tolist())}")

    @cached_property
    def _curve(self) -> tuple[FloatArray, FloatArray]:
        """Many points of the curve (m, dim), and the length up to each, (m,), m."""
        legs = np.diff(self.stops, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        units, found = legs / lengths[:, None], [self.stops[:1]]
        share = np.linspace(0.0, 1.0, PARABOLA)[:, None]
        for number, corner in enumerate(self.stops[1:-1]):
            turn = float(np.linalg.norm(units[number + 1] - units[number]))
            room = min(lengths[number], lengths[number + 1]) / 2.0
            back = room if turn * room <= 4.0 * self.rounding else 4.0 * self.rounding / turn
            first, last = corner - back * units[number], corner + back * units[number + 1]
            found.append((1.0 - share) ** 2 * first + 2.0 * share * (1.0 - share) * corner + share**2 * last)
        points = np.concatenate([*found, self.stops[-1:]])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        kept = np.append(True, steps > 0.0)
        return points[kept], np.append(0.0, np.cumsum(steps[steps > 0.0]))

    @property
    def length(self) -> float:
        return float(self._curve[1][-1])

    def points(self, s: FloatArray) -> FloatArray:
        points, along = self._curve
        return np.column_stack([np.interp(s * along[-1], along, column) for column in points.T])

    def away(self, tool: ca.SX) -> ca.SX:
        squared = []
        for first, last in pairwise(self.stops):
            leg = last - first
            share = ca.dot(ca.DM(leg), tool - ca.DM(first)) / float(leg @ leg)
            foot = ca.DM(first) + ca.DM(leg) * ca.fmax(0.0, ca.fmin(1.0, share))
            squared.append(ca.sumsqr(tool - foot))
        return ca.sqrt(reduce(ca.fmin, squared))

    @property
    def slack(self) -> float:
        return self.rounding

    def along(self, tool: ca.SX) -> ca.SX:
        return ca.SX(0.0)


@dataclass(frozen=True, eq=False)
class ToolPath:
    """A curve of the tool, which turns evenly along it.

    Attributes:
        way: of its point.
        turned: rotations (3, 3) at start and goal; None where it may turn as it likes, and in the plane.
    """

    way: ToolCurve
    turned: tuple[FloatArray, FloatArray] | None = None

    @cached_property
    def _turn(self) -> FloatArray:
        """The turn from the start's rotation to the goal's, axis times angle in the tool's frame, (3,), rad."""
        assert self.turned is not None
        start, goal = self.turned
        turn = scipy.spatial.transform.Rotation.from_matrix(start.T @ goal).as_rotvec()
        return turn if np.linalg.norm(turn) > ALIKE else np.zeros(3)

    def places(self, s: FloatArray) -> list[Place]:
        """Places of the tool at shares (n,) of the length."""
        points = self.way.points(s)
        if points.shape[1] == 2:
            return [Position(tuple(point)) for point in points.tolist()]
        if self.turned is None:
            return [Pose(tuple(point)) for point in points.tolist()]
        rotation = scipy.spatial.transform.Rotation
        turned = rotation.from_matrix(self.turned[0]) * rotation.from_rotvec(s[:, None] * self._turn)
        pairs = zip(points.tolist(), turned.as_quat().tolist(), strict=True)
        return [Pose(tuple(point), tuple(quaternion)) for point, quaternion in pairs]

    def constraints(self, robot: Robot, accuracy: float, angular_accuracy: float) -> list[StatedExpression]:
        """Limits on the distance from the curve at every time, m, and on the sine of the angle."""

        def near(m: MotionView) -> ca.SX:
            along = self.way.along(m.tool)
            beyond = ca.fmax(0.0, ca.fmax(-along, along - self.way.length))
            return ca.sqrt(self.way.away(m.tool) ** 2 + beyond**2)

        def facing(m: MotionView) -> ca.SX:
            sine, cosine = self._missing(m)
            return ca.vertcat(ca.norm_2(sine), -cosine)

        found = [_stated("path accuracy", "m", near, robot, None, (accuracy,))]
        if self.turned is not None:
            most = float(np.sin(min(angular_accuracy, np.pi / 2.0)))
            found.append(_stated("angular accuracy", "rad", facing, robot, (-LEAST, -LEAST), (most, 0.0)))
        return found

    def speed_limit(self, robot: Robot, most: float) -> StatedExpression:
        """The limit of the tool's speed to so many m/s."""
        return _stated("tool speed on the way", "m/s", lambda m: ca.norm_2(m.tool_velocity), robot, None, (most,))

    def _missing(self, moment: MotionView) -> tuple[ca.SX, ca.SX]:
        """The tool's error of orientation: axis times sine of the angle, (3, 1), and the cosine."""
        assert self.turned is not None
        wanted = ca.SX(ca.DM(self.turned[0]))
        angle = float(np.linalg.norm(self._turn))
        if angle:
            turned = angle / self.way.length * self.way.along(moment.tool)
            cross = ca.skew(ca.DM(self._turn / angle))
            wanted = wanted @ (ca.DM.eye(3) + ca.sin(turned) * cross + (1.0 - ca.cos(turned)) * (cross @ cross))
        return rotation_away(wanted, moment.rotation)

    def followed(
        self, robot: Robot, start: FloatArray, accuracy: float, angular_accuracy: float, toward: FloatArray | None
    ) -> JointPath:
        """The path of joints that follows the curve, from a posture in which the tool is at its start.

        Points on the curve are projected onto one after the other, each from the posture before, the shortest way; a
        spline runs through all of them, of which there are as many as its nearness to the curve needs.

        Args:
            robot: that moves.
            start: the posture (dof,), rad.
            accuracy: of which the spline uses up a share, m.
            angular_accuracy: likewise, rad.
            toward: a posture (dof,) that joints tend to as far as the tool leaves them free; None for the shortest way.

        Raises:
            InvalidProblem: a point cannot be reached from the one before, or not so nearly.
        """
        count, share = SETTINGS.first_points, SETTINGS.spline_share
        while count <= SETTINGS.most_points:
            path = JointPath.through(self._postures(robot, start, count, toward))
            if self._is_near(robot, path, share * accuracy + self.way.slack, share * angular_accuracy):
                return path
            count = 2 * count - 1
        raise InvalidProblem("accuracy", f"{accuracy:g} m, or {angular_accuracy:g} rad, needs too many points")

    def _postures(self, robot: Robot, start: FloatArray, count: int, toward: FloatArray | None) -> FloatArray:
        """Postures (count, dof) with the tool at equal steps along the curve."""
        shares = np.linspace(0.0, 1.0, count)
        found = [start]
        for number, place in enumerate(self.places(shares)[1:], start=1):
            before = found[-1]
            guess = before if toward is None else before + (toward - before) / (count - number + 1)
            theta, reached = place.near(robot, guess)
            jumped = float(np.abs(theta - before).max()) > SETTINGS.farthest * max(1.0, 64 / count)
            if not reached or jumped:
                raise InvalidProblem("goal", self._why(robot, theta, place, shares[number], reached))
            found.append(theta)
        return np.array(found)

    def _why(self, robot: Robot, theta: FloatArray, place: Place, share: float, jumped: bool) -> str:
        """A text of what keeps the tool from a point of the curve, if it gets as far as a posture (dof,)."""
        at = ", ".join(f"{coordinate:.4g}" for coordinate in place.position(robot))
        what = f"the tool cannot be led to ({at}), {share * self.way.length:.4g} m along the way"
        if jumped:
            return f"{what}: joints would have to jump there"
        distance, farthest = float(np.linalg.norm(place.position(robot) - robot.base)), robot.reach()[1]
        if distance > farthest:
            return f"{what}: {distance:.4g} m from the base, of {farthest:.4g} m at the most"
        ranges = robot.limits.position
        names = [
            name
            for name, angle, (low, high) in zip(robot.joints.names, theta, ranges or (), strict=ranges is not None)
            if min(angle - low, high - angle) <= 0.02 * (high - low)
        ]
        return f"{what}: " + (f"{', '.join(names)} at the end of the range" if names else "no posture next to the last")

    def _is_near(self, robot: Robot, path: JointPath, distance: float, angle: float) -> bool:
        """Whether the tool is near the curve between points too, in the middles of a path's pieces."""
        middles = (path.breakpoints[1:] + path.breakpoints[:-1]) / 2.0
        missed = self._missed(robot, path.at(middles))
        return bool(missed[0] <= distance and missed[1] <= angle)

    def _missed(self, robot: Robot, theta: FloatArray) -> tuple[float, float]:
        """The largest distance of the tool from the curve in postures (n, dof): m, and the sine of an angle."""
        point = ca.SX.sym("tool", robot.dim)
        away = ca.Function("away", [point], [self.way.away(point)])
        if not isinstance(robot, SpatialArm):
            return float(as_array(away(robot.tool.position(ca.DM(theta)).T)).max()), 0.0
        positions, rotations = _tool_of(geometry_of(robot))(theta.T)
        found = float(as_array(away(positions)).max())
        if self.turned is None:
            return found, 0.0
        rotation, tool = (ca.SX.sym(name, size) for name, size in (("rotation", 9), ("tool", 3)))
        known = {"rotation": rotation, "tool": tool}
        sine = ca.Function(
            "sine", [tool, rotation], [ca.norm_2(self._missing(MotionView(robot, known.__getitem__))[0])]
        )
        return found, float(as_array(sine(positions, rotations)).max())


def _stated(name: str, unit: str, expression: Stated, robot: Robot, lower: Bound, upper: Bound) -> StatedExpression:
    return StatedExpression(name, unit, traced(expression, robot, name, differentiates=False), lower, upper)


@lru_cache(maxsize=16)
def _tool_of(robot: SpatialArm) -> ca.Function:
    """The function from a posture (dof, 1) to the tool's position (3, 1) and rotation row by row (9, 1)."""
    theta = ca.SX.sym("theta", 1, robot.dof)
    position, rotation = robot.tool.pose(theta)
    return ca.Function("tool", [theta.T], [position.T, rotation.T])
