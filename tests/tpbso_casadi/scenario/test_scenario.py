"""The scenario file: defaults, round trips, and files of points beside it."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.running import changed, line_of

from tpbso_casadi import Scenario, builtin, parse_scenario, read_scenario
from tpbso_casadi.scenario.cases import TITLES

ARM = {"link_lengths": [0.5, 0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
POINT = {
    "arm": ARM,
    "task": {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]},
    "obstacles": [{"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}],
}


def test_built_in_scenarios_survive_the_round_trip() -> None:
    for name in TITLES:
        scenario = builtin(name)
        assert isinstance(scenario, Scenario)
        assert parse_scenario(scenario.table()) == scenario


def test_defaults_are_filled_in() -> None:
    scenario = parse_scenario(POINT)
    assert scenario.task.elbow == "free"
    assert (scenario.model.samples, scenario.model.motion, scenario.model.retime) == (50, "spline", True)
    assert (scenario.solver.name, scenario.solver.seed, scenario.solver.budget().evaluations) == ("bso", 1, 30_000)
    assert scenario.problem().robot.limits.speed == (4.0,) * 4


def test_limits_may_be_given_for_each_joint() -> None:
    scenario = parse_scenario(changed(POINT, "arm.max_speed", [1.0, 2.0, 3.0, 4.0]))
    assert scenario.problem().robot.limits.speed == (1.0, 2.0, 3.0, 4.0)


FILE = """
[arm]
link_lengths = [1.0, 1.0, 1.0]
max_speed = 4.0
max_acceleration = 20.0
[task]
kind = "path"
accuracy = 0.05
points = "way.csv"
"""


@pytest.mark.parametrize(
    "text", ["x,y\n1,0\n1,1\n\n0,1.5\n", "\ufeffx, y\r\n1,0\r\n1,1\r\n0,1.5", " 1 , 0\n1,1\n0,1.5\n"]
)
def test_points_are_read_from_beside_the_scenario(tmp_path: Path, text: str) -> None:
    (tmp_path / "mine.toml").write_text(FILE)
    (tmp_path / "way.csv").write_text(text)
    scenario = read_scenario(tmp_path / "mine.toml")
    assert scenario.task.points == [(1.0, 0.0), (1.0, 1.0), (0.0, 1.5)]
    assert parse_scenario(scenario.table()) == scenario


POINTS: list[tuple[str | None, str]] = [
    (None, "cannot be read: No such file"),
    ("1,0\none,1\n", "way.csv line 2: two numbers x,y are needed"),
    ("1,0\n1\n", "way.csv line 2: two numbers x,y are needed"),
    ("1,0\n1,2,3\n", "way.csv line 2: two numbers x,y are needed"),
    ("1,0\n1,nan\n", "way.csv line 2: a number is not finite, or larger than 1e+12"),
    ("1,0\n1,1e13\n", "larger than 1e+12"),
    ("", "at least 2 points"),
    ("1,0\n1,1\n3,1\n", "points[2] = (3.0, 1.0) is 3.16228 m from the base, out of reach: the arm reaches 3 m"),
]


def test_what_is_wrong_with_a_file_of_points(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(FILE)
    for text, expected in POINTS:
        if text is not None:
            (tmp_path / "way.csv").write_text(text)
        error = line_of(lambda: read_scenario(tmp_path / "mine.toml").problem())
        assert expected in error and "task.points" in error
