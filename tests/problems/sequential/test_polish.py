"""The polish: what touches is repaired, what is clear becomes faster, it passes in time, and all of it is proven."""

from dataclasses import replace
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import CertificateStatus, ConstantVelocity, MoveProblem, MovingObstacle, Obstacle, PlanarArm, Trajectory
from problems.families.splines import move
from problems.robots import Payload, SpatialArm, Sphere, built_in
from problems.scene import Polygon
from problems.scene.solids import Ball, Box
from problems.sequential import can_be_polished
from problems.sequential.descent import PathSpeedDescent
from problems.sequential.limit_rows import MotionLimits
from problems.sequential.pair_clearances import PairClearances
from problems.sequential.path_speed import Freedom, MotionSpace
from problems.sequential.polish import delayed, fitted
from problems.tasks import Joints, Move, Pose
from problems.timing.free_space import rest_to_rest
from tests.helpers.space import small_arm

START, GOAL = (0.0, 0.9, 0.0, 0.6, 0.0, 0.3, 0.0), (1.4, 0.9, 0.0, 0.6, 0.0, 0.3, 0.5)
SPHERES = tuple(
    Sphere(link, (0.0, 0.0, at), 0.06, f"ball of {link}") for link, at in ((3, 0.1), (3, 0.3), (5, 0.1), (7, 0.1))
)
FEWER = (SPHERES[0], *SPHERES[2:])
PILLAR = Box(center=(0.62, 0.5, 0.35), size=(0.1, 0.1, 0.7))
FAR = Box(center=(-0.5, -0.5, 0.1), size=(0.1, 0.1, 0.1))
JERK = (400.0,) * 7


def case(*obstacles: Obstacle, **changes: Any) -> MoveProblem:
    robot = small_arm(**({"spheres": SPHERES, "max_jerk": JERK} | changes))
    return move(Move(robot, Joints(START), (Joints(GOAL),), obstacles=obstacles), pieces=4)


def line(problem: MoveProblem) -> Trajectory:
    first, last = (np.array(place.values) for place in (problem.task.start, problem.task.goals[0]))  # type: ignore[attr-defined]
    return rest_to_rest(first, last, problem.robot.limits)


def pose_of(robot: SpatialArm, theta: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    point, rows = (np.asarray(ca.DM(part).full()).ravel() for part in robot.tool_pose(ca.DM([theta])))
    return tuple(point.tolist()), tuple(Rotation.from_matrix(rows.reshape(3, 3)).as_quat().tolist())


def certified(problem: MoveProblem, trajectory: Trajectory) -> Trajectory | None:
    slowed = trajectory.time_scaled(max(1.0, problem.safe_time_scale(trajectory)))
    proven = all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.verify(slowed))
    return slowed if proven else None


@pytest.mark.parametrize("jerk", [JERK, pytest.param(None, marks=pytest.mark.slow)])
def test_a_line_through_an_obstacle_is_repaired_and_proven(jerk: tuple[float, ...] | None) -> None:
    problem = case(PILLAR, max_jerk=jerk)
    through = line(case(PILLAR))
    assert certified(problem, through) is None
    made = next(problem.direct.polished(through))
    clear = certified(problem, made)
    assert clear is not None
    assert clear.duration < 1.35 * through.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([START, GOAL]), abs=1e-9)


def test_free_space_is_left_almost_as_fast_as_it_can_be() -> None:
    problem = case(FAR)
    best = line(problem)
    slow = best.time_scaled(1.6)
    made = certified(problem, next(problem.direct.polished(slow)))
    assert made is not None
    assert best.duration <= made.duration < 1.03 * best.duration


@pytest.mark.slow
def test_the_same_motions_come_out_every_time_each_farther_from_obstacles() -> None:
    problem = case(PILLAR)
    once, again = (list(islice(problem.direct.polished(line(problem)), count)) for count in (2, 1))
    assert (once[0].coefficients == again[0].coefficients).all()
    assert 0.0 < nearest(problem, once[0]) < nearest(problem, once[1])


