"""Joints that follow a curve of the tool: points of it are reached one after the other, a spline runs through all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, as_array
from problems.motions import JointPath
from problems.robots import Robot, SpatialArm
from problems.tasks.place import ANGLE_TOLERANCE, Place
from problems.tasks.pose import Projection
from problems.tasks.tool_path import ToolPath


@dataclass(frozen=True, kw_only=True)
class FollowingSettings:
    """Settings of joints that follow a curve of the tool.

    Values are chosen.

    Attributes:
        first_points: points of the curve at the beginning.
        most_points: points of the curve after all halvings.
        spline_share: share of the accuracy that a spline through followed points may use.
        farthest: rad or m: joints that go farther from one point to the next have jumped.
        tangent_step: share of the curve's length, before and after a point, by which its direction is found.
    """

    first_points: int = 9
    most_points: int = 513
    spline_share: float = 0.1
    farthest: float = 0.3
    tangent_step: float = 1e-4


SETTINGS = FollowingSettings()


@dataclass(frozen=True, eq=False)
class Following:
    """A robot whose tool follows a curve.

    Args:
        path: of the tool.
        robot: that moves.
        toward: a posture (dof,) that joints tend to as far as the tool leaves them free; None for the shortest way.
    """

    path: ToolPath
    robot: Robot
    toward: FloatArray | None = None

    def joints(self, start: FloatArray, accuracy: float, angular_accuracy: float) -> JointPath:
        """The path of joints that follows the curve, from a posture in which the tool is at its start.

        Points on the curve are projected onto one after the other, each from the posture before, the shortest way; a
        spline runs through all of them, of which there are as many as its nearness to the curve needs.

        Args:
            start: the posture (dof,), rad.
            accuracy: of which the spline uses up a share, m.
            angular_accuracy: likewise, rad.

        Raises:
            InvalidProblem: a point cannot be reached from the one before, or not so nearly.
        """
        count, share = SETTINGS.first_points, SETTINGS.spline_share
        while count <= SETTINGS.most_points:
            found = JointPath.through(self._postures(start, count))
            away, turned = self._missed(found)
            if away <= share * accuracy and turned <= share * angular_accuracy:
                return found
            count = 2 * count - 1
        raise InvalidProblem("accuracy", f"{accuracy:g} m, or {angular_accuracy:g} rad, needs too many points")

    def _postures(self, start: FloatArray, count: int) -> FloatArray:
        """Postures (count, dof) with the tool at equal steps along the curve."""
        shares = np.linspace(0.0, 1.0, count)
        found, near = [start], self._nearest(shares)
        for number in range(1, count):
            before = found[-1]
            guess = before if self.toward is None else before + (self.toward - before) / (count - number + 1)
            theta, reached = near(number, guess)
            jumped = float(np.abs(theta - before).max()) > SETTINGS.farthest * max(1.0, 64 / count)
            if not reached or jumped:
                raise InvalidProblem("goal", self._why(theta, shares[number], reached))
            found.append(theta)
        return np.array(found)

    def _nearest(self, shares: FloatArray) -> Callable[[int, FloatArray], tuple[FloatArray, bool]]:
        """The function that leads a posture (dof,) to a numbered share of the curve, and says whether it is there."""
        if not isinstance(self.robot, SpatialArm):
            places = self.path.places(shares)
            return lambda number, guess: places[number].near(self.robot, guess)
        points, rotations = self.path.way.points(shares), self.path.rotations(shares)
        onto = Projection.of(self.robot)

        def near(number: int, guess: FloatArray) -> tuple[FloatArray, bool]:
            rotation = None if rotations is None else rotations[number]
            theta, missing = onto(guess[None], guess, points[number], rotation)
            return theta[0], bool(missing[0] <= ANGLE_TOLERANCE)

        return near

    def _why(self, theta: FloatArray, share: float, jumped: bool) -> str:
        """A text of what keeps the tool from a point of the curve, if it gets as far as a posture (dof,)."""
        place: Place = self.path.places(np.array([share]))[0]
        robot, position = self.robot, place.position(self.robot)
        at = ", ".join(f"{coordinate:.4g}" for coordinate in position)
        what = f"the tool cannot be led to ({at}), {share * self.path.way.length:.4g} m along the way"
        if jumped:
            return f"{what}: joints would have to jump there"
        distance, farthest = float(np.linalg.norm(position - robot.base)), robot.reach()[1]
        if distance > farthest:
            return f"{what}: {distance:.4g} m from the base, of {farthest:.4g} m at the most"
        ranges = robot.limits.position
        names = [
            name
            for name, angle, (low, high) in zip(robot.joints.names, theta, ranges or (), strict=ranges is not None)
            if min(angle - low, high - angle) <= 0.02 * (high - low)
        ]
        return f"{what}: " + (f"{', '.join(names)} at the end of the range" if names else "no posture next to the last")

    def _missed(self, joints: JointPath) -> tuple[float, float]:
        """How far the tool is from the curve in the middles of a path's pieces: m, and the sine of an angle.

        Of a straight line it is the distance; of a bent one it differs from that in the second order.
        """
        middles = (joints.breakpoints[1:] + joints.breakpoints[:-1]) / 2.0
        theta, way = joints.at(middles), self.path.way
        count, step = middles.size, SETTINGS.tangent_step
        shares = (np.arange(count) + 0.5) / count
        after, before = way.points(shares + step), way.points(shares - step)
        tangent = (after - before) / np.linalg.norm(after - before, axis=1, keepdims=True)
        if not isinstance(self.robot, SpatialArm):
            positions, rotations = as_array(self.robot.tool.position(ca.DM(theta))), None
        else:
            positions, rotations = (as_array(part).T for part in _tool_of(self.robot.geometry)(theta.T))
        away = positions - way.points(shares)
        along = (away * tangent).sum(axis=1)
        missed = float(np.linalg.norm(away - along[:, None] * tangent, axis=1).max())
        wanted = self.path.rotations(shares + along / way.length)
        if rotations is None or wanted is None:
            return missed, 0.0
        turn = wanted.transpose(0, 2, 1) @ rotations.reshape(-1, 3, 3)
        return missed, float(np.linalg.norm(turn - turn.transpose(0, 2, 1), axis=(1, 2)).max()) / 8.0**0.5


@lru_cache(maxsize=16)
def _tool_of(robot: SpatialArm) -> ca.Function:
    """The function from a posture (dof, 1) to the tool's position (3, 1) and rotation row by row (9, 1)."""
    theta = ca.SX.sym("theta", 1, robot.dof)
    position, rotation = robot.tool.pose(theta)
    return ca.Function("tool", [theta.T], [position.T, rotation.T])
