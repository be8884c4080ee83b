"""Orientations along a path: against SciPy's Slerp, at half turns, and what is refused."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from problems import InvalidProblem
from problems.robots import Orientations, angles_between, unit_quaternions


def test_between_points_it_turns_evenly_about_one_axis() -> None:
    quaternions = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.4, -1.0]]).as_quat()
    orientations = Orientations(quaternions)
    known, wanted = np.array([0.0, 2.0, 3.0]), np.array([0.0, 0.3, 1.9, 2.0, 2.5, 3.0])
    expected = Slerp(known, Rotation.from_quat(quaternions))(wanted)
    found = Rotation.from_quat(orientations.between(known, wanted))
    assert (expected.inv() * found).magnitude() == pytest.approx(0.0, abs=1e-12)
    assert orientations.angles[0] == pytest.approx(0.5)
    assert orientations.axes[0] == pytest.approx([1.0, 0.0, 0.0])


def test_where_it_does_not_turn_there_is_an_axis_all_the_same() -> None:
    still = Orientations(np.array([[0.0, 0.0, 0.0, 1.0]] * 3))
    assert still.angles.tolist() == [0.0, 0.0]
    assert np.linalg.norm(still.axes, axis=1).tolist() == [1.0, 1.0]


def test_a_quaternion_and_its_negative_are_the_same_orientation() -> None:
    assert Orientations(np.array([[0.0, 0.0, 0.6, 0.8], [0.0, 0.0, -0.6, -0.8]])).angles == pytest.approx([0.0])


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 1.0, 3.0, np.pi])
def test_angles_between_matrices_are_exact_for_small_and_for_half_turns(angle: float) -> None:
    turned = Rotation.from_rotvec(angle * np.array([[0.36, 0.48, 0.8]])).as_matrix()
    assert angles_between(np.eye(3)[None], turned) == pytest.approx([angle], rel=1e-7)


def test_lengths_are_made_one_and_what_is_no_orientation_is_named() -> None:
    assert unit_quaternions([[0.0, 0.0, 0.0, 1.0005]]).tolist() == [[0.0, 0.0, 0.0, 1.0]]
    with pytest.raises(InvalidProblem, match=r"points\[1\]: its quaternion .* is not of length 1"):
        unit_quaternions([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    with pytest.raises(InvalidProblem, match=r"points\[0\] and points\[1\]: the tool turns by 3.142 rad"):
        unit_quaternions([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]])
