"""Joints that follow a curve of the tool: points of it are reached one after the other, a spline runs through all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

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
class FollowedPoints:
    """Postures with the tool at equal steps along a curve, from each of several starts as far as it comes.

    Attributes:
        postures: (m, count, dof), rad; the first one that is not reached is where the tool comes to, others repeat it.
        points: how many of them are reached, the start among them, (m,).
        jumped: whether the next one is reached, but by a jump of the joints, (m,).
    """

    postures: FloatArray
    points: NDArray[np.intp]
    jumped: NDArray[np.bool_]

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Whether each start leads to the curve's end, (m,)."""
        return np.asarray(self.points == self.postures.shape[1])


@dataclass(frozen=True, eq=False)
class Following:
    """A robot whose tool follows a curve.

    Args:
        path: of the tool.
        robot: that moves.
        toward: a posture (dof,), or one for each start, (m, dof), that joints tend to as far as the tool leaves them
            free; None for the shortest way.
    """

    path: ToolPath
    robot: Robot
    toward: FloatArray | None = None

    def joints(self, start: FloatArray, accuracy: float, angular_accuracy: float) -> JointPath:
        """The path of joints that follows the curve, from a posture in which the tool is at its start.

        Points on the curve are projected onto one after the other, each from the posture before, the shortest way.

        Args:
            start: the posture (dof,), rad.
            accuracy: of which the spline uses up a share, m.
            angular_accuracy: likewise, rad.

        Raises:
            InvalidProblem: a point cannot be reached from the one before, or not so nearly.
        """
        followed = self.followed(start[None])
        if not followed.complete[0]:
            raise self.why_not(followed)
        return self.refined(followed.postures[0], accuracy, angular_accuracy)

    def refined(self, postures: FloatArray, accuracy: float, angular_accuracy: float) -> JointPath:
        """The spline through postures that follow the curve at equal steps, halved until it is near enough to it.

        Args:
            postures: (n, dof), of which the path passes all.
            accuracy: as of :meth:`joints`, and so is the next.
            angular_accuracy: likewise.

        Raises:
            InvalidProblem: as :meth:`joints`.
        """
        share = SETTINGS.spline_share
        while True:
            found = JointPath.through(postures)
            away, turned = self._missed(found)
            if away <= share * accuracy and turned <= share * angular_accuracy:
                return found
            if 2 * len(postures) - 1 > SETTINGS.most_points:
                reason = f"{accuracy:g} m, or {angular_accuracy:g} rad, needs too many points"
                raise InvalidProblem("accuracy", reason)
            postures = self._halved(found, postures)

    def _halved(self, path: JointPath, postures: FloatArray) -> FloatArray:
        """Postures (n, dof) with those in the middles between them, onto which those of a path are projected.

        Raises:
            InvalidProblem: one is not reached, or by a jump.
        """
        count = 2 * len(postures) - 1
        found, shares = np.repeat(postures, 2, axis=0)[:count], np.linspace(0.0, 1.0, count)
        near = self._nearest(shares)
        guesses = path.at((path.breakpoints[1:] + path.breakpoints[:-1]) / 2.0)
        for number, guess in zip(range(1, count, 2), guesses, strict=True):
            theta, reached = near(number, guess[None])
            away = np.abs(theta[0] - found[number - 1]).max()
            if not reached[0] or away > _farthest(count):
                raise InvalidProblem("goal", self._why(theta[0], shares[number], bool(reached[0])))
            found[number] = theta[0]
        return found

    def followed(self, starts: FloatArray, count: int = SETTINGS.first_points) -> FollowedPoints:
        """Postures from several starts on at equal steps along the curve, step by step, all starts at once.

        Args:
            starts: postures with the tool at the curve's start, (m, dof), rad.
            count: of points, the start among them.
        """
        shares = np.linspace(0.0, 1.0, count)
        found, near = np.repeat(starts[:, None], count, axis=1), self._nearest(shares)
        points, jumped = np.full(len(starts), 1), np.zeros(len(starts), dtype=np.bool_)
        for number in range(1, count):
            (going,) = np.nonzero(points == number)
            if not going.size:
                break
            before = guess = found[going, number - 1]
            if self.toward is not None:
                toward = np.broadcast_to(self.toward, starts.shape)[going]
                guess = before + (toward - before) / (count - number + 1)
            theta, reached = near(number, guess)
            found[going, number:] = theta[:, None]
            jumped[going] = reached & (np.abs(theta - before).max(axis=1) > _farthest(count))
            points[going] += reached & ~jumped[going]
        return FollowedPoints(found, points, jumped)

    def _nearest(self, shares: FloatArray) -> Callable[[int, FloatArray], tuple[FloatArray, NDArray[np.bool_]]]:
        """The function that leads postures (m, dof) to a numbered share of the curve, and tells which arrive, (m,)."""
        robot = self.robot
        if not isinstance(robot, SpatialArm):
            places = self.path.places(shares)

            def in_plane(number: int, guesses: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
                theta, reached = zip(*(places[number].near(robot, guess) for guess in guesses), strict=True)
                return np.array(theta), np.array(reached)

            return in_plane
        points, rotations = self.path.way.points(shares), self.path.rotations(shares)
        onto = Projection.of(robot)

        def near(number: int, guesses: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
            rotation = None if rotations is None else rotations[number]
            theta, missing = onto(guesses, guesses, points[number], rotation)
            return theta, missing <= ANGLE_TOLERANCE

        return near

    def why_not(self, followed: FollowedPoints, number: int = 0) -> InvalidProblem:
        """The reason for which a start of that number does not lead to the curve's end."""
        reached = int(followed.points[number])
        theta, share = followed.postures[number, reached], reached / (followed.postures.shape[1] - 1)
        return InvalidProblem("goal", self._why(theta, share, bool(followed.jumped[number])))

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


def _farthest(count: int) -> float:
    """How far joints may go from one of so many points to the next, rad or m."""
    return SETTINGS.farthest * max(1.0, 64 / count)


@lru_cache(maxsize=16)
def _tool_of(robot: SpatialArm) -> ca.Function:
    """The function from a posture (dof, 1) to the tool's position (3, 1) and rotation row by row (9, 1)."""
    theta = ca.SX.sym("theta", 1, robot.dof)
    position, rotation = robot.tool.pose(theta)
    return ca.Function("tool", [theta.T], [position.T, rotation.T])
