"""Certificates of planar arms: links as long balls, obstacles as solids across the plane; against points on both."""

from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.certificates import accepted, criteria_of, straight

from problems.assembly import certificate_of
from problems.base import FloatArray, as_array
from problems.certify import check_certificate as checker
from problems.limits import limits_of
from problems.motions import Trajectory
from problems.robots import PlanarArm
from problems.scene import ConstantVelocity, Ellipse, MovingObstacle, Obstacle, Polygon, Rectangle, Tabulated

ARROW = Polygon(points=((-1.6, 0.3), (-1.2, 0.5), (-1.6, 0.7), (-1.4, 0.5)), name="arrow")  # not convex
CART = MovingObstacle(
    Rectangle(center=(0.0, 0.0), size=(0.2, 0.1), angle=0.3, name="cart"),
    ConstantVelocity((0.3, -0.2), (0.2, 1.9)),
    margin_rate=0.01,
)
SCENES: dict[str, tuple[Obstacle, ...]] = {
    "ellipse": (Ellipse(center=(0.9, 0.9), semi_axes=(0.15, 0.3), angle=0.4),),
    "solids": (ARROW, Rectangle(center=(1.2, -0.7), size=(0.3, 0.2), angle=-0.5), CART),
}
FORMS = {"thin": {}, "wide": {"link_radius": (0.03, 0.02, 0.01), "tool_offset": (0.05, 0.1), "margin": 0.01}}


