"""The polish: what touches is repaired, what is clear becomes faster, and all of it is proven."""

from dataclasses import replace
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import Move
from problems.certify import CertificateStatus
from problems.families.splines import MoveProblem, move
from problems.motions import Trajectory
from problems.robots import SpatialArm, Sphere
from problems.scene.solids import Box
from problems.sequential import can_be_polished
from problems.sequential.descent import Descent
from problems.sequential.kept_limits import KeptLimits
from problems.sequential.nearness import Nearness
from problems.sequential.path_speed import Freedom, MotionSpace
from problems.sequential.polish import fitted
from problems.tasks import Joints, Pose
from problems.timing.free_space import rest_to_rest
from tests.helpers.space import small_arm

START, GOAL = (0.0, 0.9, 0.0, 0.6, 0.0, 0.3, 0.0), (1.4, 0.9, 0.0, 0.6, 0.0, 0.3, 0.5)
SPHERES = tuple(
    Sphere(link, (0.0, 0.0, at), 0.06, f"ball of {link}") for link, at in ((3, 0.1), (3, 0.3), (5, 0.1), (7, 0.1))
)
PILLAR = Box(center=(0.62, 0.5, 0.35), size=(0.1, 0.1, 0.7))
FAR = Box(center=(-0.5, -0.5, 0.1), size=(0.1, 0.1, 0.1))
JERK = (400.0,) * 7


def case(*obstacles: Box, **changes: Any) -> MoveProblem:
    robot = small_arm(spheres=SPHERES, **({"max_jerk": JERK} | changes))
    return move(Move(robot, Joints(START), (Joints(GOAL),), obstacles=obstacles), pieces=4)


def line(problem: MoveProblem) -> Trajectory:
    return rest_to_rest(np.array(START), np.array(GOAL), problem.robot.limits)


def certified(problem: MoveProblem, trajectory: Trajectory) -> Trajectory | None:
    slowed = trajectory.time_scaled(max(1.0, problem.safe_time_scale(trajectory)))
    proven = all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.verify(slowed))
    return slowed if proven else None


@pytest.mark.parametrize("jerk", [JERK, pytest.param(None, marks=pytest.mark.slow)])
def test_a_line_through_an_obstacle_is_repaired_and_proven(jerk: tuple[float, ...] | None) -> None:
    problem = case(PILLAR, max_jerk=jerk)
    through = line(case(PILLAR))
    assert certified(problem, through) is None
    made = next(problem.polished(through))
    clear = certified(problem, made)
    assert clear is not None
    assert clear.duration < 1.35 * through.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([START, GOAL]), abs=1e-9)


def test_free_space_is_left_almost_as_fast_as_it_can_be() -> None:
    problem = case(FAR)
    best = line(problem)
    slow = best.time_scaled(1.6)
    made = certified(problem, next(problem.polished(slow)))
    assert made is not None
    assert best.duration <= made.duration < 1.03 * best.duration


@pytest.mark.slow
def test_the_same_motions_come_out_every_time_each_farther_from_obstacles() -> None:
    problem = case(PILLAR)
    once, again = (list(islice(problem.polished(line(problem)), count)) for count in (2, 1))
    assert (once[0].coefficients == again[0].coefficients).all()
    assert 0.0 < nearest(problem, once[0]) < nearest(problem, once[1])


def nearest(problem: MoveProblem, trajectory: Trajectory) -> float:
    """The smallest distance of any sphere from the pillar at 2,000 times, m."""
    theta = trajectory.at(np.linspace(0.0, trajectory.duration, 2000))
    robot = problem.robot
    positions = [np.asarray(ca.DM(p).full()) for p in robot.positions(ca.DM(theta))]
    centre, half = np.array(PILLAR.center), np.array(PILLAR.size) / 2.0
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
    for made in problem.polished(line(problem)):
        found = certified(problem, made)
        if found is not None:
            assert nearest(case(sheet), found) > -1.0
            return
    pytest.fail("nothing was found around the sheet")


@pytest.mark.slow
def test_joint_ranges_are_kept() -> None:
    robot_ranges = ((-0.05, 1.5), (0.5, 1.3), *(((-2.8, 2.8),) * 5))
    problem = case(PILLAR, position_limits=robot_ranges)
    made = certified(problem, next(problem.polished(line(problem))))
    assert made is not None
    theta = made.at(np.linspace(0.0, made.duration, 1000))
    assert (theta[:, 1] >= 0.5).all() and (theta[:, 1] <= 1.3).all()


@pytest.mark.slow
def test_a_descent_never_returns_what_is_slower_or_nearer() -> None:
    problem = case(PILLAR)
    robot, space = problem.robot, MotionSpace(12, 24)
    freedom = Freedom(robot, problem.task.start, problem.task.goals[0])
    nearness = Nearness(robot, tuple(limit for limit in problem.limits if limit.name == "clearance"))  # type: ignore[misc]
    descent = Descent(space, KeptLimits(robot.limits), freedom, nearness, 0.0, 6e-3)
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
    assert list(rotation.polished(line(rotation))) == []


def test_a_goal_pose_is_kept_while_the_posture_there_changes() -> None:
    joints = case(FAR)
    robot = joints.robot
    assert isinstance(robot, SpatialArm)
    point, rows = (np.asarray(ca.DM(part).full()).ravel() for part in robot.tool_pose(ca.DM([GOAL])))
    quaternion = Rotation.from_matrix(rows.reshape(3, 3)).as_quat()
    pose = Pose(tuple(point.tolist()), tuple(quaternion.tolist()), GOAL)
    problem = replace(joints, task=replace(joints.task, goals=(pose,)))
    made = certified(problem, next(problem.polished(line(joints))))
    assert made is not None
    last = made.at(made.breakpoints[-1:])
    assert np.abs(last[0] - GOAL).max() > 0.01
    found = [np.asarray(ca.DM(part).full()).ravel() for part in robot.tool_pose(ca.DM(last))]
    assert found[0] == pytest.approx(point, abs=1e-9)
    assert found[1] == pytest.approx(rows, abs=1e-9)
    assert made.duration < 1.02 * line(joints).duration
