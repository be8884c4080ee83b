"""Curves of the tool, straight, along an arc or with corners; its orientation there."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem
from problems.limits import Bound, FreeAxis, StatedExpression, rotation_away, tool_at_tip
from problems.motions import MotionView, Stated, traced
from problems.robots import Robot, quaternions_of, turn_of, turned_by
from problems.tasks.place import Place, Position
from problems.tasks.pose import Pose

STRAIGHT = 1e-7  # sine of an angle between lines, below which they are one


ALIKE = 1e-9  # rad: rotations that differ by less are the same
TURNED_BACK = -0.99  # cosine of an angle between two lines, beyond which a corner is not rounded
PARABOLA = 17  # points of one
FREE_LIMITS = ("axis accuracy", "range of turns")
LEAST = 2.0  # no sine or cosine is below its negative


class ToolCurve(ABC):
    """A curve that the tool follows. A subclass is a frozen dataclass; lengths in m, s is the share of the length."""

    @property
    @abstractmethod
    def length(self) -> float:
        """The length of the whole curve."""

    @property
    def corners(self) -> list[tuple[FloatArray, float]]:
        """The corners that the curve rounds, (dim,), and how far from each it begins to do so, m; none by default."""
        return []

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
        sideways = np.linalg.svd(self._direction[None])[2][1:]
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
        for number, (corner, back) in enumerate(self.corners):
            first, last = corner - back * units[number], corner + back * units[number + 1]
            found.append((1.0 - share) ** 2 * first + 2.0 * share * (1.0 - share) * corner + share**2 * last)
        points = np.concatenate([*found, self.stops[-1:]])
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        kept = np.append(True, steps > 0.0)
        return points[kept], np.append(0.0, np.cumsum(steps[steps > 0.0]))

    @property
    def length(self) -> float:
        return float(self._curve[1][-1])

    @property
    def corners(self) -> list[tuple[FloatArray, float]]:
        legs = np.diff(self.stops, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        turns = np.linalg.norm(np.diff(legs / lengths[:, None], axis=0), axis=1)
        rooms = np.minimum(lengths[:-1], lengths[1:]) / 2.0
        backs = [
            room if turn * room <= 4.0 * self.rounding else 4.0 * self.rounding / turn
            for turn, room in zip(turns, rooms, strict=True)
        ]
        return list(zip(self.stops[1:-1], backs, strict=True))

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

    def along(self, tool: ca.SX) -> ca.SX:
        return ca.SX(0.0)


@dataclass(frozen=True, eq=False)
class ToolPath:
    """A curve of the tool, which turns evenly along it.

    Attributes:
        way: of its point.
        turned: rotations (3, 3) at start and goal; None where it may turn as it likes, and in the plane.
        free: an axis about which it may be turned otherwise.
        law: coefficients (degree, 3) of the coordinates of :class:`FreeAxis` by powers of s from 1 on, which the joints
            are to follow; the limits do not ask for them.
        frame: numbers among a robot's positions of the points of the tool's tip, and of the tip in whose frame the
            curve is stated; None in the world.
    """

    way: ToolCurve
    turned: tuple[FloatArray, FloatArray] | None = None
    free: FreeAxis | None = None
    law: FloatArray | None = None
    frame: tuple[slice, slice] | None = None

    def _tool(self, m: MotionView) -> tuple[ca.SX, ca.SX]:
        """Position (dim, 1), m, and rotation of the tool, in the frame in which the curve is stated."""
        if self.frame is None:
            return m.tool, m.rotation if self.turned is not None else ca.SX()
        (p, r), (q, s) = (tool_at_tip(m, places) for places in self.frame)
        return s.T @ (p - q), s.T @ r

    @cached_property
    def _turn(self) -> FloatArray:
        """The turn from the start's rotation to the goal's, axis times angle in the tool's frame, (3,), rad."""
        assert self.turned is not None
        start, goal = self.turned
        turn = turn_of(start.T @ goal)
        return turn if np.linalg.norm(turn) > ALIKE else np.zeros(3)

    def places(self, s: FloatArray) -> list[Place]:
        """Places of the tool at shares (n,) of the length."""
        points = self.way.points(s)
        if points.shape[1] == 2:
            return [Position(tuple(point)) for point in points.tolist()]
        if self.turned is None:
            return [Pose(tuple(point)) for point in points.tolist()]
        quaternions = quaternions_of(self._turned_rotations(s).reshape(-1, 9))
        pairs = zip(points.tolist(), quaternions.tolist(), strict=True)
        return [Pose(tuple(point), tuple(quaternion)) for point, quaternion in pairs]

    def rotations(self, s: FloatArray) -> FloatArray | None:
        """Rotations of the tool at shares (n,) of the length, (n, 3, 3); None where it may turn as it likes."""
        return None if self.turned is None else self._turned_rotations(s)

    def stated_rotations(self, s: FloatArray) -> FloatArray:
        """The even rotations at shares (n,) of the length, (n, 3, 3), against which an axis may leave the tool free."""
        assert self.turned is not None
        return np.asarray(self.turned[0] @ turned_by(s[:, None] * self._turn))

    def _turned_rotations(self, s: FloatArray) -> FloatArray:
        stated = self.stated_rotations(s)
        if self.free is None or self.law is None:
            return stated
        powers = s[:, None] ** np.arange(1, len(self.law) + 1)
        return np.asarray(stated @ self.free.offsets(self.free.within(powers @ self.law)))

    def constraints(self, robot: Robot, accuracy: float, angular_accuracy: float) -> list[StatedExpression]:
        """Limits on the distance from the curve at every time, m, and on the sine of the angle."""

        def near(m: MotionView) -> ca.SX:
            tool = self._tool(m)[0]
            along = self.way.along(tool)
            beyond = ca.fmax(0.0, ca.fmax(-along, along - self.way.length))
            return ca.sqrt(self.way.away(tool) ** 2 + beyond**2)

        def facing(m: MotionView) -> ca.SX:
            sine, cosine = rotation_away(self._stated_rotation(m), self._tool(m)[1])
            return ca.vertcat(ca.norm_2(sine), -cosine)

        found = [stated_limit("path accuracy", "m", near, robot, None, (accuracy,))]
        if self.turned is not None and self.free is None:
            most = float(np.sin(min(angular_accuracy, np.pi / 2.0)))
            found.append(stated_limit("angular accuracy", "rad", facing, robot, (-LEAST, -LEAST), (most, 0.0)))
        elif self.free is not None:
            found += self._free_constraints(self.free, robot, angular_accuracy)
        return found

    def _free_constraints(self, free: FreeAxis, robot: Robot, accuracy: float) -> Iterator[StatedExpression]:
        """The limits of the direction of an axis, and of the turn about it where that has a range."""

        def limits(m: MotionView) -> list[tuple[ca.SX, tuple[float, ...]]]:
            stated, rotation = (ca.vec(each.T).T for each in (self._stated_rotation(m), self._tool(m)[1]))
            return free.limits(stated, rotation, accuracy)

        upright = ca.SX.eye(3).reshape((1, 9))
        uppers = [upper for _, upper in free.limits(upright, upright, accuracy)]
        for number, (name, upper) in enumerate(zip(FREE_LIMITS, uppers, strict=False)):

            def chosen(m: MotionView, number: int = number) -> ca.SX:
                return limits(m)[number][0]

            unit = "rad" if len(upper) > 1 else "1"  # of the sine; of the cosine alone where the angle is large
            yield stated_limit(name, unit, chosen, robot, (-LEAST,) * len(upper), upper)

    def speed_limit(self, robot: Robot, most: float) -> StatedExpression:
        """The limit of the tool's speed to so many m/s."""
        return stated_limit("tool speed on the way", "m/s", lambda m: ca.norm_2(m.tool_velocity), robot, None, (most,))

    def _stated_rotation(self, moment: MotionView) -> ca.SX:
        """The even rotation where the tool is along the curve, (3, 3)."""
        assert self.turned is not None
        wanted = ca.SX(ca.DM(self.turned[0]))
        angle = float(np.linalg.norm(self._turn))
        if angle:
            turned = angle / self.way.length * self.way.along(self._tool(moment)[0])
            cross = ca.skew(ca.DM(self._turn / angle))
            wanted = wanted @ (ca.DM.eye(3) + ca.sin(turned) * cross + (1.0 - ca.cos(turned)) * (cross @ cross))
        return wanted


def stated_limit(
    name: str, unit: str, expression: Stated, robot: Robot, lower: Bound, upper: Bound
) -> StatedExpression:
    """A limit of an expression of one instant, with its name and unit."""
    return StatedExpression(name, unit, traced(expression, robot, name, differentiates=False), lower, upper)
