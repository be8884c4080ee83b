"""The checker of certificates: what it accepts is true, by dense samples of other code; what is changed is refused."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.certificates import Content, accepted, case, changed, criteria_of, draw, scene_of, straight
from helpers.core_robots import EXAMPLES, ROBOTS, distances, margins, placed, robot_of
from helpers.slow import slow_except

from problems.assembly import certificate_of
from problems.assembly.certificate import obstacle_content
from problems.base import InvalidProblem, as_array
from problems.certify import check_certificate as checker
from problems.certify import divided
from problems.certify.division import direction_from
from problems.motions import Trajectory
from problems.robots import FixedFrame, Payload, SpatialArm, TrackingError, built_in


def refusal(content: Content) -> str:
    with pytest.raises(checker.RefusedError) as refused:
        checker.check(json.loads(json.dumps(content)))
    return str(refused.value)


def stage_of(content: Content, number: int = 0) -> checker.Stage:
    return checker.Stage(checker.formed(content["stages"][number], "STAGE", "stage", {}), "stage")


def held(stage: checker.Stage, key: str) -> Iterator[tuple[np.ndarray, checker.Cells, np.ndarray]]:
    """What a proof says to hold, level by level: pairs, cells, and the room that the checker finds."""
    claim = stage.claims[key]
    for digits in getattr(stage.given.proof, key):
        which = np.flatnonzero(digits == 0)
        cells = checker.Cells(stage, claim.cells[which])
        room, _ = claim.look(claim.pairs[which], cells)
        yield claim.pairs[which], cells, room
        claim.divide(digits)


@pytest.mark.parametrize("name", slow_except(ROBOTS, 1))
def test_what_is_accepted_is_clear_at_many_times(name: str) -> None:
    """By another product of transformations, and every ball."""
    for number in range(3):
        made = case(name, number)
        assert accepted(made.content)
        few, robot = 12 if made.robot.cover else 200, made.robot
        times = np.linspace(0.0, made.motion.duration, few)
        standing = tuple(obstacle for obstacle in made.obstacles if not obstacle.moves)
        least = np.minimum(*margins(robot, standing, made.motion.at(times))).min()
        for time in times[:: few // 6]:
            there = (_at(made.obstacles[-1], float(time)),)
            least = min(least, margins(robot, there, made.motion.at(np.array([time])))[0][0])
        assert least >= -1e-9


def _at(obstacle: Any, time: float) -> Any:
    """The box that moves where it is then, grown by what more is kept from it."""
    place = np.array(obstacle.motion.origin) + time * np.array(obstacle.motion.velocity)
    grown = 2.0 * obstacle.margin_rate * time
    return replace(obstacle.still, center=tuple(place), size=tuple(np.array(obstacle.still.size) + grown))


@pytest.mark.parametrize("name", ROBOTS)
def test_bounds_hold_all_through_cells(name: str) -> None:
    """Of every node: by positions of its centre at many times of each cell."""
    made, count = case(name), 0
    stage = stage_of(made.content)
    for pairs, cells, room in held(stage, "obstacles"):
        (node, other), least = pairs.T, np.full(len(pairs), np.inf)
        for share in np.linspace(0.0, 1.0, 9):
            times = (made.motion.breakpoints[cells.piece] + cells.start + share * (cells.end - cells.start))[cells.of]
            turns, places = placed(made.robot, made.motion.at(times))
            rows, body = np.arange(len(node)), stage.robot.body[node]
            centers = places[rows, body] + np.einsum("mij,mj->mi", turns[rows, body], stage.robot.ends[0, node])
            for k in np.unique(other):
                among, obstacle, own = other == k, made.obstacles[k], stage.given.obstacles[k]
                aside = own.center - np.array(obstacle.unmoved.center)
                seen = centers[among] - times[among, None] * own.velocity - aside
                far = distances(obstacle.unmoved, seen) - own.growth * times[among]
                kept = stage.robot.radii[node[among]] + stage.given.margins[0]
                least[among] = np.minimum(least[among], far - kept)
        assert (room <= least).all()
        count += len(room)
    assert count > 20


@pytest.mark.parametrize("shape", EXAMPLES)
def test_planes_are_across_the_shortest_way_and_any_other_is_no_farther(shape: str) -> None:
    content = checker.formed(obstacle_content(shape, EXAMPLES[shape], EXAMPLES[shape]), "OBSTACLE", "it", {})
    rng = np.random.default_rng(3)
    points = rng.uniform(-1.5, 1.5, (3_000, 3))
    exact, own = distances(EXAMPLES[shape], points), (points - content.center) @ content.rotation
    support = checker.SHAPES[shape.replace("sphere", "ball")][1]

    def beyond(n: np.ndarray) -> np.ndarray:
        return np.einsum("ij,ij->i", n, own) - support(n, content.sizes, content.points)

    outside, found = exact > 1e-3, beyond(direction_from(content, own))
    if shape == "ellipsoid":  # whose clearance of the models is no distance
        assert (found[outside] > 0.0).all()
    else:
        np.testing.assert_allclose(found[outside], exact[outside], rtol=0.0, atol=1e-8)
    other = rng.normal(size=(3_000, 3))
    most = np.maximum(exact, 0.0) if shape != "ellipsoid" else np.maximum(found, 0.0)
    assert (beyond(other / np.linalg.norm(other, axis=1)[:, None]) <= most + 5e-9).all()
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
    return replace(arm, chain=chain, base_frame=FixedFrame(on_its_side), spheres=(), kept_pairs=(), proven_pairs=())


def test_torques_are_within_their_bounds_and_these_are_sharp() -> None:
    """Against the recursion of the models, of other masses that take the same torques."""
    robot = panda()
    rng = np.random.default_rng(1)
    motion = straight(robot, *(BENT + rng.uniform(-0.6, 0.6, (2, 7))))
    content = certificate_of(criteria_of(robot, motion, ()), motion)
    assert accepted(content)
    stage = stage_of(content)
    cells = checker.Cells(stage, np.arange(16 * stage.pieces, 32 * stage.pieces))
    low, high = cells.torques(stage.given.robot)
    frictionless = replace(robot, chain=robot.chain.with_friction(None, [0.0] * 7))
    seen = []
    for share in np.linspace(0.0, 1.0, 15):
        times = motion.breakpoints[cells.piece] + cells.start + share * (cells.end - cells.start)
        state = [motion.at(times, order) for order in range(3)]
        smooth = as_array(frictionless.dynamics.torques(*map(ca.DM, state)))
        seen.append(smooth + 0.3 * np.sign(state[1]))
        assert (low <= seen[-1] + 1e-9).all()
        assert (seen[-1] <= high + 1e-9).all()
    beyond = np.maximum(np.min(seen, axis=0) - low, high - np.max(seen, axis=0))
    assert np.median(beyond) < 0.02  # N m


def test_a_torque_beyond_its_limit_is_refused_and_one_at_it_is_not() -> None:
    robot = panda()
    motion = straight(robot, BENT, BENT + np.array([0.4, 0.3, 0.0, 0.3, 0.2, 0.0, 0.3]))
    content = certificate_of(criteria_of(robot, motion, ()), motion)
    stage = stage_of(content)
    cells = checker.Cells(stage, np.arange(64 * stage.pieces, 128 * stage.pieces))
    most = np.abs(cells.torques(stage.given.robot)).max(axis=(0, 1))
    for joint in (1, 3):
        at_it = changed(content, "robot", "limits", joint, 3, value=float(most[joint]) * (1.0 + 1e-4))
        at_it["stages"][0] |= divided(at_it["stages"][0])
        assert accepted(at_it)
        lower = changed(at_it, "robot", "limits", joint, 3, value=float(most[joint]) * (1.0 - 1e-3))
        assert refusal(lower).startswith(f"torque of 'panda_joint{joint + 1}', t = ")


OFF = TrackingError(constant=(0.004, 0.001, 0.006, 0.002), speed=(0.01, 0.002, 0.004, 0.0),
                    acceleration=(0.001, 0.0005, 0.0, 0.002))  # fmt: skip


def tracked() -> tuple[SpatialArm, Trajectory, Content]:
    robot, obstacles = replace(robot_of("sliding"), tracking=OFF), scene_of("sliding")
    for seed in range(1_000):
        motion = draw(robot, seed)
        with suppress(InvalidProblem):
            return robot, motion, certificate_of(criteria_of(robot, motion, obstacles), motion)
    raise AssertionError("no motion is clear")


def least_room(robot: SpatialArm, motion: Trajectory, errors: np.ndarray) -> float:
    """Of obstacles that stand, own links and ranges, by joints that are off by as much as they may be, m or rad."""
    rng, standing = np.random.default_rng(0), scene_of("sliding")[:-1]
    times = np.repeat(np.linspace(0.0, motion.duration, 30), 8)
    speed, acceleration = (np.abs(motion.at(times, order)) for order in (1, 2))
    off = (errors[0] + errors[1] * speed + errors[2] * acceleration) * rng.choice([-1.0, 1.0], (len(times), robot.dof))
    theta = motion.at(times) + off
    low, high = np.array(robot.position_limits).T
    return min(*(part.min() for part in margins(robot, standing, theta)), (theta - low).min(), (high - theta).min())


def test_what_is_accepted_holds_for_all_joints_within_their_tracking_errors() -> None:
    """A constant, and shares of speed and acceleration; each, made so large that something is broken, is refused."""
    robot, motion, content = tracked()
    assert accepted(content)
    assert content["stages"][0]["robot"]["tracking_error"] == OFF.numbers.tolist()
    assert content["stages"][0]["robot"]["ranges"] == [list(each) for each in robot.position_limits]
    assert not any("tracking" in line for line in content["stages"][0]["not_covered"])
    assert least_room(robot, motion, OFF.numbers) >= -1e-9
    for part in range(3):
        numbers = OFF.numbers
        numbers[part] = 9.0
        assert least_room(robot, motion, numbers) < 0.0
        assert not accepted(changed(content, "robot", "tracking_error", value=numbers.tolist()))


def test_the_share_of_a_speed_without_a_limit_leaves_no_range() -> None:
    _, _, content = tracked()
    with pytest.raises(checker.RefusedError, match="joint range of 'one'"):
        divided(changed(content, "robot", "limits", 0, 0, value=None)["stages"][0])


@pytest.mark.parametrize("name", ROBOTS)
def test_points_of_bodies_are_where_the_ends_have_them(name: str) -> None:
    """By another product of transformations: no farther than is said, in any posture within the tolerances."""
    made, rng = case(name), np.random.default_rng(3)
    ends = made.motion.at(made.motion.breakpoints[[0, -1]])
    tolerance = made.content["stages"][0]["tolerances"][1]
    for end, carrier in ((0, made.robot.dof - 1), (1, made.robot.dof - 1), (1, 1)):
        own, aside = rng.normal(size=(4, 3)), rng.normal(size=(4, 3))

        def there(theta: np.ndarray, own: np.ndarray = own, body: int = carrier + 1) -> np.ndarray:
            turns, origins = (part[0, body] for part in placed(made.robot, theta[None]))
            return np.asarray(own @ turns.T + origins)

        def claiming(within: float, body: int = carrier, at: int = end, **other: Any) -> Content:
            place = {"at_goal": at, "carrier": body, "points": own.tolist(), "places": places.tolist()}  # noqa: B023
            return changed(made.content, "places", value=[place | {"within": within} | other])

        places = there(ends[end]) + 1e-3 * aside
        far = 1e-3 * np.linalg.norm(aside, axis=1).max()
        off = rng.uniform(-tolerance, tolerance, size=(50, made.robot.dof))
        worst = max(np.linalg.norm(there(ends[end] + each) - places, axis=1).max() for each in off)
        least = far + 10.0 * made.robot.dof * tolerance
        assert far < worst < least
        assert accepted(claiming(least))
        assert " m from its places" in refusal(claiming(worst))
        assert " m from its places" in refusal(claiming(least, at=1 - end))
        assert " m from its places" in refusal(claiming(least, body=0))
        assert " m from its places" in refusal(claiming(least, points=own[::-1].tolist()))
        assert " m from its places" in refusal(claiming(least, places=places[::-1].tolist()))
        assert " m from its places" in refusal(claiming(least, places=(places + 2e-4 * aside).tolist()))
