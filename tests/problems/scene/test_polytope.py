"""Polytopes as obstacles: bounds for searches, distances for proofs, one structure for all of a size."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems import Box, ConstantVelocity, InvalidProblem, MovingObstacle, Polytope
from problems.base import Arguments, Reading, as_array

POSE = {"center": (0.3, -0.2, 0.5), "quaternion": tuple(Rotation.from_rotvec([0.4, -1.1, 0.7]).as_quat().tolist())}
SIZE = (0.4, 0.2, 0.9)
CORNERS = tuple(product(*((-side / 2.0, side / 2.0) for side in SIZE)))


def clearances(solid: Polytope | Box, points: np.ndarray) -> np.ndarray:
    return as_array(solid.point_clearance(ca.DM(points))).ravel()


def test_the_corners_of_a_box_are_the_box() -> None:
    box, polytope = Box(**POSE, size=SIZE), Polytope(**POSE, points=CORNERS)
    points = np.random.default_rng(0).normal(size=(500, 3))
    np.testing.assert_allclose(polytope.exact_distances(points), clearances(box, points), atol=1e-8)
    assert polytope.width == pytest.approx(0.2)
    np.testing.assert_allclose(polytope.bounding_box(), box.bounding_box(), atol=1e-12)
    np.testing.assert_allclose(polytope.place, box.place, atol=1e-12)
    assert polytope.contains(POSE["center"]) and not polytope.contains((1.0, 1.0, 1.0))
    assert polytope.distance_of((0.3, -0.2, 0.5), (0.3, -0.2, 0.5)) == pytest.approx(-0.1)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31), st.integers(4, 80))
def test_a_search_never_sees_more_than_the_distance(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    polytope = Polytope(**POSE, points=tuple(map(tuple, (0.3 * rng.normal(size=(count, 3))).tolist())))
    points = rng.normal(size=(300, 3))
    seen, exact = clearances(polytope, points), polytope.exact_distances(points)
    assert (seen <= exact + 1e-8).all()
    assert len(polytope.planes) <= 24 and len(polytope.planes) % 8 == 0
    steps = 1e-3 * rng.normal(size=points.shape)
    moved = np.linalg.norm(steps, axis=1)
    assert (np.abs(clearances(polytope, points + steps) - seen) <= moved + 1e-12).all()
    assert (np.abs(polytope.exact_distances(points + steps) - exact) <= moved + 1e-8).all()


def test_polytopes_of_a_size_share_their_code() -> None:
    one, other = Polytope(points=CORNERS, name="one"), Polytope(points=((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    assert len(one.planes) == len(other.planes) == 8
    assert Reading(one).structure_key == Reading(other).structure_key
    assert Reading(one).structure_key != Reading(Polytope(**POSE, points=CORNERS)).structure_key
    arguments = Arguments()
    copy, point = arguments.symbolic_copy(one), ca.SX.sym("x", 1, 3)
    f = ca.Function("f", [point, arguments.symbols], [copy.point_clearance(point)])
    points = np.random.default_rng(1).normal(size=(20, 3))
    found = [float(f(place, Reading(other).values)) for place in points]
    np.testing.assert_allclose(found, clearances(other, points))


def test_names_change_nothing_but_messages() -> None:
    box = Box(center=(0.0, 0.0, 0.0), size=SIZE)
    named = replace(box, name="bin")
    assert Reading(box).structure_key == Reading(named).structure_key
    np.testing.assert_array_equal(Reading(box).values, Reading(named).values)
    assert (box.label(3), named.label(3)) == ("obstacle 3", "bin")
    assert MovingObstacle(named, ConstantVelocity((0.1, 0.0, 0.0))).label(1) == "bin"


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        (((0.0, 0.0, 0.0),) * 3, "3 points are not within 4 and 2000"),
        (((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0)), "in one plane"),
        (((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, np.inf)), "inf"),
    ],
)
def test_impossible_ones(points: tuple[tuple[float, float, float], ...], reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        Polytope(points=points)
