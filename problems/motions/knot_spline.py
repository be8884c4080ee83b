"""The paper's motion along a path: a C2 spline through knots on it, the path passed at equal intervals of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, as_array
from problems.motions.motion import Motion, SampleGrid
from problems.motions.samples import Samples
from problems.motions.splines.clamped import DEGREE
from problems.motions.splines.rest import RestSpline
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

ROWS_PER_SAMPLE = 8  # of a tabulated trajectory
SUPPORT = DEGREE + 1  # B-spline coefficients that shape a sample


@dataclass(frozen=True)
class SplineShape:
    """B-spline coefficients of the joint angles (M + 4, k) in rad over u in [0, 1], and how long it takes, s."""

    coefficients: Matrix
    time: Matrix


@dataclass(frozen=True)
class KnotSpline(Motion[SplineShape]):
    """A spline at rest at both ends, sampled at equal steps of time.

    Args:
        robot: that moves.
        knots: path parameters u of the knots, increasing from 0 to 1.
        points: how many points the path has, at equal steps of u.
        steps: of time between two points.
    """

    robot: Robot
    knots: tuple[float, ...]
    points: int
    steps: int

    @cached_property
    def spline(self) -> RestSpline:
        """The spline through the knots."""
        return RestSpline(np.array(self.knots))

    @cached_property
    def parameters_u(self) -> FloatArray:
        """Path parameters of the samples, (n,); every ``steps``-th is a point of the path."""
        return np.linspace(0.0, 1.0, self.steps * (self.points - 1) + 1)

    @cached_property
    def point_parameters(self) -> FloatArray:
        """Path parameter of each point, (points,)."""
        return np.linspace(0.0, 1.0, self.points)

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

    @cached_property
    def point_grid(self) -> SampleGrid:
        """The rows at the points of the path, for the angles alone."""
        basis, pieces = self.spline.local_basis(self.point_parameters, 0)
        return SampleGrid(rows=basis, pieces=pieces)

    def blocks(self, parameters: SplineShape, orders: tuple[int, ...]) -> Matrix:
        """The coefficients one after the other, divided by the duration to the power of each order."""
        return ca.vec(ca.horzcat(*(parameters.coefficients / parameters.time**order for order in orders)).T)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """One coefficient per piece; four of them determine a sample."""
        size = len(orders) * self.robot.dof
        return size, SUPPORT * size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        """One sample."""
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for order in orders:
            derivatives[order] = self.combined(window, row[SUPPORT * order : SUPPORT * (order + 1)], orders, order)
        u, weight = row[SUPPORT * len(self.orders)], row[SUPPORT * len(self.orders) + 1]
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=durations[0],
            times=u * durations[0],
            weights=weight * durations[0],
        )

    def combined(self, window: Matrix, basis: Matrix, orders: tuple[int, ...], order: int) -> Matrix:
        """Joint angles or a derivative (1, k) from a window and the four basis functions (4, 1)."""
        k, size = self.robot.dof, len(orders) * self.robot.dof
        first = orders.index(order) * k
        parts = [basis[i] * window[first + i * size : first + i * size + k].T for i in range(SUPPORT)]
        return ((parts[0] + parts[1]) + parts[2]) + parts[3]

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

    @cached_property
    def node_grid(self) -> SampleGrid:
        """Rows for the peaks of speed and acceleration at and between the nodes: bases of both, half a step before."""
        speed, pieces = self.spline.local_basis(self.spline.nodes, 1)
        acceleration, _ = self.spline.local_basis(self.spline.nodes, 2)
        half_steps = np.append(0.0, np.diff(self.spline.nodes) / 2.0)
        return SampleGrid(rows=np.column_stack([speed, acceleration, half_steps]), pieces=pieces)

    def trajectory(self, parameters: SplineShape) -> Trajectory:
        """The exact piecewise polynomial of the spline."""
        pieces = self.spline.pieces(as_array(parameters.coefficients))
        return Trajectory.from_pieces(np.diff(self.spline.nodes) * float(parameters.time), pieces)

    def quantities(self, phi: FloatArray, time: float) -> dict[str, FloatArray]:
        """Quantities by name: redundant values at the knots (M, redundancy), t_T, and the knots themselves."""
        named = {f"phi_{j}": column for j, column in enumerate(phi.T, start=3)}
        return {"t_T": np.array([time]), **named, "u_knots": self.spline.knots}

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Equal steps, the samples among them; many, as pieces are short."""
        intervals = self.parameters_u.size - 1
        steps = intervals * max(ROWS_PER_SAMPLE, int(np.ceil((at_least - 1) / intervals)))
        return np.linspace(0.0, trajectory.duration, steps + 1)
