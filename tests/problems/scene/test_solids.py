"""Solids: signed distances against support functions written independently, surfaces, numbers, impossible ones."""

from __future__ import annotations

from collections import Counter

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from problems import Ball, Box, Capsule, Cylinder, Ellipsoid, HalfSpace, InvalidProblem
from problems.base import Arguments, as_array
from problems.scene.solids import Solid

CENTER, TURN = (0.3, -0.2, 0.5), tuple(Rotation.from_rotvec([0.4, -1.1, 0.7]).as_quat().tolist())
PLACED = {"center": CENTER, "quaternion": TURN}
SOLIDS: dict[str, Solid] = {
    "box": Box(**PLACED, size=(0.4, 0.2, 0.9)),
    "box upright": Box(center=CENTER, size=(0.4, 0.2, 0.9)),
    "ball": Ball(center=CENTER, radius=0.35),
    "capsule": Capsule(**PLACED, radius=0.15, length=0.6),
    "cylinder": Cylinder(**PLACED, radius=0.25, length=0.5),
    "disc": Cylinder(center=CENTER, radius=0.4, length=0.02),
    "half-space": HalfSpace(**PLACED),
    "ellipsoid": Ellipsoid(**PLACED, semi_axes=(0.5, 0.2, 0.3)),
    "needle": Ellipsoid(**PLACED, semi_axes=(0.05, 0.05, 0.8)),
    "plate": Ellipsoid(center=CENTER, semi_axes=(0.6, 0.5, 0.01)),
}
VOLUMES = {
    "box": 0.072,
    "ball": 4.0 / 3.0 * np.pi * 0.35**3,
    "capsule": np.pi * 0.15**2 * (0.6 + 4.0 / 3.0 * 0.15),
    "cylinder": np.pi * 0.25**2 * 0.5,
    "ellipsoid": 4.0 / 3.0 * np.pi * 0.03,
}
each_solid = pytest.mark.parametrize("solid", SOLIDS.values(), ids=SOLIDS)


def clearances(solid: Solid, points: np.ndarray) -> np.ndarray:
    return as_array(solid.point_clearance(ca.DM(points))).ravel()


def in_own_axes(solid: Solid, points: np.ndarray) -> np.ndarray:
    return Rotation.from_quat(solid.quaternion or (0.0, 0.0, 0.0, 1.0)).inv().apply(points - solid.center)


def extent(solid: Solid, n: np.ndarray) -> np.ndarray:
    """How far it reaches from its centre in directions (m, 3) of its own axes, (m,), m."""
    across = np.hypot(n[:, 0], n[:, 1])
    match solid:
        case Box():
            return np.abs(n) @ np.array(solid.size) / 2.0
        case Ball():
            return np.full(len(n), solid.radius)
        case Capsule():
            return np.abs(n[:, 2]) * solid.length / 2.0 + solid.radius
        case Cylinder():
            return np.abs(n[:, 2]) * solid.length / 2.0 + across * solid.radius
        case Ellipsoid():
            return np.linalg.norm(n * np.array(solid.semi_axes), axis=1)
    return np.where(n[:, 2] == 1.0, 0.0, np.inf)


def room(solid: Solid, x: np.ndarray) -> np.ndarray:
    """Numbers that are not negative exactly where a point in its own axes is inside."""
    square = x[0] ** 2 + x[1] ** 2
    match solid:
        case Box():
            return np.concatenate([np.array(solid.size) / 2.0 - x, np.array(solid.size) / 2.0 + x])
        case Ball():
            return np.array([solid.radius**2 - square - x[2] ** 2])
        case Capsule():
            return np.array([solid.radius**2 - square - max(0.0, abs(x[2]) - solid.length / 2.0) ** 2])
        case Cylinder():
            return np.array([solid.radius**2 - square, solid.length / 2.0 - x[2], solid.length / 2.0 + x[2]])
        case Ellipsoid():
            return np.array([1.0 - ((x / np.array(solid.semi_axes)) ** 2).sum()])
    return -x[2:]


def nearest_distance(solid: Solid, point: np.ndarray) -> float:
    """From a point outside in its own axes, m: by a solver that looks for the nearest point inside."""
    found = minimize(
        lambda x: ((x - point) ** 2).sum(),
        0.5 * point * min(1.0, solid.width / np.linalg.norm(point)),
        jac=lambda x: 2.0 * (x - point),
        constraints=[{"type": "ineq", "fun": lambda x: room(solid, x)}],
        method="SLSQP",
        options={"ftol": 1e-14, "maxiter": 300},
    )
    assert room(solid, found.x).min() > -1e-7
    return float(np.linalg.norm(found.x - point))


