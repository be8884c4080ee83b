"""Figures of robots in space: what is painted over what, views that can be measured in, every kind of figure."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.space_plans import SOLIDS, space_plan
from matplotlib.cbook import is_math_text
from scipy.spatial.transform import Rotation

from problems import Box
from problems.tasks import Marker, MarkerKind
from tpbso_casadi.figures.path import path_figure
from tpbso_casadi.figures.scene import DIAMOND
from tpbso_casadi.figures.space import Posture, painting_order, space_figure
from tpbso_casadi.figures.space_scene import (
    FRONT,
    SIDE,
    TOP,
    Scene,
    View,
    perspective,
    polyhedron_of,
    separating_planes,
)
from tpbso_casadi.figures.style import RC

COLUMNS = ([0, 1], [0, 2], [1, 2])  # of the three views


def test_a_box_has_six_faces_and_twelve_sharp_edges() -> None:
    box = polyhedron_of(Box(center=(1.0, 2.0, 3.0), size=(0.2, 0.4, 0.6)))
    assert sorted(map(tuple, box.normals.round(12).tolist())) == sorted(map(tuple, np.vstack([np.eye(3), -np.eye(3)])))
    assert len(box.edges) == 12 and all(edge.sharp and len(edge.faces) == 2 for edge in box.edges)
    assert box.beyond(np.array([1.3, 2.0, 3.0])).max() == pytest.approx(0.2)


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)
def test_surfaces_are_convex_and_seen_from_outside(solid) -> None:
    surface = polyhedron_of(solid)
    assert surface.beyond(surface.vertices).max() < 1e-9
    middles = np.array([surface.vertices[list(face)].mean(axis=0) for face in surface.faces])
    outside = middles + 0.05 * surface.normals
    assert not any(solid.contains(tuple(point)) for point in outside)
    np.testing.assert_allclose(np.linalg.norm(surface.normals, axis=1), 1.0)


def test_views_by_hand() -> None:
    point = np.array([1.0, 2.0, 3.0])
    assert [view.project(point).tolist() for view in (TOP, FRONT, SIDE)] == [[1.0, 2.0], [1.0, 3.0], [2.0, 3.0]]
    for view in (TOP, FRONT, SIDE):  # right-handed: right x up = toward the eye
        np.testing.assert_array_equal(np.cross(*view.axes[:2]), view.axes[2])
    view = View(np.eye(3), np.zeros(3), 4.0)
    assert view.project(np.array([1.0, 0.5, 2.0])) == pytest.approx([2.0, 1.0])  # half as far, twice as large
    assert view.sees(np.array([[0.0, 0.0, 1.0]] * 2), np.array([3.9, 4.1])).tolist() == [True, False]
    level = perspective(point, 1.0, azimuth=0.0, elevation=0.0)
    assert level.project(np.array([1.0, 2.1, 3.0])) == pytest.approx([0.1, 0.0])


def apart(rng: np.random.Generator) -> tuple[list[Box], np.ndarray, np.ndarray]:
    """Boxes and balls that do not meet: in cells of a grid, turned at random."""
    cells = rng.permutation([(i, j, k) for i in range(3) for j in range(3) for k in range(3)])
    places = cells * 1.0
    boxes = [
        Box(
            center=tuple(place),
            size=tuple(rng.uniform(0.1, 0.57, 3)),
            quaternion=tuple(Rotation.random(rng=rng).as_quat()),
        )
        for place in places[:13]
    ]
    return boxes, places[13:] + rng.uniform(-0.1, 0.1, (14, 3)), rng.uniform(0.1, 0.3, 14)


def hits(origin: np.ndarray, ray: np.ndarray, boxes: list[Box], centers: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """How far along a ray balls and boxes begin; nan where it misses them."""
    found = []
    for center, radius in zip(centers, radii, strict=True):
        along = (center - origin) @ ray
        square = radius**2 - ((center - origin) @ (center - origin) - along**2)
        found.append(along - np.sqrt(square) if square > 0.0 else np.nan)
    for box in boxes:
        turned = Rotation.from_quat(box.quaternion).as_matrix()
        start, way = (origin - box.center) @ turned, ray @ turned
        ends = np.sort((np.array([[-0.5], [0.5]]) * np.array(box.size) - start) / way, axis=0)
        enters, leaves = ends[0].max(), ends[1].min()
        found.append(enters if enters < leaves else np.nan)
    return np.array(found)


@pytest.mark.parametrize("seed", range(2))
def test_what_is_nearer_along_a_ray_is_painted_later(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes, centers, radii = apart(rng)
    solids = [polyhedron_of(box) for box in boxes]
    view = perspective(np.ones(3), 1.9, rng.uniform(-180.0, 180.0), rng.uniform(-60.0, 60.0))
    order = painting_order(view, centers, radii, solids, separating_planes(solids))
    assert sorted(order) == list(range(27))
    place = np.argsort(order)
    eye = view.center + view.distance * view.axes[2]
    checked = 0
    middles = np.vstack([centers, [box.center for box in boxes]])
    for target in middles[rng.integers(0, 27, 300)] + rng.normal(0.0, 0.1, (300, 3)):
        ray = (target - eye) / np.linalg.norm(target - eye)
        met = hits(eye, ray, boxes, centers, radii)
        far_to_near = [thing for thing in np.argsort(-met) if np.isfinite(met[thing])]
        checked += len(far_to_near) > 1
        assert (np.diff(place[far_to_near]) > 0).all()
    assert checked > 20


def test_three_views_have_one_scale_and_show_the_whole_motion() -> None:
    plan = space_plan()
    figure = path_figure(plan)
    figure.draw_without_rendering()
    top, front, side, picture = figure.axes
    assert [axes.get_title(loc="left") for axes in (top, front, side)] == ["top", "front", "side"]
    metre = [np.diff(axes.transData.transform([[0.0, 0.0], [1.0, 1.0]]), axis=0)[0] for axes in (top, front, side)]
    np.testing.assert_allclose(metre, np.full((3, 2), metre[0][0]), rtol=1e-6)
    joints = plan.motion.joint_positions(plan.times).reshape(-1, 3)
    for axes, columns in zip((top, front, side), COLUMNS, strict=True):
        low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
        assert (joints[:, columns] > low).all() and (joints[:, columns] < high).all()
    assert top.get_xlim() == front.get_xlim() and front.get_ylim() == side.get_ylim()
    labels = top.get_legend_handles_labels()[1]
    fan = f"9 postures, every {plan.trajectory.duration / 8:.3g} s, light to dark"
    closest = plan.motion.closest_approach
    assert {"base", "obstacle", "path of the tool", "first posture", fan, "start", "goal"} <= set(labels)
    assert closest is not None and "posture at the closest approach" in labels
    assert picture.get_title(loc="right") == "posture at the closest approach"
    for axes in (top, front, side):
        named = {text.get_text() for text in axes.texts}
        assert {"start", "goal", f"{1000 * closest.distance:.1f} mm found at {closest.time:.3g} s"} <= named
    [way] = [line for line in front.lines if line.get_label() == "path of the tool"]
    np.testing.assert_allclose(way.get_xydata(), plan.motion.joint_positions(plan.times)[:, -1, [0, 2]])
    assert not picture.axison
    assert figure.texts[0].get_fontsize() == RC["figure.titlesize"]  # that of which its lines are broken


def test_a_robot_without_spheres_and_obstacles_is_a_line() -> None:
    plan = space_plan(obstacles=False, spheres=False)
    *views, picture = path_figure(plan).axes
    skeleton = plan.motion.joint_positions(np.zeros(1))[0]
    for axes, columns in zip(views, COLUMNS, strict=True):
        [first] = [line for line in axes.lines if line.get_label() == "first posture"]
        np.testing.assert_allclose(first.get_xydata(), skeleton[:, columns], atol=1e-12)
        assert not any(len(balls.get_offsets()) for balls in axes.collections)  # neither spheres nor solids
        assert "obstacle" not in axes.get_legend_handles_labels()[1]
    assert picture.get_title(loc="right") == "last posture"


def test_any_name_is_shown_as_it_is() -> None:
    name, robot = "$\\frac$ \\$", space_plan().criteria.robot
    figure = space_figure(Scene(robot), [Posture(name, "#1f77b4", np.zeros(4))])
    figure.draw_without_rendering()
    shown = figure.legends[0].get_texts()[-1].get_text()
    assert not is_math_text(shown)  # no formula, and of "\\$" there is "$" to be seen
    assert shown.replace("\\$", "$") == name


def test_a_path_to_trace_in_space_has_its_band_in_each_view() -> None:
    points = np.array([[0.3, 0.0, 0.2], [0.3, 0.4, 0.2], [0.3, 0.4, 0.6]])
    marker = Marker(label="given points", points=points, kind=MarkerKind.POINTS, tolerance=0.05, connects_points=True)
    via = Marker(label="via", points=points[:1], kind=MarkerKind.VIA)
    robot = space_plan().criteria.robot
    figure = space_figure(Scene(robot, markers=(marker, via)), [Posture("zero", "black", np.zeros(4))])
    shown = {handle.get_label(): handle for handle in figure.legends[0].legend_handles}
    assert (shown["via"].get_marker(), shown["via"].get_color()) == ("D", DIAMOND["color"])  # as in the figure
    for axes, columns in zip(figure.axes, COLUMNS, strict=False):
        [band] = [patch for patch in axes.patches if patch.get_label() == "within 50 mm of the path"]
        low, high = band.get_path().get_extents().get_points()
        np.testing.assert_allclose([low, high], [points[:, columns].min(0) - 0.05, points[:, columns].max(0) + 0.05])


def test_what_a_box_hides() -> None:
    box = polyhedron_of(Box(center=(0.0, 0.0, 0.0), size=(2.0, 2.0, 2.0)))
    points = np.array([[-3.0, 0.0, 0.0], [-3.0, 5.0, 0.0], [2.0, 0.0, 0.0], [-1.5, 3.0, 0.0], [-1.5, 0.9, 0.0]])
    assert box.hides(points, np.array([4.0, 0.0, 0.0])).tolist() == [True, False, False, False, True]


def test_the_picture_is_taken_where_obstacles_hide_least() -> None:
    robot, theta = space_plan().criteria.robot, np.zeros((1, 4))
    scene = Scene(robot, [Box(center=(0.8, 0.0, 0.3), size=(0.1, 1.0, 1.0))])
    view = scene.view(theta, scene.bounds(theta))
    assert view.depth(np.array([0.0, 0.0, 0.3])) > view.depth(np.array([0.8, 0.0, 0.3]))
    walls = [
        Box(center=(x, y, 0.5), size=size)
        for x, y, size in ((0.9, 0.0, (0.1, 2.0, 4.0)), (-0.9, 0.0, (0.1, 2.0, 4.0)), (0.0, 0.9, (2.0, 0.1, 4.0)))
    ]
    view = Scene(robot, walls).view(theta, np.array([[-1.0, -1.0, -0.2], [1.0, 1.0, 1.2]]))
    assert not any(polyhedron_of(wall).hides(robot.skeleton(theta)[0], view.eye).any() for wall in walls)
    assert view.eye[1] < -1.0  # through the open side
