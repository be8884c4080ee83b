"""Postures at points: on their points by independent kinematics, nearest as the arm itself says."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems import PlanarArm
from problems.base import as_array
from problems.nlp.starts import Postures

ARM = PlanarArm((0.7, 0.5, 0.6, 0.2), (4.0,) * 4, (20.0,) * 4)
POINTS = [(1.0, 0.0), (0.5, 1.5), (-0.3, -0.8)]
POSTURES = Postures(ARM, POINTS)
RNG = np.random.default_rng(0)


def tips(theta: np.ndarray) -> np.ndarray:
    """Complex forward kinematics."""
    return (np.array(ARM.link_lengths) * np.exp(1j * np.cumsum(theta, axis=-1))).sum(axis=-1)


@pytest.mark.parametrize("elbow", [1.0, -1.0])
def test_shares_give_postures_on_the_points(elbow: float) -> None:
    theta = POSTURES.at_shares(RNG.random((3, 2)), np.full(3, elbow))
    assert tips(theta) == pytest.approx(np.array(POINTS) @ [1.0, 1j], abs=1e-12)
    assert (np.sign(theta[:, 1]) == elbow).all()
    assert (np.abs(theta) <= np.pi).all()


def test_angles_are_those_of_the_last_links_where_the_point_is_in_reach() -> None:
    phi = RNG.uniform(-np.pi, np.pi, (200, 2))
    theta, reached = POSTURES.at_angles(1, phi, np.ones(200))
    assert 10 < reached.sum() < 200
    assert tips(theta[reached]) == pytest.approx(np.full(reached.sum(), 0.5 + 1.5j), abs=1e-9)
    assert (np.abs(tips(theta[~reached]) - (0.5 + 1.5j)) > 1e-6).all()
    assert np.exp(1j * np.cumsum(theta, axis=1)[:, 2:]) == pytest.approx(np.exp(1j * phi))


def test_nearest_is_the_projection_of_the_arm() -> None:
    theta = POSTURES.at_shares(RNG.random((3, 2)), np.array([1.0, -1.0, 1.0])) + 0.05 * RNG.normal(size=(3, 4)) + 7.0
    pairs = zip(theta, POINTS, strict=True)
    expected = [as_array(ARM.project_to_point(ca.DM(row).T, ca.DM(point))) for row, point in pairs]
    assert POSTURES.nearest(theta) == pytest.approx(np.vstack(expected), abs=1e-12)
