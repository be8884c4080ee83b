"""Torques at samples of a time law, and how they change with its control points and with its duration."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array, vstack

from problems.base.matrix import FloatArray
from problems.timing.motors.path_torques import PathTorques
from problems.timing.smooth.law_rows import LawRows, combined


def torque_law_rows(motors: PathTorques, basis: list[csr_array], controls: FloatArray, duration: float) -> LawRows:
    """Linearise the torques around a time law, as shares of their limits.

    Args:
        motors: of the path.
        basis: matrices that turn control points into s, s', s'', s''' at the samples.
        controls: the control points.
        duration: in s.
    """
    s, rate, change = _at_samples(motors, basis, controls)
    v, a = rate[:, None] / duration, change[:, None] / duration**2
    (m, c, g), (m1, c1, g1) = (motors.at(s, order) for order in (0, 1))
    q1, q2 = (motors.path.at(s, order) for order in (1, 2))
    inertial, viscous = m * a + c * v**2, motors.viscous * q1 * v
    sign, either = _friction(motors, s, q1 * v)
    bound = motors.bound - either
    parts = [  # with respect to s, s', s''
        (m1 * a + c1 * v**2 + motors.viscous * q2 * v + g1) / bound,
        (2.0 * c * v + motors.viscous * q1) / (bound * duration),
        m / (bound * duration**2),
    ]
    joints = bound.shape[1]
    return LawRows(
        values=((inertial + viscous + g + sign) / bound).T.ravel(),
        slopes=csr_array(vstack([combined([part[:, joint] for part in parts], basis) for joint in range(joints)])),
        orders=np.zeros(s.size * joints),
        samples=np.tile(np.arange(s.size), joints),
        slowing=(-(2.0 * inertial + viscous) / bound).T.ravel(),
    )


def law_time_scale(motors: PathTorques, basis: list[csr_array], controls: FloatArray, duration: float) -> float:
    """How many times slower a law has to be run for its torques, at samples in order.

    Args:
        motors: of the path.
        basis: matrices that turn control points into s, s', s'' at the samples.
        controls: the control points.
        duration: in s.
    """
    s, rate, change = _at_samples(motors, basis, controls)
    return motors.time_scale(s, rate / duration, change / duration**2)


def _at_samples(
    motors: PathTorques, basis: list[csr_array], controls: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    s, rate, change = (matrix @ controls for matrix in basis[:3])
    return np.clip(s, *motors.path.breakpoints[[0, -1]]), rate, change


def _friction(motors: PathTorques, s: FloatArray, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
    """As :meth:`PathTorques.friction`, of samples in any order."""
    order = np.argsort(s, kind="stable")
    back = np.argsort(order, kind="stable")
    sign, either = motors.friction(velocity[order])
    return sign[back], either[back]
