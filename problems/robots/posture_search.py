"""Postures that reach poses of the tool: damped Newton steps from many starts.

Steps are those of :mod:`problems.robots.inverse_kinematics`, taken in numbers. Of postures that are alike up to whole
turns one is told, in the turns nearest to a posture that is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import pairwise, product
from typing import NamedTuple, Protocol, TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from problems.base import FloatArray, as_array
from problems.robots.inverse_kinematics import UPSIDE_DOWN, tool_jacobian
from problems.robots.spatial_arm import SpatialArm

Bounds: TypeAlias = tuple[FloatArray, FloatArray]  # the least and the most of each joint
HALF_A_TURN = 1.0  # least size of the error of a tool upside down, whose Rodrigues vector may be anything
TURN = 2.0 * np.pi


@dataclass(frozen=True, kw_only=True)
class NewtonSettings:
    """Settings of damped Newton steps in NumPy from many starts.

    Values are chosen.

    Attributes:
        steps: of each start, at most.
        longest_step: rad or m, of any joint.
        damping: times the square of the error.
        least_damping: added to that.
        tolerance: m and rad, of a posture that reaches its pose.
        converged: error of a posture that is stepped no further.
        patience: steps in which the error has to fall.
        least_gain: share by which it has to.
        least_difference: rad or m, in some joint, of two postures.
    """

    steps: int = 80
    longest_step: float = 0.6
    damping: float = 0.05
    least_damping: float = 1e-12
    tolerance: float = 1e-9
    converged: float = 1e-12
    patience: int = 10
    least_gain: float = 0.2
    least_difference: float = 1e-3


NEWTON = NewtonSettings()


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of the tool.

    Attributes:
        positions: (m, 3), m.
        rotations: (m, 3, 3); None where any will do.
    """

    positions: FloatArray
    rotations: FloatArray | None

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def arrays(self) -> tuple[FloatArray, ...]:
        """The positions, and the rotations where they matter."""
        return (self.positions,) if self.rotations is None else (self.positions, self.rotations)

    @property
    def each(self) -> Iterator[tuple[FloatArray, FloatArray | None]]:
        """Position (3,) and rotation (3, 3) of one pose after the other."""
        rotations = [None] * len(self) if self.rotations is None else self.rotations
        return zip(self.positions, rotations, strict=True)

    def part(self, chosen: slice) -> Poses:
        """Some of the poses."""
        return Poses(self.positions[chosen], None if self.rotations is None else self.rotations[chosen])


class FoundPostures(NamedTuple):
    """The postures that reach poses, of one pose after the other.

    Attributes:
        theta: of all poses, (n, dof), rad or m.
        counts: of each pose, (m,).
        manipulability: the root of det(J J^T) of each, (n,); J of positions alone where any rotation will do.
    """

    theta: FloatArray
    counts: NDArray[np.int32]
    manipulability: FloatArray

    @property
    def each(self) -> list[FloatArray]:
        """The postures of each pose, (n, dof)."""
        ends = np.cumsum([0, *self.counts])
        return [self.theta[begin:end] for begin, end in pairwise(ends.tolist())]


class Steps(Protocol):
    """Newton steps of an arm towards poses of its tool."""

    def __call__(
        self, theta: FloatArray, position: FloatArray, rotation: FloatArray | None, bounds: Bounds, steps: int
    ) -> tuple[FloatArray, FloatArray]:
        """The postures that steps lead to, and the error that each then has.

        Args:
            theta: where they begin, (n, dof), rad or m.
            position: of the tool, (3,), m.
            rotation: of the tool, (3, 3); None where it does not matter.
            bounds: the least and the most of each joint, (dof,) each, infinite where there is none.
            steps: at most; one posture takes no further ones if they lead nowhere.

        Returns:
            Postures (n, dof), and what each then lacks, m and rad together, (n,).
        """

    def inverse(self, poses: Poses, starts: FloatArray, turns: JointTurns, near: FloatArray) -> FoundPostures:
        """The postures that reach poses.

        Args:
            poses: of the tool.
            starts: where steps begin, (n, dof).
            turns: of the joints.
            near: a posture (dof,) in the turns nearest to which joints are taken.
        """


