"""Objects as the tables of a scenario, and back: what is built from the table is the object."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import problems
import tpbso_casadi as tp
from problems.scene import SOLIDS
from problems.tasks import JointFollowing, Place, RecordedMotion, Task
from tpbso_casadi.facade.statement import goals_of, place_of
from tpbso_casadi.scenario.obstacles import ShapeSection, read_obstacle
from tpbso_casadi.scenario.places import read_place
from tpbso_casadi.scenario.tasks import STATED

SQUARE = ((0.0, 0.0), (0.3, 0.0), (0.3, 0.3), (0.0, 0.3))
OBSTACLES = [
    tp.Ellipse((0.5, 0.25), (0.2, 0.1), 0.3),
    tp.Rectangle((0.5, 0.25), (0.2, 0.1), 0.3),
    tp.Polygon(SQUARE),
    tp.Box(center=(0.5, 0.25, 0.1), size=(0.2, 0.1, 0.4)),
    tp.Sphere(center=(0.5, 0.25, 0.1), radius=0.2),
    tp.Capsule(center=(0.5, 0.25, 0.1), radius=0.1, length=0.5, quaternion=(0.0, 0.6, 0.0, 0.8)),
    tp.Cylinder(center=(0.5, 0.25, 0.1), radius=0.1, length=0.5),
    tp.Ellipsoid(center=(0.5, 0.25, 0.1), semi_axes=(0.2, 0.1, 0.4)),
    tp.HalfSpace(center=(0.0, 0.0, -0.5)),
    tp.Polytope(points=((0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 0.2)), name="wedge"),
]
TIMES = [0.0, 1.0, 2.5]
POSITIONS = np.array([[0.0, 0.0], [0.1, 0.3], [0.4, 0.2]])
MOTIONS = [
    tp.ConstantVelocity((0.1, -0.2)),
    tp.Tabulated.through(TIMES, POSITIONS),
    tp.Tabulated.through(TIMES, POSITIONS, np.array([[0.0], [0.2], [0.5]])),
]


def test_an_obstacle_is_what_its_table_builds() -> None:
    assert {type(obstacle) for obstacle in OBSTACLES} == {*problems.OBSTACLES.values(), *SOLIDS.values()}
    for obstacle in OBSTACLES:
        assert read_obstacle(ShapeSection.of(obstacle).table()).built(1) == (obstacle,)


@pytest.mark.parametrize("motion", MOTIONS, ids=["velocity", "table", "turning"])
def test_an_obstacle_that_moves_is_what_its_table_builds(motion: Any) -> None:
    moving = tp.MovingObstacle(OBSTACLES[0], motion, margin_rate=0.01)
    (again,) = read_obstacle(ShapeSection.of(moving).table()).built(1)
    assert isinstance(again, tp.MovingObstacle)
    assert (again.still, again.margin_rate) == (moving.still, moving.margin_rate)
    times = np.linspace(-0.5, 3.0, 50)
    np.testing.assert_allclose(again.frames(times).origins, moving.frames(times).origins, atol=1e-12)


@pytest.mark.parametrize("still", OBSTACLES, ids=lambda still: type(still).__name__)
def test_where_the_frame_of_a_motion_begins_is_kept(still: tp.Obstacle) -> None:
    """Points are in what is built from the table where they are in the shape as seen from the frame."""
    dim, time = still.dim, 0.5
    origin, velocity = (1.3, -0.1, 0.4)[:dim], (-0.5, 0.2, 0.1)[:dim]
    moving = tp.MovingObstacle(still, tp.ConstantVelocity(velocity, origin), margin_rate=0.01)
    (again,) = read_obstacle(ShapeSection.of(moving).table()).built(1)
    points = np.random.default_rng(1).uniform(-0.25, 0.25, (80, dim)) + still.place
    within = [still.contains(tuple(point)) for point in points]
    world = points + origin + time * np.array(velocity)
    assert any(within) and not all(within)
    assert [again.at(time).contains(tuple(point)) for point in world] == within


def test_what_moves_in_a_frame_that_moves_is_refused() -> None:
    moving = tp.MovingObstacle(OBSTACLES[0], MOTIONS[0])
    with pytest.raises(tp.ScenarioError, match="no table states what moves in a frame that moves"):
        ShapeSection.of(tp.MovingObstacle(moving, MOTIONS[0]))


class Stranger(tp.ConstantVelocity):
    """A motion that nobody knows."""


@pytest.mark.parametrize(
    ("motion", "reason"),
    [
        (tp.Tabulated.along_lines(TIMES, POSITIONS), "along lines cannot be stored"),
        (Stranger((0.1, 0.0)), "no table states the motion Stranger"),
    ],
)
def test_a_motion_without_a_table_is_refused(motion: Any, reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason):
        ShapeSection.of(tp.MovingObstacle(OBSTACLES[0], motion))


def place_read(value: Any, dof: int, dim: int) -> Place:
    return read_place(place_of(value, dof, dim, "goal"))


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda v: [np.float32(x) for x in v]])
def test_as_many_numbers_as_joints_are_a_posture_as_many_as_dimensions_a_point(kind: Any) -> None:
    assert place_read(kind([0.25, 0.5, 0.75]), 3, 2) == tp.Joints((0.25, 0.5, 0.75))
    assert place_read(kind([0.25, 0.5]), 3, 2) == tp.Position((0.25, 0.5))
    assert place_read(kind([0.25, 0.5, 0.75]), 7, 3) == tp.Pose((0.25, 0.5, 0.75))


@given(angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3), point=st.tuples(*[st.floats(-1.0, 1.0)] * 3))
@settings(max_examples=10, deadline=None)
def test_a_homogeneous_matrix_is_a_pose(angles: tuple[float, float, float], point: tuple[float, float, float]) -> None:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_euler("xyz", angles).as_matrix(), point
    pose = place_read(matrix, 7, 3)
    assert isinstance(pose, tp.Pose)
    assert pose.point == point
    np.testing.assert_allclose(Rotation.from_quat(pose.quaternion).as_matrix(), matrix[:3, :3], atol=1e-12)


@pytest.mark.parametrize(
    ("matrix", "reason"),
    [
        (np.zeros((3, 3)), "4 x 4"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "last row"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), "no rotation"),
        (np.diag([1.0, 1.0, 2.0, 1.0]), "no rotation"),
        ([["a"]], "numbers are needed"),
    ],
)
def test_what_is_no_frame_is_said(matrix: Any, reason: str) -> None:
    with pytest.raises(tp.InvalidProblem, match=reason):
        tp.Pose.from_matrix(matrix)


def test_a_list_of_places_is_any_of_them() -> None:
    postures = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    expected = [{"joints": row} for row in postures.tolist()]
    assert goals_of(postures, 3, 2, "goal") == expected
    listed = [tp.Joints(tuple(row)) for row in postures.tolist()]
    assert goals_of(listed, 3, 2, "goal") == listed
    assert goals_of(postures[0], 3, 2, "goal") == expected[0]
    assert goals_of([np.eye(4), np.eye(4)], 7, 3, "goal")[1].quaternion == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("value", "dim", "reason"),
    [
        ([1.0, 2.0, 3.0, 4.0, 5.0], 2, "goal: 5 numbers; 3 joint values are needed, or 2 coordinates of a point"),
        (3.0, 2, "goal: 3.0 is no place"),
        ([True, 1.0], 2, "True is no place"),
        ([], 2, "goal: 0 numbers"),
        ([0.1, 0.2, 0.3], 3, "may be a point or joint values"),
    ],
)
def test_what_is_no_place_is_said(value: Any, dim: int, reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason):
        goals_of(value, 3, dim, "goal")


ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0).model
OVAL = tp.Ellipse((1.6, 1.2), (0.1, 0.2))
PATH = tp.Path.through([(1.0, 0.2), (1.2, 0.6), (0.8, 0.8), (0.7, 0.8)])
HALF = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
PANDA = tp.robot("panda").model
POSES = np.array([[0.4, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0], [0.5, 0.1, 0.5, 1.0, 0.0, 0.0, 0.0]])
TASKS: list[Task] = [
    tp.PointToPoint(ARM, (1.0, 0.0), (0.5, 1.5)),
    tp.PointToPoint(ARM, (1.0, 0.0), (0.5, 1.5), "up", (OVAL,), (0.2, 3.0)),
    tp.Move(ARM, tp.Position((1.0, 0.0)), (tp.Position((0.5, 1.5)), tp.Joints((0.1, 0.2, 0.3))), obstacles=(OVAL,)),
    tp.Move(
        ARM, tp.Joints((0.3, 0.2, 0.1)), (tp.Joints((1.0, 0.2, 0.1)),), (tp.Joints((0.5, 0.0, 0.0)),),
        start_velocity=(0.1, 0.0, 0.0), goal_velocity=(0.0, 0.1, 0.0), total_time=(0.1, 5.0),
    ),
    tp.Move(replace(ARM, margin=0.01), tp.Joints((0.3, 0.2, 0.1)), (tp.Joints((1.0, 0.2, 0.1)),), stay=0.5),
    tp.PathFollowing(ARM, PATH, 0.1, elbow="up", knots=3),
    tp.PathTracing(ARM, PATH, 0.02, obstacles=(OVAL,), total_time=(0.5, 9.0)),
    tp.SpaceTracing(replace(PANDA, self_collision=True), tp.Path.through(POSES), 0.01, 0.05),
]  # fmt: skip


def test_every_kind_is_tried() -> None:
    assert {type(task) for task in TASKS} | {JointFollowing, RecordedMotion} == set(STATED)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: type(task).__name__)
def test_the_scenario_has_the_task(task: Task) -> None:
    assert tp.scenario_of(task).problem().criteria.task == task


class MyTask(tp.PointToPoint):
    """A task that no table states."""


SLOW = replace(PANDA, max_speed=tuple(0.5 * speed for speed in PANDA.limits.speed))
START = tp.Joints((0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.5))


@pytest.mark.parametrize(
    ("task", "reason"),
    [
        (tp.PathTracing(ARM, replace(PATH, corners=()), 0.02), "path: its corners"),
        (MyTask(ARM, (1.0, 0.0), (0.5, 1.5)), "robot, no scenario|needed|robot"),
        (tp.Move(SLOW, START, (tp.Joints((0.3, 0.3, 0.3, -2.0, 0.3, 0.3, 0.3)),)), r"robot: say tp\.robot\('panda'\)"),
    ],
)
def test_what_no_table_states_is_refused(task: Task, reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason):
        tp.scenario_of(task)


def test_a_path_in_joint_space_is_a_task_too() -> None:
    path = tp.JointPath.through(np.array([[0.0, 0.5, 0.0], [0.6, 0.9, 0.3], [1.0, 0.2, 0.1]]))
    task = JointFollowing(ARM, path, start_speed=0.5)
    plan = tp.plan(task)
    assert plan.certified
    assert plan.search is None
    assert plan.duration == pytest.approx(tp.retime(path, ARM, start_speed=0.5).duration, abs=1e-12)


def test_arguments_override_what_a_task_says() -> None:
    scenario = tp.scenario_of(TASKS[0], goal=np.array([0.6, 1.4]), motion="spline", obstacles=[OVAL], seed=np.int64(4))
    assert scenario.model.motion == "spline"
    assert scenario.solver.seed == 4
    assert scenario.problem().criteria.task.obstacles == (OVAL,)
