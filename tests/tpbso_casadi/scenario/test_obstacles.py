"""[[obstacles]] that move and solids in space: what they become, and one line for what is wrong with them."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of
from helpers.scenes import TWO_LINKS, toml
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Box, Rectangle
from problems.base import InvalidProblem
from problems.scene import Tabulated
from problems.scene.moving import MovingObstacle
from problems.scene.tabulated import as_numbers
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.scenario import ObstacleSection, read_scenario
from tpbso_casadi.scenario.input_files import MOST_MOTION_ROWS
from tpbso_casadi.scenario.obstacles import build_obstacles, read_obstacle

PLANE = {
    "arm": TWO_LINKS | {"link_lengths": [0.7, 0.7, 0.6]},
    "task": {"kind": "point-to-point", "start": [1.6, -0.6], "goal": [0.6, 1.6]},
}
OVAL = {"center": [1.9, 1.2], "semi_axes": [0.15, 0.25]}
RECTANGLE = {"shape": "box", "center": [2.0, 0.5], "size": [0.2, 0.4]}
SPACE = {
    "robot": {"model": "panda"},
    "task": {
        "kind": "point-to-point",
        "start": {"joints": [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]},
        "goal": {"joints": [1.2, 0.2, 0.2, -1.8, 0.0, 2.0, 0.785]},
    },
}
IN_SPACE = {"shape": "box", "center": [0.0, 0.0, 0.0], "size": [0.2, 0.1, 0.2], "motion": "box.csv"}
TABLE = "t,x,y,angle\n0,0,0,0\n\n1, 0.5 ,0,90\n2,1,0.25,90\n"


def plane(folder: Path, unit: str = "rad", **motion: Any) -> Path:
    file = folder / "scene.toml"
    file.write_text(toml(unit=unit, **PLANE, obstacles=[OVAL, RECTANGLE | motion]))
    return file


def space(folder: Path, unit: str = "rad") -> Path:
    file = folder / "scene.toml"
    file.write_text(toml(unit=unit, **SPACE, obstacles=[IN_SPACE]))
    return file


def moving(file: Path, number: int = -1) -> MovingObstacle:
    obstacle = read_scenario(file).problem().criteria.obstacles[number]
    assert isinstance(obstacle, MovingObstacle)
    return obstacle


def refusal(file: Path) -> str:
    return line_of(lambda: read_scenario(file).problem())


def test_a_velocity(tmp_path: Path) -> None:
    obstacle = moving(plane(tmp_path, velocity=[-1.0, 0.5], margin_rate=0.1))
    assert obstacle.still == Rectangle((2.0, 0.5), (0.2, 0.4), 0.0)
    assert obstacle.at(2.0).place == pytest.approx((0.0, 1.5))
    assert obstacle.margin_rate == 0.1


@pytest.mark.parametrize(("unit", "quarter"), [("rad", "1.5707963267948966"), ("deg", "90")])
def test_the_frame_of_a_table_moves_and_turns(tmp_path: Path, unit: str, quarter: str) -> None:
    (tmp_path / "cart.csv").write_text(TABLE.replace("90", quarter))
    obstacle = moving(plane(tmp_path, unit, motion="cart.csv"))
    # at t = 2 the frame stands at (1, 0.25), turned by 90 degrees: its (2, 0.5) is at (1 - 0.5, 0.25 + 2)
    assert obstacle.at(2.0).place == pytest.approx((0.5, 2.25))
    assert obstacle.at(7.0).place == pytest.approx((0.5, 2.25))
    assert obstacle.at(0.0).place == pytest.approx((2.0, 0.5))


def test_degrees_are_not_meant_for_heights(tmp_path: Path) -> None:
    """In space the fourth column is z."""
    (tmp_path / "box.csv").write_text("t,x,y,z\n0,1,0,1\n1,1,1,2\n")
    assert read_scenario(space(tmp_path, "deg")).obstacles[0].motion_rows == [
        [0.0, 1.0, 0.0, 1.0],
        [1.0, 1.0, 1.0, 2.0],
    ]


def test_quaternions_of_a_table(tmp_path: Path) -> None:
    half = repr(float(np.sqrt(0.5)))
    (tmp_path / "box.csv").write_text(f"t,x,y,z,qx,qy,qz,qw\n0,1,0,0.5,0,0,0,1\n1,1,0,0.5,0,0,-{half},-{half}\n")
    obstacle = moving(space(tmp_path))
    assert isinstance(obstacle.still, Box)
    assert obstacle.at(1.0).bounding_box() == pytest.approx(np.array([[0.95, -0.1, 0.4], [1.05, 0.1, 0.6]]))


def test_what_is_stored_is_complete_without_files(tmp_path: Path) -> None:
    (tmp_path / "cart.csv").write_text(TABLE)
    scenario = read_scenario(plane(tmp_path, "deg", motion="cart.csv", margin_rate=0.05))
    again = parse_scenario(json.loads(scenario.as_text()))
    assert again.obstacles == scenario.obstacles
    assert again.problem().criteria.obstacles == scenario.problem().criteria.obstacles
    stored = scenario.table()["obstacles"]
    assert set(stored[0]) == {"shape", "center", "semi_axes", "angle"}  # which stands still: nothing of a motion
    assert stored[1]["motion_rows"][1] == [1.0, 0.5, 0.0, pi / 2.0]


STATED: list[tuple[dict[str, Any], str]] = [
    ({"motion": "gone.csv"}, "obstacles.1.motion: "),
    ({"motion": "../scene.toml"}, "lies outside the scenario's folder; --allow-outside-files allows that"),
    ({"motion": "/etc/passwd"}, "lies outside the scenario's folder"),
]


def test_what_is_wrong_with_a_key(tmp_path: Path) -> None:
    (tmp_path / "cart.csv").write_text(TABLE)
    for motion, expected in STATED:
        message = refusal(plane(tmp_path, **motion))
        assert message.startswith(f"{tmp_path / 'scene.toml'}: ") or "obstacles.1" in message.split(": ")[0]
        assert expected in message, motion


def test_turns_that_a_spline_cannot_follow() -> None:
    """Each row is 80 degrees from the one before, to and fro about other axes: between them the spline is no turn."""
    angles, axes = np.deg2rad([0.0, 88.0, 0.0, 88.0, 0.0]) / 2.0, [0, 0, 0, 1, 1]
    turns = np.zeros((5, 4))
    turns[np.arange(5), axes], turns[:, 3] = np.sin(angles), np.cos(angles)
    times = [0.0, 1.0, 1.001, 1.002, 3.0]
    with pytest.raises(InvalidProblem, match="turned too far from each other"):
        Tabulated.through(times, np.zeros((5, 3)), turns)


def test_quaternions_take_the_nearer_sign() -> None:
    turns = np.array([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -0.6, -0.8], [0.0, 0.0, 0.6, 0.8]])
    assert as_numbers(turns).tolist() == [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.6, 0.8], [0.0, 0.0, 0.6, 0.8]]


def test_too_many_rows(tmp_path: Path) -> None:
    rows = [f"{n},0,0" for n in range(MOST_MOTION_ROWS + 1)]
    (tmp_path / "cart.csv").write_text("\n".join(["t,x,y", *rows]))
    message = refusal(plane(tmp_path, motion="cart.csv"))
    assert f"cart.csv line {MOST_MOTION_ROWS + 2}: more than {MOST_MOTION_ROWS} rows" in message
    again = [[float(n), 0.0, 0.0] for n in range(MOST_MOTION_ROWS)]
    table = {"shape": "box", "center": [3.0, 0.0], "size": [0.1, 0.1], "motion_rows": again}
    content = read_scenario(plane(tmp_path)).table() | {"obstacles": [table] * 4}
    with pytest.raises(ScenarioError, match=r"obstacles\.3\.motion: more than 600 rows in all tables"):
        parse_scenario(content).problem()


class Round(ObstacleSection):
    """A shape of a plug-in, which knows nothing of motions."""

    radius: float

    def build(self) -> Rectangle:
        """A square of that size."""
        return Rectangle((1.5, 1.0), (self.radius, self.radius), 0.0)


def test_a_shape_of_a_plugin_moves_too(tmp_path: Path) -> None:
    content = read_scenario(plane(tmp_path)).table()
    shape = f"{__name__}:Round"
    content["obstacles"] = [{"shape": shape, "radius": 0.1, "velocity": [0.5, 0.0]}]
    [obstacle] = parse_scenario(content).problem().criteria.obstacles
    assert isinstance(obstacle, MovingObstacle)
    assert obstacle.at(1.0).place == pytest.approx((2.0, 1.0))


CENTER = (0.3, 0.1, 0.5)


@settings(max_examples=50)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda n: np.linalg.norm(n) > 1e-150))
def test_a_half_space_is_below_its_normal(normal: tuple[float, float, float]) -> None:
    [solid] = build_obstacles([read_obstacle({"shape": "half-space", "center": CENTER, "normal": normal})], 7)
    away = np.array(normal) / np.linalg.norm(normal)
    assert solid.distance_of(tuple(CENTER + 0.7 * away), CENTER) == pytest.approx(0.7, abs=1e-9)
    across = np.cross(away, np.roll(away, 1) + 0.1)
    assert solid.distance_of(tuple(CENTER + across - 0.7 * away), CENTER) == pytest.approx(-0.7, abs=1e-9)
