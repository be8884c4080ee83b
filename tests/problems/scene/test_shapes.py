"""Boxes and polygons: sign and distance against dense points, gradients, outlines, impossible shapes."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.outlines import along, dense, inside, nearest

from problems import OBSTACLES, Ellipse, InvalidProblem, Obstacle, Polygon, Rectangle
from problems.base import Arguments, as_array


def star_shaped(radii: np.ndarray) -> Polygon:
    """A polygon with corners in equal directions from the origin."""
    z = radii * np.exp(2j * np.pi * np.arange(radii.size) / radii.size)
    return Polygon(tuple(zip(z.real.tolist(), z.imag.tolist(), strict=True)))


ELL = Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 0.5), (0.5, 0.5), (0.5, 2.0), (0.0, 2.0)))
COMB = Polygon(((0.0, 0.0), (0.0, 3.0), (1.0, 3.0), (1.0, 1.0), (2.0, 1.0), (2.0, 3.0), (3.0, 3.0), (3.0, 0.0)))
STAR = star_shaped(np.array([1.0, 0.4] * 5))
TRIANGLE = Polygon(((0.0, 0.0), (2.0, 0.0), (0.0, 1.0)))
SHAPES = {
    "box": Rectangle((0.3, -0.2), (1.0, 0.4)),
    "turned box": Rectangle((0.3, -0.2), (1.0, 0.4), 0.7),
    "triangle": TRIANGLE,
    "ell": ELL,
    "comb": COMB,
    "star": STAR,
    "ell mirrored": Polygon(tuple((-x, y) for x, y in ELL.points)),
}
each_shape = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def clearances(shape: Obstacle, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    return as_array(shape.segment_clearance(ca.DM(start), ca.DM(end))).ravel()


def random_segments(shape: Obstacle, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng, (low, high) = np.random.default_rng(seed), shape.bounding_box()
    start = rng.uniform(low - 0.5, high + 0.5, (count, 2))
    return start, start + rng.normal(size=(count, 2)) * rng.choice([0.0, 0.1, 1.0], (count, 1))


@each_shape
def test_sign_and_distance_against_dense_points(shape: Obstacle) -> None:
    corners = shape.outline()
    boundary = dense(corners, 150)
    for start, end, clearance in zip(*(s := random_segments(shape, 40, 1)), clearances(shape, *s), strict=True):
        points = along(start, end, 120)
        enters = inside(corners, points).any()
        assert clearance < 0.0 if enters else clearance > -0.03
        if not enters and clearance > 0.0:
            assert clearance == pytest.approx(nearest(points, boundary), abs=0.02)
            assert clearance <= nearest(points, boundary) + 1e-12


@each_shape
def test_it_changes_by_no_more_than_the_points_move(shape: Obstacle) -> None:
    rng = np.random.default_rng(2)
    start, end = random_segments(shape, 2000, 3)
    steps = rng.normal(size=(2, 2000, 2)) * rng.choice([1e-6, 1e-2, 0.3], (1, 2000, 1))
    change = np.abs(clearances(shape, start + steps[0], end + steps[1]) - clearances(shape, start, end))
    assert (change <= np.hypot(steps[..., 0], steps[..., 1]).max(axis=0) + 1e-12).all()


@each_shape
def test_every_inner_point_is_inside_a_part(shape: Obstacle) -> None:
    low, high = shape.bounding_box()
    points = np.random.default_rng(4).uniform(low - 0.2, high + 0.2, (3000, 2))
    within = inside(shape.outline(), points)
    assert ((clearances(shape, points, points) < 0.0) == within).all()
    assert [shape.contains(tuple(p)) for p in points[:60]] == within[:60].tolist()
    assert [shape.distance_to(tuple(p)) == 0.0 for p in points[:30]] == within[:30].tolist()


@pytest.mark.parametrize("shape", [ELL, COMB, STAR])
def test_the_borders_of_the_parts_are_inside_too(shape: Polygon) -> None:
    corners = np.array(shape.points)
    borders = [
        (first[0][0], second[0][0])
        for part in shape.parts
        for first, second in pairwise([*part, part[0]])
        if len(first) == len(second) == 1 and abs(first[0][0] - second[0][0]) not in (1, len(corners) - 1)
    ]
    assert borders
    for i, j in borders:
        points = along(corners[i], corners[j], 13)[1:-1]
        assert (clearances(shape, points, points) < 0.0).all()
        assert (clearances(shape, points[:1], points[-1:]) < 0.0).all()


@each_shape
def test_the_gradient_inside_leads_out(shape: Obstacle) -> None:
    symbols = ca.SX.sym("s", 1, 2)
    clearance = shape.smooth(shape.segment_clearance(symbols, symbols))
    slope = ca.Function("slope", [symbols], [clearance, ca.gradient(clearance, symbols)])
    low, high = shape.bounding_box()
    points = np.random.default_rng(5).uniform(low, high, (200, 2))
    for point in points[inside(shape.outline(), points)]:
        value, gradient = (as_array(part).ravel() for part in slope(ca.DM(point).T))
        assert np.hypot(*gradient) == pytest.approx(1.0, abs=1e-9)
        if not isinstance(shape, Polygon) or len(shape.parts) == 1:  # one way out: the shortest
            out = point + gradient * (-value + 1e-9)
            assert not inside(shape.outline(), out[None])[0]


def test_by_hand() -> None:
    box = Rectangle((1.0, 1.0), (2.0, 1.0))
    zero, right, up = (0.0, 0.0), (2.0, 0.0), (0.0, 3.0)
    for shape, start, end, expected in (
        (box, zero, right, 0.5),
        (box, zero, zero, 0.5),
        (box, (-1.0, -1.0), zero, 0.5),
        (box, (1.0, -1.0), (1.0, 3.0), -1.0),  # to the side: 1 m; up or down it sticks out
        (box, (1.0, 1.0), (1.0, 1.0), -0.5),
        (box, (-3.0, 0.5), (-3.0, 0.5), 3.0),
        (box, (-3.0, 4.5), (-3.0, 4.5), np.hypot(3.0, 3.0)),
        (Rectangle((1.0, 1.0), (2.0, 1.0), np.pi / 2.0), zero, up, 0.5),
        (TRIANGLE, (1.0, 1.0), (1.0, 1.0), 1.0 / np.sqrt(5.0)),
        (ELL, (1.0, 1.0), (1.0, 1.0), 0.5),
        (ELL, (1.0, 1.0), (3.0, 1.0), 0.5),
        (ELL, (0.25, 1.5), (0.25, 1.5), -0.25),
        (COMB, (1.5, 2.0), (1.5, 4.0), 0.5),  # between the teeth
    ):
        assert float(shape.segment_clearance(ca.DM([start]), ca.DM([end]))) == pytest.approx(expected, abs=1e-12)
    assert (box.width, ELL.width, COMB.width) == (1.0, pytest.approx(np.sqrt(3.125)), 3.0)
    assert box.bounding_box().tolist() == [[0.0, 0.5], [2.0, 1.5]]
    assert ELL.bounding_box().tolist() == [[0.0, 0.0], [2.0, 2.0]]
    assert len(TRIANGLE.parts) == 1
    assert len(ELL.parts) == 3


@each_shape
def test_the_outline_is_counter_clockwise_and_does_not_depend_on_how_it_was_given(shape: Obstacle) -> None:
    x, y = shape.outline().T
    assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0.0
    if isinstance(shape, Polygon):
        segments, other = random_segments(shape, 50, 6), Polygon(shape.points[::-1])
        outside = clearances(shape, *segments) > 0.0
        assert clearances(other, *segments)[outside] == pytest.approx(clearances(shape, *segments)[outside], abs=1e-12)


@each_shape
def test_numbers_are_arguments(shape: Obstacle) -> None:
    start, end = random_segments(shape, 1, 7)
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(shape)
    evaluate = ca.Function("f", [arguments.symbols], [symbolic_copy.segment_clearance(ca.DM(start), ca.DM(end))])
    assert float(evaluate(arguments.values)) == pytest.approx(clearances(shape, start, end)[0], abs=1e-12)
    assert arguments.values.size == (2 * len(shape.points) if isinstance(shape, Polygon) else 5 - (shape.angle == 0.0))


@settings(max_examples=20, deadline=None)
@given(st.integers(4, 14), st.integers(0, 10_000))
def test_any_star_shaped_polygon_is_covered(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = star_shaped(rng.uniform(0.2, 1.0, count))
    points = rng.uniform(-1.0, 1.0, (400, 2))
    assert ((clearances(shape, points, points) < 0.0) == inside(shape.outline(), points)).all()


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Ellipse((0.0, 0.0), (0.0, 1.0)), "semi_axes: 0 is not within"),
        (lambda: Ellipse((float("nan"), 0.0), (1.0, 1.0)), "center: nan"),
        (lambda: Ellipse((0.0, 0.0), (1.0, 1.0), float("inf")), "angle: inf"),
        (lambda: Rectangle((0.0, 0.0), (0.0, 1.0)), "size: 0 is not within"),
        (lambda: Polygon(((0.0, 0.0), (1.0, 0.0))), "points: 2 corners are not within 3"),
        (lambda: Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, 0.0))), "points: the side from point 2 on: 0 is not"),
        (lambda: Polygon(((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))), "sides from points 1 and 3 on meet"),
        (lambda: Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 0.0), (0.0, 2.0))), "meet"),
        (lambda: Polygon(((0.0, 0.0), (1e9, 0.0), (1.0, 1.0))), "points: 1e\\+09 is not within"),
    ],
)
def test_impossible_shapes(make: object, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        make()


def test_straight_corners_are_no_corners() -> None:
    shape = Polygon(((0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0), (0.0, 0.5)))
    assert [len(part) for part in shape.parts] == [4]


def test_shapes_are_registered() -> None:
    assert {"ellipse": Ellipse, "box": Rectangle, "polygon": Polygon} == OBSTACLES