def depths(solid: Solid, points: np.ndarray) -> np.ndarray:
    """Of points inside in its own axes, m: the shortest way out in any of many directions."""
    axes, spread = np.concatenate([np.eye(3), -np.eye(3)]), np.random.default_rng(0).normal(size=(20_000, 3))
    ways = np.concatenate([axes, spread / np.linalg.norm(spread, axis=1, keepdims=True)])
    return np.array([(extent(solid, ways) - ways @ point).min() for point in points])


def points_around(solid: Solid, count: int, seed: int) -> np.ndarray:
    low, high = solid.bounding_box()
    return np.random.default_rng(seed).uniform(low - 0.4, high + 0.4, (count, 3))


@each_solid
def test_distances_against_a_solver_that_looks_for_the_nearest_point(solid: Solid) -> None:
    points = points_around(solid, 20, 1)
    found, local = clearances(solid, points), in_own_axes(solid, points)
    assert (np.array([room(solid, x).min() for x in local]) < 0.0).tolist() == (found > 0.0).tolist()
    outside = found > 0.0
    expected = np.array([nearest_distance(solid, x) for x in local[outside]])
    assert len(expected) > 3
    assert (found[outside] <= expected + 1e-6).all()
    assert found[outside] == pytest.approx(expected, rel=1e-3, abs=1e-6)


@each_solid
def test_inside_it_is_the_shortest_way_out(solid: Solid) -> None:
    low, high = solid.bounding_box()
    points = np.random.default_rng(8).uniform(low, high, (60, 3))
    points = points[clearances(solid, points) < 0.0]
    shortest = depths(solid, in_own_axes(solid, points))
    assert (shortest > 0.0).all()
    if not isinstance(solid, Ellipsoid):
        assert -clearances(solid, points) == pytest.approx(shortest, rel=1e-3, abs=3e-3)
        assert (-clearances(solid, points) <= shortest + 1e-12).all()


@each_solid
def test_it_changes_by_no_more_than_the_points_move(solid: Solid) -> None:
    rng, points = np.random.default_rng(2), points_around(solid, 3000, 3)
    steps = rng.normal(size=points.shape) * rng.choice([1e-6, 1e-2, 0.3], (3000, 1))
    change = np.abs(clearances(solid, points + steps) - clearances(solid, points))
    spare = 1e-3 if isinstance(solid, Ellipsoid) else 1e-9  # of which the distance is bounded, not computed
    outside = (clearances(solid, points) > 0.0) & (clearances(solid, points + steps) > 0.0)
    assert (change[outside] <= np.linalg.norm(steps, axis=1)[outside] + spare).all()


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.floats(-3.0, 0.0)] * 3), st.integers(0, 10_000))
def test_an_ellipsoids_clearance_is_never_more_than_the_distance(exponents: tuple[float, ...], seed: int) -> None:
    a = np.power(10.0, exponents)
    solid = Ellipsoid(center=(0.0, 0.0, 0.0), semi_axes=tuple(a.tolist()))
    rng = np.random.default_rng(seed)
    on_it = rng.normal(size=(40, 3))
    on_it *= a / np.linalg.norm(on_it, axis=1, keepdims=True)
    normal = on_it / a**2 / np.linalg.norm(on_it / a**2, axis=1, keepdims=True)
    away = rng.choice([1e-6, 1e-3, 0.1, 3.0], 40)
    found = clearances(solid, on_it + away[:, None] * normal)  # from a point of the surface along its normal: exact
    assert (found <= away * (1.0 + 1e-9) + 1e-12).all()
    assert (found >= (0.99 * away if a.max() <= 10.0 * a.min() else 0.0) - 1e-9).all()
    assert (clearances(solid, 0.999 * on_it) < 0.0).all()


@each_solid
def test_gradients_are_finite_and_lead_away(solid: Solid) -> None:
    symbols = ca.SX.sym("p", 1, 3)
    clearance = solid.point_clearance(symbols)
    slope = ca.Function("slope", [symbols], [clearance, ca.gradient(clearance, symbols)])
    for point in [*points_around(solid, 60, 4), np.array(solid.center)]:
        value, gradient = (as_array(part).ravel() for part in slope(ca.DM(point).T))
        assert np.isfinite(gradient).all()
        if value[0] > 0.0:
            length = np.linalg.norm(gradient)
            assert length == pytest.approx(1.0, abs=0.05 if isinstance(solid, Ellipsoid) else 1e-6)


