"""An arm among obstacles: where its tool is, which postures reach a pose, and how much room they have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from problems import InvalidProblem
from problems.base import FloatArray, as_array, shown_value
from problems.core import fixed_clearance, steps_of
from problems.robots import (
    NEWTON,
    FoundPostures,
    JointTurns,
    Poses,
    Robot,
    SpatialArm,
    Steps,
    manipulability,
    spread_shares,
    tool_jacobian,
)
from problems.scene import Obstacle
from problems.tasks import Pose, check_length_one, checked_frames
from problems.worlds import World, world_of

PoseLike: TypeAlias = Pose | FloatArray | Sequence[Sequence[float]]
MATRIX = (4, 4)
POSE_STARTS = 64  # of Newton steps for a pose
MOST_STARTS = 100_000


@dataclass(frozen=True, eq=False)
class ArmAmong:
    """An arm with one tool among obstacles that stand still.

    Args:
        arm: with the tool that is asked about, and what it keeps.
        obstacles: around it.
    """

    arm: SpatialArm
    obstacles: tuple[Obstacle, ...] = ()

    @classmethod
    def of(cls, robot: Robot, obstacles: Sequence[Obstacle] = (), tip: str | None = None) -> ArmAmong:
        """A robot in space, with the tool at one of its tips.

        Raises:
            InvalidProblem: it is in the plane, has no such tip, or an obstacle moves.
        """
        if not isinstance(robot, SpatialArm):
            raise InvalidProblem("robot", "an arm in space is needed")
        for number, obstacle in enumerate(obstacles):
            if obstacle.moves:
                raise InvalidProblem(f"obstacles.{number}", "moves; the others stand still where this is asked")
        return cls(robot if tip is None else robot.with_tool_at(tip), tuple(obstacles))

    @cached_property
    def turns(self) -> JointTurns:
        """The ranges of the joints."""
        return JointTurns.of(self.arm)

    @cached_property
    def world(self) -> World:
        """The arm and what it keeps clear of."""
        return world_of(self.arm, self.obstacles, ())

    @cached_property
    def steps(self) -> Steps:
        """Newton steps of the arm."""
        return steps_of(self.arm)

    def forward(self, postures: ArrayLike) -> FloatArray:
        """The tool's poses in postures, as homogeneous matrices.

        Args:
            postures: one (dof,), or several (n, dof), rad or m.

        Returns:
            (4, 4), or (n, 4, 4).
        """
        theta, shape = self._several(postures)
        found = np.tile(np.eye(4), (len(theta), 1, 1))
        found[:, :3, 3], found[:, :3, :3] = self.arm.tool.at(theta)
        return found.reshape(*shape, *MATRIX)

    def jacobian(self, postures: ArrayLike) -> FloatArray:
        """The tool's geometric Jacobians: its velocity, m/s, then its angular velocity, rad/s, in the axes outside.

        Args:
            postures: as of :meth:`forward`.

        Returns:
            (6, dof), or (n, 6, dof).
        """
        theta, shape = self._several(postures)
        if not len(theta):
            return np.empty((0, 6, self.arm.dof))
        columns = as_array(self._jacobian(theta.T)).reshape(6, len(theta), self.arm.dof)
        return columns.swapaxes(0, 1).reshape(*shape, 6, self.arm.dof)

    def manipulability(self, postures: ArrayLike) -> FloatArray:
        """Yoshikawa's measure, the root of det(J J^T): zero in a singular posture.

        Args:
            postures: as of :meth:`forward`.

        Returns:
            (), or (n,).
        """
        theta, shape = self._several(postures)
        return manipulability(self.jacobian(theta)).reshape(shape)

    def clearance(self, postures: ArrayLike) -> FloatArray:
        """The distance to what comes nearest of obstacles and own links, less what is kept of it; m.

        Args:
            postures: as of :meth:`forward`.

        Returns:
            (), or (n,); infinite where there is nothing. A plan may pass what is not negative.
        """
        theta, shape = self._several(postures)
        return self.world.clearance_margins(theta).reshape(shape)

    @cached_property
    def base_clearance(self) -> float:
        """The distance from obstacles of links that no joint moves, such as the base, as far as they must not touch; m.

        Negative where one goes into the other, infinite where there is nothing. No plan is refused for it.
        """
        return fixed_clearance(self.arm, self.obstacles)

    def inverse(
        self,
        pose: PoseLike | Sequence[PoseLike],
        *,
        near: ArrayLike | None = None,
        turns: bool = False,
        touching: bool = False,
        starts: int = POSE_STARTS,
    ) -> FloatArray | list[FloatArray]:
        """Postures with the tool at a pose that keep clear, those that are nearest to one first.

        Newton steps lead there from the same starts every time. Of an arm of six joints, 64 find all postures of 99.8 %
        of poses; of one of seven they find some of each family.

        Args:
            pose: a :class:`Pose`, a homogeneous matrix (4, 4), or several of either.
            near: a posture (dof,), rad or m, also the first start; the middle of the joints' ranges by default. Joints
                that do not move the tool stay as they are in it.
            turns: whether each posture comes in all turns within the joints' ranges, not in the nearest alone.
            touching: whether postures that touch something come too.
            starts: for each pose.

        Returns:
            Postures (n, dof), n = 0 where there is none; of several poses a list.

        Raises:
            InvalidProblem: an argument is wrong.
        """
        poses, alone = poses_of(pose)
        middle = self.turns.middle if near is None else self._several(near)[0][0]
        found = self.postures(poses, starts, middle)
        parts = found.each
        if not touching:
            clear = self.world.clear(found.theta)
            ends = np.cumsum(found.counts)[:-1]
            parts = [each[kept] for each, kept in zip(parts, np.split(clear, ends), strict=True)]
        each_sorted = [self._sorted(theta, middle, turns) for theta in parts]
        return each_sorted[0] if alone else each_sorted

    def postures(self, poses: Poses, starts: int, near: FloatArray) -> FoundPostures:
        """Postures that reach poses, whatever they touch, in the turns nearest to one; joints of other arms stay there.

        Args:
            poses: of the tool.
            starts: of Newton steps for each pose, which are always the same.
            near: a posture (dof,), rad or m.

        Raises:
            InvalidProblem: there are no starts, or too many.
        """
        return self.steps.inverse(poses, self._begun(starts, near), self.turns, near)

    def nearest(self, pose: PoseLike, *, starts: int = POSE_STARTS) -> FloatArray:
        """The posture (dof,) found with the tool nearest to a pose that may be out of reach, whatever it touches.

        Args:
            pose: as of :meth:`inverse`, one.
            starts: likewise.

        Raises:
            InvalidProblem: an argument is wrong.
        """
        poses, alone = poses_of(pose)
        if not alone:
            raise InvalidProblem("pose", "one is needed")
        begun, ((position, rotation),) = self._begun(starts, self.turns.middle), poses.each
        theta, missing = self.steps(begun, position, rotation, self.turns.bounds, NEWTON.steps)
        return np.asarray(theta[np.argmin(missing)])

    def _begun(self, starts: int, near: FloatArray) -> FloatArray:
        """A posture (dof,) within the ranges and so many others, (1 + starts, dof), where steps begin."""
        if not isinstance(starts, int | np.integer) or not 1 <= starts <= MOST_STARTS:
            raise InvalidProblem(
                "starts", f"a whole number from 1 to {MOST_STARTS} is needed, not {shown_value(starts)}"
            )
        begun = self.turns.within(spread_shares(starts, self.arm.dof))
        begun = np.vstack([self.turns.clipped(near), begun])
        begun[:, self._others] = near[self._others]
        return begun

    @cached_property
    def _others(self) -> NDArray[np.int64]:
        """The joints that do not move the tool."""
        moved = np.array(self.arm.chain.above(self.arm.chain.carrier)) - 1
        return np.setdiff1d(np.arange(self.arm.dof), moved)

    def _sorted(self, theta: FloatArray, middle: FloatArray, all_turns: bool) -> FloatArray:
        if all_turns and len(theta):
            theta = np.concatenate([self.turns.all_of(posture) for posture in theta])
        return theta[np.argsort(np.abs(theta - middle).max(axis=1), kind="stable")]

    def _several(self, postures: ArrayLike) -> tuple[FloatArray, tuple[int, ...]]:
        """Postures as (n, dof), and the shape of what is told of them.

        Raises:
            InvalidProblem: they have other numbers of joints, or are no finite numbers.
        """
        try:
            theta = np.asarray(postures, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise InvalidProblem("postures", "numbers are needed, rad or m") from error
        if theta.ndim not in (1, 2) or theta.shape[-1] != self.arm.dof or not np.isfinite(theta).all():
            raise InvalidProblem("postures", f"{self.arm.dof} finite numbers are needed of each, rad or m")
        return theta.reshape(-1, self.arm.dof), theta.shape[:-1]

    @cached_property
    def _jacobian(self) -> ca.Function:
        theta = ca.SX.sym("theta", self.arm.dof)
        return ca.Function("jacobian", [theta], [ca.densify(tool_jacobian(self.arm, theta.T))])


def poses_of(stated: PoseLike | Sequence[PoseLike]) -> tuple[Poses, bool]:
    """Stated poses, and whether it is one alone.

    Args:
        stated: a pose, a matrix (4, 4), or several of either.

    Raises:
        InvalidProblem: naming what is wrong.
    """
    if isinstance(stated, Pose):
        return _of_objects([stated]), True
    if isinstance(stated, list | tuple) and any(isinstance(one, Pose) for one in stated):
        each = [one if isinstance(one, Pose) else Pose.from_matrix(np.asarray(one)) for one in stated]
        return _of_objects(each), False
    frames = checked_frames(stated)
    rows = frames.reshape(-1, *MATRIX)
    if not len(rows):
        raise InvalidProblem("pose", "there is none")
    return Poses(rows[:, :3, 3].copy(), rows[:, :3, :3].copy()), frames.ndim == 2


def _of_objects(poses: Sequence[Pose]) -> Poses:
    if any(pose.freedom is not None or pose.within for pose in poses):
        raise InvalidProblem("pose", "within and free are of goals; state a pose, or its point alone")
    for pose in poses:
        if pose.quaternion is not None:
            check_length_one("pose", pose.quaternion)
    turned = [pose.rotation for pose in poses if pose.rotation is not None]
    if turned and len(turned) < len(poses):
        raise InvalidProblem("pose", "some have a quaternion and some do not; ask for them one after the other")
    points = np.array([pose.point for pose in poses], dtype=np.float64)
    if points.shape[1:] != (3,) or not np.isfinite(points).all():
        raise InvalidProblem("pose", "x, y, z are needed, in m")
    return Poses(points, np.array(turned) if turned else None)
