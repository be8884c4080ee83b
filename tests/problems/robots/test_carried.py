"""What the hand holds: masses against integrals, payloads together, links that end the chain."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import InvalidProblem
from problems.robots import (
    BoxShape,
    CapsuleShape,
    Carried,
    CylinderShape,
    HullShape,
    Payload,
    Shape,
    SphereShape,
    Transform,
    built_in,
    complete_arm,
    payload_of,
)
from problems.robots.inertia import Moments
from problems.robots.transform import FixedFrame, as_point

WEDGE = ((0.1, 0.0, 0.0), (0.5, 0.1, 0.0), (0.0, 0.4, 0.1), (0.1, 0.1, 0.6))
SHAPES: dict[str, Shape] = {
    "box": BoxShape(sizes=(0.2, 0.4, 0.6)),
    "sphere": SphereShape(radius=0.3),
    "cylinder": CylinderShape(radius=0.2, length=0.5),
    "capsule": CapsuleShape(radius=0.15, length=0.4),
    "hull": HullShape(points=WEDGE),
}


def inside(shape: Shape, points: np.ndarray) -> np.ndarray:
    match shape:
        case BoxShape():
            return (np.abs(points) <= np.array(shape.sizes) / 2.0).all(axis=1)
        case SphereShape():
            return np.linalg.norm(points, axis=1) <= shape.radius
        case CylinderShape():
            return (np.hypot(*points[:, :2].T) <= shape.radius) & (np.abs(points[:, 2]) <= shape.length / 2.0)
        case CapsuleShape():
            beyond = np.maximum(np.abs(points[:, 2]) - shape.length / 2.0, 0.0)
            return np.linalg.norm(np.column_stack([points[:, :2], beyond]), axis=1) <= shape.radius
    shares = np.linalg.solve(np.vstack([np.array(WEDGE).T, np.ones(4)]), np.vstack([points.T, np.ones(len(points))]))
    return (shares >= 0.0).all(axis=0)


@pytest.mark.parametrize("name", SHAPES)
def test_bulk_is_what_samples_say(name: str) -> None:
    shape, low, high = SHAPES[name], np.full(3, -0.7), np.full(3, 0.7)
    points = np.random.default_rng(0).uniform(low, high, (400_000, 3))
    held = points[inside(shape, points)]
    bulk = shape.bulk
    assert bulk.volume == pytest.approx(len(held) / len(points) * np.prod(high - low), rel=0.04)
    np.testing.assert_allclose(bulk.center, held.mean(axis=0), atol=0.006)
    np.testing.assert_allclose(bulk.second, held.T @ held / len(held), atol=0.001)


def test_a_box_of_two_halves_is_one_box() -> None:
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2])
    rows = tuple(as_point(row) for row in turn.as_matrix())
    whole = Carried("box", (BoxShape(sizes=(0.2, 0.4, 0.6), pose=FixedFrame(rows, (0.1, 0.0, 0.2))),), 3.0)  # type: ignore[arg-type]
    places = [turn.apply([0.0, y, 0.0]) + np.array([0.1, 0.0, 0.2]) for y in (-0.1, 0.1)]
    halves = tuple(BoxShape(sizes=(0.2, 0.2, 0.6), pose=FixedFrame(rows, as_point(place))) for place in places)  # type: ignore[arg-type]
    one, two = whole.inertia, Carried("halves", halves, 3.0).inertia
    assert one.mass == two.mass == 3.0
    np.testing.assert_allclose(two.center, one.center, atol=1e-12)
    np.testing.assert_allclose(two.matrix, one.matrix, atol=1e-12)
    principal = np.sort(np.linalg.eigvalsh(np.array(one.matrix)))
    np.testing.assert_allclose(principal, [3.0 / 12 * 0.2, 3.0 / 12 * 0.4, 3.0 / 12 * 0.52], atol=1e-12)


def test_payloads_add_up_as_their_moments_do() -> None:
    payload = Payload(mass=2.0, center=(0.1, 0.2, 0.0), matrix=((0.02, 0, 0), (0, 0.03, 0), (0, 0, 0.04)))
    part = Carried("part", (BoxShape(sizes=(0.1, 0.2, 0.3), pose=FixedFrame(translation=(0.0, -0.1, 0.3))),), 1.5)
    together = payload_of([part], payload)
    assert together is not None and together.mass == 3.5
    sums = [Moments.of(each, Transform()) for each in (payload, part.inertia, together)]
    for field in ("mass", "first", "second"):
        one, two, both = (np.array(getattr(each, field), dtype=float) for each in sums)
        np.testing.assert_allclose(both, one + two, atol=1e-12)


def test_what_has_no_mass_changes_no_payload() -> None:
    payload, part = Payload(mass=2.0), Carried("part", (SphereShape(radius=0.1),))
    assert payload_of([part], payload) is payload
    assert payload_of([part], None) is None and payload_of([], None) is None
    assert payload_of([], payload) is payload


def test_it_ends_the_chain() -> None:
    panda = built_in("panda")
    tool = Transform(translation=(0.0, 0.0, 0.1))
    part = Carried("part", (SphereShape(radius=0.05, pose=FixedFrame(translation=(0.0, 0.02, 0.0))),))
    held = panda.carrying([part], tool)
    sphere = held.spheres[-1]
    assert len(held.spheres) == len(panda.spheres) + 1
    assert (sphere.name, sphere.link, sphere.radius) == ("part", 7, 0.05)
    place = (panda.chain.tip @ tool).apply((0.0, 0.02, 0.0))
    np.testing.assert_allclose(sphere.center, [float(value) for value in place], atol=1e-12)
    cover = complete_arm(held, held.arm()).cover
    assert cover is not None
    together = {frozenset((cover.links[a].name, cover.links[b].name)) for a, b in cover.pairs}
    assert frozenset(("part", "panda_link0")) in together and frozenset(("part", "panda_hand")) not in together
    assert frozenset(("part", "panda_link6")) in together and frozenset(("panda_link7", "panda_link6")) not in together


@pytest.mark.parametrize("size", [0.03, 0.3])
def test_a_box_in_the_hand_of_a_built_in_robot_is_2_mm_thicker_than_it_is(size: float) -> None:
    """No ball that proofs have for it reaches farther, which is all of its size for a search."""
    box = Carried("box", (BoxShape(sizes=(size, size, size)),))
    held = built_in("ur5e").carrying([box], Transform())
    cover = complete_arm(held, held.arm()).cover
    assert cover is not None
    (balls,) = [link.balls for link in cover.links if link.name == "box"]
    farthest = np.abs(balls.centers @ np.array(held.frame("box").pose.rotation)) + balls.radii[:, None]
    assert size / 2.0 <= farthest.max() < size / 2.0 + 0.0021


def test_names_are_taken_once() -> None:
    part = Carried("panda_link7", (SphereShape(radius=0.05),))
    with pytest.raises(InvalidProblem, match="carried: the robot has a link 'panda_link7': state another name"):
        built_in("panda").carrying([part], Transform())
