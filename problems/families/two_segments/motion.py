"""The motion: a quartic, then a quintic (3)-(6).

The matrices below, from the boundary data of a segment to the scaled coefficients c_n = a_n t_i^n of (4) and (6), are
the whole polynomial model, for symbols and for numbers alike.

The arm's own quantities are theta_s, theta_m, dtheta_m, theta_f, t1 and t2. Objective and limits depend on them alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, as_array
from problems.motions import QUINTIC_HERMITE, BoundaryPieces, Trajectory, joined
from problems.robots import Robot

TIME_SHARES = (0.1, 0.9)  # of t1 in t1 + t2, where the shape alone is sought

# (4): rows are c_0..c_4, columns the data theta_s, theta_m - theta_s, dtheta_m t1.
QUARTIC = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 4.0, -1.0], [0.0, -3.0, 1.0]])

# (6): rows are c_0..c_5, columns the data theta_m, theta_f - theta_m, dtheta_m t2, ddtheta_m t2^2.
QUINTIC = np.column_stack(
    [QUINTIC_HERMITE[:, 0] + QUINTIC_HERMITE[:, 3], QUINTIC_HERMITE[:, 3], QUINTIC_HERMITE[:, 1], QUINTIC_HERMITE[:, 2]]
)


def quartic_data(theta_s: Matrix, theta_m: Matrix, dtheta_m: Matrix, t1: Matrix) -> Matrix:
    """Boundary data of the first segment, one column a joint: (3, k), rad. Arguments (1, k) and a scalar."""
    return ca.vertcat(theta_s, theta_m - theta_s, dtheta_m * t1)


def quintic_data(theta_m: Matrix, dtheta_m: Matrix, ddtheta_m: Matrix, theta_f: Matrix, t2: Matrix) -> Matrix:
    """Boundary data of the second segment, one column a joint: (4, k), rad. Arguments (1, k) and a scalar."""
    return ca.vertcat(theta_m, theta_f - theta_m, dtheta_m * t2, ddtheta_m * t2**2)


def middle_acceleration(theta_s: Matrix, theta_m: Matrix, dtheta_m: Matrix, t1: Matrix) -> Matrix:
    """ddtheta_m in rad/s^2: the second derivative of (3) at t1, with which (5) continues. (1, k)."""
    return (6.0 * dtheta_m * t1 - 12.0 * (theta_m - theta_s)) / t1**2


@dataclass(frozen=True)
class Quantities:
    """The arm's own quantities: angles (1, k) in rad, speeds (1, k) in rad/s, times scalar in s."""

    theta_s: Matrix
    theta_m: Matrix
    dtheta_m: Matrix
    theta_f: Matrix
    t1: Matrix
    t2: Matrix

    def time_scaled(self, factor: Operand) -> Quantities:
        """The motion run ``factor`` times slower."""
        slower = self.dtheta_m / factor, self.theta_f, self.t1 * factor, self.t2 * factor
        return Quantities(self.theta_s, self.theta_m, *slower)

    @property
    def data(self) -> tuple[Matrix, Matrix]:
        """Boundary data of the quartic (3, k) and the quintic (4, k), rad."""
        start = self.theta_s, self.theta_m, self.dtheta_m, self.t1
        first = quartic_data(*start)
        second = quintic_data(self.theta_m, self.dtheta_m, middle_acceleration(*start), self.theta_f, self.t2)
        return first, second

    def trajectory(self) -> Trajectory:
        """Quartic (3) and quintic (5), exactly; of numeric quantities."""
        return joined((QUARTIC, QUINTIC), self.data, ca.vertcat(self.t1, self.t2))

    def arrays(self) -> dict[str, FloatArray]:
        """Numeric quantities by name, each (k,) or (1,)."""
        return {field.name: as_array(getattr(self, field.name)).ravel() for field in fields(self)}


@dataclass(frozen=True)
class TwoSegments(BoundaryPieces[Quantities]):
    """Quartic and quintic, sampled at equal steps of time in each.

    Args:
        robot: that moves.
        steps: of time in each segment.
    """

    joins_are_smooth: ClassVar[bool] = True  # up to the acceleration, as the paper has them

    robot: Robot
    steps: int

    @property
    def matrices(self) -> tuple[FloatArray, ...]:
        """The quartic's and the quintic's."""
        return QUARTIC, QUINTIC

    def boundary_data(self, parameters: Quantities) -> list[Matrix]:
        return list(parameters.data)

    def durations(self, parameters: Quantities) -> Matrix:
        """The durations t1 and t2."""
        return ca.vertcat(parameters.t1, parameters.t2)

    def as_matrices(self, parameters: Quantities) -> list[Matrix]:
        return [getattr(parameters, field.name) for field in fields(parameters)]

    def from_matrices(self, matrices: Sequence[Matrix]) -> Quantities:
        return Quantities(*matrices)
