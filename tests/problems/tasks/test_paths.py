"""Paths of tools and of joints: shapes, corners, resampling, and what cannot be followed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from problems import InvalidProblem, Path, PathFollowing, PlanarArm, Trajectory, closed_curve, pentagram
from problems.assembly import joint_following
from problems.motions import JointPath
from problems.tasks import JointFollowing, PathTracing, SpaceTracing, knots_of
from problems.timing import retime
from tests.helpers.space import small_arm


def test_pentagram_has_its_five_corners_on_the_circle() -> None:
    star = pentagram((0.5, -0.25), 1.2, 0.3, 50)
    corners = star.array[[0, *star.corners]]
    assert len(star.points) == 50
    assert len(star.corners) == 4
    assert np.hypot(*(corners - [0.5, -0.25]).T) == pytest.approx(1.2)
    assert star.points[0] == star.points[-1]
    sides = np.linalg.norm(np.diff(np.vstack([corners, corners[:1]]), axis=0), axis=1)
    assert sides == pytest.approx(2.0 * 1.2 * np.sin(2.0 * np.pi / 5.0))


def test_closed_curve_is_smooth_evenly_spaced_and_keeps_its_radius() -> None:
    curve = closed_curve((0.0, 0.0), 1.5, 0.0, 4, 0.2, 60)
    rho = np.hypot(*curve.array.T)
    steps = np.linalg.norm(np.diff(curve.array, axis=0), axis=1)
    assert curve.corners == ()
    assert rho.max() <= 1.5 * 1.2 + 1e-12
    assert rho.min() >= 1.5 * 0.8 - 1e-12
    assert steps.max() / steps.min() < 1.05


@pytest.mark.parametrize("count", [6, 7, 50])
def test_resampling_keeps_ends_corners_and_count(count: int) -> None:
    star = pentagram((0.0, 0.0), 1.0, 0.0, 400).resampled(count)
    assert len(star.points) == count
    assert np.hypot(*star.array[list(star.corners)].T) == pytest.approx(1.0)
    assert np.hypot(*star.array[[0, -1]].T) == pytest.approx(1.0)


@pytest.mark.parametrize("axes", [[[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]], ids=["plane", "space"])
def test_turn_of_45_degrees_is_a_corner_and_less_is_not(axes: list[list[float]]) -> None:
    along, across = np.array(axes)
    for degrees, corners in ((46.0, (1,)), (-46.0, (1,)), (44.0, ())):
        angle = np.radians(degrees)
        assert (
            Path.through([0.0 * along, along, along + np.cos(angle) * along + np.sin(angle) * across]).corners
            == corners
        )


def test_closing_a_path_repeats_the_first_point_once() -> None:
    triangle = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    assert Path.through(triangle, closed=True).points == (*triangle, triangle[0])
    assert Path.through([*triangle, triangle[0]], closed=True).points == (*triangle, triangle[0])
    posed = Path.through(poses(Rotation.from_rotvec([[0.1, 0.0, 0.0]] * 3)), closed=True)
    assert posed.points[-1] == posed.points[0]
    assert posed.quaternions[-1] == posed.quaternions[0]
    assert len(posed.quaternions) == 4


@given(arrays(np.int64, (5, 2), elements=st.integers(-40, 40), unique=True), st.integers(7, 60))
def test_resampled_points_lie_on_the_given_way(tenths: np.ndarray, count: int) -> None:
    points = tenths / 10.0
    path = Path.through(points)
    for x, y in path.resampled(count).points:
        distances = []
        for (ax, ay), (bx, by) in pairwise(points):
            dx, dy = bx - ax, by - ay
            square = max(dx * dx + dy * dy, 1e-300)
            share = np.clip(((x - ax) * dx + (y - ay) * dy) / square, 0.0, 1.0)
            distances.append(np.hypot(x - ax - share * dx, y - ay - share * dy))
        assert min(distances) < 1e-9


def test_what_is_not_a_path() -> None:
    for points, reason in (
        ([(0.0, 0.0)], "at least 2 points"),
        ([(0.0, 0.0), (0.0, 0.0)], r"points\[0\] and points\[1\] are the same"),
        ([(0.0, 0.0), (1.0, float("nan"))], r"points\[1\]"),
        ([(0.0, 0.0), (1.0, float("inf"))], r"points\[1\]"),
    ):
        with pytest.raises(InvalidProblem, match=reason):
            Path(tuple(points))
    with pytest.raises(InvalidProblem, match="4 points cannot hold both ends and 4 corners"):
        pentagram((0.0, 0.0), 1.0, 0.0, 4)


EDGE = np.array([[0.4, 0.0, 0.5], [0.4, 0.2, 0.5], [0.4, 0.2, 0.7]])
LEVEL = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))


def poses(rotations: Rotation) -> np.ndarray:
    return np.column_stack([EDGE, rotations.as_quat()])


def test_resampled_poses_turn_evenly() -> None:
    path = Path.through(poses(Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.0, 0.8], [0.0, 0.0, 0.8]])))
    resampled = path.resampled(9)
    assert resampled.corners == (4,)
    assert np.linalg.norm(np.diff(resampled.array, axis=0), axis=1) == pytest.approx(0.05)
    turns = Rotation.from_quat(resampled.quaternions).as_rotvec()
    assert turns[:, 2] == pytest.approx([0.0, 0.2, 0.4, 0.6, 0.8, 0.8, 0.8, 0.8, 0.8])


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


ARM = PlanarArm((1.0, 1.0), (2.0, 3.0), (10.0, 8.0))
LINE = JointPath.through(np.array([[0.0, 0.0], [3.0, 4.0]]))  # 5 rad long
REST = JointPath(np.array([0.0, 1.0]), np.array([[[-2.0, 1.0]], [[3.0, -1.5]], [[0.0, 0.0]], [[0.0, 0.0]]]))


def status_of(task: JointFollowing, trajectory: Trajectory) -> dict[str, str]:
    return {v.name: str(v.status) for v in joint_following(task).verify(trajectory)}


@pytest.mark.parametrize(
    ("arguments", "field", "reason"),
    [
        ({"path": JointPath.through(np.eye(2, 3))}, "joints", "a path of 3 joints for a robot of 2"),
        ({"start_speed": -1.0}, "start_speed", "negative"),
        ({"goal_speed": np.nan}, "goal_speed", "no number"),
        ({"start_speed": 4.0}, "start_speed", "joint 1 would have 2.4 rad/s, and may have 2 rad/s"),
        ({"path": REST, "goal_speed": 0.1}, "goal_speed", "standstill"),
        ({"total_time": (2.0, 1.0)}, "total_time", "does not hold"),
    ],
)
def test_what_cannot_be_is_named(arguments: dict[str, object], field: str, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason) as caught:
        JointFollowing(**({"robot": ARM, "path": LINE} | arguments))  # type: ignore[arg-type]
    assert caught.value.field == field


def test_a_speed_along_the_path_is_that_of_its_length() -> None:
    task = JointFollowing(ARM, LINE, start_speed=1.0, goal_speed=2.0)
    np.testing.assert_allclose(task.end_velocities, [[0.6, 0.8], [1.2, 1.6]])


@pytest.mark.parametrize(("start", "goal"), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.5), (1.0, 2.0)])
def test_the_motion_along_it_is_certified(start: float, goal: float) -> None:
    task = JointFollowing(ARM, LINE, start_speed=start, goal_speed=goal)
    motion = joint_following(task).given_motion()
    assert set(status_of(task, motion).values()) == {"certified"}
    np.testing.assert_allclose(motion.at(motion.breakpoints[[0, -1]], 1), task.end_velocities, atol=1e-12)


def test_another_path_and_other_ends_are_seen() -> None:
    task = JointFollowing(ARM, LINE)
    other = retime(JointPath.through(np.array([[0.0, 0.0], [1.5, 2.1], [3.0, 4.0]])), ARM.limits)
    assert status_of(task, other)["path"] == "violated"
    moving = joint_following(JointFollowing(ARM, LINE, start_speed=1.0)).given_motion()
    assert status_of(task, moving)["start velocity"] == "violated"


def test_a_total_time_slows_it() -> None:
    task = JointFollowing(ARM, LINE, total_time=(5.0, 6.0))
    motion = joint_following(task).given_motion()
    assert motion.duration == pytest.approx(5.0)
    assert set(status_of(task, motion).values()) == {"certified"}
