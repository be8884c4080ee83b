"""What is drawn in the plane: postures, their closest approach, bands around paths, what a problem offers; by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from helpers.moving_plans import moving_space_plan, plane_plan
from helpers.space_plans import space_plan
from matplotlib.figure import Figure
from matplotlib.path import Path
from oracles.outlines import along, dense, to_segment

from problems import PlanarArm
from problems.tasks import Marker, MarkerKind
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.figures.curves import STATUSES, curve_figures, headline, progress_figures, progress_history
from tpbso_casadi.figures.path import COUNT, Nearest, fan_of, nearest_of, path_figure
from tpbso_casadi.figures.scene import capsule, draw_band, draw_bodies, outlines, wide_bodies
from tpbso_casadi.figures.style import PlaceLabel, label_places, width_of
from tpbso_casadi.planning import PlannedMotion, plan

ZIGZAG = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 1.0], [0.3, 0.2]])


@cache
def planned(case: str, solver: str = "pso") -> PlannedMotion:
    content = builtin(case).table()
    content["model"] |= {"retime": False, "formulation": "reduced"}
    content["solver"] |= {"name": solver} | ({"iterations": 2} if solver == "ipopt" else {"evaluations": 300})
    return plan(parse_scenario(content))


@cache
def drawn(case: str) -> Figure:
    return path_figure(planned(case))


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for axes in figure.axes for text in axes.texts]


def test_the_fan_is_equally_spaced_and_gets_darker() -> None:
    fan = fan_of(plane_plan().motion)
    times = [snapshot.time for snapshot in fan]
    assert 8 <= len(fan) == COUNT <= 10
    np.testing.assert_allclose(np.diff(times), plane_plan().trajectory.duration / (COUNT - 1))
    assert all(sum(after.colour) < sum(before.colour) for before, after in pairwise(fan))
    assert [snapshot.label for snapshot in fan if snapshot.label] == ["start", "end"]


def test_each_posture_of_the_fan_is_drawn() -> None:
    solution = planned("obstacle-3")
    figure = drawn("obstacle-3")
    [axes] = figure.axes
    lines = [line.get_xydata() for line in axes.lines]
    times = np.linspace(0.0, solution.trajectory.duration, COUNT)
    for posture in solution.motion.joint_positions(times):
        assert sum(line.shape == posture.shape and np.allclose(line, posture) for line in lines) >= 1
    closest = solution.motion.closest_approach
    assert closest is not None
    assert f"{1000 * closest.distance:.1f} mm found at {closest.time:.3g} s" in texts(figure)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"9 postures, every {solution.trajectory.duration / 8:.3g} s, light to dark" in legend
    assert legend.count("obstacle") == 1
    assert figure.get_suptitle().split() == headline(solution).split()
    assert all(width_of(line, 9.5) < figure.get_figwidth() for line in figure.get_suptitle().split("\n"))


def test_the_nearest_points_in_the_plane_are_as_near_as_dense_ones() -> None:
    for solution in (planned("obstacle-3"), plane_plan()):
        nearest = nearest_of(solution.motion)
        assert nearest is not None
        gap = float(np.linalg.norm(np.diff(nearest.points, axis=0)))
        assert gap == pytest.approx(max(nearest.distance, 0.0), abs=2e-6)
        skeleton = solution.motion.joint_positions(np.array([nearest.time]))[0]
        outlines_then = [obstacle.at(nearest.time).outline(4000) for obstacle in solution.criteria.obstacles]
        radius = max(float(body.radius) for body in solution.criteria.robot.bodies.each)
        points = np.vstack([dense(outline, 20) for outline in outlines_then])
        apart = min(to_segment(points, start, end).min() for start, end in pairwise(skeleton))
        assert apart - radius == pytest.approx(nearest.distance, abs=1e-4)
        assert min(np.linalg.norm(points - nearest.points[1], axis=1)) < 1e-3  # on the outline


@pytest.mark.parametrize("motion", [space_plan, moving_space_plan])
def test_the_nearest_points_in_space_are_as_far_apart_as_is_said(motion) -> None:
    nearest = nearest_of(motion().motion)
    assert nearest is not None
    apart = float(np.linalg.norm(np.diff(nearest.points, axis=0)))
    assert apart == pytest.approx(max(nearest.distance, 0.0), abs=1e-3)


@pytest.mark.parametrize("joined", [True, False])
def test_the_band_is_as_wide_as_is_allowed(joined: bool) -> None:
    width = 0.1
    pieces = [Path(piece, closed=True) for piece in outlines(ZIGZAG, width, joined=joined)]
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.3, 1.3, (4000, 2))
    inside = np.any([piece.contains_points(points) for piece in pieces], axis=0)
    lines = zip(ZIGZAG, ZIGZAG[1:] if joined else ZIGZAG, strict=False)
    apart = np.min([to_segment(points, start, end) for start, end in lines], axis=0)
    assert inside[apart < 0.995 * width].all() and not inside[apart > width].any()
    area = [0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) for x, y in (piece.vertices.T for piece in pieces)]
    assert min(area) > 0.0  # one orientation: where two overlap the band is no darker, and has no hole


def test_a_path_to_trace_has_its_band() -> None:
    axes = Figure().subplots()
    marker = Marker(label="points", points=ZIGZAG, kind=MarkerKind.POINTS, tolerance=0.02, connects_points=True)
    draw_band(axes, marker)
    draw_band(axes, Marker(label="via", points=ZIGZAG, kind=MarkerKind.POINTS))
    assert [patch.get_label() for patch in axes.patches] == ["within 20 mm of the path"]
    legend = drawn("pentagram-time").legends[0].get_texts()
    assert "within 100 mm of a given point" in [text.get_text() for text in legend]


def test_the_headline_says_what_a_plan_is_and_without_obstacles_nothing_is_closest() -> None:
    solution = planned("obstacle-3")
    assert headline(replace(solution, name="a$b")).startswith(r"a\$b: ")
    assert headline(replace(solution, name="né")) == headline(solution)  # not in every font
    first, second, third = headline(solution).split("\n")
    assert first == f"length {solution.objective:.4g} m, T = {solution.trajectory.duration:.4g} s"
    assert second == f"3 joints, {STATUSES[solution.motion.status]}"
    assert third == solution.motion.clearance_in_words
    fastest = planned("time-3")
    assert headline(fastest).startswith(f"time T = {fastest.trajectory.duration:.4g} s\n")
    assert fastest.motion.clearance_in_words == ""
    assert nearest_of(fastest.motion) is None
    assert not [text for text in texts(drawn("time-3")) if " mm found" in text]
    assert Nearest(0.5, 0.0123, np.zeros((2, 2))).label == "12.3 mm found at 0.5 s"
    assert Nearest(0.5, -0.001, np.zeros((2, 2))).label == "touches at 0.5 s"


@pytest.mark.parametrize("seed", range(2))
def test_labels_beside_points_do_not_overlap(seed: int) -> None:
    rng = np.random.default_rng(seed)
    figure = Figure(figsize=(4.0, 4.0))
    axes = figure.subplots()
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    places = rng.uniform(0.4, 0.6, (6, 2))
    line = along(np.array([0.0, 0.5]), np.array([1.0, 0.5]), 50)
    figure.draw_without_rendering()
    label_places(axes, [PlaceLabel(f"label {k}", place) for k, place in enumerate(places)], [line])
    figure.draw_without_rendering()
    boxes = [text.get_bbox_patch().get_window_extent() for text in axes.texts]
    assert not any(a.padded(-1.0).overlaps(b.padded(-1.0)) for k, a in enumerate(boxes) for b in boxes[:k])
    assert all(axes.bbox.x0 <= box.x0 and box.x1 <= axes.bbox.x1 for box in boxes)


ARM = PlanarArm((0.5, 0.4), (1.0,) * 2, (1.0,) * 2, link_radius=(0.1, 0.0), tool_offset=(0.1, 0.1))


def test_only_wide_bodies_are_drawn_to_scale() -> None:
    skeleton = ARM.skeleton(np.array([[0.4, -0.9]]))[0]
    assert [body.name for body in wide_bodies(ARM)] == ["link 1"]
    [body] = wide_bodies(ARM)
    outline = capsule(body, skeleton)
    assert to_segment(outline, skeleton[0], skeleton[1]) == pytest.approx(np.full(len(outline), 0.1))
    ahead, beside = (skeleton[1] - skeleton[0]) / 0.5, np.array([-1.0, 1.0]) * ((skeleton[1] - skeleton[0]) / 0.5)[::-1]
    along, across = (outline - skeleton[0]) @ ahead, (outline - skeleton[0]) @ beside
    assert (along.min(), along.max()) == pytest.approx((-0.1, 0.6), abs=2e-3)
    assert (across.min(), across.max()) == pytest.approx((-0.1, 0.1))
    axes = Figure().subplots()
    [patch] = draw_bodies(axes, ARM, skeleton, "black")
    assert list(axes.patches) == [patch]
    assert draw_bodies(axes, PlanarArm((0.5, 0.4), (1.0,) * 2, (1.0,) * 2), skeleton, "black") == []


@pytest.mark.parametrize("solver", ["pso", "ipopt"])
def test_a_path_offers_accuracy_and_redundancy(solver: str) -> None:
    solution = planned("pentagram-time", solver)
    [accuracy] = solution.problem.progress_measures()
    history = progress_history(solution, accuracy)
    assert history.shape == solution.search.history.cost.shape
    worst = next(verdict.worst for verdict in solution.verdicts if verdict.name == "accuracy")
    assert accuracy.of_trajectory(solution.trajectory) == pytest.approx(worst)
    assert history[-1] == pytest.approx(worst, rel=1e-6)
    figures = progress_figures(solution) | curve_figures(solution)
    assert {name: caption for name, (caption, _) in figures.items()} == {
        "accuracy": "trajectory accuracy",
        "redundancy": "redundancy angle",
    }
    [curve] = solution.problem.criteria.task.bounded_curves(solution.trajectory)
    values = curve.value(curve.times)
    assert ((values >= curve.lower - 0.2) & (values <= curve.upper + 0.2)).all()
    [marker] = solution.problem.criteria.task.markers()
    assert (marker.kind, marker.points.shape) == (MarkerKind.POINTS, (50, 2))
    assert solution.problem.criteria.milestones(solution.trajectory) == ()


def test_a_path_with_four_links_has_a_panel_for_each_redundant_one() -> None:
    content = builtin("pentagram-time").table()
    content["arm"] |= {"link_lengths": [0.75] * 4}
    content["solver"]["evaluations"] = 60
    [(_, figure)] = curve_figures(plan(parse_scenario(content))).values()
    assert [axes.get_ylabel().split("$")[1] for axes in figure.axes] == [r"\phi_{3}", r"\phi_{4}"]
