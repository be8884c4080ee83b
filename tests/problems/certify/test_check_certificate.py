"""The checker of certificates: what it accepts is true, by dense samples of other code; what is changed is refused."""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.certificates import case, criteria_of, straight
from helpers.core_robots import EXAMPLES, ROBOTS, distances, placed, rooms

from problems.assembly import certificate_of
from problems.assembly.certificate import obstacle_content
from problems.base import as_array
from problems.certify import check_certificate as checker
from problems.robots import Payload, SpatialArm, built_in

Content = dict[str, Any]


def accepted(content: Content) -> bool:
    try:
        checker.check(json.loads(json.dumps(content)))
    except checker.RefusedError:
        return False
    return True


def refusal(content: Content) -> str:
    with pytest.raises(checker.RefusedError) as refused:
        checker.check(json.loads(json.dumps(content)))
    return str(refused.value)


def fault(content: Any) -> str:
    with pytest.raises(checker.NoCertificateError) as found:
        checker.check(content)
    return str(found.value)


def changed(content: Content, *path: Any, value: Any) -> Content:
    """The content with another value at a place; a function makes it of the one that is there."""
    new = deepcopy(content)
    place = new
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value(place[path[-1]]) if callable(value) else value
    return new


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_accepted_is_clear_at_many_times(name: str) -> None:
    """By another product of transformations, and every ball."""
    for number in range(3):
        made = case(name, number)
        assert accepted(made.content)
        few, robot = 12 if made.robot.cover else 200, made.robot
        times = np.linspace(0.0, made.motion.duration, few)
        standing = tuple(obstacle for obstacle in made.obstacles if not obstacle.moves)
        least = np.minimum(*rooms(robot, standing, made.motion.at(times))).min()
        for time in times[:: few // 6]:
            there = (_at(made.obstacles[-1], float(time)),)
            least = min(least, rooms(robot, there, made.motion.at(np.array([time])))[0][0])
        assert least >= -1e-9


def _at(obstacle: Any, time: float) -> Any:
    """The box that moves where it is then, grown by what more is kept from it."""
    place = np.array(obstacle.motion.origin) + time * np.array(obstacle.motion.velocity)
    grown = 2.0 * obstacle.margin_rate * time
    return replace(obstacle.still, center=tuple(place), size=tuple(np.array(obstacle.still.size) + grown))


@pytest.mark.parametrize("name", ROBOTS)
def test_bounds_hold_all_through_cells_and_are_not_much_too_low(name: str) -> None:
    """Of every node: by positions of its centre at many times of each cell."""
    made = case(name)
    certificate = checker.Certificate(made.content)
    scene = checker.Scene(certificate.robot, certificate.obstacles, certificate.cells)
    node, other, cell = (part[::7] for part in certificate.items[0])
    spare, _ = scene.spare(node, other, cell, own=False)
    least = np.full(len(node), np.inf)
    for share in np.linspace(0.0, 1.0, 9):
        start, end = (part[cell] for part in (certificate.cells.start, certificate.cells.end))
        times = made.motion.breakpoints[certificate.cells.piece[cell]] + start + share * (end - start)
        turns, places = placed(made.robot, made.motion.at(times))
        rows, body = np.arange(len(node)), certificate.robot.body[node]
        centers = places[rows, body] + np.einsum("mij,mj->mi", turns[rows, body], certificate.robot.centers[node])
        for k in np.unique(other):
            among = other == k
            obstacle, own = made.obstacles[k], certificate.obstacles[k]
            seen = centers[among] - times[among, None] * own.velocity - (own.center - np.array(obstacle.unmoved.center))
            room = distances(obstacle.unmoved, seen) - own.growth * times[among]
            kept = certificate.robot.radii[node[among]] + certificate.robot.margins[0]
            least[among] = np.minimum(least[among], room - kept)
    assert (spare <= least).all()
    assert len(spare) > 20


@pytest.mark.parametrize("shape", EXAMPLES)
def test_distances_are_exact_and_never_larger(shape: str) -> None:
    content = obstacle_content(1, EXAMPLES[shape])
    obstacle = checker.Obstacle(checker.formed(content, checker.OBSTACLE, "it"), "it")
    points = np.random.default_rng(3).uniform(-1.5, 1.5, (3_000, 3))
    found, exact = obstacle.distances(points, np.zeros(len(points))), distances(EXAMPLES[shape], points)
    outside = exact > 1e-3
    assert (found <= np.maximum(exact, 0.0) * (1.0 + 1e-3 * (shape == "ellipsoid")) + 5e-9).all()
    np.testing.assert_allclose(found[outside], exact[outside], rtol=2e-3 if shape == "ellipsoid" else 0.0, atol=1e-8)
    assert outside.sum() > 1_000


CARRIED = Payload(
    mass=2.0, center=(0.01, 0.02, 0.1), matrix=((0.01, 0.001, 0.0), (0.001, 0.02, 0.0), (0.0, 0.0, 0.015))
)
BENT = np.array([0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0])


def panda() -> SpatialArm:
    """On its side, with a payload and friction."""
    arm = built_in("panda").arm(max_acceleration=15.0, payload=CARRIED)
    chain = arm.chain.with_friction([0.5] * 7, [0.3] * 7)
    on_its_side = ((0.0, -1.0, 0.0), (0.6, 0.0, -0.8), (0.8, 0.0, 0.6))
    return replace(arm, chain=chain, base_rotation=on_its_side, spheres=(), kept_pairs=(), proven_pairs=())


def test_torques_are_within_their_bounds_and_these_are_sharp() -> None:
    """Against the recursion of the models, of other masses that take the same torques."""
    robot = panda()
    rng = np.random.default_rng(1)
    motion = straight(robot, *(BENT + rng.uniform(-0.6, 0.6, (2, 7))))
    content = certificate_of(criteria_of(robot, motion, ()), motion)
    certificate = checker.Certificate(content)
    assert accepted(content)
    cells = certificate.torque_cells
    low, high = checker.torques(certificate.robot, cells)
    frictionless = replace(robot, chain=robot.chain.with_friction(None, [0.0] * 7))
    seen = []
    for share in np.linspace(0.0, 1.0, 15):
        times = motion.breakpoints[cells.piece] + cells.start + share * (cells.end - cells.start)
        state = [motion.at(times, order) for order in range(3)]
        smooth = as_array(frictionless.inverse_dynamics(*map(ca.DM, state)))
        seen.append(smooth + 0.3 * np.sign(state[1]))
        assert (low <= seen[-1] + 1e-9).all()
        assert (seen[-1] <= high + 1e-9).all()
    beyond = np.maximum(np.min(seen, axis=0) - low, high - np.max(seen, axis=0))
    assert np.median(beyond) < 0.02  # N m


def test_a_torque_beyond_its_limit_is_refused_and_one_at_it_is_not() -> None:
    robot = panda()
    motion = straight(robot, BENT, BENT + np.array([0.4, 0.3, 0.0, 0.3, 0.2, 0.0, 0.3]))
    content = certificate_of(criteria_of(robot, motion, ()), motion)
    certificate = checker.Certificate(content)
    most = np.abs(checker.torques(certificate.robot, certificate.torque_cells)).max(axis=(0, 1))
    for joint in range(7):
        assert accepted(changed(content, "robot", "joints", joint, "torque", value=float(most[joint])))
        lower = changed(content, "robot", "joints", joint, "torque", value=float(most[joint]) * (1.0 - 1e-6))
        assert refusal(lower).startswith(f"torque of panda_joint{joint + 1}, t = ")