def nearest(problem: MoveProblem, trajectory: Trajectory, box: Box = PILLAR) -> float:
    """The smallest distance of any sphere from a box at 2,000 times, m."""
    theta = trajectory.at(np.linspace(0.0, trajectory.duration, 2000))
    robot = problem.robot
    positions = [np.asarray(ca.DM(p).full()) for p in robot.positions(ca.DM(theta))]
    centre, half = np.array(box.center), np.array(box.size) / 2.0
    found = []
    for number, sphere in enumerate(SPHERES):
        beyond = np.abs(positions[robot.dof + 1 + number] - centre) - half
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        found.append((np.where(outside > 0.0, outside, beyond.max(axis=1)) - sphere.radius).min())
    return float(min(found))


@pytest.mark.slow
def test_a_sheet_thinner_than_a_step_is_not_passed_through() -> None:
    sheet = Box(center=(0.62, 0.5, 0.35), size=(0.25, 0.004, 0.7))
    problem = case(sheet)
    for made in problem.direct.polished(line(problem)):
        found = certified(problem, made)
        if found is not None:
            assert nearest(problem, found, sheet) > 0.0
            return
    pytest.fail("nothing was found around the sheet")


@pytest.mark.slow
def test_joint_ranges_are_kept() -> None:
    robot_ranges = ((-0.05, 1.5), (0.5, 1.3), *(((-2.8, 2.8),) * 5))
    problem = case(PILLAR, position_limits=robot_ranges)
    made = certified(problem, next(problem.direct.polished(line(problem))))
    assert made is not None
    theta = made.at(np.linspace(0.0, made.duration, 1000))
    assert (theta[:, 1] >= 0.5).all() and (theta[:, 1] <= 1.3).all()


@pytest.mark.slow
def test_a_descent_never_returns_what_is_slower_or_nearer() -> None:
    problem = case(PILLAR)
    robot, space = problem.robot, MotionSpace(12, 24)
    freedom = Freedom(robot, problem.task.start, problem.task.goals[0])
    nearness = PairClearances(robot, tuple(limit for limit in problem.limits if limit.name == "clearance"))  # type: ignore[misc]
    descent = PathSpeedDescent(space, MotionLimits(robot.limits), freedom, nearness, 0.0, 6e-3)
    first = descent(fitted(line(problem), space))
    assert first.missing == 0.0
    second = descent(first.motion)
    assert second.missing == 0.0
    assert second.motion.duration <= first.motion.duration * (1.0 + 1e-9)


def test_what_it_does_not_know_is_not_polished() -> None:
    task = case(PILLAR).task
    assert can_be_polished(task, case(PILLAR).limits)
    assert not can_be_polished(replace(task, goal_velocity=(0.1,) * 7), ())
    assert not can_be_polished(replace(task, vias=(Joints(START),)), ())
    assert not can_be_polished(replace(task, total_time=(1.0, 2.0)), ())
    rotation = move(task, "rotation", pieces=4)
    assert list(rotation.direct.polished(line(rotation))) == []


def test_a_goal_pose_is_kept_while_the_posture_there_changes() -> None:
    joints = case(FAR)
    assert isinstance(joints.robot, SpatialArm)
    point, quaternion = pose_of(joints.robot, GOAL)
    problem = replace(joints, task=replace(joints.task, goals=(Pose(point, quaternion, GOAL),)))
    made = certified(problem, next(problem.direct.polished(line(joints))))
    assert made is not None
    last = tuple(made.at(made.breakpoints[-1:])[0])
    assert np.abs(np.array(last) - GOAL).max() > 0.01
    found, turned = pose_of(joints.robot, last)
    assert found == pytest.approx(point, abs=1e-9)
    assert abs(np.dot(turned, quaternion)) == pytest.approx(1.0, abs=1e-12)
    assert made.duration < 1.02 * line(joints).duration


ARM = PlanarArm(link_lengths=(0.7, 0.7, 0.6), max_speed=(4.0,) * 3, max_acceleration=(20.0,) * 3, max_jerk=(400.0,) * 3)
PLANAR_START, PLANAR_GOAL = (0.0, 0.3, 0.3), (1.5, 0.3, 0.3)
ACROSS = np.array([[0.55, 0.75], [0.60, 0.72], [1.40, 1.95], [1.35, 1.98]])  # a wall between start and goal


