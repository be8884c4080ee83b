"""The common part of motions whose joint angles are a spline over time divided by the duration."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import add

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.motions.motion import Motion, SampleGrid
from problems.motions.samples import Samples
from problems.motions.splines.clamped import ClampedSpline
from problems.robots.robot import Robot


@dataclass(frozen=True)
class SplineShape:
    """B-spline coefficients of the joint angles (N, k) in rad over u in [0, 1], and how long it takes, s."""

    coefficients: Matrix
    time: Matrix


class SplineInTime(Motion[SplineShape]):
    """A spline sampled at given shares u of its duration.

    Attributes:
        robot: that moves.
    """

    robot: Robot

    @property
    @abstractmethod
    def spline(self) -> ClampedSpline:
        """The basis over u, from 0 to 1."""

    @property
    @abstractmethod
    def parameters_u(self) -> FloatArray:
        """Shares of the duration at which it is sampled, equally spaced, (n,)."""

    @property
    def support(self) -> int:
        """The number of coefficients that shape a sample."""
        return self.spline.degree + 1

    @cached_property
    def weights_u(self) -> FloatArray:
        """Weights of the trapezoidal rule over u, (n,)."""
        weights = np.full(self.parameters_u.size, 1.0 / (self.parameters_u.size - 1))
        weights[[0, -1]] /= 2.0
        return weights

    def samples(self, parameters: SplineShape) -> Samples:
        """The motion on the grid."""
        blocks = [
            ca.mtimes(self.spline.sampling_matrix(self.parameters_u, n), parameters.coefficients / parameters.time**n)
            for n in self.orders
        ]
        return Samples(
            robot=self.robot,
            derivatives=tuple(blocks),
            duration=parameters.time,
            times=ca.DM(self.parameters_u) * parameters.time,
            weights=ca.DM(self.weights_u) * parameters.time,
        )

    @cached_property
    def grid(self) -> SampleGrid:
        """Rows: the basis functions of each order that are not zero there, u, the weight."""
        bases, pieces = zip(*(self.spline.local_basis(self.parameters_u, n) for n in self.orders), strict=True)
        return SampleGrid(rows=np.column_stack([*bases, self.parameters_u, self.weights_u]), pieces=pieces[0])

    def blocks(self, parameters: SplineShape, orders: tuple[int, ...]) -> Matrix:
        """The coefficients one after the other, divided by the duration to the power of each order."""
        return ca.vec(ca.horzcat(*(parameters.coefficients / parameters.time**order for order in orders)).T)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """One coefficient per piece; as many of them determine a sample as basis functions are not zero there."""
        size = len(orders) * self.robot.dof
        return size, self.support * size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        """One sample."""
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for order in orders:
            basis = row[self.support * order : self.support * (order + 1)]
            derivatives[order] = self.combined(window, basis, orders, order)
        u, weight = row[self.support * len(self.orders)], row[self.support * len(self.orders) + 1]
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=durations[0],
            times=u * durations[0],
            weights=weight * durations[0],
        )

    def combined(self, window: Matrix, basis: Matrix, orders: tuple[int, ...], order: int) -> Matrix:
        """Joint angles or a derivative (1, k) from a window and the basis functions (support, 1)."""
        k, size = self.robot.dof, len(orders) * self.robot.dof
        first = orders.index(order) * k
        parts = [basis[i] * window[first + i * size : first + i * size + k].T for i in range(self.support)]
        return reduce(add, parts)

    def durations(self, parameters: SplineShape) -> Matrix:
        """The duration t_T, s."""
        return parameters.time

    @property
    def duration_count(self) -> int:
        """One: t_T."""
        return 1

    def as_matrices(self, parameters: SplineShape) -> list[Matrix]:
        """The coefficients and the duration."""
        return [parameters.coefficients, parameters.time]

    def from_matrices(self, matrices: Sequence[Matrix]) -> SplineShape:
        """The coefficients and the duration."""
        return SplineShape(*matrices)
