"""Poses of the tool in space: position and orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import (
    COORDINATES,
    Angle,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    as_array,
    check_within,
    columns,
    rotation_of,
)
from problems.core import steps_of
from problems.limits import SAMPLING_MARGIN, AxisName, FreeAxis, TurnRange, can_hold
from problems.robots import Robot, SpatialArm, Steps, postures, project, quaternions_of
from problems.scene import Obstacle
from problems.tasks.checks import check_length_one, least_clearances, overloaded, too_near
from problems.tasks.place import ANGLE_TOLERANCE, Choice, Place

ASIDE = 1e-9  # rad, added to a turn whose axis is not known
LEAST_SQUARE = 1e-60  # keeps a root's derivative finite


def rotation_rows(quaternion: tuple[Operand, ...]) -> Matrix:
    """The rotation of a quaternion (x, y, z, w), row by row, (1, 9)."""
    return ca.horzcat(*(entry for row in rotation_of(quaternion) for entry in row))


def turn_between(wanted: Matrix, rotation: Matrix) -> Matrix:
    """The turn from a wanted rotation (1, 9) to others (n, 9), all row by row: axis times size, (n, 3).

    The size is the sine of the angle, and beyond a quarter turn 2 - sine: the sine alone is zero for half a turn too.
    """
    entries, wanted_entries = columns(rotation), columns(wanted)
    x, y, z = entries[0:3], entries[3:6], entries[6:9]
    u, v, w = wanted_entries[0:3], wanted_entries[3:6], wanted_entries[6:9]
    crossed = [_dot(z, v) - _dot(y, w), _dot(x, w) - _dot(z, u), _dot(y, u) - _dot(x, v)]
    sine = ca.horzcat(*crossed) / 2.0
    within_quarter = _dot(x, u) + _dot(y, v) + _dot(z, w) >= 1.0
    aside = ca.horzcat(sine[:, 0] + ASIDE, sine[:, 1:])  # for half a turn any axis will do
    size = ca.sqrt(ca.sum2(aside**2) + LEAST_SQUARE)
    factor = ca.repmat((2.0 - size) / size, 1, 3)
    return ca.if_else(ca.repmat(within_quarter, 1, 3), sine, factor * aside)


def _dot(first: list[Matrix], second: list[Matrix]) -> Matrix:
    return sum((a * b for a, b in zip(first, second, strict=True)), ca.DM(0.0))


@dataclass(frozen=True, kw_only=True)
class BranchSettings:
    """Settings of the branches of inverse kinematics at a pose.

    Values are chosen.

    Attributes:
        offset: rad or m by which a joint is put beside a branch's posture before it is projected onto the pose.
        starts: starts of inverse kinematics.
        starts_each: likewise for each of the orientations that a free axis leaves.
        seed: of these starts, so that a pose has the same branches in every plan.
        projection_steps: steps of the projection, with which all but a few candidates arrive.
        least_difference: rad or m by which two branches differ in some joint.
        of_an_arm: postures of one arm of several at a pose, at most, the nearest ones, that are combined with others'.
        of_all_arms: branches of all arms together, at most, the nearest ones.
    """

    offset: float = 0.8
    starts: int = 400
    starts_each: int = 48
    seed: int = 16
    projection_steps: int = 10
    least_difference: float = 0.5
    of_an_arm: int = 24
    of_all_arms: int = 16


SETTINGS = BranchSettings()


RANGE_MARGIN = 2.0 * SAMPLING_MARGIN  # of a joint's range, at both ends: what a search keeps at its samples, and more
MATRIX_TOLERANCE = 1e-6  # of the entries of a matrix


@dataclass(frozen=True, eq=False)
class Projection:
    """Newton steps of an arm onto poses of its tool, within its joints' ranges.

    Attributes:
        steps: of the arm.
        low: the least of each joint, (dof,), rad or m; infinite where there is none.
        high: the most, likewise.
    """

    steps: Steps
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, arm: SpatialArm) -> Projection:
        """The projection of an arm."""
        ranges = arm.limits.position or ((-np.inf, np.inf),) * arm.dof
        low, high = np.array(ranges, dtype=np.float64).T
        return cls(steps_of(arm), low, high)

    def __call__(
        self, starts: FloatArray, known: FloatArray, point: FloatArray, rotation: FloatArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """The postures that starts (n, dof) lead to, and what each lacks, (n,), m and rad together.

        At the ends of the ranges a margin is kept, less of it where a known posture, (dof,) or one each, keeps less.
        """
        kept = RANGE_MARGIN * np.where(np.isfinite(self.low), self.high - self.low, 0.0)
        least = np.minimum(self.low + kept, np.maximum(self.low, known))
        most = np.maximum(self.high - kept, np.minimum(self.high, known))
        bounds = np.atleast_2d(np.hstack([least, most]))
        found, missing, left = np.empty_like(starts), np.empty(len(starts)), np.ones(len(starts), dtype=np.bool_)
        while left.any():  # those of one range are led at once: nearly always all
            shared = bounds[np.argmax(left) if len(bounds) > 1 else 0]
            own = left & (bounds == shared).all(axis=1)
            lower, upper = np.split(shared, 2)
            steps = SETTINGS.projection_steps
            found[own], missing[own] = self.steps(starts[own], point, rotation, (lower, upper), steps)
            left &= ~own
        return found, missing


def are_rotations(matrices: FloatArray) -> bool:
    """Whether matrices (..., 3, 3) are rotations, all of them."""
    orthogonal = np.allclose(matrices @ np.swapaxes(matrices, -1, -2), np.eye(3), atol=MATRIX_TOLERANCE)
    return orthogonal and bool((np.linalg.det(matrices) > 0.0).all())


def checked_frames(matrices: object) -> FloatArray:
    """Homogeneous matrices, (4, 4) or (m, 4, 4), of rotations and translations in m.

    Raises:
        InvalidProblem: one is none: another shape or last row, or a part that is no rotation.
    """
    try:
        given = np.asarray(matrices, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidProblem("matrix", "4 x 4 numbers are needed") from error
    last_row = (0.0, 0.0, 0.0, 1.0)
    if given.shape[-2:] != (4, 4) or not np.allclose(given[..., 3, :], last_row, atol=MATRIX_TOLERANCE):
        raise InvalidProblem("matrix", "a homogeneous matrix is needed: 4 x 4, the last row 0, 0, 0, 1")
    if not are_rotations(given[..., :3, :3]):
        raise InvalidProblem("matrix", "its 3 x 3 part is no rotation")
    return given


@dataclass(frozen=True)
class Pose(Place):
    """A place with the tool at a point in space, with a stated orientation or any.

    The posture is a free one near that of a branch: joints are put somewhere around it and projected onto the pose by
    damped Newton steps.

    Args:
        point: of the tool, m.
        quaternion: how the tool is turned, (x, y, z, w), of length 1; None where that does not matter.
        branch: a posture there, dof joint values; empty where none has been chosen, see :meth:`branches`.
        within: how far from the point a motion may pass, m; how the tool is turned then does not matter.
        free: an axis of the tool about which it may turn against the quaternion; None for none.
        turn: the least and the most turn about it, rad, right-handed; None where any will do.
        tilt: how far this axis may lean, rad, with any turn.
        cost: of a goal among several, added to the duration or whatever is minimised.
    """

    numbers: ClassVar[tuple[str, ...]] = ("point", "quaternion", "branch")
    chosen_by_inverse_kinematics: ClassVar[bool] = False
    always_reached: ClassVar[bool] = False

    point: tuple[float, ...]
    quaternion: tuple[float, ...] | None = None
    branch: tuple[float, ...] = ()
    within: float = 0.0
    free: AxisName | None = None
    turn: TurnRange | None = None
    tilt: Angle = 0.0
    cost: float = 0.0

    @classmethod
    def from_matrix(cls, matrix: FloatArray) -> Pose:
        """The pose of a homogeneous matrix.

        Args:
            matrix: (4, 4), rotation and translation in m, as other libraries write a frame.

        Raises:
            InvalidProblem: it is none: another shape or last row, or a part that is no rotation.
        """
        frame = checked_frames(matrix)
        if frame.ndim != 2:
            raise InvalidProblem("matrix", "one homogeneous matrix is needed, 4 x 4")
        (quaternion,) = quaternions_of(frame[:3, :3].reshape(1, 9))
        return cls(tuple(frame[:3, 3].tolist()), tuple(quaternion.tolist()))

    @property
    def unit(self) -> str:
        return "m" if self.quaternion is None or self.within else "m, rad"

    def check(self, robot: Robot, obstacles: Sequence[Obstacle], field: str, name: str = "") -> None:
        """Check that it is in space and in reach, its quaternion has length 1, and its branch is there."""
        arm = _in_space(robot, field, name)
        if len(self.point) != arm.dim:
            raise InvalidProblem(field, f"{name}{self.point} where x, y, z are needed")
        check_within(field, self.point, COORDINATES, "m", name)
        if self.quaternion is not None:
            check_length_one(field, self.quaternion, name)
        self._check_freedom(field, name)
        distance, farthest = float(np.linalg.norm(np.subtract(self.point, arm.base))), arm.reach()[1]
        if not distance <= (1.0 + ANGLE_TOLERANCE) * farthest:
            reason = f"{self.point} is {distance:.6g} m from the base, out of reach: {farthest:.6g} m at the most"
            raise InvalidProblem(field, f"{name}{reason}")
        if self.branch and len(self.branch) != arm.dof:
            raise InvalidProblem(field, f"{name}{len(self.branch)} joints of a branch for a robot of {arm.dof}")

    def _check_freedom(self, field: str, name: str) -> None:
        try:
            freedom = self.freedom
            if freedom is not None:
                freedom.check()
        except InvalidProblem as error:
            raise InvalidProblem(field, f"{name}{error.field}: {error.reason}") from error
        if freedom is not None and self.quaternion is None:
            raise InvalidProblem(field, f"{name}free: without a quaternion any orientation will do; leave it out")

    def choices(self, robot: Robot) -> tuple[Choice, ...]:
        return tuple(Choice("branch_offset", f"[{joint}]", -1.0, 1.0) for joint in range(1, robot.dof + 1))

    def branches(
        self, robot: Robot, obstacles: Sequence[Obstacle], near: FloatArray | None, field: str
    ) -> tuple[Place, ...]:
        """The pose with each of the clear and separate postures of inverse kinematics as its branch, nearest first.

        Those that the motors cannot hold are left out.

        Raises:
            InvalidProblem: it finds none, or none that is clear and held.
        """
        found, what = self.postures_there(_in_space(robot, field), near, field), self._described
        held = usable_postures(robot, obstacles, found, f"with the tool at {what}", field)
        return tuple(map(self.on_branch, separate_postures(held, middle_of(robot) if near is None else near)))

    def postures_there(self, arm: SpatialArm, near: FloatArray | None, field: str) -> FloatArray:
        """Postures of inverse kinematics at the pose, (n, dof), rad, whatever they touch.

        Args:
            arm: that moves.
            near: a posture (dof,) in the turns nearest to which joints are taken, rad; the middle where None.
            field: of the task, for messages.

        Raises:
            InvalidProblem: it finds none.
        """
        rotations, starts = self._rotations_looked_at()
        each = [
            postures(arm, self.point, one, np.random.default_rng(SETTINGS.seed), starts, near, steps_of(arm))
            for one in rotations
        ]
        found = np.concatenate(each)
        if not len(found):
            count = starts * len(rotations)
            raise InvalidProblem(field, f"no posture of {count} searches for one has the tool at {self._described}")
        return found

    @property
    def _described(self) -> str:
        return f"{self.point}" if self.quaternion is None else f"{self.point} turned by {self.quaternion}"

    def _rotations_looked_at(self) -> tuple[Sequence[FloatArray | None], int]:
        """Rotations (3, 3) of the tool, and the starts for each."""
        if self.freedom is None:
            return (self.rotation,), SETTINGS.starts
        return list(self._stated_rotation @ self.freedom.offsets(self.freedom.grid)), SETTINGS.starts_each

    def on_branch(self, theta: FloatArray) -> Place:
        return replace(self, branch=tuple(theta.tolist()))

    @property
    def branch_angles(self) -> tuple[float, ...]:
        return self.branch

    def posture(
        self, robot: Robot, chosen: Matrix, elbow: Operand, near: Matrix | None
    ) -> tuple[Matrix, Matrix | None]:
        """The posture at which joints are put, projected onto the pose; and its miss relative to the tolerance."""
        theta = self.onto(robot, ca.horzcat(*self.branch) + SETTINGS.offset * chosen.T)
        return theta, ca.norm_inf(self.miss(robot, theta)) / self.tolerance(robot)

    def postures(self, robot: Robot, chosen: FloatArray, elbow: float = 1.0) -> tuple[FloatArray, NDArray[np.bool_]]:
        arm, known = _in_space(robot), np.array(self.branch)
        starts, onto = known + SETTINGS.offset * chosen, Projection.of(arm)
        if self.freedom is None:
            theta, missing = onto(starts, known, self.position(robot), self.rotation)
        else:
            turned = self.freedom.nearest_of(self._stated_rotation, arm.tool.at(starts)[1])
            rows = [
                onto(start[None], known, self.position(robot), each) for start, each in zip(starts, turned, strict=True)
            ]
            theta, missing = (np.concatenate(part) for part in zip(*rows, strict=True))
        return theta, missing <= self.tolerance(robot)

    @property
    def rotation(self) -> FloatArray | None:
        """The rotation matrix of the tool, (3, 3), as it is stated; None where any will do."""
        return None if self.quaternion is None else self._stated_rotation

    @property
    def _stated_rotation(self) -> FloatArray:
        assert self.quaternion is not None
        return as_array(rotation_rows(self.quaternion)).reshape(3, 3)

    @property
    def freedom(self) -> FreeAxis | None:
        """The axis that leaves the tool free to turn against the stated orientation."""
        return FreeAxis.stated(self.free, self.turn, self.tilt)

    def near(self, robot: Robot, theta: FloatArray) -> tuple[FloatArray, bool]:
        found, reached = self.on_branch(theta).postures(robot, np.zeros((1, robot.dof)))
        return found[0], bool(reached[0])

    def projected(self, robot: Robot, theta: FloatArray) -> FloatArray:
        return as_array(self.onto(robot, ca.DM(theta).T)).ravel()

    def onto(self, robot: Robot, theta: Matrix) -> Matrix:
        """A posture (1, dof), rad, projected onto the pose."""
        rotation: Matrix | None = None
        if self.quaternion is not None:
            rotation = ca.reshape(rotation_rows(self.quaternion), 3, 3).T
        if rotation is not None and self.freedom is not None:
            before = _in_space(robot).tool.pose(theta)[1]
            rotation = self.freedom.nearest(rotation, ca.reshape(before, 3, 3).T)
        known = ca.horzcat(*self.branch) if self.branch else None
        return project(
            _in_space(robot), theta, ca.vertcat(*self.point), rotation, SETTINGS.projection_steps, RANGE_MARGIN, known
        )

    def miss(self, robot: Robot, theta: Matrix) -> Matrix:
        """Vectors from the point to the tool, m, and its turns about the axes outside, rad if small; (n, 3 to 7).

        The turn is zero for the stated one alone; instead of it, what misses a free axis.
        """
        position, rotation = _in_space(robot).tool.pose(theta)
        away = position - ca.repmat(ca.horzcat(*self.point), theta.shape[0], 1)
        if self.quaternion is None or self.within:
            return away
        stated = rotation_rows(self.quaternion)
        turned = turn_between(stated, rotation) if self.freedom is None else self.freedom.misses(stated, rotation)
        return ca.horzcat(away, turned)

    def tolerance(self, robot: Robot) -> float:
        return max(ANGLE_TOLERANCE, self.within)

    def position(self, robot: Robot) -> FloatArray:
        return np.array(self.point)

    def taken(self, robot: Robot, theta: FloatArray) -> str:
        if self.freedom is None or self.within:
            return ""
        turn, tilt = self.freedom.taken(self._stated_rotation, _in_space(robot).tool.at(theta[None])[1][0])
        leans = f", leaning by {tilt:.3f} rad" if self.tilt else ""
        return f"turned by {round(turn, 3) + 0.0:.3f} rad about {self.free} of the tool{leans}"

    def table(self) -> dict[str, Any]:
        turned = {} if self.quaternion is None else {"quaternion": [*map(float, self.quaternion)]}
        free = {"free": self.free, "turn": self.turn and [*map(float, self.turn)], "tilt": float(self.tilt)}
        stated = {key: value for key, value in free.items() if value}
        return self._completed({"position": [*map(float, self.point)], **turned, **stated})


def _in_space(robot: Robot, field: str = "goal", name: str = "") -> SpatialArm:
    if not isinstance(robot, SpatialArm):
        raise InvalidProblem(field, f"{name}a pose in space is not for {type(robot).__name__}")
    return robot


def middle_of(robot: Robot) -> FloatArray:
    """The posture (dof,) in the middle of the joints' ranges; zero where there are none."""
    ranges = robot.limits.position
    return np.zeros(robot.dof) if ranges is None else np.array(ranges).mean(axis=1)


