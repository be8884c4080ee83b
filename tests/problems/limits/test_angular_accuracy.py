"""The angle from a tool to the orientation at the nearest point of a line, against SciPy."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from problems.limits import AngularAccuracy, shares_along
from problems.robots import Orientations


def test_angles_are_those_of_spherical_interpolation() -> None:
    rng = np.random.default_rng(5)
    ends = Rotation.from_rotvec([[0.2, -0.3, 0.1], [0.9, 0.8, -0.4]])
    line = Orientations(ends.as_quat())
    row = np.concatenate([line.matrices[0].ravel(), line.axes[0], line.angles])
    shares = rng.uniform(0.0, 1.0, 12)
    wanted = Slerp([0.0, 1.0], ends)(shares)
    angles = np.array([0.0, 1e-6, *rng.uniform(0.0, 3.1, 10)])
    axes = rng.normal(size=(12, 3))
    tool = wanted * Rotation.from_rotvec(angles[:, None] * axes / np.linalg.norm(axes, axis=1)[:, None])
    constraint = AngularAccuracy(0.01).along(
        ca.DM(tool.as_matrix().reshape(-1, 9)), ca.DM(shares), ca.DM(np.tile(row, (12, 1))), margin=0.1
    )
    assert constraint.expression.full().ravel() == pytest.approx(angles, rel=1e-9, abs=1e-12)
    assert constraint.bounds[1] == pytest.approx([0.009])


def test_nearest_points_of_lines_by_hand() -> None:
    tool = ca.DM([[0.5, 1.0, 0.0], [-1.0, 0.0, 2.0], [3.0, 0.0, 0.0]])
    starts, ends = ca.DM.zeros(3, 3), ca.repmat(ca.DM([[2.0, 0.0, 0.0]]), 3, 1)
    assert shares_along(tool, starts, ends).full().ravel().tolist() == [0.25, 0.0, 1.0]
