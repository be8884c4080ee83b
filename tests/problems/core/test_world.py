"""Rooms of postures, what comes near and how it changes, against every ball by NumPy."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest
from helpers.core_robots import EXAMPLES, MARGIN, ROBOTS, SCENE, links_and_pairs, margins, postures, robot_of, world_of
from helpers.slow import slow_except
from scipy.spatial import cKDTree

from problems import PlanarArm
from problems.base import Matrix
from problems.core import CompiledWorld, Separation, is_known
from problems.robots import SpatialArm
from problems.scene import SOLIDS, Box, Ellipsoid

TOLERANCE = 1e-9  # m; where two balls are at the same distance up to rounding, either is the nearest


each_robot = pytest.mark.parametrize("name", ROBOTS)


@pytest.mark.parametrize("name", slow_except(ROBOTS, 1))
def test_rooms_are_those_of_the_nearest_balls(name: str) -> None:
    robot = robot_of(name)
    theta = postures(robot, np.random.default_rng(1), 203 if name != "bars" else 27)
    outside, own = margins(robot, SCENE, theta)
    world = world_of(robot, SCENE)
    np.testing.assert_allclose(
        world.clearance_margins(theta, which=Separation.FROM_OBSTACLES), outside, rtol=0.0, atol=TOLERANCE
    )
    np.testing.assert_allclose(
        world.clearance_margins(theta, which=Separation.FROM_EACH_OTHER), own, rtol=0.0, atol=TOLERANCE
    )
    np.testing.assert_allclose(world.clearance_margins(theta), np.minimum(outside, own), rtol=0.0, atol=TOLERANCE)
    assert (outside < 0.0).any() and (outside > 0.0).any()


@pytest.mark.parametrize("shape", SOLIDS)
def test_every_shape_that_scenarios_have_is_known_as_it_is_or_not_at_all(shape: str) -> None:
    assert shape in EXAMPLES, "a shape is new: give an example of it"
    obstacle = EXAMPLES[shape]
    assert isinstance(obstacle, SOLIDS[shape])
    robot = robot_of("sliding")
    world = CompiledWorld.of(robot, (obstacle,))
    if world is None:
        return  # others answer for it
    theta = postures(robot, np.random.default_rng(2), 400)
    found, expected = (
        world.clearance_margins(theta, which=Separation.FROM_OBSTACLES),
        margins(robot, (obstacle,), theta)[0],
    )
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=TOLERANCE)
    assert (expected > 0.0).any()


def test_no_room_of_a_thin_ellipsoid_is_less_than_its_balls_say_nor_more_than_there_is() -> None:
    """What is known of its distance is a bound, which need not change as slowly as points move."""
    needle, robot = Ellipsoid(center=(0.4, 0.3, 0.6), semi_axes=(0.6, 0.01, 0.3)), robot_of("bars")
    theta = postures(robot, np.random.default_rng(3), 15)
    found, low = (
        world_of(robot, (needle,)).clearance_margins(theta, which=Separation.FROM_OBSTACLES),
        margins(robot, (needle,), theta)[0],
    )
    assert (found >= low - TOLERANCE).all()
    surface = np.random.default_rng(4).normal(size=(3_000, 3))
    surface = surface / np.linalg.norm(surface, axis=1, keepdims=True) * needle.semi_axes + needle.center
    points, frames = cKDTree(surface), robot.body_frames(theta)
    for posture, room in zip(frames, found, strict=True):
        for link in links_and_pairs(robot)[0]:
            centers = posture[link.body, 0] + link.centers @ posture[link.body, 1:]
            assert room <= (points.query(centers)[0] - link.radii).min() - robot.margin + TOLERANCE


def test_what_may_touch_an_obstacle_keeps_nothing_of_it() -> None:
    robot = robot_of("sliding")
    box = replace(EXAMPLES["box"], name="table")
    ball = replace(EXAMPLES["sphere"], name="lamp")
    allowed = replace(robot, may_touch=(("rod", "table"), ("arm", "table"), ("boom", "lamp")))
    theta = postures(robot, np.random.default_rng(5), 300)
    expected = margins(allowed, (box, ball), theta)[0]
    np.testing.assert_allclose(
        world_of(allowed, (box, ball)).clearance_margins(theta, which=Separation.FROM_OBSTACLES),
        expected,
        rtol=0.0,
        atol=TOLERANCE,
    )
    assert (expected > margins(robot, (box, ball), theta)[0] + 0.01).any()


@each_robot
def test_what_is_asked_for_bounds_rooms_and_changes_no_smaller_one(name: str) -> None:
    robot = robot_of(name)
    theta, world = postures(robot, np.random.default_rng(7), 77), world_of(robot, SCENE)
    least = world.clearance_margins(theta)
    for most in (-0.05, 0.0, 0.1):
        np.testing.assert_allclose(world.clearance_margins(theta, most), np.minimum(least, most), rtol=0.0, atol=1e-12)


@each_robot
def test_postures_are_clear_where_they_have_room_to_spare(name: str) -> None:
    robot = robot_of(name)
    theta, world = postures(robot, np.random.default_rng(8), 301), world_of(robot, SCENE)
    least = world.clearance_margins(theta)
    for spare in (-0.1, 0.0, 0.02, 0.08):
        assert (world.clear(theta, spare) == (least >= spare)).all()
    assert 0 < world.clear(theta, -0.1).sum() < len(theta)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9])
def test_any_number_of_postures_has_the_same_rooms_as_each_alone(count: int) -> None:
    robot = robot_of("upright")
    theta, world = postures(robot, np.random.default_rng(9), 9)[:count], world_of(robot, SCENE)
    alone = [world.clearance_margins(theta[k : k + 1])[0] for k in range(count)]
    np.testing.assert_array_equal(world.clearance_margins(theta), np.array(alone))
    assert set(world.nearby(theta, np.inf).samples.tolist()) == set(range(count))


@each_robot
def test_the_least_of_what_comes_near_is_the_room(name: str) -> None:
    robot = robot_of(name)
    theta, world, below = postures(robot, np.random.default_rng(10), 101), world_of(robot, SCENE), 0.12
    least, near = world.clearance_margins(theta), world.nearby(theta, below)
    assert (near.clearance_margins < below).all() and near.gradients.shape == (near.clearance_margins.size, robot.dof)
    found = np.full(len(theta), np.inf)
    np.minimum.at(found, near.samples, near.clearance_margins)
    np.testing.assert_allclose(found[least < below], least[least < below], rtol=0.0, atol=TOLERANCE)
    assert np.isinf(found[least >= below]).all()
    for own, which in ((False, Separation.FROM_OBSTACLES), (True, Separation.FROM_EACH_OTHER)):
        part, one = world.clearance_margins(theta, below, which), np.full(len(theta), below)
        np.minimum.at(one, near.samples[near.is_link == own], near.clearance_margins[near.is_link == own])
        np.testing.assert_allclose(one, part, rtol=0.0, atol=TOLERANCE)


@each_robot
def test_gradients_are_those_of_differences(name: str) -> None:
    """Where centres are outside: in an ellipsoid, what is said of the depth changes faster than points move."""
    robot, step, compared = robot_of(name), 1e-5, 0
    theta = postures(robot, np.random.default_rng(12), 40 if name != "bars" else 20)
    for obstacles, which, own in ((SCENE, Separation.FROM_OBSTACLES, False), ((), Separation.FROM_EACH_OTHER, True)):
        world = world_of(robot, obstacles)
        near = world.nearby(theta, 0.5)
        for posture in range(len(theta)):
            of_it = np.flatnonzero((near.samples == posture) & (near.is_link == own))
            if not of_it.size or near.clearance_margins[of_it].min() < -MARGIN:
                continue
            least = of_it[near.clearance_margins[of_it].argmin()]
            around = np.concatenate([theta[posture] + sign * step * np.eye(robot.dof) for sign in (1.0, -1.0)])
            beside = world.clearance_margins(around, which=which).reshape(2, -1)
            slopes = (beside[0] - beside[1]) / (2.0 * step)
            bend = np.abs(beside.sum(axis=0) - 2.0 * near.clearance_margins[least]) / step
            if bend.max() < 1e-3:  # no kink, as where another ball takes over
                np.testing.assert_allclose(near.gradients[least], slopes, rtol=0.0, atol=2e-3)
                compared += 1
    assert compared > 20


def test_the_same_world_is_the_same_object() -> None:
    robot = robot_of("upright")
    assert CompiledWorld.of(robot, SCENE) is CompiledWorld.of(robot, tuple(SCENE))
    assert CompiledWorld.of(robot, SCENE) is not CompiledWorld.of(robot, SCENE[:2])


def test_there_is_no_world_of_arms_in_the_plane() -> None:
    assert CompiledWorld.of(PlanarArm((0.5, 0.5), (4.0,) * 2, (20.0,) * 2), ()) is None


def test_where_there_is_nothing_to_keep_clear_of_room_has_no_end() -> None:
    alone = replace(robot_of("upright"), self_collision=False)
    world, theta = world_of(alone, ()), postures(alone, np.random.default_rng(13), 10)
    assert np.isinf(world.clearance_margins(theta)).all()
    assert world.clear(theta).all()
    assert world.nearby(theta, np.inf).clearance_margins.size == 0


def test_a_class_derived_from_a_known_shape_or_robot_is_not_taken_for_it() -> None:
    class Hollow(Box):
        def point_clearance(self, points: Matrix) -> Matrix:
            return super().point_clearance(points) - 0.1

    class Longer(SpatialArm):
        pass

    arm, hollow = robot_of("upright"), Hollow(center=(0.5, 0.0, 0.5), size=(0.1, 0.1, 0.1))
    assert is_known(Box(center=hollow.center, size=hollow.size)) and not is_known(hollow)
    longer = Longer(**{field.name: getattr(arm, field.name) for field in fields(SpatialArm) if field.init})
    assert CompiledWorld.of(longer, ()) is None
