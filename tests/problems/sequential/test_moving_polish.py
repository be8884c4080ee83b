"""The polish among obstacles that move: it passes in time, waits where it must, and all of it is proven."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import Move
from problems.certify import CertificateStatus
from problems.families.splines import MoveProblem, move
from problems.motions import Trajectory
from problems.robots import PlanarArm, SpatialArm, Sphere
from problems.scene import Obstacle, Polygon
from problems.scene.moving import ConstantVelocity, MovingObstacle
from problems.scene.solids import Ball
from problems.sequential.polish import delayed
from problems.tasks import Joints, Pose
from problems.timing.free_space import rest_to_rest
from tests.helpers.space import small_arm

ARM = PlanarArm(link_lengths=(0.7, 0.7, 0.6), max_speed=(4.0,) * 3, max_acceleration=(20.0,) * 3, max_jerk=(400.0,) * 3)
START, GOAL = (0.0, 0.3, 0.3), (1.5, 0.3, 0.3)
ACROSS = np.array([[0.55, 0.75], [0.60, 0.72], [1.40, 1.95], [1.35, 1.98]])  # a wall between start and goal
SPHERES = tuple(Sphere(link, (0.0, 0.0, 0.1), 0.06, f"ball of {link}") for link in (3, 5, 7))
SPACE_START, SPACE_GOAL = (0.0, 0.9, 0.0, 0.6, 0.0, 0.3, 0.0), (1.4, 0.9, 0.0, 0.6, 0.0, 0.3, 0.5)


def gate(speed: float, margin_rate: float = 0.0) -> Obstacle:
    """The wall, sliding outwards."""
    outwards = speed * np.array([0.56, 0.83])
    still = Polygon(tuple((float(x), float(y)) for x, y in ACROSS))
    return MovingObstacle(still, ConstantVelocity(tuple(outwards.tolist())), margin_rate=margin_rate)


def plane(*obstacles: Obstacle) -> MoveProblem:
    return move(Move(ARM, Joints(START), (Joints(GOAL),), obstacles=obstacles), pieces=4)


def space(*obstacles: Obstacle) -> MoveProblem:
    robot = small_arm(spheres=SPHERES, max_jerk=(400.0,) * 7)
    return move(Move(robot, Joints(SPACE_START), (Joints(SPACE_GOAL),), obstacles=obstacles), pieces=4)


def line(problem: MoveProblem) -> Trajectory:
    first, last = (np.array(place.values) for place in (problem.task.start, problem.task.goals[0]))  # type: ignore[attr-defined]
    return rest_to_rest(first, last, problem.robot.limits)


def certified(problem: MoveProblem, trajectory: Trajectory) -> Trajectory | None:
    slowed = trajectory.time_scaled(max(1.0, problem.safe_time_scale(trajectory)))
    proven = all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.verify(slowed))
    return slowed if proven else None


def first_certified(problem: MoveProblem, start: Trajectory) -> Trajectory:
    found = (certified(problem, made) for made in problem.polished(start))
    return next(each for each in found if each is not None)


@pytest.mark.parametrize("margin_rate", [0.0, 0.1])
def test_a_gate_that_opens_is_waited_for_and_no_longer_than_standing_still_would(margin_rate: float) -> None:
    problem = plane(gate(1.4, margin_rate))
    straight = line(problem)
    assert certified(problem, straight) is None
    made = first_certified(problem, straight)
    waits = (delayed(straight, float(seconds)) for seconds in np.arange(0.05, 3.0, 0.05))
    stood = next(each for each in waits if certified(problem, each) is not None)
    assert straight.duration < made.duration < stood.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([START, GOAL]), abs=1e-9)


def test_what_moves_far_away_costs_no_time() -> None:
    far = MovingObstacle(Polygon(((-1.6, -1.6), (-1.4, -1.6), (-1.5, -1.4))), ConstantVelocity((0.0, 0.2)))
    problem = plane(far)
    straight = line(problem)
    assert first_certified(problem, straight.time_scaled(1.5)).duration < 1.03 * straight.duration


def test_a_start_that_waits_longer_than_it_must_is_begun_sooner() -> None:
    problem = plane(gate(1.4))
    late = delayed(line(problem), 2.5)
    assert certified(problem, late) is not None
    assert first_certified(problem, late).duration < late.duration - 1.0


def crossing() -> Obstacle:
    """A ball that is in the way of the straight line when the arm comes by."""
    return MovingObstacle(Ball(center=(0.5, 0.9, 0.62), radius=0.1), ConstantVelocity((0.0, -0.9, 0.0)))


def test_a_ball_that_crosses_is_passed_in_time() -> None:
    problem = space(crossing())
    straight = line(problem)
    assert certified(problem, straight) is None
    made = first_certified(problem, straight)
    assert made.duration < 1.35 * straight.duration


def pose_of(robot: SpatialArm, theta: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    point, rows = (np.asarray(ca.DM(part).full()).ravel() for part in robot.tool_pose(ca.DM([theta])))
    return tuple(point.tolist()), tuple(Rotation.from_matrix(rows.reshape(3, 3)).as_quat().tolist())


@pytest.mark.slow
def test_a_goal_pose_is_kept_among_obstacles_that_move() -> None:
    problem = space(crossing())
    assert isinstance(problem.robot, SpatialArm)
    point, quaternion = pose_of(problem.robot, SPACE_GOAL)
    joints = problem.task
    goal = Pose(point, quaternion, SPACE_GOAL)
    stated = move(Move(joints.robot, joints.start, (goal,), obstacles=joints.obstacles), pieces=4)
    made = first_certified(stated, line(problem))
    found, turned = pose_of(problem.robot, tuple(made.at(made.breakpoints[-1:])[0]))
    assert found == pytest.approx(point, abs=1e-8)
    assert abs(np.dot(turned, quaternion)) == pytest.approx(1.0, abs=1e-12)
