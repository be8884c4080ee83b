"""Objects as the tables of a scenario, and back: what is built from the table is the object."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import problems
import tpbso_casadi as tp
from problems.scene import SOLIDS
from problems.tasks import Place
from tpbso_casadi.facade.statement import goals_table, place_table
from tpbso_casadi.scenario import built
from tpbso_casadi.scenario.obstacles import obstacle_table, read_obstacle
from tpbso_casadi.scenario.places import read_place

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
]
TIMES = [0.0, 1.0, 2.5]
POSITIONS = np.array([[0.0, 0.0], [0.1, 0.3], [0.4, 0.2]])
MOTIONS = [
    tp.ConstantVelocity((0.1, -0.2)),
    tp.Tabulated.through(TIMES, POSITIONS),
    tp.Tabulated.through(TIMES, POSITIONS, np.array([[0.0], [0.2], [0.5]])),
]


def test_every_shape_is_tried() -> None:
    assert {type(obstacle) for obstacle in OBSTACLES} == {*problems.OBSTACLES.values(), *SOLIDS.values()}


@pytest.mark.parametrize("obstacle", OBSTACLES, ids=lambda each: type(each).__name__)
def test_an_obstacle_is_what_its_table_builds(obstacle: tp.Obstacle) -> None:
    assert read_obstacle(obstacle_table(obstacle)).built() == obstacle


@pytest.mark.parametrize("motion", MOTIONS, ids=["velocity", "table", "turning"])
def test_an_obstacle_that_moves_is_what_its_table_builds(motion: Any) -> None:
    moving = tp.MovingObstacle(OBSTACLES[0], motion, margin_rate=0.01)
    again = read_obstacle(obstacle_table(moving)).built()
    assert isinstance(again, tp.MovingObstacle)
    assert (again.still, again.margin_rate) == (moving.still, moving.margin_rate)
    times = np.linspace(-0.5, 3.0, 50)
    np.testing.assert_allclose(again.frames(times).origins, moving.frames(times).origins, atol=1e-12)


def test_a_motion_along_lines_is_refused() -> None:
    moving = tp.MovingObstacle(OBSTACLES[0], tp.Tabulated.along_lines(TIMES, POSITIONS))
    with pytest.raises(tp.ScenarioError, match="along lines cannot be stored"):
        obstacle_table(moving)


class Stranger(tp.ConstantVelocity):
    """A motion that nobody knows."""


def test_an_unknown_motion_is_refused() -> None:
    with pytest.raises(tp.ScenarioError, match="no table states the motion Stranger"):
        obstacle_table(tp.MovingObstacle(OBSTACLES[0], Stranger((0.1, 0.0))))


# Places


def place_of(value: Any, dof: int, dim: int) -> Place:
    return built(read_place(place_table(value, dof, dim, "goal")))


@pytest.mark.parametrize("kind", [list, tuple, np.array, lambda v: [np.float32(x) for x in v]])
def test_as_many_numbers_as_joints_are_a_posture_as_many_as_dimensions_a_point(kind: Any) -> None:
    assert place_of(kind([0.25, 0.5, 0.75]), 3, 2) == tp.Joints((0.25, 0.5, 0.75))
    assert place_of(kind([0.25, 0.5]), 3, 2) == tp.Position((0.25, 0.5))
    assert place_of(kind([0.25, 0.5, 0.75]), 7, 3) == tp.Pose((0.25, 0.5, 0.75))


@given(angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3), point=st.tuples(*[st.floats(-1.0, 1.0)] * 3))
@settings(max_examples=40, deadline=None)
def test_a_homogeneous_matrix_is_a_pose(angles: tuple[float, float, float], point: tuple[float, float, float]) -> None:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = Rotation.from_euler("xyz", angles).as_matrix(), point
    pose = place_of(matrix, 7, 3)
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
    assert goals_table(postures, 3, 2, "goal") == expected
    assert goals_table([tp.Joints(tuple(row)) for row in postures.tolist()], 3, 2, "goal") == expected
    assert goals_table(postures[0], 3, 2, "goal") == expected[0]
    assert goals_table([np.eye(4), np.eye(4)], 7, 3, "goal")[1]["quaternion"] == [0.0, 0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ([1.0, 2.0, 3.0, 4.0, 5.0], "goal: 5 numbers; 3 joint values are needed, or 2 coordinates of a point"),
        ("there", "goal: 'there' is no place"),
        (3.0, "goal: 3.0 is no place"),
        ([True, 1.0], "True is no place"),
        ([], "goal: 0 numbers"),
    ],
)
def test_what_is_no_place_is_said(value: Any, reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason):
        goals_table(value, 3, 2, "goal")


def test_three_numbers_for_three_joints_in_space_may_be_either() -> None:
    with pytest.raises(tp.ScenarioError, match="may be a point or joint values"):
        place_table([0.1, 0.2, 0.3], 3, 3, "start")
