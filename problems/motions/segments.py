"""The two polynomial segments of a point-to-point motion, (3)-(6).

Both are written in normalised time tau = t / t_i in [0, 1]. The scaled coefficients c_n = a_n t_i^n of (4) and (6)
are then a constant matrix times the segment's boundary data, and so are all samples of the segment: the matrices
below are the whole polynomial model, for symbols and for numbers alike.
"""

from __future__ import annotations

from math import factorial

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, constant

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
