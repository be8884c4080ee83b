"""Speed, acceleration and jerk along a path at samples of a time law, and how they change with its control points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, diags_array, vstack

from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.robots.robot import JointLimits

ORDERS = 3  # speed, acceleration, jerk


@dataclass(frozen=True, kw_only=True)
class LawRows:
    """What is limited as a share of its limit, one row for each order or torque, joint and sample.

    Attributes:
        values: (rows,), those of the order n for a duration of which they are the n-th power less.
        slopes: with respect to the control points, (rows, controls).
        orders: n, (rows,).
        samples: the index of the sample, (rows,).
        slowing: of torques, of the order 0: how they change with a small share of the duration, (rows,); else zero.
    """

    values: FloatArray
    slopes: csr_array
    orders: FloatArray
    samples: FloatArray
    slowing: FloatArray

    def with_rows(self, other: LawRows) -> LawRows:
        """These and others, of the same samples."""
        return LawRows(
            values=np.append(self.values, other.values),
            slopes=csr_array(vstack([self.slopes, other.slopes])),
            orders=np.append(self.orders, other.orders),
            samples=np.append(self.samples, other.samples),
            slowing=np.append(self.slowing, other.slowing),
        )


def law_rows(
    path: JointPath, limits: JointLimits, basis: list[csr_array], controls: FloatArray, duration: float
) -> LawRows:
    """Linearise q(s(t)) and its derivatives around a time law.

    Args:
        path: of k joints.
        limits: a jerk among them.
        basis: matrices that turn control points into s, s', s'', s''' at the samples.
        controls: the control points.
        duration: in s.
    """
    s, *law = (matrix @ controls for matrix in basis)
    ends = path.breakpoints[[0, -1]]
    v, a, j = (derivative[:, None] for derivative in law)
    q1, q2, q3, q4 = (path.at(np.clip(s, *ends), order) for order in range(1, ORDERS + 2))
    values = [q1 * v, q1 * a + q2 * v**2, q1 * j + 3.0 * q2 * v * a + q3 * v**3]
    partial = [  # with respect to s, s', s'', s'''
        [q2 * v, q1],
        [q2 * a + q3 * v**2, 2.0 * q2 * v, q1],
        [q2 * j + 3.0 * q3 * v * a + q4 * v**3, 3.0 * q2 * a + 3.0 * q3 * v**2, 3.0 * q2 * v, q1],
    ]
    every_limit = (limits.speed, limits.acceleration, limits.jerk)
    scales = [np.array(bound) * duration ** (n + 1) for n, bound in enumerate(every_limit)]
    slopes = [
        combined([part[:, joint] / scale[joint] for part in parts], basis)
        for parts, scale in zip(partial, scales, strict=True)
        for joint in range(scale.size)
    ]
    per_order = s.size * scales[0].size
    return LawRows(
        values=np.concatenate([(value / scale).T.ravel() for value, scale in zip(values, scales, strict=True)]),
        slopes=csr_array(vstack(slopes)),
        orders=np.repeat(np.arange(1.0, ORDERS + 1.0), per_order),
        samples=np.tile(np.arange(s.size), ORDERS * scales[0].size),
        slowing=np.zeros(ORDERS * per_order),
    )


def combined(weights: list[FloatArray], matrices: list[csr_array]) -> csr_array:
    """The sum of as many matrices as there are weights (n,) of their rows."""
    total = csr_array(matrices[0].shape)
    for weight, matrix in zip(weights, matrices, strict=False):
        total += diags_array(weight) @ matrix
    return total
