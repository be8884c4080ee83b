"""Structured starts: postures of a task, and how far joints move between them.

Without obstacles nothing else couples the joints: the least time is that of the joint with the largest displacement,
the rotation adds all displacements. Only here do the starts depend on the objective.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array
from problems.objectives import Objective
from problems.robots import Robot


@dataclass(frozen=True, kw_only=True)
class Displacement:
    """How the displacements of the joints count.

    Attributes:
        longest: the largest of them counts, measured in time; otherwise their sum, in rad.
        exponent: p of the cost |step|^p of a joint's step between two knots of a path.
    """

    longest: bool
    exponent: float


LONGEST = Displacement(longest=True, exponent=3.0)
SUM = Displacement(longest=False, exponent=1.5)


def displacement_of(objective: Objective) -> Displacement:
    """How the displacements count for an objective."""
    return LONGEST if np.isinf(objective.norm) else SUM


class PointPostures:
    """Inverse kinematics of a robot at n points.

    Args:
        robot: whose.
        points: of the tool, (n, dim), m.
    """

    def __init__(self, robot: Robot, points: Sequence[tuple[float, ...]]) -> None:
        self.robot = robot
        self.points = ca.DM(points)
        form = robot.closed_form
        point, elbow = ca.SX.sym("point", robot.dim), ca.SX.sym("elbow")
        share, angle = ca.SX.sym("x_phi", form.redundancy), ca.SX.sym("phi", form.redundancy)
        normalised, _ = form.inverse(point, form.restore_redundancy(point, share), elbow)
        absolute, cosine = form.inverse(point, angle, elbow)
        outputs = [form.wrap(absolute).T, cosine]
        self._normalised = ca.Function("ik", [point, share, elbow], [form.wrap(normalised).T])
        self._absolute = ca.Function("ik", [point, angle, elbow], outputs)
        theta = ca.SX.sym("theta", robot.dof)
        self._nearest = ca.Function("nearest", [theta, point], [form.project_to_point(theta.T, point).T])

    def at_shares(self, x_phi: FloatArray, elbow: FloatArray) -> FloatArray:
        """Postures (n, k) in rad, each angle in its first turn, at normalised redundancy (n, k - 2) and elbows (n,)."""
        return as_array(self._normalised.map(self.points.shape[0])(self.points.T, x_phi.T, elbow[None, :])).T

    def at_angles(self, index: int, phi: FloatArray, elbow: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Postures at one point, with links 3..k at absolute angles.

        Args:
            index: of the point.
            phi: angles (m, k - 2), rad.
            elbow: +1 up or -1 down, (m,).

        Returns:
            Joint angles (m, k) in rad, each in its first turn, and which of them reach the point, (m,).
        """
        theta, cosine = self._absolute.map(len(phi))(self.points[index, :].T, phi.T, elbow[None, :])
        return as_array(theta).T, np.abs(as_array(cosine).ravel()) <= 1.0

    def nearest(self, theta: FloatArray) -> FloatArray:
        """The postures nearest to ``theta`` (n, k) that are exactly on the points; links 3..k keep their direction."""
        return as_array(self._nearest.map(self.points.shape[0])(theta.T, self.points.T)).T