def usable_postures(
    robot: Robot, obstacles: Sequence[Obstacle], theta: FloatArray, what: str, field: str
) -> FloatArray:
    """Postures of some (n, dof) that are clear and that the motors can hold.

    Args:
        robot: that moves.
        obstacles: to keep clear of.
        theta: postures, rad.
        what: they have in common, for messages.
        field: of the task, likewise.

    Raises:
        InvalidProblem: there is none.
    """
    nearest = least_clearances(robot, obstacles, theta)
    clear = theta[nearest >= robot.margin]
    if not len(clear):
        reason = too_near(robot, obstacles, theta[int(np.argmax(nearest))])
        raise InvalidProblem(field, f"none of {len(theta)} postures {what} is clear; {reason}")
    held = clear[can_hold(robot, clear)]
    if not len(held):
        reason = overloaded(robot, clear[0])
        raise InvalidProblem(field, f"none of {len(clear)} clear postures {what} can be held; {reason}")
    return held


def separate_postures(theta: FloatArray, near: FloatArray) -> list[FloatArray]:
    """Postures of some (n, dof) that lie apart, rad or m, the nearest to another one (dof,) first."""
    apart: list[FloatArray] = []
    for posture in sorted(theta, key=lambda each: float(np.abs(each - near).max())):
        if all(np.abs(posture - other).max() > SETTINGS.least_difference for other in apart):
            apart.append(posture)
    return apart
