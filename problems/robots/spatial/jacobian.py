"""How the joints' rates move the tool."""

from __future__ import annotations

import casadi as ca

from problems.base.matrix import Matrix
from problems.robots.rigid.transform import as_rows
from problems.robots.spatial.projection import jacobian_columns
from problems.robots.spatial.spatial_arm import SpatialArm


def tool_jacobian(robot: SpatialArm, theta: Matrix) -> Matrix:
    """The geometric Jacobian (6, dof) of a posture (1, dof).

    Its rows are the tool's velocity, m/s, then its angular velocity, rad/s, in the axes outside; a column is for a rate
    of 1 rad/s or 1 m/s of one joint.
    """
    _, found = jacobian_columns(robot, theta, turning=True)
    return ca.horzcat(*(as_rows(column, 1).T for column in found))
