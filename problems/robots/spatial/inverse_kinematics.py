"""Postures for a pose of the tool, found numerically: damped Newton steps from many starts at once.

[1] Levenberg (1944); Marquardt (1963). The damping shrinks with the square of the error, so that the last steps are
    Newton's (Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", 2011).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from problems.base.matrix import FloatArray, as_array
from problems.robots.spatial.jacobian import tool_jacobian
from problems.robots.spatial.spatial_arm import SpatialArm

STEPS = 80
LARGEST_STEP = 0.6  # rad or m, of any joint
DAMPING = 0.05  # times the square of the error
LEAST_DAMPING = 1e-12
SOLVED = 1e-9  # m and rad
CONVERGED = 1e-12  # the error of a posture that is stepped no further
PATIENCE = 10  # steps in which the error has to fall
LEAST_GAIN = 0.2  # by this part
APART = 1e-3  # rad or m, in some joint
TURN = 2.0 * np.pi


def postures(
    robot: SpatialArm,
    position: ArrayLike,
    rotation: ArrayLike | None,
    rng: np.random.Generator,
    starts: int = 400,
    near: ArrayLike | None = None,
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

    Returns:
        Postures (m, dof), rad or m, that differ by more than 0.001 in some joint; m = 0 where none is found. The tool
        is within 1e-9 m and 1e-9 rad of its pose.
    """
    search = _Search(robot, np.asarray(position, dtype=float), _turned(rotation))
    middle = search.middle if near is None else np.asarray(near, dtype=float)
    begun = search.starts(rng, starts)
    if near is not None:  # what is nearest, of a redundant arm, no random start may lead to
        begun = np.vstack([search.within(middle), begun])
    theta = search.solved(begun)
    theta = search.wrapped(theta[search.arrived(theta)], middle)
    # wrapping rounds an angle of several turns; what is returned has been checked as it is
    return search.distinct(theta[search.arrived(theta)])


def _turned(rotation: ArrayLike | None) -> FloatArray | None:
    return None if rotation is None else np.asarray(rotation, dtype=float).reshape(3, 3)


