"""The motion: a quartic, then a quintic (3)-(6).

Both are written in normalised time tau = t / t_i in [0, 1]. The scaled coefficients c_n = a_n t_i^n of (4) and (6)
are then a constant matrix times the segment's boundary data, and so are all samples of the segment: the matrices
below are the whole polynomial model, for symbols and for numbers alike.

The arm's own quantities are theta_s, theta_m, dtheta_m, theta_f, t1 and t2. Objective and limits depend on them alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from math import factorial

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, as_array, constant
from problems.motions import Motion, SampleGrid, Samples, Trajectory
from problems.robots import Robot

TIME_SHARES = (0.1, 0.9)  # of t1 in t1 + t2, where the shape alone is sought

# (4): rows are c_0..c_4, columns the data theta_s, theta_m - theta_s, dtheta_m t1.
QUARTIC = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 4.0, -1.0], [0.0, -3.0, 1.0]])

# (6): rows are c_0..c_5, columns the data theta_m, theta_f - theta_m, dtheta_m t2, ddtheta_m t2^2.
QUINTIC = np.array(
    [
        [1.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 0.5],
        [0.0, 10.0, -6.0, -1.5],
        [0.0, -15.0, 8.0, 1.5],
        [0.0, 6.0, -3.0, -0.5],
    ]
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


def sampling_matrix(coefficients: FloatArray, tau: FloatArray, derivative: int = 0) -> ca.DM:
    """The constant matrix that turns boundary data into samples.

    Args:
        coefficients: ``QUARTIC`` or ``QUINTIC``, (order, data).
        tau: normalised times, (n,).
        derivative: how often to differentiate with respect to tau.

    Returns:
        (n, data), with structural zeros.
    """
    order = coefficients.shape[0]
    powers = np.zeros((tau.size, order))
    for n in range(derivative, order):
        powers[:, n] = factorial(n) / factorial(n - derivative) * tau ** (n - derivative)
    return constant(powers @ coefficients)


BOUNDARY_ROWS = 4  # rows of a segment's boundary data; the quartic's three and a zero


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
        pieces = [
            coefficients @ as_array(data) for coefficients, data in zip((QUARTIC, QUINTIC), self.data, strict=True)
        ]
        return Trajectory.from_pieces(np.array([float(self.t1), float(self.t2)]), pieces)

    def arrays(self) -> dict[str, FloatArray]:
        """Numeric quantities by name, each (k,) or (1,)."""
        return {field.name: as_array(getattr(self, field.name)).ravel() for field in fields(self)}

    def vector(self) -> Matrix:
        """The quantities one after the other, (4 k + 2, 1)."""
        matrices: list[Matrix] = [getattr(self, field.name) for field in fields(self)]
        return ca.vertcat(*(ca.vec(matrix) for matrix in matrices))

    @classmethod
    def from_vector(cls, vector: Matrix) -> Quantities:
        """The inverse of :meth:`vector`."""
        k = (vector.shape[0] - 2) // 4
        theta_s, theta_m, dtheta_m, theta_f = (vector[i * k : (i + 1) * k].T for i in range(4))
        return cls(theta_s, theta_m, dtheta_m, theta_f, vector[4 * k], vector[4 * k + 1])


@dataclass(frozen=True)
class TwoSegments(Motion[Quantities]):
    """Quartic and quintic, sampled at equal steps of time in each.

    Args:
        robot: that moves.
        steps: of time in each segment.
    """

    robot: Robot
    steps: int

    def samples(self, parameters: Quantities) -> Samples:
        """Samples of both segments in equal steps: (2 steps + 1, k)."""
        tau = np.arange(1, self.steps + 1) / self.steps
        blocks = []
        early, late = parameters.data
        for derivative in self.orders:
            first = sampling_matrix(QUARTIC, np.append(0.0, tau), derivative)
            second = sampling_matrix(QUINTIC, tau, derivative)
            blocks.append(
                ca.vertcat(
                    ca.mtimes(first, early / parameters.t1**derivative),
                    ca.mtimes(second, late / parameters.t2**derivative),
                )
            )
        shares, weights = self._timing
        durations = ca.vertcat(parameters.t1, parameters.t2)
        return Samples(
            robot=self.robot,
            derivatives=tuple(blocks),
            duration=parameters.t1 + parameters.t2,
            times=ca.mtimes(ca.DM(shares), durations),
            weights=ca.mtimes(ca.DM(weights), durations),
        )

    @cached_property
    def _timing(self) -> tuple[FloatArray, FloatArray]:
        """Each sample's time, and its weight in the trapezoidal rule, as shares of t1 and t2; both (n, 2)."""
        n = self.steps
        shares, weights = np.zeros((2 * n + 1, 2)), np.zeros((2 * n + 1, 2))
        shares[: n + 1, 0], shares[n:, 0] = np.arange(n + 1) / n, 1.0
        shares[n:, 1] = np.arange(n + 1) / n
        weights[: n + 1, 0], weights[n:, 1] = 1.0 / n, 1.0 / n
        weights[[0, n], 0] /= 2.0
        weights[[n, 2 * n], 1] /= 2.0
        return shares, weights

    @cached_property
    def grid(self) -> SampleGrid:
        """Rows: coefficients of the boundary data for each order, shares of the times, shares of the weights."""
        tau = np.arange(1, self.steps + 1) / self.steps
        columns = []
        for derivative in self.orders:
            first = np.array(sampling_matrix(QUARTIC, np.append(0.0, tau), derivative))
            second = np.array(sampling_matrix(QUINTIC, tau, derivative))
            padded = np.column_stack([first, np.zeros(len(first))])
            columns.append(np.vstack([padded, second])[:, 1:])  # the first is 1 for angles, else 0
        rows = np.column_stack([*columns, *self._timing])
        second_segment = np.repeat([0, 1], [self.steps + 1, self.steps])
        return SampleGrid(rows=rows, pieces=second_segment)

    def blocks(self, parameters: Quantities, orders: tuple[int, ...]) -> Matrix:
        """The boundary data of both segments, divided by their times to the power of the order."""
        early, late = parameters.data
        early = ca.vertcat(early, ca.DM.zeros(1, early.shape[1]))
        parts = [
            ca.vec((data / time**order)[(1 if order else 0) :, :].T)
            for data, time in ((early, parameters.t1), (late, parameters.t2))
            for order in orders
        ]
        return ca.vertcat(*parts)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """The boundary data of one segment, which alone determine a sample; window and piece are the same."""
        size = sum(BOUNDARY_ROWS - bool(order) for order in orders) * self.robot.dof
        return size, size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        k, first = self.robot.dof, 0
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for order in orders:
            count = BOUNDARY_ROWS - bool(order)
            data = [window[first + i * k : first + (i + 1) * k].T for i in range(count)]
            weights = row[(BOUNDARY_ROWS - 1) * order : (BOUNDARY_ROWS - 1) * (order + 1)]
            value = data[0] if order == 0 else weights[0] * data[0]
            for i in range(1, BOUNDARY_ROWS - 1 + (order == 0)):
                value = value + weights[i - (order == 0)] * data[i]
            derivatives[order], first = value, first + count * k
        timing = row[(BOUNDARY_ROWS - 1) * len(self.orders) :]
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=durations[0] + durations[1],
            times=ca.mtimes(timing[:2].T, durations),
            weights=ca.mtimes(timing[2:].T, durations),
        )

    def durations(self, parameters: Quantities) -> Matrix:
        """The durations t1 and t2."""
        return ca.vertcat(parameters.t1, parameters.t2)

    @property
    def duration_count(self) -> int:
        """The durations t1 and t2."""
        return 2

    def as_matrices(self, parameters: Quantities) -> list[Matrix]:
        return [getattr(parameters, field.name) for field in fields(parameters)]

    def from_matrices(self, matrices: Sequence[Matrix]) -> Quantities:
        return Quantities(*matrices)

    def trajectory(self, parameters: Quantities) -> Trajectory:
        return parameters.trajectory()

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        steps = self.steps * int(np.ceil((at_least - 1) / (2 * self.steps)))
        return trajectory.times(2 * steps + 1)
