"""Links that no joint moves: how far they are from obstacles, by hand and by NumPy, and what is said of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.core_robots import arm, rows
from helpers.space import small_arm
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems import PlanarArm
from problems.certify import fixed_contacts
from problems.core import CompiledWorld, fixed_clearance, fixed_links
from problems.robots import ChainJoint, FixedFrame, SpatialArm, Sphere
from problems.scene import Ball, Box, ConstantVelocity, MovingObstacle, Obstacle

FOOT, POST = Sphere(0, (0.0, 0.0, 0.0), 0.1, "foot"), Sphere(0, (0.0, 0.0, 0.5), 0.05, "post")
HAND = Sphere(3, (0.0, 0.0, 0.2), 0.05, "hand")
CUBE = (0.2, 0.2, 0.2)


def robot(**changes: Any) -> SpatialArm:
    return small_arm(3, **({"spheres": (FOOT, POST, HAND), "margin": 0.01} | changes))


def cube(x: float, name: str = "cube") -> Box:
    """A cube of 0.2 m with its centre on the x axis."""
    return Box(center=(x, 0.0, 0.0), size=CUBE, name=name)


def cart(speed: float = 1.0, size: tuple[float, float, float] = CUBE) -> Obstacle:
    """A box that passes through the foot 1 s after it starts, at 1 m/s."""
    return MovingObstacle(
        Box(center=(0.0, 0.0, 0.0), size=size, name="cart"), ConstantVelocity((0.0, speed, 0.0), (0.0, -speed, 0.0))
    )


@given(seed=st.integers(0, 2**32 - 1))
def test_the_distance_is_that_of_spheres_from_boxes(seed: int) -> None:
    """However base and box lie: of a point (x, y, z) in the box's axes, by how much it is out of it, or how deep."""
    rng = np.random.default_rng(seed)
    base, turned = (Rotation.random(random_state=rng) for _ in range(2))
    place, center, size = rng.uniform(-0.4, 0.4, 3), rng.uniform(-0.4, 0.4, 3), rng.uniform(0.1, 0.6, 3)
    placed = robot(base_frame=FixedFrame(rows(base), tuple(place.tolist())))
    box = Box(center=tuple(center.tolist()), size=tuple(size.tolist()), quaternion=tuple(turned.as_quat().tolist()))
    found = []
    for sphere in (FOOT, POST):
        out = np.abs(turned.inv().apply(place + base.apply(sphere.center) - center)) - size / 2.0
        found.append(np.linalg.norm(np.maximum(out, 0.0)) + min(out.max(), 0.0) - sphere.radius)
    assert fixed_clearance(placed, [box]) == pytest.approx(min(found), abs=1e-12)


def test_only_what_no_joint_moves_and_may_not_touch_counts() -> None:
    at_hand = Box(center=(0.0, 0.0, 0.9), size=(0.1, 0.1, 0.1))  # around the sphere that joints move
    assert fixed_links(robot()) == ("foot", "post")
    assert fixed_clearance(robot(), [at_hand]) == pytest.approx(0.3)  # from 0.55 to 0.85
    assert fixed_clearance(robot(), [cube(0.5), cube(0.25)]) == pytest.approx(0.05)
    allowed = robot(may_touch=(("foot", "cube"),))
    assert fixed_clearance(allowed, [cube(0.25)]) == pytest.approx(np.hypot(0.15, 0.4) - 0.05)  # of the post
    assert fixed_clearance(robot(), []) == np.inf
    assert fixed_clearance(robot(spheres=(HAND,)), [cube(0.0)]) == np.inf
    assert fixed_clearance(PlanarArm((1.0, 1.0), (1.0, 1.0), (1.0, 1.0)), []) == np.inf


def test_a_sphere_on_the_first_axis_stands_too() -> None:
    axis = ChainJoint(name="one", link="column")
    turning = arm(axis, spheres=(Sphere(1, (0.0, 0.0, 0.3), 0.1, "column"), Sphere(1, (0.3, 0.0, 0.3), 0.1, "column")))
    ball = Ball(center=(0.0, 0.0, 0.6), radius=0.1)
    assert fixed_links(turning) == ("column",)
    assert fixed_clearance(turning, [ball]) == pytest.approx(0.1)


