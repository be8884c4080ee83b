"""Postures that reach a pose: damped Newton steps from many starts, and their projection inside compiled code.

A step is Levenberg's, ``J^T (J J^T + lambda I)^-1 e``, with lambda = 0.05 |e|^2 + 1e-9: the shortest change of the
joints where the error e is small, so that what the tool leaves free stays as it was, and a cautious one far away. It is
never longer than 0.6 rad in any joint, and ends within the joint limits: a joint that would leave them stays, and the
others do its part.

Orientations are compared by the Rodrigues vector 2 tan(a / 2) of the turn by an angle a that is missing. It has no zero
but a = 0, while the cross products of the axes, 2 sin(a), vanish for a tool upside down as well.

[1] Levenberg (1944); Marquardt (1963). The damping shrinks with the square of the error, so that the last steps are
    Newton's (Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", 2011).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from problems.base import FloatArray, Matrix, Operand, as_array, cached_function, largest
from problems.robots.spatial_arm import SpatialArm
from problems.robots.transform import Rotation, Transform, Vector, as_rows, plus, times

ERROR_DAMPING = 0.05  # lambda over |e|^2
LEAST_COMPILED_DAMPING = 1e-9  # keeps the equations solvable at a singular posture
LONGEST_STEP = 0.6  # rad or m in any joint
UPSIDE_DOWN = 1e-3  # least 1 + cos(a) that errors are divided by
HALF_A_TURN = 1.0  # least size of the error of a tool upside down, whose Rodrigues vector may be anything

Columns: TypeAlias = list[list[Operand]]
Bounds: TypeAlias = tuple[FloatArray, FloatArray]  # the least and the most of each joint
Steps: TypeAlias = Callable[[FloatArray, FloatArray, FloatArray | None, Bounds, int], tuple[FloatArray, FloatArray]]


def project(
    robot: SpatialArm,
    theta: Matrix,
    position: Matrix,
    rotation: Matrix | None,
    steps: int,
    kept: float = 0.0,
    known: Matrix | None = None,
) -> Matrix:
    """The posture near ``theta`` with the tool at a position, and at an orientation if a rotation is given.

    Args:
        robot: that moves.
        theta: where to begin, (1, dof), rad or m.
        position: of the tool, (3, 1), m.
        rotation: of the tool, (3, 3); None where it does not matter.
        steps: of Newton's method; 5 reach 1e-9 m and rad from 0.1 m and 0.2 rad away, unless a limit or a singular
            posture is in the way: whoever needs to know looks where the tool is.
        kept: share of each joint's range that stays free at both ends.
        known: a posture there, (1, dof): what stays free is less where this is nearer to a limit.
    """
    limits = joint_bounds(robot, kept, known)
    step = _step(robot.geometry, rotation is not None, bool(limits))
    wanted = (position,) if rotation is None else (position, rotation)
    for _ in range(steps):
        theta = step(theta, *wanted, *limits)
    return theta


@lru_cache(maxsize=16)
def _step(robot: SpatialArm, turning: bool, limited: bool) -> ca.Function:
    return cached_function(lambda: _new_step(robot, turning, limited), "step", robot, turning, limited)


def _new_step(robot: SpatialArm, turning: bool, limited: bool) -> ca.Function:
    """The function of one step: posture (1, dof), position (3, 1), [rotation (3, 3), limits (1, dof)] -> posture."""
    theta, position, rotation = ca.SX.sym("theta", 1, robot.dof), ca.SX.sym("position", 3), ca.SX.sym("rotation", 3, 3)
    low, high = ca.SX.sym("low", 1, robot.dof), ca.SX.sym("high", 1, robot.dof)
    pose, jacobian = jacobian_columns(robot, theta, turning)
    error = pose_error(pose, position, rotation if turning else None)
    step = _damped_step(jacobian, error)
    if limited:
        leaves = ca.logic_or(ca.logic_and(theta >= high, step > 0.0), ca.logic_and(theta <= low, step < 0.0))
        moves = ca.horzsplit(1.0 - leaves)
        step = _damped_step([[part * own for part in c] for c, own in zip(jacobian, moves, strict=True)], error)
    moved = theta + step * (LONGEST_STEP / ca.fmax(LONGEST_STEP, largest(ca.fabs(step))))
    if limited:
        moved = ca.fmin(high, ca.fmax(low, moved))
    return ca.Function("step", [theta, position, *[rotation] * turning, *[low, high] * limited], [moved])


def pose_error(pose: Transform, position: Matrix, rotation: Matrix | None) -> list[Operand]:
    """The error from a pose to another one: 3 numbers in m, then 3 in rad if a rotation (3, 3) is given."""
    away: list[Operand] = [position[i] - pose.translation[i] for i in range(3)]
    return away if rotation is None else [*away, *_turn_missing(pose.rotation, rotation)]


def jacobian_columns(robot: SpatialArm, theta: Matrix, turning: bool) -> tuple[Transform, Columns]:
    """The pose of the tool in a posture (1, dof), and how each joint moves it, joint by joint.

    Args:
        robot: that moves.
        theta: its posture.
        turning: whether each column has the 3 angular velocities below the 3 velocities.
    """
    frames, carrier = robot.chain.frames(theta, robot.base_frame), robot.chain.carrier
    pose, moving = frames[carrier] @ robot.tool.frame, set(robot.chain.above(carrier))
    found: Columns = []
    for number, (joint, frame) in enumerate(zip(robot.chain.joints, frames[1:], strict=True), start=1):
        if number not in moving:
            found.append([0.0] * (6 if turning else 3))
            continue
        axis = frame.turn(joint.axis)
        lever = [plus(a, times(-1.0, b)) for a, b in zip(pose.translation, frame.translation, strict=True)]
        velocity = _cross(axis, lever) if joint.turns else list(axis)
        spin: list[Operand] = list(axis) if joint.turns else [0.0, 0.0, 0.0]
        found.append([*velocity, *spin] if turning else velocity)
    return pose, found


def _turn_missing(current: Rotation, wanted: Matrix) -> list[Operand]:
    """The Rodrigues vector from one rotation to another one (3, 3)."""
    turn = [[sum(wanted[i, k] * current[j][k] for k in range(3)) for j in range(3)] for i in range(3)]
    sine = [(turn[k][j] - turn[j][k]) / 2.0 for j, k in ((1, 2), (2, 0), (0, 1))]
    cosine = (turn[0][0] + turn[1][1] + turn[2][2] - 1.0) / 2.0
    factor = 2.0 / ca.fmax(UPSIDE_DOWN, 1.0 + cosine)
    return [part * factor for part in sine]


def joint_bounds(robot: SpatialArm, kept: float, known: Matrix | None) -> tuple[Matrix, ...]:
    """Lowest and highest values, (1, dof), that :func:`project` leaves free; none where there are no limits."""
    limits = robot.limits.position
    if limits is None:
        return ()
    low, high = (ca.horzcat(*ends) for ends in zip(*limits, strict=True))
    least, most = low + kept * (high - low), high - kept * (high - low)
    if known is None:
        return least, most
    return ca.fmin(least, ca.fmax(low, known)), ca.fmax(most, ca.fmin(high, known))


def _damped_step(jacobian: Columns, error: Sequence[Operand]) -> Matrix:
    """The damped step ``J^T (J J^T + lambda I)^-1 e``, (1, dof)."""
    count = len(error)
    damping = ERROR_DAMPING * sum(part * part for part in error) + LEAST_COMPILED_DAMPING
    square = [[_dot([c[i] for c in jacobian], [c[j] for c in jacobian]) for j in range(i + 1)] for i in range(count)]
    for i in range(count):
        square[i][i] = square[i][i] + damping
    weights = solve_positive_definite(square, error)
    return ca.horzcat(*(_dot(column, weights) for column in jacobian))


def solve_positive_definite(lower: Sequence[Sequence[Operand]], right: Sequence[Operand]) -> list[Operand]:
    """The solution of a small symmetric system by L D L^T, entry by entry, without pivoting.

    Args:
        lower: the rows of a positive definite matrix, each up to the diagonal.
        right: the right side.
    """
    count = len(right)
    factor: Columns = [[0.0] * count for _ in range(count)]
    pivots: list[Operand] = []
    solution: list[Operand] = []
    for i in range(count):
        scaled = [lower[i][j] for j in range(i)]  # L_ij D_j
        for j in range(i):
            scaled[j] = scaled[j] - _dot(scaled[:j], factor[j][:j])
            factor[i][j] = scaled[j] / pivots[j]
        pivots.append(lower[i][i] - _dot(scaled, factor[i][:i]))
        solution.append(right[i] - _dot(factor[i][:i], solution))
    for i in reversed(range(count)):
        below = [factor[k][i] for k in range(i + 1, count)]
        solution[i] = solution[i] / pivots[i] - _dot(below, solution[i + 1 :])
    return solution


def _cross(a: Vector, b: Sequence[Operand]) -> list[Operand]:
    return [plus(times(a[j], b[k]), times(-1.0, times(a[k], b[j]))) for j, k in ((1, 2), (2, 0), (0, 1))]


def _dot(a: Sequence[Operand], b: Sequence[Operand]) -> Operand:
    found: Operand = 0.0
    for x, y in zip(a, b, strict=True):
        found = plus(found, times(x, y))
    return found


def tool_jacobian(robot: SpatialArm, theta: Matrix) -> Matrix:
    """The geometric Jacobian (6, dof) of a posture (1, dof).

    Its rows are the tool's velocity, m/s, then its angular velocity, rad/s, in the axes outside; a column is for a rate
    of 1 rad/s or 1 m/s of one joint.
    """
    _, found = jacobian_columns(robot, theta, turning=True)
    return ca.horzcat(*(as_rows(column, 1).T for column in found))


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


TURN = 2.0 * np.pi


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
    search = _Search(robot, np.asarray(position, dtype=float), _turned(rotation))
    middle = search.middle if near is None else np.asarray(near, dtype=float)
    begun = search.starts(rng, starts)
    if near is not None:  # what is nearest, of a redundant arm, no random start may lead to
        begun = np.vstack([search.within(middle), begun])
    theta, _ = (steps or search.steps)(begun, search.position, search.rotation, search.bounds, NEWTON.steps)
    theta = search.wrapped(theta[search.arrived(theta)], middle)
    # wrapping rounds an angle of several turns; what is returned has been checked as it is
    return search.distinct(theta[search.arrived(theta)])


def _turned(rotation: ArrayLike | None) -> FloatArray | None:
    return None if rotation is None else np.asarray(rotation, dtype=float).reshape(3, 3)


@dataclass
class _Search:
    """A search for postures that reach a pose.

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

    @property
    def bounds(self) -> Bounds:
        """Bounds of the joints while they are stepped, none of a winding joint."""
        return np.where(self.winding, -np.inf, self.low), np.where(self.winding, np.inf, self.high)

    @property
    def steps(self) -> NewtonSteps:
        """Newton steps in NumPy."""
        return NewtonSteps(self.robot)

    def starts(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Uniform starts within the limits, of winding joints within a turn."""
        low = np.where(self.winding, self.middle - np.pi, self.low)
        high = np.where(self.winding, self.middle + np.pi, self.high)
        return rng.uniform(low, high, (count, self.robot.dof))

    def within(self, theta: FloatArray) -> FloatArray:
        """The posture (dof,) within the limits that is nearest to another one."""
        return np.asarray(np.where(self.winding, theta, np.clip(theta, self.low, self.high)))

    def arrived(self, theta: FloatArray) -> FloatArray:
        """Whether each posture reaches the pose within the limits, (n,)."""
        if not len(theta):
            return np.zeros(0, dtype=bool)
        error, _, size = self.steps.error(theta, self.position, self.rotation)
        parts = np.max(np.linalg.norm(error.reshape(len(theta), -1, 3), axis=2), axis=1)
        reached = (parts <= NEWTON.tolerance) & (size < HALF_A_TURN)
        within = np.all(self.winding | ((theta >= self.low) & (theta <= self.high)), axis=1)
        return np.asarray(reached & within)

    def wrapped(self, theta: FloatArray, near: FloatArray) -> FloatArray:
        """The postures with winding joints in the turn nearest to a posture (dof,), within their limits."""
        turned = theta - TURN * np.round((theta - near) / TURN)
        turned = np.where(turned > self.high, turned - TURN * np.ceil((turned - self.high) / TURN), turned)
        turned = np.where(turned < self.low, turned + TURN * np.ceil((self.low - turned) / TURN), turned)
        return np.where(self.winding, turned, theta)

    def distinct(self, theta: FloatArray) -> FloatArray:
        """The first of all postures that are alike up to whole turns."""
        kept: list[FloatArray] = []
        for posture in theta:
            apart = np.abs(np.array(kept).reshape(-1, self.robot.dof) - posture)
            apart = np.where(self.winding, np.abs(apart - TURN * np.round(apart / TURN)), apart)
            if np.all(np.max(apart, axis=1) > NEWTON.least_difference):
                kept.append(posture)
        return np.array(kept).reshape(-1, self.robot.dof)


@dataclass(frozen=True)
class NewtonSteps:
    """Damped Newton steps from postures towards a pose, in NumPy.

    Args:
        robot: whose tool is to be there.
    """

    robot: SpatialArm

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
