"""The posture with the tool at a pose that is near another one: damped Newton steps, written once for symbols too."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from problems.base.matrix import Matrix, Operand, columns, largest
from problems.limits.limit import SAMPLING_MARGIN
from problems.robots.spatial.jacobian import tool_jacobian
from problems.robots.spatial.spatial_arm import SpatialArm

STEPS = 8
LARGEST_STEP = 0.6  # rad or m, of any joint
DAMPING, LEAST_DAMPING = 0.05, 1e-9  # the first times the squared error
KEPT = 2.0 * SAMPLING_MARGIN  # of a joint's range, at both ends: what a search keeps at its samples, and more
TINY = 1e-15  # keeps a root's derivative finite


@dataclass(frozen=True)
class PoseError:
    """How a pose of the tool differs from the one that is wanted.

    Args:
        point: wanted, m.
        quaternion: wanted, (x, y, z, w); None where any will do.
    """

    point: tuple[Operand, ...]
    quaternion: tuple[Operand, ...] | None

    def __call__(self, position: Matrix, rotation: Matrix) -> Matrix:
        """Of positions (n, 3) and rotations row by row (n, 9): (n, 3), m, or with the turns, rad, (n, 6)."""
        away = position - ca.repmat(ca.horzcat(*self.point), position.shape[0], 1)
        if self.quaternion is None:
            return away
        wanted = rotation_rows(self.quaternion)
        return ca.horzcat(away, _turned(columns(rotation), columns(wanted)))


def rotation_rows(quaternion: tuple[Operand, ...]) -> Matrix:
    """The rotation of a quaternion (x, y, z, w), row by row, (1, 9)."""
    x, y, z, w = quaternion
    s: Operand = 2.0 / (x * x + y * y + z * z + w * w)
    return ca.horzcat(
        *(1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
        *(s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)),
        *(s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)),
    )


def _turned(entries: list[Matrix], wanted: list[Matrix]) -> Matrix:
    """Axis times sine of the turn from a wanted rotation to another, (n, 3); beyond a quarter turn times 2 - sine.

    The sine alone is zero for half a turn too.
    """
    x, y, z = entries[0:3], entries[3:6], entries[6:9]
    u, v, w = wanted[0:3], wanted[3:6], wanted[6:9]
    crossed = [_dot(z, v) - _dot(y, w), _dot(x, w) - _dot(z, u), _dot(y, u) - _dot(x, v)]
    sine = ca.horzcat(*crossed) / 2.0
    within_quarter = _dot(x, u) + _dot(y, v) + _dot(z, w) >= 1.0
    aside = ca.horzcat(sine[:, 0] + TINY, sine[:, 1:])  # for half a turn any axis will do
    size = ca.sqrt(ca.sum2(aside**2) + TINY**2)
    factor = ca.repmat((2.0 - size) / size, 1, 3)
    return ca.if_else(ca.repmat(within_quarter, 1, 3), sine, factor * aside)


def _dot(first: list[Matrix], second: list[Matrix]) -> Matrix:
    return sum((a * b for a, b in zip(first, second, strict=True)), ca.DM(0.0))


def projected(robot: SpatialArm, error: PoseError, theta: Matrix) -> Matrix:
    """Where damped Newton steps from a posture (1, dof) lead, within the joints' ranges; it may not have arrived.

    A joint at the end of its range stays there.
    """
    kinematics = _kinematics(robot)
    theta = _within(robot, theta)
    for _ in range(STEPS):
        position, rotation, jacobian = kinematics(theta)
        missing = error(position, rotation).T
        jacobian = jacobian[: missing.shape[0], :] * ca.repmat(_free(robot, theta), missing.shape[0], 1)
        damping = DAMPING * ca.sumsqr(missing) + LEAST_DAMPING
        square = ca.mtimes(jacobian, jacobian.T) + damping * ca.DM.eye(missing.shape[0])
        step = ca.mtimes(jacobian.T, ca.ldl_solve(-missing, *ca.ldl(square))).T
        shorter = ca.fmin(1.0, LARGEST_STEP / (largest(ca.fabs(step)) + TINY))
        theta = _within(robot, theta + shorter * step)
    return theta


def _kinematics(robot: SpatialArm) -> ca.Function:
    """Position (1, 3), rotation (1, 9) and Jacobian (6, dof) of a posture (1, dof)."""
    theta = ca.SX.sym("theta", 1, robot.dof)
    return ca.Function("kinematics", [theta], [*robot.tool_pose(theta), tool_jacobian(robot, theta)])


def _ranges(robot: SpatialArm) -> tuple[Matrix, Matrix] | None:
    if robot.limits.position is None:
        return None
    lowest, highest = (ca.horzcat(*bound) for bound in zip(*robot.limits.position, strict=True))
    spare = KEPT * (highest - lowest)
    return lowest + spare, highest - spare


def _within(robot: SpatialArm, theta: Matrix) -> Matrix:
    ranges = _ranges(robot)
    return theta if ranges is None else ca.fmin(ca.fmax(theta, ranges[0]), ranges[1])


def _free(robot: SpatialArm, theta: Matrix) -> Matrix:
    """1 for each joint of a posture (1, dof) that is between the ends of its range, else 0."""
    ranges = _ranges(robot)
    if ranges is None:
        return ca.DM.ones(1, robot.dof)
    return ca.logic_and(theta > ranges[0], theta < ranges[1])
