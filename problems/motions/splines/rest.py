"""The interpolation in joint space: a cubic C2 spline through knots, at rest at both ends.

At rest means zero speed and zero acceleration, two conditions more at each end than a cubic spline has room for. Two
further nodes, in the middle of the first and the last interval and with no angle prescribed, make that room.
Everything is linear in the knot angles: B-spline coefficients follow by one banded solve, and each sample takes four
of them. Time is normalised, u in [0, 1].
"""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline

from problems.base.matrix import FloatArray, Matrix
from problems.motions.splines.clamped import DEGREE
from problems.motions.splines.interpolating import InterpolatingSpline, without_rounding


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
        """Right-hand side (M + 4, k) of ``conditions`` for knot angles (M, k): rest, knots, rest."""
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
