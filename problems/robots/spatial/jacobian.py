"""How the joints' rates move the tool."""

from __future__ import annotations

import casadi as ca

from problems.base.matrix import Matrix
from problems.robots.spatial.spatial_arm import SpatialArm
from problems.robots.spatial.transform import Vector, as_rows


def tool_jacobian(robot: SpatialArm, theta: Matrix) -> Matrix:
    """The geometric Jacobian (6, dof) of a posture (1, dof).

    Its rows are the tool's velocity, m/s, then its angular velocity, rad/s, in the axes outside; a column is for a rate
    of 1 rad/s or 1 m/s of one joint.
    """
    frames = robot.chain.frames(theta, robot.base_frame)
    tool = frames[-1].apply(robot.tool_frame.translation)
    columns = []
    for joint, frame in zip(robot.chain.joints, frames[1:], strict=True):
        axis = _column(frame.turn(joint.axis))
        lever = _column(tool) - _column(frame.translation)
        linear, angular = (ca.cross(axis, lever), axis) if joint.turns else (axis, ca.DM.zeros(3))
        columns.append(ca.vertcat(linear, angular))
    return ca.horzcat(*columns)


def _column(vector: Vector) -> Matrix:
    column: Matrix = as_rows(vector, 1).T
    return column
