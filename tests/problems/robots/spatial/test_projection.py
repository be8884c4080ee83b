"""Newton steps onto a position or a pose."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from problems.robots import SpatialArm, project
from problems.robots.inverse_kinematics import jacobian_columns, pose_error, solve_positive_definite
from tests.helpers.space import sliding_arm, small_arm

ARMS = [small_arm(), small_arm(6), sliding_arm()]


def pose_of(robot: SpatialArm, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    position, rotation = robot.tool_pose(ca.DM(theta).T)
    return position.full().ravel(), rotation.full().reshape(3, 3)


@pytest.mark.parametrize("robot", ARMS)
def test_jacobian_is_the_derivative_of_the_tool_pose(robot: SpatialArm) -> None:
    theta = np.random.default_rng(1).uniform(-1.0, 1.0, robot.dof)
    h = 1e-6
    _, columns = jacobian_columns(robot, ca.DM(theta).T, turning=True)
    for joint, column in enumerate(columns):
        moved = [pose_of(robot, theta + sign * h * np.eye(robot.dof)[joint]) for sign in (1, -1)]
        velocity = (moved[0][0] - moved[1][0]) / (2 * h)
        spin = Turn.from_matrix(moved[0][1] @ moved[1][1].T).as_rotvec() / (2 * h)
        assert [float(part) for part in column] == pytest.approx([*velocity, *spin], abs=1e-8)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("robot", ARMS[:2])
def test_five_steps_reach_what_is_near(robot: SpatialArm, turned: bool) -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        there = rng.uniform(0.4, 1.2, robot.dof)  # bent, away from singular postures
        position, rotation = pose_of(robot, there)
        start = ca.DM(there + rng.uniform(-0.07, 0.07, robot.dof)).T
        found = project(robot, start, ca.DM(position), ca.DM(rotation) if turned else None, 5).full().ravel()
        position_found, rotation_found = pose_of(robot, found)
        assert position_found == pytest.approx(position, abs=1e-9)
        assert not turned or rotation_found == pytest.approx(rotation, abs=1e-9)


def test_symbols_and_numbers_agree_and_a_posture_that_is_there_stays() -> None:
    robot = small_arm()
    theta, there = np.full(7, 0.5), np.full(7, 0.6)
    x, p, r = ca.SX.sym("x", 1, 7), ca.SX.sym("p", 3), ca.SX.sym("r", 3, 3)
    function = ca.Function("project", [x, p, r], [project(robot, x, p, r, 4)])
    position, rotation = pose_of(robot, there)
    symbolic = function(theta[None], position, rotation).full()
    numeric = project(robot, ca.DM(theta).T, ca.DM(position), ca.DM(rotation), 4).full()
    assert symbolic == pytest.approx(numeric, abs=1e-12)
    assert function(there[None], position, rotation).full().ravel() == pytest.approx(there, abs=1e-9)


def test_step_in_a_position_is_the_shortest_one() -> None:
    """The change that leads to a near position has no part that leaves the tool where it is."""
    robot, theta = small_arm(), np.full(7, 0.5)
    position = pose_of(robot, theta)[0] + np.array([1e-5, -2e-5, 1e-5])
    change = project(robot, ca.DM(theta).T, ca.DM(position), None, 2).full().ravel() - theta
    jacobian = np.array([[float(part) for part in c] for c in jacobian_columns(robot, ca.DM(theta).T, False)[1]]).T
    shortest = np.linalg.pinv(jacobian) @ (jacobian @ change)
    assert change == pytest.approx(shortest, abs=1e-9)


def test_a_tool_upside_down_is_not_there() -> None:
    robot, theta = small_arm(), np.array([0.3, 0.6, -0.4, 0.9, 0.5, 0.7, 0.1])
    pose, _ = jacobian_columns(robot, ca.DM(theta).T, turning=True)
    _, rotation = pose_of(robot, theta)
    for angle, axis in ((np.pi - 1e-3, [1.0, 0.0, 0.0]), (3.0, [0.6, 0.0, 0.8]), (0.2, [0.0, 1.0, 0.0])):
        wanted = Turn.from_rotvec(angle * np.array(axis)).as_matrix() @ rotation
        missing = np.array([float(part) for part in pose_error(pose, ca.DM([0.0, 0.0, 0.0]), ca.DM(wanted))[3:]])
        assert missing / np.linalg.norm(missing) == pytest.approx(axis, abs=1e-6)
        assert np.linalg.norm(missing) >= min(angle, 1.0)


def test_limits_are_kept_and_no_step_is_long() -> None:
    robot = small_arm(position_limits=((-0.55, 0.55),) * 7)
    start = ca.DM(np.full(7, 0.5)).T
    for steps in (1, 20):
        found = project(robot, start, ca.DM([-3.0, 2.0, -5.0]), None, steps).full()
        assert np.all(np.abs(found) <= 0.55)
    free = small_arm(position_limits=None)
    moved = project(free, start, ca.DM([-3.0, 2.0, -5.0]), None, 1) - start
    assert np.abs(moved.full()).max() <= 0.6 + 1e-12


def test_small_systems_are_solved() -> None:
    rng = np.random.default_rng(3)
    for count in (1, 3, 6):
        half = rng.normal(size=(count, count))
        matrix, right = half @ half.T + np.eye(count), rng.normal(size=count)
        lower = [[matrix[i, j] for j in range(i + 1)] for i in range(count)]
        assert solve_positive_definite(lower, right) == pytest.approx(np.linalg.solve(matrix, right))


def test_a_posture_at_a_limit_can_be_reached_where_it_is_known() -> None:
    robot = small_arm(6)
    known = np.array([0.3, 0.8, 2.8, -0.9, 0.4, 0.7])  # the third joint at its limit
    position, rotation = pose_of(robot, known)
    start = ca.DM(known + 0.05 * np.array([1.0, -1.0, -1.0, 1.0, -1.0, 1.0])).T

    def missed(with_known: bool) -> float:
        given = ca.DM(known).T if with_known else None
        found = project(robot, start, ca.DM(position), ca.DM(rotation), 10, 0.01, given).full().ravel()
        assert np.all(np.abs(found) <= 2.8)
        return float(np.abs(pose_of(robot, found)[0] - position).max())

    assert missed(with_known=True) < 1e-9
    assert missed(with_known=False) > 1e-4