@dataclass(frozen=True, eq=False)
class JointTurns:
    """The ranges of joints, and the turns in which those may be whose range is a turn or more.

    Attributes:
        low: the least of each joint, (dof,), rad or m; infinite where there is none.
        high: the most.
        winding: whether any angle has a turn within the range, (dof,).
    """

    low: FloatArray
    high: FloatArray
    winding: NDArray[np.bool_]

    @classmethod
    def of(cls, robot: SpatialArm) -> JointTurns:
        """The ranges of a robot's joints."""
        low, high = np.array(robot.position_limits or ((-np.inf, np.inf),) * robot.dof, dtype=np.float64).T
        turning = np.array([joint.turns for joint in robot.chain.joints])
        return cls(low, high, turning & (high - low >= TURN))

    @cached_property
    def middle(self) -> FloatArray:
        """The middle of the ranges, (dof,); zero where a turn around it is within."""
        middle = np.where(np.isfinite(self.low), (self.low + self.high) / 2, 0.0)
        middle[self.winding & (self.low < -np.pi) & (self.high > np.pi)] = 0.0
        return middle

    @property
    def bounds(self) -> Bounds:
        """Bounds of the joints while they are stepped, none of a winding joint."""
        return np.where(self.winding, -np.inf, self.low), np.where(self.winding, np.inf, self.high)

    def within(self, shares: FloatArray) -> FloatArray:
        """Postures at shares (n, dof) of the ranges, of winding joints of a turn around the middle."""
        low = np.where(self.winding, self.middle - np.pi, self.low)
        high = np.where(self.winding, self.middle + np.pi, self.high)
        return np.asarray(low + shares * (high - low))

    def clipped(self, theta: FloatArray) -> FloatArray:
        """The posture (dof,) within the ranges that is nearest to another one."""
        return np.asarray(np.where(self.winding, theta, np.clip(theta, self.low, self.high)))

    def are_kept(self, theta: FloatArray) -> NDArray[np.bool_]:
        """Whether postures (n, dof) are within the ranges, (n,)."""
        return np.asarray(((theta >= self.low) & (theta <= self.high)).all(axis=1))

    def nearest(self, theta: FloatArray, near: FloatArray) -> FloatArray:
        """The postures (n, dof) with winding joints in the turn nearest to a posture (dof,), within their ranges."""
        turned = theta - TURN * np.round((theta - near) / TURN)
        turned = np.where(turned > self.high, turned - TURN * np.ceil((turned - self.high) / TURN), turned)
        turned = np.where(turned < self.low, turned + TURN * np.ceil((self.low - turned) / TURN), turned)
        return np.where(self.winding, turned, theta)

    def all_of(self, theta: FloatArray) -> FloatArray:
        """A posture (dof,) in all turns within the ranges, those of joints without an end as they are, (n, dof)."""
        several = self.winding & np.isfinite(self.high - self.low)
        each = [
            angle + TURN * np.arange(np.ceil((low - angle) / TURN), np.floor((high - angle) / TURN) + 1.0)
            if winds
            else np.array([angle])
            for angle, low, high, winds in zip(theta, self.low, self.high, several, strict=True)
        ]
        return np.array(list(product(*each)))

    def distinct(self, theta: FloatArray) -> FloatArray:
        """The first of all postures (n, dof) that are alike up to whole turns."""
        kept: list[FloatArray] = []
        for posture in theta:
            apart = np.abs(np.array(kept).reshape(-1, len(self.low)) - posture)
            apart = np.where(self.winding, np.abs(apart - TURN * np.round(apart / TURN)), apart)
            if np.all(np.max(apart, axis=1) > NEWTON.least_difference):
                kept.append(posture)
        return np.array(kept).reshape(-1, len(self.low))


def manipulability(jacobians: FloatArray) -> FloatArray:
    """The measure of Yoshikawa (1985) of Jacobians (n, rows, dof), the root of det(J J^T), (n,)."""
    square = np.linalg.det(jacobians @ jacobians.transpose(0, 2, 1))
    return np.asarray(np.sqrt(np.maximum(square, 0.0)))


