"""Robots as they look: what is before what, shades, outlines, and where no look is known."""

from __future__ import annotations

import numpy as np
from helpers.space_plans import BAR, LOOKS, space_plan
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from problems import Box
from tpbso_casadi.figures.appearance import SHADES, front_of, layers, placed_corners, shades_of, silhouette
from tpbso_casadi.figures.palette import NEUTRAL
from tpbso_casadi.figures.path import path_figure
from tpbso_casadi.figures.space import Painting, Posture, draw_picture, space_figure
from tpbso_casadi.figures.space_scene import FRONT, TOP, Scene, perspective, polyhedron_of
from tpbso_casadi.planning import PlannedMotion


def dressed() -> PlannedMotion:
    return space_plan(appearances=True)


def test_of_a_box_the_sides_toward_the_eye_are_seen() -> None:
    rows, shades = front_of(TOP, BAR.corners)
    assert (BAR.corners[rows][:, :, 2] == 0.1).all() and len(rows) == 2
    assert (shades >= 0).all() and (shades < SHADES).all()
    around = perspective(np.zeros(3), 1.0, azimuth=40.0, elevation=30.0)
    assert len(front_of(around, BAR.corners)[0]) == 6  # three sides


def test_what_faces_the_light_is_brighter_and_black_and_white_have_shades() -> None:
    for colour in ("#000000", "#ffffff", "#cc0000", ""):
        shades = shades_of(colour)
        brightness = shades.sum(axis=1)
        assert (np.diff(brightness) > 0.0).all() and brightness[-1] > 1.4 * brightness[0]
        assert shades.min() >= 0.0 and shades.max() <= 1.0
    np.testing.assert_array_equal(shades_of(""), shades_of(NEUTRAL))
    red, green, _ = shades_of("#cc0000")[8]
    assert red > 2.0 * green and to_rgb(NEUTRAL)


def test_small_things_are_painted_before_what_hides_them_and_after_what_they_hide() -> None:
    """Against rays from the eye: points around a box."""
    rng = np.random.default_rng(0)
    box = polyhedron_of(Box(center=(0.0, 0.0, 0.0), size=(0.4, 0.6, 0.3)))
    places = rng.uniform(-1.0, 1.0, (400, 3))
    places = places[box.beyond(places).max(axis=1) > 0.01]
    for turn in range(0, 360, 30):
        view = perspective(np.zeros(3), 1.0, azimuth=turn, elevation=25.0)
        (before, solid), (after, end) = layers(view, places, [box], [0])
        assert (solid, end) == (0, None)
        assert sorted([*before.tolist(), *after.tolist()]) == list(range(len(places)))
        assert not box.hides(places, view.eye)[after].any()
        assert (np.diff(view.depth(places[before])) >= 0.0).all() and (np.diff(view.depth(places[after])) >= 0.0).all()
        for place in places[before]:  # beyond it, on the ray, there is nothing of the box
            assert not box.hides((view.eye + 10.0 * (place - view.eye))[None], place)[0]


def test_links_without_a_look_are_balls() -> None:
    scene = Scene(dressed().criteria.robot)
    assert [scene.balls[number].name for number in scene.bare] == ["foot", "link_4"]
    assert scene.frames(np.zeros((3, 4))).shape == (3, 5, 4, 3)
    plain = Scene(space_plan().criteria.robot)
    assert plain.appearances == () and len(plain.bare) == len(plain.balls)


def test_looks_stand_where_the_balls_of_their_links_are() -> None:
    scene = Scene(dressed().criteria.robot)
    theta = np.array([0.4, -0.3, 0.7, 1.1])
    corners = placed_corners(scene.appearances, scene.frames(theta[None])[0])
    joints = scene.robot.skeleton(theta[None])[0]
    middles = [corners[:12].mean(axis=(0, 1)), corners[12:].mean(axis=(0, 1))]
    np.testing.assert_allclose(middles, [joints[1], joints[3]], atol=1e-12)  # the bars are about the joints' origins


def test_the_outline_of_a_box_is_filled_once() -> None:
    path = silhouette(FRONT, BAR.corners)
    inside = path.contains_points([[0.0, 0.0], [0.029, 0.099], [0.031, 0.0], [0.0, -0.101]])
    assert inside.tolist() == [True, True, False, False]


def test_figures_show_looks_and_balls_of_what_has_none() -> None:
    plan = dressed()
    *views, picture = path_figure(plan).axes
    for axes in views:
        outlines = [patch for patch in axes.patches if isinstance(patch, PathPatch)]
        assert len(outlines) == 3  # the first posture, the last, and the closest
    painted = [np.asarray(shown.get_facecolor()) for shown in picture.collections if len(shown.get_paths()) > 100]
    reds = {tuple(shade.round(6)) for shade in shades_of("#cc0000")}
    assert any(tuple(colour[:3].round(6)) in reds for colour in painted[0])
    assert all(line.get_linewidth() == 0.0 for line in picture.lines if len(line.get_xdata()) == 6)


def test_a_picture_moves() -> None:
    scene, theta = Scene(dressed().criteria.robot, dressed().criteria.obstacles), np.zeros((1, 4))
    bounds = scene.bounds(theta)
    picture = draw_picture(Figure().subplots(), scene.view(theta, bounds), scene, Posture("", "k", theta[0]), bounds)
    assert isinstance(picture.painting, Painting) and len(scene.appearances) == len(LOOKS)
    before = picture.painting._collection.get_paths()[0].vertices.copy()
    picture.painting.show(theta[0] + 0.5)
    assert len(picture.painting._collection.get_paths()) > 20 and before.shape[1] == 2
    assert space_figure(scene, [Posture("zero", "k", theta[0])]).axes
