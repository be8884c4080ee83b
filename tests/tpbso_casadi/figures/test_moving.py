"""Figures of scenes with obstacles that move: where they are at which time, and how far the arm is from them."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.moving_plans import IN_PLANE, IN_SPACE, moving_space_plan, plane_plan
from helpers.space import small_arm
from helpers.space_plans import space_plan
from matplotlib.patches import Polygon

from problems import Ellipse, PlanarArm, Trajectory
from problems.scene.moving import ConstantVelocity, MovingObstacle
from tpbso_casadi.figures.limits import clearance_drawings, closest_to_moving, distance_curves
from tpbso_casadi.figures.path import path_figure, snapshots
from tpbso_casadi.figures.scene import Course, courses_of, labelled_times, placed
from tpbso_casadi.figures.space_scene import Scene, polyhedron_of

DISC = Ellipse(center=(0.0, 0.0), semi_axes=(0.2, 0.2))
TIMES = np.array([0.0, 0.15, 0.4])


def test_a_course_is_the_obstacle_at_each_time() -> None:
    courses = courses_of(IN_PLANE, TIMES)
    assert [course.number for course in courses] == [2, 3]
    for course in courses:
        expected = [course.obstacle.at(time).outline() for time in TIMES]
        np.testing.assert_allclose(course.outlines, expected, atol=1e-12)
        np.testing.assert_allclose(course.outlines.mean(axis=1), course.middles, atol=1e-12)
        origins, axes = course.frames[:, :1], course.frames[:, 1:]
        np.testing.assert_allclose(origins + course.obstacle.unmoved.outline() @ axes, expected, atol=1e-12)
    points = np.array([[1.0, 2.0], [3.0, 4.0]])
    np.testing.assert_array_equal(placed(IN_PLANE[0], points, TIMES), [points] * 3)  # what stands


def test_a_course_is_seen_within_a_box_alone() -> None:
    course = Course(1, MovingObstacle(DISC, ConstantVelocity((10.0, 0.0))), np.array([0.0, 0.1, 0.2]))
    np.testing.assert_allclose(course.within(np.array([-1.0, -1.0]), np.array([1.1, 1.0])), [[-0.2, -0.2], [1.1, 0.2]])
    # at 0.2 s it is 2 m away, and no longer seen
    assert course.within(np.array([-9.0, 5.0]), np.array([9.0, 6.0])).shape == (0, 2)


def test_distances_by_hand() -> None:
    # an arm of 1 m along x stands still; a disc of 0.2 m passes 0.5 m beyond its tip
    arm = PlanarArm(
        link_lengths=(0.5, 0.5), max_speed=(1.0,) * 2, max_acceleration=(1.0,) * 2, link_radius=(0.05, 0.05)
    )
    passing = MovingObstacle(Ellipse(center=(1.5, -1.0), semi_axes=(0.2, 0.2)), ConstantVelocity((0.0, 1.0)), 0.1)
    scene = (Ellipse(center=(0.5, 2.0), semi_axes=(0.2, 0.2)), passing)
    rest = Trajectory(np.array([0.0, 3.0]), np.zeros((1, 1, 2)))
    times = np.array([0.0, 1.0, 2.5])
    still, moving = distance_curves(arm, scene, rest, times)
    assert [curve.number for curve in (still, moving)] == [0, 2]
    np.testing.assert_allclose(still.distances, 2.0 - 0.25)
    np.testing.assert_allclose(moving.distances, np.hypot(0.5, times - 1.0) - 0.25, rtol=5e-3)
    np.testing.assert_allclose(moving.kept, 0.1 * times)
    assert not still.kept.any()
    closest = closest_to_moving(arm, scene, rest)
    assert closest is not None and closest.pair == "link 2, obstacle 2"
    assert (closest.time, closest.distance) == (pytest.approx(1.0, abs=1e-3), pytest.approx(0.25, abs=1e-6))


def test_a_path_in_the_plane_shows_obstacles_at_four_times() -> None:
    plan = plane_plan()
    figure = path_figure(plan)
    figure.draw_without_rendering()
    [axes] = figure.axes
    shown = [snapshot for snapshot in snapshots(plan.motion) if snapshot.opacity]
    closest = plan.motion.closest_approach
    assert closest is not None
    duration = plan.trajectory.duration
    assert [snapshot.time for snapshot in shown] == pytest.approx([0.0, duration / 2.0, duration, closest.time])
    assert [snapshot.opacity for snapshot in shown] == [0.12, 0.22, 0.35, 0.55]
    drawn = [patch for patch in axes.patches if isinstance(patch, Polygon)]
    for obstacle in IN_PLANE[1:]:
        for snapshot in shown:
            outline = obstacle.at(snapshot.time).outline()
            same = [
                patch for patch in drawn
                if len(patch.get_xy()) == len(outline) + 1 and np.allclose(patch.get_xy()[:-1], outline)
            ]  # fmt: skip
            assert [patch.get_facecolor()[3] for patch in same] == [snapshot.opacity]
    [posture] = [line for line in axes.lines if line.get_label() == "posture at the closest approach"]
    np.testing.assert_allclose(posture.get_xydata(), plan.motion.joint_positions(np.array([closest.time]))[0])
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels.count("moving obstacle") == labels.count("its way") == 1
    assert f"{1000 * closest.distance:.1f} mm found at {closest.time:.3g} s" in [text.get_text() for text in axes.texts]


@pytest.mark.parametrize(
    ("speed", "labels"),
    [(0.0, ["0 to 0.4 s"]), (1.0, ["0 to 0.15 s", "0.4 s"]), (9.0, ["0 s", "0.15 s", "0.4 s"])],
)
def test_what_hardly_moves_has_one_label(speed: float, labels: list[str]) -> None:
    course = Course(1, MovingObstacle(DISC, ConstantVelocity((speed, 0.0))), TIMES)  # 0.4 m wide
    found = dict(labelled_times(course))
    assert list(found) == labels
    shuffled = Course(1, course.obstacle, TIMES[[2, 0, 1]])
    assert list(dict(labelled_times(shuffled))) == list(found)


def test_the_picture_ends_where_the_arm_does() -> None:
    far = MovingObstacle(Ellipse(center=(1.0, 1.0), semi_axes=(0.2, 0.2)), ConstantVelocity((300.0, 0.0)))
    [axes] = path_figure(plane_plan(far)).axes
    reach = 1.8 + 0.05
    assert axes.get_xlim()[1] < 1.2 * reach
    [arrow] = [text for text in axes.texts if text.arrow_patch is not None and not text.get_text()]
    assert arrow.xy[0] < axes.get_xlim()[1]


def test_the_figure_of_distances_marks_the_closest_approach() -> None:
    plan = plane_plan()
    [axes] = clearance_drawings(plan)["clearance"]().axes
    lines = {line.get_label(): line for line in axes.lines}
    assert list(lines) == [
        "nearest standing obstacle", "obstacle 2, moving", "kept from obstacle 2", "obstacle 3, moving", "margin",
        "closest approach",
    ]  # fmt: skip
    closest = closest_to_moving(plan.criteria.robot, plan.criteria.obstacles, plan.trajectory)
    assert closest is not None
    np.testing.assert_allclose(lines["closest approach"].get_xydata(), [[closest.time, closest.distance]])
    apart = f"{1000 * closest.distance:.1f} mm found at {closest.time:.3g} s ({closest.pair})"
    assert axes.get_title() == f"closest to a moving obstacle:\n{apart}"
    ends = [text.get_text() for text in axes.texts]
    assert ends == ["standing", "obstacle 2", "kept from 2", "obstacle 3", "margin"]
    times, kept = lines["kept from obstacle 2"].get_data()
    np.testing.assert_allclose(kept, 0.05 * np.asarray(times))


def test_solids_are_where_obstacles_are() -> None:
    robot = moving_space_plan().criteria.robot
    scene = Scene(robot, IN_SPACE)
    assert scene.moving == (1,) and scene.planes == {}
    box, ball = scene.solids_at(0.4)
    assert box is scene.solids[0]
    np.testing.assert_allclose(ball.vertices, polyhedron_of(IN_SPACE[1].at(0.4)).vertices, atol=1e-12)
    planes = scene.planes_of((box, ball))
    assert set(planes) == {(0, 1), (1, 0)}
    for (a, b), face in planes.items():
        assert (box, ball)[a].beyond((box, ball)[b].vertices)[:, face].min() >= 0.0


def test_a_robot_without_spheres_is_close_to_nothing() -> None:
    rest = Trajectory(np.array([0.0, 1.0]), np.zeros((1, 1, 4)))
    assert closest_to_moving(small_arm(4), IN_SPACE, rest) is None
    assert distance_curves(small_arm(4), IN_SPACE, rest, TIMES) == []
    assert clearance_drawings(space_plan()) == {}  # nothing moves