@dataclass
class _Search:
    """A pose to be reached.

    Attributes:
        robot: that has to.
        position: (3,), m.
        rotation: (3, 3), or None.
    """

    robot: SpatialArm
    position: FloatArray
    rotation: FloatArray | None

    def __post_init__(self) -> None:
        limits = self.robot.position_limits or ((-np.inf, np.inf),) * self.robot.dof
        self.low, self.high = np.array(limits).T
        turning = np.array([joint.turns for joint in self.robot.chain.joints])
        self.winding = turning & (self.high - self.low >= TURN)  # any angle has a turn within the limits
        self.middle = np.where(np.isfinite(self.low), (self.low + self.high) / 2, 0.0)
        self.middle[self.winding & (self.low < -np.pi) & (self.high > np.pi)] = 0.0

    @cached_property
    def kinematics(self) -> ca.Function:
        """Position, rotation row by row and Jacobian column by column of a posture (dof, 1): (12 + 6 dof, 1)."""
        theta = ca.SX.sym("theta", self.robot.dof)
        position, rotation = self.robot.tool_pose(theta.T)
        parts = position.T, rotation.T, ca.vec(tool_jacobian(self.robot, theta.T))
        return ca.Function("kinematics", [theta], [ca.densify(ca.vertcat(*parts))])

    def starts(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Uniform within the limits, of winding joints within a turn."""
        low = np.where(self.winding, self.middle - np.pi, self.low)
        high = np.where(self.winding, self.middle + np.pi, self.high)
        return rng.uniform(low, high, (count, self.robot.dof))

    def within(self, theta: FloatArray) -> FloatArray:
        """The posture (dof,) within the limits that is nearest to another one."""
        return np.asarray(np.where(self.winding, theta, np.clip(theta, self.low, self.high)))

    def solved(self, theta: FloatArray) -> FloatArray:
        """Where damped Newton steps from each posture lead."""
        theta = theta.copy()
        size = np.full(len(theta), np.inf)
        last = size.copy()
        unsolved = np.arange(len(theta))
        for number in range(STEPS):
            error, jacobian = self.error(theta[unsolved])
            size[unsolved] = np.linalg.norm(error, axis=1)
            going = size[unsolved] > CONVERGED
            if number % PATIENCE == 0:
                going &= size[unsolved] < (1.0 - LEAST_GAIN) * last[unsolved]
                last = size.copy()
            unsolved, error, jacobian = unsolved[going], error[going], jacobian[going]
            if not len(unsolved):
                break
            theta[unsolved] = self._stepped(theta[unsolved], error, jacobian)
        return theta

    def _stepped(self, theta: FloatArray, error: FloatArray, jacobian: FloatArray) -> FloatArray:
        """A damped step; joints that would leave their limits stay there, and the others do their part."""
        step = _damped(jacobian, error)
        stuck = self._leaves(theta, step)
        if np.any(stuck):
            step = _damped(np.where(stuck[:, None, :], 0.0, jacobian), error)
        step *= np.minimum(1.0, LARGEST_STEP / np.maximum(np.max(np.abs(step), axis=1, keepdims=True), 1e-300))
        moved = theta + step
        return self.within(moved)

    def _leaves(self, theta: FloatArray, step: FloatArray) -> FloatArray:
        outwards = ((theta >= self.high) & (step > 0.0)) | ((theta <= self.low) & (step < 0.0))
        return np.asarray(outwards & ~self.winding)

    def error(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What the tool lacks, m and rad along the axes outside, (n, 3 or 6), and its Jacobian (n, 3 or 6, dof)."""
        values = as_array(self.kinematics(theta.T)).T
        missing = self.position - values[:, :3]
        turning = values[:, 12:].reshape(len(theta), -1, 6).transpose(0, 2, 1)
        if self.rotation is None:
            return missing, turning[:, :3]
        between = self.rotation @ values[:, 3:12].reshape(-1, 3, 3).transpose(0, 2, 1)
        return np.hstack([missing, rotation_vectors(between)]), turning

    def arrived(self, theta: FloatArray) -> FloatArray:
        """Which postures reach the pose within their limits, (n,)."""
        if not len(theta):
            return np.zeros(0, dtype=bool)
        error, _ = self.error(theta)
        reached = np.max(np.linalg.norm(error.reshape(len(theta), -1, 3), axis=2), axis=1) <= SOLVED
        within = np.all(self.winding | ((theta >= self.low) & (theta <= self.high)), axis=1)
        return np.asarray(reached & within)

    def wrapped(self, theta: FloatArray, near: FloatArray) -> FloatArray:
        """The same postures with winding joints in the turn nearest to a posture (dof,), within their limits."""
        turned = theta - TURN * np.round((theta - near) / TURN)
        turned = np.where(turned > self.high, turned - TURN * np.ceil((turned - self.high) / TURN), turned)
        turned = np.where(turned < self.low, turned + TURN * np.ceil((self.low - turned) / TURN), turned)
        return np.where(self.winding, turned, theta)

    def distinct(self, theta: FloatArray) -> FloatArray:
        """The first of all that are alike, whole turns aside."""
        kept: list[FloatArray] = []
        for posture in theta:
            apart = np.abs(np.array(kept).reshape(-1, self.robot.dof) - posture)
            apart = np.where(self.winding, np.abs(apart - TURN * np.round(apart / TURN)), apart)
            if np.all(np.max(apart, axis=1) > APART):
                kept.append(posture)
        return np.array(kept).reshape(-1, self.robot.dof)


def _damped(jacobian: FloatArray, error: FloatArray) -> FloatArray:
    """The step that lessens an error (n, m), damped by its square: (n, dof)."""
    damping = DAMPING * np.sum(error**2, axis=1) + LEAST_DAMPING
    square = jacobian @ jacobian.transpose(0, 2, 1) + damping[:, None, None] * np.eye(error.shape[1])
    return np.asarray((jacobian.transpose(0, 2, 1) @ np.linalg.solve(square, error[:, :, None]))[:, :, 0])


def rotation_vectors(rotations: FloatArray) -> FloatArray:
    """Axis times angle, rad, of rotation matrices (n, 3, 3): (n, 3); its length is 0 for the identity alone."""
    skew = rotations - rotations.transpose(0, 2, 1)
    sine = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) / 2
    size = np.linalg.norm(sine, axis=1)
    cosine = (np.trace(rotations, axis1=1, axis2=2) - 1.0) / 2
    angle = np.arctan2(size, cosine)
    # half a turn: the axis is the largest column of R + 1
    flipped = (size < 1e-9) & (cosine < 0.0)
    shifted = rotations + np.eye(3)
    longest = np.argmax(np.linalg.norm(shifted, axis=1), axis=1)
    column = np.take_along_axis(shifted, longest[:, None, None], axis=2)[:, :, 0]
    length = np.maximum(np.where(flipped, np.linalg.norm(column, axis=1), size), 1e-300)[:, None]
    axis = np.where(flipped[:, None], column, sine) / length
    return np.where((size < 1e-9)[:, None] & ~flipped[:, None], sine, axis * angle[:, None])