@lru_cache(maxsize=16)
def spread_shares(count: int, dof: int) -> FloatArray:
    """Points that fill a unit cube evenly, (count, dof), the same ones whenever it is asked.

    Kronecker's sequence with the powers of the root of x^(d + 1) = x + 1 (Roberts, "The unreasonable effectiveness of
    quasirandom sequences", 2018).
    """
    root = 2.0
    for _ in range(50):
        root = (1.0 + root) ** (1.0 / (dof + 1.0))
    shares = np.asarray((0.5 + np.arange(1, count + 1)[:, None] * root ** -np.arange(1.0, dof + 1.0)) % 1.0)
    shares.setflags(write=False)
    return shares


def postures(
    robot: SpatialArm,
    position: ArrayLike,
    rotation: ArrayLike | None,
    rng: np.random.Generator,
    starts: int = 400,
    near: ArrayLike | None = None,
    steps: Steps | None = None,
) -> FloatArray:
    """Postures within the joints' limits that put the tool where it should be.

    All that the starts lead to: of an arm with finitely many, such as the 8 of a UR5, usually every one; of a redundant
    arm as many members of its families as there are starts that arrive.

    Args:
        robot: with position limits, or none.
        position: of the tool, (3,), m.
        rotation: its rotation matrix, (3, 3) or row by row; None leaves it free.
        rng: draws the starts: the same state, the same postures.
        starts: how many.
        near: a posture (dof,) from which it begins too, and what the joints reach from there comes first; joints that
            can turn more than once are taken in the turn nearest to it, rad; the middle of their limits by default.
        steps: that are taken; those in NumPy by default.

    Returns:
        Postures (m, dof), rad or m, that differ by more than 0.001 in some joint; m = 0 where none is found. The tool
        is within 1e-9 m and 1e-9 rad of its pose.
    """
    turns = JointTurns.of(robot)
    begun = turns.within(rng.random((starts, robot.dof)))
    middle = turns.middle if near is None else np.asarray(near, dtype=float)
    if near is not None:  # what is nearest, of a redundant arm, no random start may lead to
        begun = np.vstack([turns.clipped(middle), begun])
    turned = None if rotation is None else np.asarray(rotation, dtype=float).reshape(1, 3, 3)
    pose = Poses(np.asarray(position, dtype=float)[None], turned)
    return (steps or NewtonSteps(robot)).inverse(pose, begun, turns, middle).theta