def test_what_is_clear_is_not_told() -> None:
    assert fixed_contacts(robot(), [cube(0.22, "near"), cube(5.0)], 1.0) == ()  # 0.02 m away
    assert fixed_contacts(robot(), [cart()], 0.78) == ()  # then 0.02 m away
    assert fixed_contacts(robot(), [], 1.0) == fixed_contacts(robot(spheres=(HAND,)), [cube(0.0)], 1.0) == ()


def test_each_link_and_obstacle_that_touch_are_told_with_the_depth() -> None:
    wall = Box(center=(0.2, 0.0, 0.3), size=(0.34, 0.2, 1.0), name="wall")  # from x = 0.03 on
    found = fixed_contacts(robot(), [cube(5.0, "far"), cube(0.15), wall], 1.0)
    assert [(one.link, one.place, one.obstacle) for one in found] == [
        ("foot", 1, "cube"),
        ("foot", 2, "wall"),
        ("post", 2, "wall"),
    ]
    assert [one.distance for one in found] == pytest.approx([-0.05, -0.07, -0.02])
    assert str(found[0]) == "contact of foot, which no joint moves, with cube: 0.05 m deep"
    allowed = robot(may_touch=(("foot", "wall"), ("foot", "cube")))
    assert [one.link for one in fixed_contacts(allowed, [cube(0.15), wall], 1.0)] == ["post"]


def test_what_is_nearer_than_the_margin_is_told_with_the_distance() -> None:
    (near,) = fixed_contacts(robot(), [cube(0.205)], 1.0)
    assert near.distance == pytest.approx(0.005)
    said = "no more than 0.005 m, and the margin of 0.01 m is not proven"
    assert str(near) == f"clearance of foot, which no joint moves, from cube: {said}"
    (exact,) = fixed_contacts(robot(margin=0.0), [cube(0.2)], 1.0)  # it stands on it
    assert str(exact) == "contact of foot, which no joint moves, with cube: 0 m deep"


@pytest.mark.parametrize(
    ("seconds", "distance", "time"), [(0.795, 0.005, 0.795), (0.9, -0.1, 0.9), (1.0, -0.2, 1.0), (4.0, -0.2, 1.0)]
)
def test_what_drives_into_the_foot_is_told_with_the_time(seconds: float, distance: float, time: float) -> None:
    """Along y the foot ends at 0.1 m, and the cart 0.1 m ahead of its centre."""
    (found,) = fixed_contacts(robot(), [cart()], seconds)
    assert found.distance == pytest.approx(distance, abs=0.01)
    assert found.time == pytest.approx(time, abs=0.01)
    assert f" at t = {found.time:.4g} s" in str(found)
    assert str(found).startswith("contact of foot" if distance < 0.0 else "clearance of foot")


def test_nothing_passes_between_two_times() -> None:
    """At 1000 m/s a thin sheet is within the foot for 0.2 ms of 2 s."""
    (found,) = fixed_contacts(robot(), [cart(1000.0, (0.2, 0.001, 0.2))], 2.0)
    assert found.distance < 0.01 and found.time == pytest.approx(1.0, abs=2e-4)


def test_a_margin_that_grows_is_kept_too() -> None:
    ball = MovingObstacle(
        Ball(center=(0.0, 0.0, 0.0), radius=0.1, name="ball"), ConstantVelocity((0.0, 0.0, 0.0), (0.4, 0.0, 0.0)), 0.1
    )
    assert fixed_contacts(robot(), [ball], 1.8) == ()  # 0.2 m less 0.18 m and the margin of 0.01 m
    (found,) = fixed_contacts(robot(), [ball], 2.5)
    assert found.distance == pytest.approx(-0.05)


def test_the_world_of_fixed_links_is_one_object_and_is_pickled_as_such() -> None:
    world = CompiledWorld.of_fixed(robot(), [cube(0.25), cart()])
    assert world is CompiledWorld.of_fixed(robot(), [cube(0.25), cart()])
    assert world is not None and world.moves and not world.still.moves
    make, arguments = world.__reduce__()
    assert callable(make) and make(*arguments) is world  # type: ignore[misc]
    assert world.still.clearance_margins(np.zeros((1, 3))) == pytest.approx(0.04)
