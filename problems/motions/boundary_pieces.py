"""Polynomial pieces written in their boundary data, one after the other, with durations of their own.

Each piece is written in normalised time tau = t / h in [0, 1], h its duration. Its scaled coefficients c_n = a_n h^n
are a constant matrix times its boundary data (angles, and derivatives times powers of h), and so are all its samples.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from math import factorial
from typing import ClassVar, TypeVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array, constant
from problems.motions.samples import Samples
from problems.motions.trajectory import Motion, SampleGrid, Trajectory

P = TypeVar("P")

# Rows are c_0..c_5; columns q_0, h q'_0, h^2 q''_0, q_1, h q'_1, h^2 q''_1 of the quintic with these ends.
QUINTIC_HERMITE = np.array(
    [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
        [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
        [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
        [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
    ]
)


def powers_at(order: int, tau: FloatArray, derivative: int = 0) -> FloatArray:
    """The matrix (n, order) from coefficients, lowest power first, to a derivative at normalised times (n,)."""
    powers = np.zeros((tau.size, order))
    for n in range(derivative, order):
        powers[:, n] = factorial(n) / factorial(n - derivative) * tau ** (n - derivative)
    return powers


def sampling_matrix(coefficients: FloatArray, tau: FloatArray, derivative: int = 0) -> ca.DM:
    """The constant matrix that turns boundary data into samples.

    Args:
        coefficients: from the data to the polynomial's coefficients, (order, data).
        tau: normalised times, (n,).
        derivative: how often to differentiate with respect to tau.

    Returns:
        (n, data), with structural zeros.
    """
    return constant(powers_at(coefficients.shape[0], tau, derivative) @ coefficients)


def joined(matrices: Sequence[FloatArray], data: Sequence[Matrix], durations: Matrix) -> Trajectory:
    """The exact motion of numeric boundary data, given the matrix of each piece and the durations (p, 1), s."""
    pieces = [matrix @ as_array(part) for matrix, part in zip(matrices, data, strict=True)]
    return Trajectory.from_pieces(as_array(durations).ravel(), pieces)


class BoundaryPieces(Motion[P]):
    """Pieces in boundary data, sampled at equal steps of time in each.

    The first entry of the data is the angle at the start, on which no derivative depends.

    Attributes:
        joins_are_smooth: whether no sampled derivative jumps where two pieces meet, so that they share a sample there.
        steps: of time in each piece.
    """

    joins_are_smooth: ClassVar[bool] = False
    steps: int

    @property
    @abstractmethod
    def matrices(self) -> tuple[FloatArray, ...]:
        """The matrix of each piece from boundary data to coefficients, lowest power first, (order, data)."""

    @abstractmethod
    def boundary_data(self, parameters: P) -> list[Matrix]:
        """The boundary data of each piece, (data, k), rad."""

    @property
    def duration_count(self) -> int:
        """One duration for each piece."""
        return len(self.matrices)

    @property
    def data_rows(self) -> int:
        """The rows of boundary data that each piece has room for."""
        return max(int(matrix.shape[1]) for matrix in self.matrices)

    def _tau(self, piece: int) -> FloatArray:
        """Normalised times of the samples of a piece: where it begins unless that is shared with the one before."""
        return np.arange(1 if piece and self.joins_are_smooth else 0, self.steps + 1) / self.steps

    def samples(self, parameters: P) -> Samples:
        """All samples, (pieces (steps + 1), k), or one less for each join that is shared."""
        data, durations = self.boundary_data(parameters), self.durations(parameters)
        each = list(zip(self.matrices, data, ca.vertsplit(durations), strict=True))
        blocks = []
        for order in self.orders:
            rows = [
                ca.mtimes(sampling_matrix(matrix, self._tau(i), order), part / time**order)
                for i, (matrix, part, time) in enumerate(each)
            ]
            blocks.append(ca.vertcat(*rows))
        shares, weights = self._timing
        return Samples(
            robot=self.robot,
            derivatives=tuple(blocks),
            duration=self.duration(durations),
            times=ca.mtimes(ca.DM(shares), durations),
            weights=ca.mtimes(ca.DM(weights), durations),
        )

    @cached_property
    def _timing(self) -> tuple[FloatArray, FloatArray]:
        """Each sample's time, and its weight in the trapezoidal rule, as shares of the durations; both (n, pieces)."""
        n, pieces = self.steps, self.duration_count
        apart = n if self.joins_are_smooth else n + 1
        shares, weights = (np.zeros((apart * (pieces - 1) + n + 1, pieces)) for _ in range(2))
        for piece in range(pieces):
            rows = slice(apart * piece, apart * piece + n + 1)
            shares[rows, piece], shares[rows.stop :, piece] = np.arange(n + 1) / n, 1.0
            weights[rows, piece] = 1.0 / n
            weights[[rows.start, rows.stop - 1], piece] /= 2.0
        return shares, weights

    @cached_property
    def grid(self) -> SampleGrid:
        """Rows: coefficients of the boundary data for each order, shares of the times, shares of the weights."""
        columns = []
        for order in self.orders:
            rows = [np.array(sampling_matrix(matrix, self._tau(i), order)) for i, matrix in enumerate(self.matrices)]
            padded = [np.pad(each, ((0, 0), (0, self.data_rows - each.shape[1]))) for each in rows]
            columns.append(np.vstack(padded)[:, 1:])  # the first is 1 for angles, else 0
        pieces = [np.full(self._tau(piece).size, piece) for piece in range(self.duration_count)]
        return SampleGrid(rows=np.column_stack([*columns, *self._timing]), pieces=np.concatenate(pieces))

    def blocks(self, parameters: P, orders: tuple[int, ...]) -> Matrix:
        """The boundary data of all pieces, divided by their durations to the power of the order."""
        parts: list[Matrix] = []
        for data, time in zip(self.boundary_data(parameters), ca.vertsplit(self.durations(parameters)), strict=True):
            padded = ca.vertcat(data, ca.DM.zeros(self.data_rows - data.shape[0], data.shape[1]))
            parts += [ca.vec((padded / time**order)[(1 if order else 0) :, :].T) for order in orders]
        return ca.vertcat(*parts)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """The boundary data of one piece, which alone determine a sample; window and piece are the same."""
        size = sum(self.data_rows - bool(order) for order in orders) * self.robot.dof
        return size, size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        k, first, inner = self.robot.dof, 0, self.data_rows - 1
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for order in orders:
            count = self.data_rows - bool(order)
            data = [window[first + i * k : first + (i + 1) * k].T for i in range(count)]
            weights = row[inner * order : inner * (order + 1)]
            value = data[0] if order == 0 else weights[0] * data[0]
            for i in range(1, inner + (order == 0)):
                value = value + weights[i - (order == 0)] * data[i]
            derivatives[order], first = value, first + count * k
        timing, pieces = row[inner * len(self.orders) :], self.duration_count
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=self.duration(durations),
            times=ca.mtimes(timing[:pieces].T, durations),
            weights=ca.mtimes(timing[pieces:].T, durations),
        )

    def trajectory(self, parameters: P) -> Trajectory:
        return joined(self.matrices, self.boundary_data(parameters), self.durations(parameters))

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        pieces = self.duration_count
        steps = self.steps * int(np.ceil((at_least - 1) / (pieces * self.steps)))
        return trajectory.times(pieces * steps + 1)