def arm(form: str) -> PlanarArm:
    return PlanarArm(
        link_lengths=(0.7, 0.6, 0.5), max_speed=(4.0,) * 3, max_acceleration=(20.0,) * 3, base_point=(0.1, -0.1),
        base_angle=0.2, self_collision=True, **FORMS[form],  # type: ignore[arg-type]
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Case:
    robot: PlanarArm
    obstacles: tuple[Obstacle, ...]
    motion: Trajectory
    content: dict[str, Any]


SEEDS = {("thin", "ellipse"): 35, ("thin", "solids"): 1, ("wide", "ellipse"): 72, ("wide", "solids"): 2}
CASES = list(SEEDS)


@cache
def case(form: str, scene: str) -> Case:
    """A random move that keeps clear, but not by much."""
    robot, obstacles = arm(form), SCENES[scene]
    motion = straight(robot, *np.random.default_rng(SEEDS[form, scene]).uniform(-2.0, 2.0, (2, 3)))
    return Case(robot, obstacles, motion, certificate_of(criteria_of(robot, motion, obstacles), motion))


def links_at(robot: PlanarArm, theta: FloatArray) -> FloatArray:
    """Points on the middle lines of all bodies, (n, bodies, points, 2)."""
    places = np.stack([as_array(place) for place in robot.positions(ca.DM(theta))], axis=1)
    share = np.linspace(0.0, 1.0, 41)[:, None]
    return places[:, :-1, None] * (1.0 - share) + places[:, 1:, None] * share


def outline_at(obstacle: Obstacle, time: float) -> FloatArray:
    """Points on its outline, a few mm apart."""
    placed = obstacle.at(time) if isinstance(obstacle, MovingObstacle) else obstacle
    corners = placed.outline(400)
    share = np.linspace(0.0, 1.0, max(1, 400 // len(corners)))[:, None, None]
    return (corners * (1.0 - share) + np.roll(corners, -1, axis=0) * share).reshape(-1, 2)


def least_room(made: Case, count: int = 25) -> tuple[float, float]:
    """Of all samples: between links and obstacles, and between links, on top of what is to be kept, or more."""
    robot, times = made.robot, np.linspace(0.0, made.motion.duration, count)
    radii = np.array([float(body.radius) for body in robot.bodies.each])
    lines, rooms, own = links_at(robot, made.motion.at(times)), [], [np.inf]
    pairs = [(robot.bodies.number_of(one), robot.bodies.number_of(two)) for one, two in robot.bodies.pairs]
    for time, line in zip(times, lines, strict=True):
        for obstacle in made.obstacles:
            apart = np.linalg.norm(line[:, :, None] - outline_at(obstacle, time), axis=-1).min(axis=(1, 2))
            rooms.append((apart - radii - obstacle.growth_rate * time).min() - robot.margin)
        for one, two in pairs:
            apart = np.linalg.norm(line[one][:, None] - line[two], axis=-1).min()
            own.append(apart - radii[one] - radii[two] - robot.margin)
    return min(rooms), min(own)


@pytest.mark.parametrize(("form", "scene"), CASES)
def test_what_is_accepted_is_clear_at_many_times(form: str, scene: str) -> None:
    made = case(form, scene)
    assert accepted(made.content)
    assert min(least_room(made)) >= -1e-9
    assert not made.content["stages"][0]["not_covered"]
    shapes = {obstacle["shape"] for obstacle in made.content["stages"][0]["obstacles"]}
    assert shapes == ({"ellipsoid"} if scene == "ellipse" else {"polytope", "box"})


@pytest.mark.parametrize(("form", "scene"), CASES)
def test_more_than_there_is_room_for_is_refused(form: str, scene: str) -> None:
    """Samples see no less than the room there is, so that a margin larger by all that they see is false."""
    made = case(form, scene)
    for place, room in enumerate(least_room(made)):
        other = deepcopy(made.content)
        other["stages"][0]["margins"][place] += room + 1e-6
        assert not accepted(other)


@pytest.mark.parametrize(("form", "scene"), CASES)
def test_bounds_hold_all_through_cells_and_are_sharp_in_short_ones(form: str, scene: str) -> None:
    """Of links and obstacles, and of links among themselves, by points on both."""
    made = case(form, scene)
    with np.errstate(invalid="ignore"):
        stage = checker.Stage(checker.formed(made.content["stages"][0], "STAGE", "stage", {}), "stage")
    for key in ("obstacles", "own"):
        claim, rng = stage.claims[key], np.random.default_rng(4)
        for digits in getattr(stage.given.proof, key):
            which = np.flatnonzero(digits == 0)
            cells = checker.Cells(stage, claim.cells[which])
            rooms, travels = claim.look(claim.pairs[which], cells)
            for k in rng.permutation(len(which))[:4]:
                c = cells.of[k]
                begin = made.motion.breakpoints[cells.piece[c]] + cells.start[c]
                times = begin + np.linspace(0.0, 1.0, 5) * (cells.end - cells.start)[c]
                seen = [_room(made, stage, key, claim.pairs[which[k]], time) for time in times]
                assert 0.0 <= rooms[k] <= min(seen)
                assert rooms[k] >= seen[2] - travels[k] - 0.03
            claim.divide(digits)


def _room(made: Case, stage: checker.Stage, key: str, pair: FloatArray, time: float) -> float:
    """Of a pair by points, which are at most 2 cm apart on links."""
    (lines,), (one, two) = links_at(made.robot, made.motion.at(np.array([time]))), pair
    given, radii = stage.given, stage.robot.radii
    if key == "own":
        return (
            float(np.linalg.norm(lines[one][:, None] - lines[two], axis=-1).min() - radii[[one, two]].sum())
            - (given.margins[1])
        )
    o = given.obstacles[two]
    place = o.center + time * o.velocity
    seen = (np.pad(lines[one], ((0, 0), (0, 1))) - place) @ o.rotation
    angle = np.linspace(0.0, 2.0 * np.pi, 400)[:, None]
    ellipse = o.sizes[:2] * np.hstack([np.cos(angle), np.sin(angle)]) if o.shape == "ellipsoid" else None
    corners = o.points[::2, :2] if o.shape == "polytope" else o.sizes[:2] * [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    share = np.linspace(0.0, 1.0, 100)[:, None, None]
    edges = (corners * (1.0 - share) + np.roll(corners, -1, axis=0) * share).reshape(-1, 2)
    surface = edges if ellipse is None else ellipse
    apart = np.linalg.norm(seen[:, None, :2] - surface, axis=-1).min()
    return float(apart - radii[one] - given.margins[0] - o.growth * time)


def test_links_that_cross_are_refused() -> None:
    """Whatever the proof says: they have no distance, and no plane is between them."""
    made = case("wide", "ellipse")
    stage = deepcopy(made.content["stages"][0])
    stage["robot"]["own_pairs"] = [[1, 0]]  # which a joint connects
    count = len(stage["breakpoints"]) - 1
    stage["proof"]["own"] = ["0" * count]
    with pytest.raises(checker.RefusedError, match="self clearance of 'link 2' from 'link 1'"):
        checker.check({**made.content, "stages": [stage]})


def test_pairs_that_may_touch_and_motions_that_are_not_known_are_said() -> None:
    made = case("thin", "solids")
    loose = PlanarArm(
        link_lengths=(0.7, 0.6, 0.5), max_speed=(4.0,) * 3, max_acceleration=(20.0,) * 3, base_point=(0.1, -0.1),
        base_angle=0.2, may_touch=(("link 1", "arrow"),),
    )  # fmt: skip
    table = Tabulated.along_lines([0.0, 9.0], np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])[:, :2])
    turning = MovingObstacle(Ellipse(center=(9.0, 9.0), semi_axes=(0.1, 0.1), name="far"), table)
    content = certificate_of(criteria_of(loose, made.motion, (*made.obstacles, turning)), made.motion)
    (stage,) = checker.check(json.loads(json.dumps(content)))
    lines = "\n".join(stage.lines())
    parts = [name for name in (o.name for o in stage.given.obstacles) if "arrow" in name]
    assert len(parts) > 1
    assert all(f"    but 'link 1' and {part}" in lines for part in parts)
    assert "not in this certificate: 'clearance from far, of a shape or motion that no certificate knows'" in lines


def test_an_obstacle_of_a_class_of_its_own_is_not_taken_for_another() -> None:
    class Squeezed(Ellipse):
        """Its clearance may be another."""

    robot, motion = arm("thin"), case("thin", "ellipse").motion
    obstacles = (Squeezed(center=(9.0, 9.0), semi_axes=(0.1, 0.1)),)
    criteria = criteria_of(robot, motion, obstacles)
    assert limits_of(robot, obstacles)
    (stage,) = certificate_of(criteria, motion)["stages"]
    assert stage["obstacles"] == []
    assert "clearance from obstacle 1, of a shape or motion that no certificate knows" in stage["not_covered"]
