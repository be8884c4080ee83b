"""The motion: splines through knots at equal times, at rest at both ends.

At rest means zero speed and zero acceleration, two conditions more at each end than a cubic spline has room for. Two
further nodes, in the middle of the first and the last interval and with no angle prescribed, make that room.
Everything is linear in the knot angles: B-spline coefficients follow by one banded solve, and each sample takes four
of them. Time is normalised, u in [0, 1].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import BSpline, FloatArray, Matrix, as_array, constant
from problems.motions import (
    DEGREE,
    InterpolatingSpline,
    SampleGrid,
    SplineInTime,
    SplineShape,
    Trajectory,
    without_rounding,
)
from problems.robots import Robot


class RestSpline(InterpolatingSpline):
    """Splines with given knots.

    Args:
        knots: M >= 2 increasing values of u, the first 0, the last 1.
    """

    def __init__(self, knots: FloatArray) -> None:
        first, last = (knots[0] + knots[1]) / 2.0, (knots[-2] + knots[-1]) / 2.0
        inner = np.unique(np.concatenate([[first], knots[1:-1], [last]]))
        if inner.size < knots.size:  # two knots: both middles are the same node
            inner = np.array([1.0, 2.0]) / 3.0
        super().__init__(knots, np.concatenate([[0.0], inner, [1.0]]))

    @cached_property
    def conditions(self) -> FloatArray:
        """The square matrix that the coefficients satisfy: rest, knots, rest; (M + 4, M + 4)."""
        start, end = ([self.basis.derivative(n)(u) for n in (1, 2)] for u in (0.0, 1.0))
        at_knots = self.basis(self.knots)
        rows = np.vstack([at_knots[:1], *start, at_knots[1:-1], *reversed(end), at_knots[-1:]])
        return without_rounding(rows)

    def known(self, angles: Matrix) -> Matrix:
        scaled = self.scaled(angles)
        rest = ca.DM.zeros(2, angles.shape[1])
        return ca.vertcat(scaled[0, :], rest, scaled[1:-1, :], rest, scaled[-1, :])

    def extreme_speeds(self, coefficients: Matrix) -> Matrix:
        """All values among which the extremes of the speed over all u are, exactly: (2 nodes - 1, k), rad per u."""
        speed = ca.mtimes(self.sampling_matrix(self.nodes, 1), coefficients)
        m = self.accelerations(coefficients)
        half_steps = ca.repmat(ca.DM(np.diff(self.nodes) / 2.0), 1, coefficients.shape[1])
        return ca.vertcat(speed, turning_speed(speed[:-1, :], m[:-1, :], m[1:, :], half_steps))

    def accelerations(self, coefficients: Matrix) -> Matrix:
        """Second derivatives m at the nodes, (nodes, k), rad per u^2: the extremes over all u are among them."""
        return ca.mtimes(self.sampling_matrix(self.nodes, 2), coefficients)

    def jerks(self, coefficients: Matrix) -> Matrix:
        """Third derivatives, constant between nodes, (nodes - 1, k), rad per u^3."""
        m = self.accelerations(coefficients)
        return (m[1:, :] - m[:-1, :]) / ca.repmat(ca.DM(np.diff(self.nodes)), 1, coefficients.shape[1])

    def pieces(self, coefficients: FloatArray) -> list[FloatArray]:
        """Per piece between nodes the coefficients (4, k) in powers of its own time in [0, 1], lowest first."""
        values = [
            np.asarray(BSpline(self.basis.t, coefficients, DEGREE).derivative(n)(self.nodes)) for n in range(1, 3)
        ]
        angle = np.asarray(BSpline(self.basis.t, coefficients, DEGREE)(self.nodes))
        speed, m = values
        h = np.diff(self.nodes)[:, None]
        cubic = (m[1:] - m[:-1]) * h**2 / 6.0
        return list(np.stack([angle[:-1], speed[:-1] * h, m[:-1] * h**2 / 2.0, cubic], axis=1))


def turning_speed(speed: Matrix, before: Matrix, after: Matrix, half_step: Matrix) -> Matrix:
    """The speed where it turns between two nodes; that at the first node where it does not.

    The acceleration is linear between nodes; where it changes sign the speed turns, at
    v_i + h m_i^2 / (2 (m_i - m_{i+1})).

    Args:
        speed: at the first node, any shape.
        before: acceleration m_i there.
        after: acceleration m_{i+1} at the second node.
        half_step: h / 2.
    """
    turning = speed + half_step * before * before / (before - after)
    return ca.if_else(before * after < 0.0, turning, speed)


ROWS_PER_SAMPLE = 8  # of a tabulated trajectory


@dataclass(frozen=True)
class KnotSpline(SplineInTime):
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
    def point_grid(self) -> SampleGrid:
        """The rows at the points of the path, for the angles alone."""
        basis, pieces = self.spline.local_basis(self.point_parameters, 0)
        return SampleGrid(rows=basis, pieces=pieces)

    @cached_property
    def node_grid(self) -> SampleGrid:
        """Rows for the peaks of speed and acceleration at and between the nodes: bases of both, half a step before."""
        speed, pieces = self.spline.local_basis(self.spline.nodes, 1)
        acceleration, _ = self.spline.local_basis(self.spline.nodes, 2)
        half_steps = np.append(0.0, np.diff(self.spline.nodes) / 2.0)
        return SampleGrid(rows=np.column_stack([speed, acceleration, half_steps]), pieces=pieces)

    def trajectory(self, parameters: SplineShape) -> Trajectory:
        pieces = self.spline.pieces(as_array(parameters.coefficients))
        return Trajectory.from_pieces(np.diff(self.spline.nodes) * float(parameters.time), pieces)

    def quantities(self, phi: FloatArray, time: float) -> dict[str, FloatArray]:
        """Quantities by name: redundant values at the knots (M, redundancy), t_T, and the knots themselves."""
        named = {f"phi_{j}": column for j, column in enumerate(phi.T, start=3)}
        return {"t_T": np.array([time]), **named, "u_knots": self.spline.knots}

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        intervals = self.parameters_u.size - 1
        steps = intervals * max(ROWS_PER_SAMPLE, int(np.ceil((at_least - 1) / intervals)))
        return np.linspace(0.0, trajectory.duration, steps + 1)


class NodeForm:
    """A cubic C2 spline written in angles and second derivatives at its nodes.

    Args:
        spline: whose nodes.
    """

    def __init__(self, spline: RestSpline) -> None:
        self.nodes = spline.nodes
        self.steps = np.diff(spline.nodes)
        self.unit = float(self.steps.mean()) ** 2  # scales second derivatives to rad
        self.knots = [int(np.argmin(np.abs(spline.nodes - u))) for u in spline.knots]

    def samples(self, angles: Matrix, bends: Matrix, u: FloatArray) -> tuple[Matrix, ...]:
        """Angles, speeds, accelerations and jerks (n, k) at u (n,), from angles and scaled bends (nodes, k)."""
        i = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.steps.size - 1)
        h = self.steps[i]
        b = (u - self.nodes[i]) / h
        a = 1.0 - b
        of_angles = ((a, b), (-1.0 / h, 1.0 / h), (0.0 * a, 0.0 * b), (0.0 * a, 0.0 * b))
        of_bends = (
            ((a**3 - a) * h**2 / 6.0, (b**3 - b) * h**2 / 6.0),
            (-(3.0 * a**2 - 1.0) * h / 6.0, (3.0 * b**2 - 1.0) * h / 6.0),
            (a, b),
            (-1.0 / h, 1.0 / h),
        )
        return tuple(
            ca.mtimes(self._between(i, *pair), angles) + ca.mtimes(self._between(i, *bend), bends) / self.unit
            for pair, bend in zip(of_angles, of_bends, strict=True)
        )

    def _between(self, i: np.ndarray, left: FloatArray, right: FloatArray) -> ca.DM:
        matrix = np.zeros((i.size, self.nodes.size))
        rows = np.arange(i.size)
        matrix[rows, i], matrix[rows, i + 1] = left, right
        return constant(matrix)

    def joins(self, angles: Matrix, bends: Matrix) -> Matrix:
        """Zero (nodes, k) when speeds are continuous at the inner nodes and zero at both ends; rad."""
        h, n = self.steps, self.nodes.size
        slopes, curvature = np.zeros((n, n)), np.zeros((n, n))
        for i in range(n):
            if i > 0:  # the speed at the end of the piece before
                slopes[i, i - 1 : i + 1] += np.array([-1.0, 1.0]) / h[i - 1]
                curvature[i, i - 1 : i + 1] += np.array([1.0, 2.0]) * h[i - 1] / 6.0
            if i < n - 1:  # less the speed at the start of the piece after
                slopes[i, i : i + 2] -= np.array([-1.0, 1.0]) / h[i]
                curvature[i, i : i + 2] += np.array([2.0, 1.0]) * h[i] / 6.0
        scale = float(np.sqrt(self.unit))
        return ca.mtimes(constant(slopes * scale), angles) + ca.mtimes(constant(curvature * scale / self.unit), bends)


def knot_operators(spline: RestSpline, *samples: tuple[FloatArray, int]) -> tuple[FloatArray, ...]:
    """Constant matrices (n, M) from angles at the knots to derivatives of the spline, by (times u (n,), order)."""
    shape = spline.coefficients(ca.DM.eye(spline.knots.size))
    return tuple(as_array(ca.mtimes(spline.sampling_matrix(u, order), shape)) for u, order in samples)
