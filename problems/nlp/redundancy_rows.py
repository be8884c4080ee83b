"""Constraints for a path with few values of redundancy: links at the knots follow the interpolated values."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix, constant
from problems.encodings import KnotsEncoding
from problems.limits.constraint import Constraint
from problems.nlp.program import equality

REDUNDANCY_MARGIN = 1e-3  # distance of interpolated x_phi from the ends of [0, 1], where (7) has infinite slope


def redundancy_rows(encoding: KnotsEncoding, theta: Matrix, values: Matrix) -> list[Constraint]:
    """The orientations of links 3..k at the knots are those of (7), up to whole turns; x_phi stays inside.

    Args:
        encoding: whose knots.
        theta: joint angles at the knots, (M, k), rad.
        values: of x_phi, (redundancy_values (k - 2), 1).
    """
    robot = encoding.task.robot
    extra = robot.redundancy
    share = ca.mtimes(constant(encoding.interpolation), ca.reshape(values, -1, extra))
    at_zero = ca.repmat(ca.DM(robot.redundant_values(np.zeros((1, robot.dof)))), theta.shape[0], 1)
    psi = ca.cumsum(theta, 1)[:, 2:] + at_zero
    points = enumerate(encoding.knot_points)
    phi = [robot.restore_redundancy(ca.DM(point), share[row, :].T).T for row, point in points]
    links = tuple(f"link {link}" for link in range(3, 3 + extra))
    half = (psi - ca.vertcat(*phi)) / 2.0
    return [
        equality("redundancy", ca.sin(half), "1", links, "psi_j = phi_j of (7) at every knot, up to whole turns"),
        Constraint(
            name="x_phi",
            equation="(7)",
            unit="1",
            expression=share,
            lower=ca.DM(np.full((1, extra), REDUNDANCY_MARGIN)),
            upper=ca.DM(np.full((1, extra), 1.0 - REDUNDANCY_MARGIN)),
            columns=links,
            for_all_t=False,
            formula="0 < x_phi interpolated at the knots < 1",
        ),
    ]
