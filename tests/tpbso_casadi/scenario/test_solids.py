"""Obstacles in space as a scenario file states them: what they become, and what is said of wrong ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Ball, Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Rectangle
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.scenario import NestedError
from tpbso_casadi.scenario.obstacles import build_obstacles, read_obstacle

CENTER, TURN = (0.3, 0.1, 0.5), (0.0, 0.0, 0.6, 0.8)
SHAPES: list[tuple[dict[str, Any], object]] = [
    ({"shape": "box", "center": [0.3, 0.1], "size": [0.2, 0.1]}, Rectangle((0.3, 0.1), (0.2, 0.1))),
    (
        {"shape": "box", "center": CENTER, "size": [0.2, 0.1, 0.3], "quaternion": TURN},
        Box(center=CENTER, quaternion=TURN, size=(0.2, 0.1, 0.3)),
    ),
    ({"shape": "sphere", "center": CENTER, "radius": 0.2}, Ball(center=CENTER, radius=0.2)),
    (
        {"shape": "capsule", "center": CENTER, "radius": 0.2, "length": 1.0, "quaternion": TURN},
        Capsule(center=CENTER, quaternion=TURN, radius=0.2, length=1.0),
    ),
    (
        {"shape": "cylinder", "center": CENTER, "radius": 0.2, "length": 1.0},
        Cylinder(center=CENTER, radius=0.2, length=1.0),
    ),
    ({"shape": "half-space", "center": CENTER}, HalfSpace(center=CENTER)),
    ({"shape": "half-space", "center": CENTER, "quaternion": TURN}, HalfSpace(center=CENTER, quaternion=TURN)),
    ({"shape": "half-space", "center": CENTER, "normal": [0.0, 0.0, 5.0]}, HalfSpace(center=CENTER)),
    (
        {"shape": "ellipsoid", "center": CENTER, "semi_axes": [0.2, 0.1, 0.3]},
        Ellipsoid(center=CENTER, semi_axes=(0.2, 0.1, 0.3)),
    ),
]


@pytest.mark.parametrize(("table", "expected"), SHAPES, ids=lambda value: str(type(value).__name__))
def test_a_table_becomes_the_obstacle_that_it_states(table: dict[str, Any], expected: object) -> None:
    section = read_obstacle(table)
    assert build_obstacles([section], 7) == (expected,)
    assert build_obstacles([read_obstacle(section.model_dump(mode="json", exclude_none=True))], 7) == (expected,)


@settings(max_examples=200, deadline=None)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 1e-150))
def test_a_half_space_is_below_its_normal(normal: tuple[float, float, float]) -> None:
    [solid] = build_obstacles([read_obstacle({"shape": "half-space", "center": CENTER, "normal": normal})], 7)
    away = np.array(normal) / np.linalg.norm(normal)
    assert solid.distance_of(tuple(CENTER + 0.7 * away), CENTER) == pytest.approx(0.7, abs=1e-9)
    across = np.cross(away, np.roll(away, 1) + 0.1)
    assert solid.distance_of(tuple(CENTER + across - 0.7 * away), CENTER) == pytest.approx(-0.7, abs=1e-9)


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ({"shape": "box", "center": CENTER, "size": [0.2, 0.1]}, "size.2: missing key"),
        ({"shape": "box", "center": [0.1, 0.2], "size": [0.2, 0.1, 0.1]}, "center.2: missing key"),
        ({"shape": "box", "center": CENTER, "size": [0.2, 0.1, 0.0]}, "size.2: input should be greater than 0, not 0"),
        ({"shape": "box", "center": CENTER, "size": [1, 1, 1], "angle": 0.1}, "angle: unknown key"),
        ({"shape": "box", "center": CENTER, "size": [1, 1, 1], "quaternion": [0, 1]}, "quaternion.2: missing key"),
        ({"shape": "sphere", "center": CENTER}, "radius: missing key"),
        ({"shape": "sphere", "center": CENTER, "radius": 1.0, "quaternion": TURN}, "quaternion: unknown key"),
        ({"shape": "capsule", "center": [0.1, 0.2], "radius": 1.0, "length": 1.0}, "center.2: missing key"),
        ({"shape": "cylinder", "center": CENTER, "radius": 1.0, "height": 1.0}, "length: missing key"),
        ({"shape": "half-space", "center": CENTER, "normal": "up"}, "normal: a list is needed, not 'up'"),
        ({"shape": "ellipsoid", "center": CENTER, "semi_axes": [1.0, 1.0]}, "semi_axes.2: missing key"),
        ({"shape": "spere", "center": CENTER}, "shape: input should be .*'spere'; did you mean sphere?"),
    ],
)
def test_a_table_that_fits_no_shape_is_named(table: dict[str, Any], reason: str) -> None:
    with pytest.raises(NestedError, match=reason):
        read_obstacle(table)


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ({"quaternion": [0.0, 0.0, 0.0, 2.0]}, r"obstacles.0.quaternion: \(0.0, 0.0, 0.0, 2.0\) is not of length 1"),
        ({"normal": [0.0, 0.0, 0.0]}, "obstacles.0.normal: a vector of no length has no direction"),
        ({"normal": [0.0, 0.0, 1.0], "quaternion": TURN}, "obstacles.0.normal: the quaternion says already how"),
        ({"center": [0.0, 0.0, 1e9]}, "obstacles.0.center: 1e\\+09 is not within"),
    ],
)
def test_an_impossible_half_space_is_named(table: dict[str, Any], reason: str) -> None:
    section = read_obstacle({"shape": "half-space", "center": CENTER, **table})
    with pytest.raises(ScenarioError, match=reason):
        build_obstacles([section], 7)


def test_a_solid_is_nothing_for_a_robot_in_the_plane() -> None:
    scenario = parse_scenario(
        {
            "arm": {"link_lengths": [1.0, 1.0], "max_speed": 1.0, "max_acceleration": 1.0},
            "task": {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]},
            "obstacles": [{"shape": "sphere", "center": CENTER, "radius": 0.1}],
        }
    )
    with pytest.raises(ScenarioError, match=r"^obstacles: obstacle 1, Ball at .* it has 3 dimensions, the robot 2"):
        scenario.problem()
