"""The polish: what touches is repaired, what is clear becomes faster, it passes in time, and all of it is proven."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import CertificateStatus, ConstantVelocity, MoveProblem, MovingObstacle, Obstacle, PlanarArm, Trajectory
from problems.families.splines import move
from problems.polish import never
from problems.robots import Payload, SpatialArm, Sphere, built_in
from problems.scene import Polygon
from problems.scene.solids import Box
from problems.tasks import Joints, Move, Pose
from problems.timing.free_space import rest_to_rest
from tests.helpers.space import small_arm

START, GOAL = (0.0, 0.9, 0.0, 0.6, 0.0, 0.3, 0.0), (1.4, 0.9, 0.0, 0.6, 0.0, 0.3, 0.5)
SPHERES = tuple(
    Sphere(link, (0.0, 0.0, at), 0.06, f"ball of {link}") for link, at in ((3, 0.1), (3, 0.3), (5, 0.1), (7, 0.1))
)
PILLAR = Box(center=(0.62, 0.5, 0.35), size=(0.1, 0.1, 0.7))
FAR = Box(center=(-0.5, -0.5, 0.1), size=(0.1, 0.1, 0.1))
JERK = (400.0,) * 7


def case(*obstacles: Obstacle, **changes: Any) -> MoveProblem:
    robot = small_arm(**({"spheres": SPHERES, "max_jerk": JERK} | changes))
    return move(Move(robot, Joints(START), (Joints(GOAL),), obstacles=obstacles), pieces=4)


def line(problem: MoveProblem) -> Trajectory:
    first, last = (np.array(place.values) for place in (problem.criteria.task.start, problem.criteria.task.goals[0]))  # type: ignore[attr-defined]
    return rest_to_rest(first, last, problem.criteria.robot.limits)


def pose_of(robot: SpatialArm, theta: tuple[float, ...]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    point, rows = (np.asarray(ca.DM(part).full()).ravel() for part in robot.tool.pose(ca.DM([theta])))
    return tuple(point.tolist()), tuple(Rotation.from_matrix(rows.reshape(3, 3)).as_quat().tolist())


def certified(problem: MoveProblem, trajectory: Trajectory) -> Trajectory | None:
    slowed = trajectory.time_scaled(max(1.0, problem.criteria.safe_time_scale(trajectory)))
    proven = all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.criteria.verify(slowed))
    return slowed if proven else None


@pytest.mark.parametrize("jerk", [JERK, pytest.param(None, marks=pytest.mark.slow)])
def test_a_line_through_an_obstacle_is_repaired_and_proven(jerk: tuple[float, ...] | None) -> None:
    problem = case(PILLAR, max_jerk=jerk)
    through = line(case(PILLAR))
    assert certified(problem, through) is None
    made = next(problem.direct.polished(through, never))
    clear = certified(problem, made)
    assert clear is not None
    assert clear.duration < 1.35 * through.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([START, GOAL]), abs=1e-9)


@pytest.mark.parametrize(
    "changes", [{"goal_velocity": (0.1,) * 7}, {"vias": (Joints(START),)}, {"total_time": (1.0, 2.0)}]
)
def test_what_programs_do_not_know_is_not_polished(changes: dict[str, Any]) -> None:
    problem = case(PILLAR)
    other = move(replace(problem.criteria.task, **changes), pieces=4)
    assert list(other.direct.polished(line(problem), never)) == []


def test_what_least_time_does_not_matter_to_is_not_polished() -> None:
    rotation = move(case(PILLAR).criteria.task, "rotation", pieces=4)
    assert list(rotation.direct.polished(line(rotation), never)) == []


def test_a_goal_pose_is_kept_while_the_posture_there_changes() -> None:
    joints = case(FAR)
    assert isinstance(joints.criteria.robot, SpatialArm)
    point, quaternion = pose_of(joints.criteria.robot, GOAL)
    problem = move(replace(joints.encoding.task, goals=(Pose(point, quaternion, GOAL),)), pieces=4)
    branch = min(problem.branches or (problem,), key=lambda each: np.abs(each.branch["goal"] - GOAL).max())
    direct = rest_to_rest(np.array(START), branch.branch["goal"], branch.criteria.robot.limits)
    made = certified(branch, next(branch.direct.polished(direct, never)))
    assert made is not None
    last = tuple(made.at(made.breakpoints[-1:])[0])
    assert np.abs(np.array(last) - branch.branch["goal"]).max() > 0.01
    found, turned = pose_of(joints.criteria.robot, last)
    assert found == pytest.approx(point, abs=1e-9)
    assert abs(np.dot(turned, quaternion)) == pytest.approx(1.0, abs=1e-12)
    assert made.duration < 0.99 * direct.duration


def delayed(trajectory: Trajectory, seconds: float) -> Trajectory:
    """A motion that first stands still at its start for so many seconds."""
    first = np.zeros_like(trajectory.coefficients[:, :1])
    first[-1, 0] = trajectory.coefficients[-1, 0]
    breakpoints = np.concatenate([[0.0], trajectory.breakpoints + seconds])
    return Trajectory(breakpoints, np.concatenate([first, trajectory.coefficients], axis=1))


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
    found = (certified(problem, made) for made in problem.direct.polished(start, never))
    return next(each for each in found if each is not None)


@pytest.mark.parametrize("margin_rate", [pytest.param(0.0, marks=pytest.mark.slow), 0.1])
def test_a_gate_that_opens_is_waited_for_and_no_longer_than_standing_still_would(margin_rate: float) -> None:
    problem = plane(gate(1.4, margin_rate))
    straight = line(problem)
    assert certified(problem, straight) is None
    made = first_certified(problem, straight)
    waits = (delayed(straight, float(seconds)) for seconds in np.arange(0.1, 3.0, 0.1))
    stood = next(each for each in waits if certified(problem, each) is not None)
    assert straight.duration < made.duration < stood.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([PLANAR_START, PLANAR_GOAL]), abs=1e-9)


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
    slowed = fastest.duration * problem.criteria.safe_time_scale(fastest)
    made = next(problem.direct.polished(fastest, never))
    made = made.time_scaled(max(1.0, problem.criteria.safe_time_scale(made)))
    assert all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.criteria.verify(made))
    assert fastest.duration <= made.duration < 1.02 * fastest.duration
    assert slowed > 1.3 * fastest.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([PANDA_START, PANDA_GOAL]), abs=1e-9)
    torques = problem.criteria.robot.dynamics
    times = np.linspace(0.0, made.duration, 2000)
    largest = np.abs(np.asarray(torques.torques(*(ca.DM(made.at(times, order)) for order in range(3)))))
    shares = largest / np.array(problem.criteria.robot.limits.torque)
    assert 0.95 < shares.max() <= 1.0
