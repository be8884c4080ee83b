"""Paths in space: corners, resampling, knots, and what an arm in space cannot trace."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import InvalidProblem, Path, PathFollowing, PlanarArm
from problems.tasks import PathTracing, SpaceTracing, knots_of
from tests.helpers.space import small_arm

EDGE = np.array([[0.4, 0.0, 0.5], [0.4, 0.2, 0.5], [0.4, 0.2, 0.7]])
LEVEL = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))


def poses(rotations: Rotation) -> np.ndarray:
    return np.column_stack([EDGE, rotations.as_quat()])


def test_corners_in_space_are_changes_of_direction_by_45_degrees() -> None:
    def bent(degrees: float) -> Path:
        angle = np.radians(degrees)
        return Path.through([(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0 + np.cos(angle), np.sin(angle))])

    assert bent(46.0).corners == (1,)
    assert bent(-46.0).corners == (1,)
    assert bent(44.0).corners == ()


def test_resampled_poses_turn_evenly() -> None:
    path = Path.through(poses(Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.0, 0.8], [0.0, 0.0, 0.8]])))
    resampled = path.resampled(9)
    assert resampled.corners == (4,)
    assert np.linalg.norm(np.diff(resampled.array, axis=0), axis=1) == pytest.approx(0.05)
    turns = Rotation.from_quat(resampled.quaternions).as_rotvec()
    assert turns[:, 2] == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 0.8, 0.8, 0.8, 0.8])


def test_closing_repeats_the_first_pose() -> None:
    path = Path.through(poses(Rotation.from_rotvec([[0.1, 0.0, 0.0]] * 3)), closed=True)
    assert path.points[-1] == path.points[0]
    assert path.quaternions[-1] == path.quaternions[0]
    assert len(path.quaternions) == 4


def test_knots_are_close_where_the_tool_turns_and_hold_the_points() -> None:
    path = Path.through(poses(Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.5, 0.0]])))
    knots = knots_of(path, 0.01, 1.2, 0.02)
    assert knots.rotations is not None
    turned = Rotation.from_matrix(knots.rotations)
    steps = (turned[:-1].inv() * turned[1:]).magnitude()
    assert steps.max() <= 0.1
    assert knots.points[knots.vertices] == pytest.approx(EDGE)
    assert turned[knots.vertices].as_quat(canonical=True) == pytest.approx(np.array(path.quaternions))
    plain = knots_of(Path.through(EDGE), 0.01, 1.2)
    assert plain.rotations is None
    assert len(plain.points) < len(knots.points)


def test_a_sudden_turn_of_the_tool_is_a_corner_even_on_a_straight_line() -> None:
    line = np.column_stack([np.linspace(0.3, 0.5, 3), np.zeros(3), np.full(3, 0.6)])
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.5, 0.0]]).as_quat()
    knots = knots_of(Path.through(np.column_stack([line, turns])), 0.01, 1.2, 0.001)
    assert knots.corners == (int(knots.vertices[1]),)
    assert knots_of(Path.through(line), 0.01, 1.2).corners == ()


@pytest.mark.parametrize(
    ("points", "accuracies", "reason"),
    [
        (EDGE[:2, :2], (0.01, None), r"points\[0\] has 2 coordinates; the robot is in 3 dimensions"),
        (EDGE + 2.0, (0.01, None), r"points\[0\] = .* out of reach: the arm reaches 1.2 m"),
        (EDGE, (0.0, None), "accuracy: 0 m is not positive"),
        (EDGE, (0.01, 0.1), "angular_accuracy: the path gives no orientations"),
        (np.column_stack([EDGE, LEVEL]), (0.01, None), "angular_accuracy: missing"),
        (np.column_stack([EDGE, LEVEL]), (0.01, 0.0), "angular_accuracy: 0 is not within 1e-09 and 1 rad"),
        (np.column_stack([EDGE, LEVEL]), (0.01, 2.0), "angular_accuracy: 2 is not within"),
    ],
)
def test_what_cannot_be_traced_is_named(
    points: np.ndarray, accuracies: tuple[float, float | None], reason: str
) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        SpaceTracing(small_arm(), Path.through(points), *accuracies)


def test_points_in_space_are_not_for_planar_arms_nor_equal_intervals_for_arms_in_space() -> None:
    arm = PlanarArm((0.5, 0.4, 0.3), (3.0,) * 3, (20.0,) * 3)
    with pytest.raises(InvalidProblem, match="3 coordinates; the robot is in 2 dimensions"):
        PathTracing(arm, Path.through(EDGE), 0.01)
    with pytest.raises(InvalidProblem, match='a path in space is traced, with motion = "spline"'):
        PathFollowing(small_arm(), Path.through(EDGE), 0.01)
