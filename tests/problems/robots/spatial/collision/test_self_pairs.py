"""Which spheres have to keep apart: those that can touch and do not always."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from problems import InvalidProblem
from problems.robots import BUILT_IN, ChainJoint, SpatialArm, Sphere, built_in
from problems.robots.chain import Chain
from problems.robots.self_pairs import self_collision_pairs


def arm(*spheres: Sphere, bend: float = 3.0) -> SpatialArm:
    """Three links of 1 m in a plane, whose joints bend by so much."""
    places = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    joints = tuple(ChainJoint(name=f"j{i}", link=f"l{i}", translation=place) for i, place in enumerate(places))
    return SpatialArm(
        chain=Chain(name="arm", joints=joints),
        max_speed=(1.0,) * 3,
        max_acceleration=(1.0,) * 3,
        position_limits=((-bend, bend),) * 3,
        spheres=spheres,
    )


def ball(link: int, x: float, radius: float = 0.1) -> Sphere:
    return Sphere(link, (x, 0.0, 0.0), radius, f"l{link}")


def test_what_can_touch_has_to_keep_apart() -> None:
    assert self_collision_pairs(arm(ball(0, 0.5), ball(1, 0.5), ball(3, 0.9))) == ((0, 2), (1, 2))


def test_bodies_that_a_joint_connects_may_touch() -> None:
    assert self_collision_pairs(arm(ball(1, 0.5), ball(2, 0.5))) == ()


def test_what_never_touches_needs_no_watching() -> None:
    assert self_collision_pairs(arm(ball(1, 0.5), ball(3, 0.9), bend=0.5)) == ()


def test_what_always_touches_is_one_thing() -> None:
    assert self_collision_pairs(arm(ball(0, 0.0, 1.2), ball(2, 0.0, 0.3))) == ()


def test_the_margin_counts() -> None:
    near = arm(ball(1, 0.0), ball(3, 0.0), bend=1.0)  # at least 1.75 m apart
    assert self_collision_pairs(near) == ()
    wide = replace(near, margin=1.7)
    assert self_collision_pairs(wide) == ((0, 1),)


def test_links_are_named_to_override() -> None:
    robot = arm(ball(0, 0.5), ball(1, 0.5), ball(3, 0.9))
    assert self_collision_pairs(robot, disabled=[("l3", "l0")]) == ((1, 2),)
    stiff = arm(ball(1, 0.5), ball(3, 0.9), bend=0.5)
    assert self_collision_pairs(stiff, kept=[("l1", "l3")]) == ((0, 1),)
    assert self_collision_pairs(robot, disabled=[("l0", "l3"), ("l1", "l3")]) == ()


def test_what_a_joint_connects_cannot_be_kept_apart() -> None:
    with pytest.raises(InvalidProblem, match="kept_pairs: 'l1' and 'l0' are one body, or a joint connects them"):
        self_collision_pairs(arm(ball(0, 0.5), ball(1, 0.5), ball(3, 0.9)), kept=[("l0", "l3"), ("l1", "l0")])


def test_spheres_that_would_take_minutes_are_refused() -> None:
    row = [ball(link, 0.001 * place) for link in (0, 3) for place in range(150)]
    with pytest.raises(InvalidProblem, match="spheres: 300 make 22500 pairs, of at most 20000"):
        self_collision_pairs(arm(*row))
    assert self_collision_pairs(arm(*row), disabled=[("l0", "l3")]) == ()


def test_links_without_spheres_are_named() -> None:
    with pytest.raises(InvalidProblem, match="disabled_pairs: no spheres on link 'l7'; there are l0, l1"):
        self_collision_pairs(arm(ball(0, 0.5), ball(1, 0.5)), disabled=[("l0", "l7")])


@pytest.mark.parametrize("name", BUILT_IN)
def test_no_pair_of_a_real_robot_is_missed(name: str) -> None:
    """At 10,000 other random postures no sphere that may touch does."""
    description = built_in(name)
    robot = description.arm()
    kept = set(description.self_pairs(robot))
    assert kept == set(description.self_pairs(robot))
    low, high = np.clip(np.array(robot.position_limits).T, -np.pi, np.pi)
    theta = np.random.default_rng(99).uniform(low, high, (10_000, robot.dof))
    frames = robot.positions(ca.DM(theta))
    centers = [np.array(frames[body.start]) for body in robot.bodies]
    links = [sphere.name for sphere in robot.spheres]
    disabled = {frozenset(pair) for pair in description.disabled}
    for one, two in robot.link_pairs:
        if (one, two) in kept or frozenset((links[one], links[two])) in disabled:
            continue
        gaps = np.linalg.norm(centers[one] - centers[two], axis=1)
        assert gaps.min() > robot.spheres[one].radius + robot.spheres[two].radius


def test_links_that_are_known_to_be_near_may_touch_if_they_have_spheres() -> None:
    description = built_in("panda")
    spheres = [sphere for sphere in description.spheres if sphere.name != "panda_hand"]
    robot = description.arm(spheres=spheres)
    links = {frozenset((spheres[one].name, spheres[two].name)) for one, two in description.self_pairs(robot)}
    assert frozenset(("panda_link5", "panda_link7")) not in links
    assert frozenset(("panda_link2", "panda_link7")) in links


@pytest.mark.parametrize("name", BUILT_IN)
def test_most_postures_of_a_real_robot_are_free(name: str) -> None:
    description = built_in(name)
    robot = description.arm()
    pairs = np.array(description.self_pairs(robot))
    low, high = np.clip(np.array(robot.position_limits).T, -np.pi, np.pi)
    frames = robot.positions(ca.DM(np.random.default_rng(5).uniform(low, high, (500, robot.dof))))
    centers = np.stack([np.array(frames[body.start]) for body in robot.bodies])
    radii = np.array([sphere.radius for sphere in robot.spheres])
    gaps = np.linalg.norm(centers[pairs[:, 0]] - centers[pairs[:, 1]], axis=2) - radii[pairs].sum(axis=1)[:, None]
    assert np.mean(gaps.min(axis=0) > 0.0) > 0.7