@dataclass(frozen=True)
class NewtonSteps(Steps):
    """Damped Newton steps from postures towards a pose, in NumPy.

    Args:
        robot: whose tool is to be there.
    """

    robot: SpatialArm

    def __call__(
        self, theta: FloatArray, position: FloatArray, rotation: FloatArray | None, bounds: Bounds, steps: int
    ) -> tuple[FloatArray, FloatArray]:
        theta = np.array(theta, dtype=np.float64)
        error, jacobian, size = self.error(theta, position, rotation)
        last, unsolved = np.full(len(theta), np.inf), np.arange(len(theta))
        for number in range(steps):
            going = size[unsolved] > NEWTON.converged
            if number % NEWTON.patience == 0:
                going &= size[unsolved] < (1.0 - NEWTON.least_gain) * last[unsolved]
                last = size.copy()
            unsolved, error, jacobian = unsolved[going], error[going], jacobian[going]
            if not len(unsolved):
                break
            theta[unsolved] = _stepped(theta[unsolved], error, jacobian, bounds)
            error, jacobian, size[unsolved] = self.error(theta[unsolved], position, rotation)
        return theta, size

    def inverse(self, poses: Poses, starts: FloatArray, turns: JointTurns, near: FloatArray) -> FoundPostures:
        found = []
        for pose in poses.each:
            theta, _ = self(starts, *pose, turns.bounds, NEWTON.steps)
            theta = turns.nearest(theta[self._arrived(theta, *pose)], near)
            # rounding an angle by several turns moves the tool: what is returned has been checked as it is
            theta = theta[self._arrived(theta, *pose) & turns.are_kept(theta)]
            found.append(turns.distinct(theta))
        theta = np.concatenate(found)
        counts = np.array([len(each) for each in found], dtype=np.int32)
        return FoundPostures(theta, counts, self._manipulability(theta, poses.rotations is not None))

    def _manipulability(self, theta: FloatArray, turning: bool) -> FloatArray:
        """The manipulability of postures (n, dof), (n,), of positions alone where rotations do not matter."""
        if not len(theta):
            return np.zeros(0)
        columns = as_array(_kinematics(self.robot)(theta.T))[12:].T.reshape(len(theta), -1, 6)
        return manipulability(columns[:, :, : 6 if turning else 3].transpose(0, 2, 1))

    def _arrived(self, theta: FloatArray, position: FloatArray, rotation: FloatArray | None) -> NDArray[np.bool_]:
        """Whether each posture reaches the pose, (n,)."""
        if not len(theta):
            return np.zeros(0, dtype=bool)
        error, _, size = self.error(theta, position, rotation)
        parts = np.max(np.linalg.norm(error.reshape(len(theta), -1, 3), axis=2), axis=1)
        return np.asarray((parts <= NEWTON.tolerance) & (size < HALF_A_TURN))

    def error(
        self, theta: FloatArray, position: FloatArray, rotation: FloatArray | None
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The tool's error, m and Rodrigues vector, (n, 3 or 6), its Jacobian (n, 3 or 6, dof), and its size, (n,).

        Half a turn has no such vector, but a size.
        """
        values = as_array(_kinematics(self.robot)(theta.T)).T
        missing = position - values[:, :3]
        turning = values[:, 12:].reshape(len(theta), -1, 6).transpose(0, 2, 1)
        if rotation is None:
            return missing, turning[:, :3], np.linalg.norm(missing, axis=1)
        between = rotation @ values[:, 3:12].reshape(-1, 3, 3).transpose(0, 2, 1)
        skew, beside = between - between.transpose(0, 2, 1), (np.trace(between, axis1=1, axis2=2) + 1.0) / 2.0
        vectors = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
        error = np.hstack([missing, vectors / np.maximum(UPSIDE_DOWN, beside)[:, None]])
        size = np.linalg.norm(error, axis=1)
        return error, turning, np.where(beside < UPSIDE_DOWN, np.maximum(size, HALF_A_TURN), size)


@lru_cache(maxsize=16)
def _kinematics(robot: SpatialArm) -> ca.Function:
    """Position, rotation row by row and Jacobian column by column of a posture (dof, 1): (12 + 6 dof, 1)."""
    theta = ca.SX.sym("theta", robot.dof)
    position, rotation = robot.tool.pose(theta.T)
    parts = position.T, rotation.T, ca.vec(tool_jacobian(robot, theta.T))
    return ca.Function("kinematics", [theta], [ca.densify(ca.vertcat(*parts))])


def _stepped(theta: FloatArray, error: FloatArray, jacobian: FloatArray, bounds: Bounds) -> FloatArray:
    """A damped step; joints that would leave their limits stay there, and the others do their part."""
    low, high = bounds
    step = _damped(jacobian, error)
    stuck = ((theta >= high) & (step > 0.0)) | ((theta <= low) & (step < 0.0))
    if np.any(stuck):
        step = _damped(np.where(stuck[:, None, :], 0.0, jacobian), error)
    step *= np.minimum(1.0, NEWTON.longest_step / np.maximum(np.max(np.abs(step), axis=1, keepdims=True), 1e-300))
    return np.asarray(np.clip(theta + step, low, high))


def _damped(jacobian: FloatArray, error: FloatArray) -> FloatArray:
    """The step that lessens an error (n, m), damped by its square: (n, dof)."""
    damping = NEWTON.damping * np.sum(error**2, axis=1) + NEWTON.least_damping
    square = jacobian @ jacobian.transpose(0, 2, 1) + damping[:, None, None] * np.eye(error.shape[1])
    return np.asarray((jacobian.transpose(0, 2, 1) @ np.linalg.solve(square, error[:, :, None]))[:, :, 0])
