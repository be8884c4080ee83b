"""Projection of postures onto a pose inside compiled code, by damped Newton steps.

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

from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import casadi as ca

from problems.base import Matrix, Operand, cached_function, largest
from problems.robots.spatial_arm import SpatialArm
from problems.robots.transform import Rotation, Transform, Vector, as_rows, plus, times

ERROR_DAMPING = 0.05  # lambda over |e|^2
LEAST_COMPILED_DAMPING = 1e-9  # keeps the equations solvable at a singular posture
LONGEST_STEP = 0.6  # rad or m in any joint
UPSIDE_DOWN = 1e-3  # least 1 + cos(a) that errors are divided by

Columns: TypeAlias = list[list[Operand]]


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