def gate(speed: float, margin_rate: float = 0.0) -> Obstacle:
    """The wall, sliding outwards."""
    outwards = speed * np.array([0.56, 0.83])
    still = Polygon(tuple((float(x), float(y)) for x, y in ACROSS))
    return MovingObstacle(still, ConstantVelocity(tuple(outwards.tolist())), margin_rate=margin_rate)


def plane(*obstacles: Obstacle) -> MoveProblem:
    return move(Move(ARM, Joints(PLANAR_START), (Joints(PLANAR_GOAL),), obstacles=obstacles), pieces=4)


def first_certified(problem: MoveProblem, start: Trajectory) -> Trajectory:
    found = (certified(problem, made) for made in problem.direct.polished(start))
    return next(each for each in found if each is not None)


@pytest.mark.parametrize("margin_rate", [pytest.param(0.0, marks=pytest.mark.slow), 0.1])
def test_a_gate_that_opens_is_waited_for_and_no_longer_than_standing_still_would(margin_rate: float) -> None:
    problem = plane(gate(1.4, margin_rate))
    straight = line(problem)
    assert certified(problem, straight) is None
    made = first_certified(problem, straight)
    waits = (delayed(straight, float(seconds)) for seconds in np.arange(0.05, 3.0, 0.05))
    stood = next(each for each in waits if certified(problem, each) is not None)
    assert straight.duration < made.duration < stood.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([PLANAR_START, PLANAR_GOAL]), abs=1e-9)


@pytest.mark.slow
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


@pytest.mark.slow  # a gate that opens is waited for in the plane, a line is repaired in space
def test_a_ball_that_crosses_is_passed_in_time() -> None:
    problem = case(crossing(), spheres=FEWER)
    straight = line(problem)
    assert certified(problem, straight) is None
    made = first_certified(problem, straight)
    assert made.duration < 1.35 * straight.duration


@pytest.mark.slow
def test_a_goal_pose_is_kept_among_obstacles_that_move() -> None:
    problem = case(crossing(), spheres=FEWER)
    assert isinstance(problem.robot, SpatialArm)
    point, quaternion = pose_of(problem.robot, GOAL)
    joints = problem.task
    goal = Pose(point, quaternion, GOAL)
    stated = move(Move(joints.robot, joints.start, (goal,), obstacles=joints.obstacles), pieces=4)
    made = first_certified(stated, line(problem))
    found, turned = pose_of(problem.robot, tuple(made.at(made.breakpoints[-1:])[0]))
    assert found == pytest.approx(point, abs=1e-8)
    assert abs(np.dot(turned, quaternion)) == pytest.approx(1.0, abs=1e-12)


PANDA_START = (0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8)
PANDA_GOAL = (1.2, 0.9, 0.3, -0.7, 0.2, 1.6, 0.8)


def lifting(mass: float) -> MoveProblem:
    """A Panda that puts something down far out, in free space."""
    arm = built_in("panda", None).arm(payload=Payload(mass=mass, center=(0.0, 0.0, 0.1)))
    return move(Move(arm, Joints(PANDA_START), (Joints(PANDA_GOAL),)), pieces=4)


@pytest.mark.slow  # in the plane torques are kept so by default: planning/test_finishing.py
def test_a_payload_costs_far_less_than_running_more_slowly() -> None:
    problem = lifting(3.0)
    fastest = line(problem)
    slowed = fastest.duration * problem.safe_time_scale(fastest)
    made = next(problem.direct.polished(fastest))
    made = made.time_scaled(max(1.0, problem.safe_time_scale(made)))
    assert all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.verify(made))
    assert fastest.duration <= made.duration < 1.02 * fastest.duration
    assert slowed > 1.3 * fastest.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([PANDA_START, PANDA_GOAL]), abs=1e-9)
    torques = problem.robot.massive
    times = np.linspace(0.0, made.duration, 2000)
    largest = np.abs(np.asarray(torques.torques(*(ca.DM(made.at(times, order)) for order in range(3)))))
    shares = largest / np.array(problem.robot.limits.torque)
    assert 0.95 < shares.max() <= 1.0
