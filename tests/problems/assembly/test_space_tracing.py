"""Tracing a path in space: the search's cost, starts, wandering joints, and motions judged by dense samples."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers.searching import sampled
from helpers.slow import slow_except
from helpers.space import TOOL, small_arm
from oracles.space import away_from_path, tool_poses
from scipy.spatial.transform import Rotation

from problems import InvalidProblem, Path, Trajectory
from problems.base import FloatArray
from problems.families.traced import space_tracing
from problems.families.traced.encoding import clear_postures, wandering_joints
from problems.families.traced.problem import SpaceTracingProblem
from problems.polish import never
from problems.robots import Sphere
from problems.scene import ConstantVelocity, MovingObstacle
from problems.scene.solids import Ball
from problems.tasks import SpaceTracing

TURN = np.linspace(0.0, 2.0 * np.pi, 17)
CIRCLE = np.column_stack([0.5 + 0.1 * np.cos(TURN), 0.1 * np.sin(TURN), np.full(17, 0.45)])
DOWN = Rotation.from_euler("y", np.pi)
NODDING = DOWN * Rotation.from_rotvec(np.column_stack([0.3 * np.sin(TURN), 0.0 * TURN, 0.0 * TURN]))
POSES = np.column_stack([CIRCLE, NODDING.as_quat()])
ELBOW = small_arm(spheres=(Sphere(3, (0.0, 0.0, 0.4), 0.05, "elbow"),), margin=0.01)
TASKS = {
    "positions": SpaceTracing(small_arm(), Path.through(CIRCLE), 0.002),
    "poses": SpaceTracing(small_arm(), Path.through(POSES), 0.002, 0.02),
    "poses, six joints": SpaceTracing(small_arm(6), Path.through(POSES), 0.002, 0.02),
    "corners and jerk": SpaceTracing(small_arm(max_jerk=(300.0,) * 7), Path.through(CIRCLE[:9:4]), 0.002),
    "corner": SpaceTracing(small_arm(6), Path.through(POSES[[0, 2, 3]]), 0.002, 0.02),
    "obstacle": SpaceTracing(ELBOW, Path.through(POSES), 0.002, 0.02, (Ball(center=(0.0, 0.35, 0.55), radius=0.05),)),
}


@cache
def problem_of(name: str) -> SpaceTracingProblem:
    return space_tracing(TASKS[name])


def best(problem: SpaceTracingProblem) -> FloatArray:
    x = 0.3 * sampled(problem, 24, 4)
    x[:, -1] = sampled(problem, 24, 4)[:, -1]
    return np.asarray(x[int(np.argmin(problem.cost(x)))])


@pytest.mark.parametrize("name", slow_except(TASKS, ["corners and jerk", "obstacle"]))
def test_a_candidate_is_certified_and_dense_samples_agree(name: str) -> None:
    problem = problem_of(name)
    x = best(problem)
    assert float(problem.cost(x[None])[0]) <= problem.objective_upper_bound
    check(problem, problem.quick_trajectory(x) if problem.criteria.robot.limits.jerk is None else problem.trajectory(x))


@pytest.mark.slow
@pytest.mark.parametrize("name", TASKS)
def test_a_polished_motion_is_faster_within_the_accuracy(name: str) -> None:
    problem = problem_of(name)
    exact = problem.trajectory(best(problem))
    (found,) = problem.direct.polished(exact, never)
    assert found.duration < 0.995 * exact.duration
    check(problem, found)


def test_what_programs_do_not_know_is_not_polished() -> None:
    task = replace(TASKS["positions"], path=Path.through(CIRCLE[:3]))
    moving = MovingObstacle(Ball(center=(0.0, 0.9, 0.5), radius=0.1), ConstantVelocity((0.0, 0.1, 0.0)))
    for problem in (
        space_tracing(task, "rotation"),
        space_tracing(replace(task, total_time=(3.0, 4.0))),
        space_tracing(replace(task, robot=ELBOW, obstacles=(moving,))),
    ):
        assert problem.direct.integrals is None
        assert not list(problem.direct.polished(Trajectory.standing(np.zeros(7), 1.0), never))


def check(problem: SpaceTracingProblem, trajectory: Trajectory) -> None:
    """All verdicts hold; limits, ends, distances and angles at 4,000 times, by NumPy and SciPy alone."""
    verdicts = problem.criteria.verify(trajectory)
    assert all(verdict.satisfied for verdict in verdicts), verdicts
    times, robot, task = np.linspace(0.0, trajectory.duration, 4_000), problem.criteria.robot, problem.criteria.task
    for order, bounds in ((1, robot.limits.speed), (2, robot.limits.acceleration), (3, robot.limits.jerk)):
        if bounds is not None:
            assert (np.abs(trajectory.at(times, order)) <= np.array(bounds) * (1.0 + 1e-9)).all()
    poses, points = tool_poses(trajectory.at(times)), task.path.array
    distance, angle = away_from_path(poses, points, np.array(task.path.quaternions) if task.path.quaternions else None)
    assert distance.max() <= task.accuracy
    assert np.abs(poses[0][[0, -1]] - points[[0, -1]]).max() < 1e-9
    assert task.angular_accuracy is None or angle.max() <= task.angular_accuracy


def test_the_cost_of_a_feasible_candidate_is_about_its_duration() -> None:
    problem = space_tracing(replace(TASKS["poses"], path=Path.through(POSES[:5])), samples=200)
    x = best(problem)
    assert float(problem.cost(x[None])[0]) == pytest.approx(problem.trajectory(x).duration, rel=0.02)


def test_as_many_joints_wander_as_there_are_motions_that_leave_the_tool() -> None:
    assert len(problem_of("positions").encoding.joints) == 3  # the seventh turns the tool about itself alone
    assert 6 not in problem_of("positions").encoding.joints
    assert len(problem_of("poses").encoding.joints) == 1
    six = problem_of("poses, six joints")
    assert six.encoding.joints == ()
    assert [variable.name for variable in six.variables] == ["branch"]


def test_every_start_has_the_tool_at_the_first_pose() -> None:
    problem = problem_of("poses, six joints")
    position, rotation = tool_poses(np.array(problem.encoding.starts))
    assert position == pytest.approx(np.tile(CIRCLE[0], (len(position), 1)), abs=1e-8)
    assert (NODDING[0].inv() * rotation).magnitude() == pytest.approx(0.0, abs=1e-8)
    assert len(position) > 1


def test_starts_touch_nothing() -> None:
    problem = problem_of("obstacle")
    beyond, rotation = tool_poses(np.array(problem.encoding.starts)[:, :3])  # the sphere is 0.4 m from this joint
    elbow = beyond + rotation.apply([0.0, 0.0, 0.4 - TOOL])
    assert (np.linalg.norm(elbow - [0.0, 0.35, 0.55], axis=1) >= 0.05 + 0.05 + 0.01).all()
    everywhere = Ball(center=(0.2, 0.0, 0.5), radius=1.2)
    blocked = SpaceTracing(ELBOW, Path.through(POSES), 0.002, 0.02, (everywhere,))
    with pytest.raises(InvalidProblem, match=r"points\[0\]: each of \d+ postures there touches something"):
        space_tracing(blocked)


def test_offsets_move_the_posture_and_not_the_tool() -> None:
    problem = problem_of("poses")
    x = np.zeros(len(problem.variables))
    still, moved = (np.array(problem.encoding.postures(shift + x)) for shift in (0.0, np.append(np.full(5, 0.2), 0.0)))
    assert np.abs(still - moved).max() > 0.05
    for theta in (still, moved):
        position, _ = tool_poses(theta)
        assert position == pytest.approx(problem.knots.points, abs=1e-8)


def test_what_cannot_be_begun_is_named() -> None:
    far = small_arm(position_limits=((-0.1, 0.1),) * 7)
    with pytest.raises(
        InvalidProblem, match=r"points\[0\]: inverse kinematics finds no posture with the tool at this p"
    ):
        space_tracing(SpaceTracing(far, Path.through(CIRCLE), 0.002))
    with pytest.raises(InvalidProblem, match="redundancy_values"):
        space_tracing(TASKS["poses"], redundancy_values=1)
    with pytest.raises(InvalidProblem, match="no nonlinear program"):
        problem_of("poses").nlp()


def test_the_same_task_begins_alike() -> None:
    task = TASKS["positions"]
    knots = problem_of("positions").knots
    first, second = clear_postures(task, knots), clear_postures(task, knots)
    assert (first == second).all()
    assert wandering_joints(task, first) == wandering_joints(task, second)