@each_solid
def test_messages_and_bounds_of_a_robot_ask_for_points(solid: Solid) -> None:
    points = points_around(solid, 20, 5)
    for point, clearance in zip(points, clearances(solid, points), strict=True):
        place = tuple(point.tolist())
        assert solid.contains(place) == (clearance <= 0.0)
        assert solid.distance_to(place) == max(0.0, clearance)
        assert solid.distance_of(place, place) == clearance
    assert (solid.dim, solid.place) == (3, CENTER)


@each_solid
def test_surfaces_lie_on_the_boundary_and_look_outwards(solid: Solid) -> None:
    vertices, polygons = solid.surface()
    assert clearances(solid, vertices) == pytest.approx(0.0, abs=1e-9)
    low, high = solid.bounding_box()
    assert ((vertices >= low - 1e-12) & (vertices <= high + 1e-12)).all()
    middles = np.array([vertices[polygon].mean(axis=0) for polygon in polygons])
    a, b, c = (vertices[[polygon[corner] for polygon in polygons]] for corner in range(3))
    normals = np.cross(b - a, c - b)
    assert (clearances(solid, middles + 0.3 * normals / np.linalg.norm(normals, axis=1, keepdims=True)) > 0.0).all()
    if not isinstance(solid, HalfSpace):
        edges = Counter(edge for face in polygons for edge in zip(face, [*face[1:], face[0]], strict=True))
        assert set(edges.values()) == {1}
        assert all((b, a) in edges for a, b in edges)


@pytest.mark.parametrize("name", VOLUMES)
def test_surfaces_enclose_the_volume(name: str) -> None:
    vertices, polygons = SOLIDS[name].surface()
    around = vertices - vertices.mean(axis=0)
    fans = [(face[0], face[i], face[i + 1]) for face in polygons for i in range(1, len(face) - 1)]
    assert sum(np.linalg.det(around[list(fan)]) for fan in fans) / 6.0 == pytest.approx(VOLUMES[name], rel=0.04)


@each_solid
def test_the_bounding_box_is_the_smallest(solid: Solid) -> None:
    if isinstance(solid, HalfSpace):
        return  # only what is drawn of it has one
    half = extent(solid, in_own_axes(solid, np.eye(3) + solid.center))
    assert solid.bounding_box() == pytest.approx(np.array(CENTER) + np.outer([-1.0, 1.0], half))


@each_solid
def test_numbers_are_arguments(solid: Solid) -> None:
    points, arguments = points_around(solid, 5, 7), Arguments()
    symbolic_copy = arguments.symbolic_copy(solid)
    evaluate = ca.Function("f", [arguments.symbols], [symbolic_copy.point_clearance(ca.DM(points))])
    assert as_array(evaluate(arguments.values)).ravel() == pytest.approx(clearances(solid, points), abs=1e-12)
    own = {Box: 3, Ball: 1, Capsule: 2, Cylinder: 2, HalfSpace: 0, Ellipsoid: 3}[type(solid)]
    assert arguments.values.size == 3 + own + 4 * (solid.quaternion is not None)


@pytest.mark.parametrize(
    ("make", "reason"),
    [
        (lambda: Box(center=CENTER, size=(1.0, 0.0, 1.0)), "size: 0 is not within"),
        (lambda: Ball(center=CENTER, radius=-1.0), "radius: -1 is not within"),
        (lambda: Ball(center=(0.0, np.nan, 0.0), radius=1.0), "center: nan"),
        (lambda: Capsule(center=CENTER, radius=0.0, length=1.0), "radius: 0 is not within"),
        (lambda: Capsule(center=CENTER, radius=1.0, length=0.0), "length: 0 is not within"),
        (lambda: Cylinder(center=CENTER, radius=np.inf, length=1.0), "radius: inf is not within"),
        (lambda: Ellipsoid(center=CENTER, semi_axes=(1.0, 1.0, 0.0)), "semi_axes: 0 is not within"),
        (lambda: HalfSpace(center=CENTER, quaternion=(0.0, 0.0, 0.0, 0.9)), "quaternion: .* is not of length 1"),
    ],
)
def test_impossible_solids(make: object, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        make()


def test_widths() -> None:
    widths = [SOLIDS[name].width for name in ("box", "ball", "capsule", "cylinder", "disc", "half-space", "needle")]
    assert widths == pytest.approx([0.2, 0.7, 0.3, 0.5, 0.02, np.inf, 0.1])
