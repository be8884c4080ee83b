"""The scenario file: defaults, round trips, and one clear line for everything that is wrong."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path
from typing import Any

import pytest
from helpers.running import REMOVED, changed, line_of, scenario_error

from tpbso_casadi import Scenario, builtin, parse_scenario, read_scenario
from tpbso_casadi.scenario.cases import TITLES

ARM = {"link_lengths": [0.5, 0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
POINT = {
    "arm": ARM,
    "task": {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]},
    "obstacles": [{"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}],
}
PATH = {"arm": ARM, "task": {"kind": "path", "accuracy": 0.05, "points": [[1.0, 0.0], [1.0, 0.5], [0.5, 1.0]]}}
STAR = {"arm": ARM, "task": {"kind": "path", "accuracy": 0.05, "shape": "pentagram", "radius": 0.9}}
UP = POINT | {"task": POINT["task"] | {"elbow": "up"}}


def nested(depth: int) -> Any:
    """A list in a list in a list."""
    value: Any = []
    for _ in range(depth):
        value = [value]
    return value


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


WRONG: list[tuple[dict[str, Any], str, object, str]] = [
    (POINT, "arm.max_sped", 1.0, "arm.max_sped: .*did you mean max_speed"),
    (POINT, "robbot", {}, "robbot: unknown key; did you mean robot"),
    (POINT, "task.radius", 1.0, "task.radius: "),
    (POINT, "arm.max_speed", REMOVED, "arm.max_speed: .*missing"),
    (POINT, "arm", REMOVED, "arm: .*missing"),
    (POINT, "task.goal", REMOVED, "task.goal: .*missing"),
    (POINT, "task.kind", REMOVED, "task: needs kind"),
    (POINT, "task.kind", "dance", "task: needs kind"),
    (POINT, "arm.link_lengths", "long", "arm.link_lengths: "),
    (POINT, "arm.link_lengths", [0.5, "1"], r"arm.link_lengths.1: "),
    (POINT, "arm.link_lengths", [1.0], "arm.link_lengths: "),
    (POINT, "arm.link_lengths", [0.5, 0.0, 0.5], r"arm.link_lengths.1: .*greater than 0"),
    (POINT, "arm.link_lengths", [0.5, -0.5, 0.5], r"arm.link_lengths.1: .*greater than 0"),
    (POINT, "arm.link_lengths", [0.5, float("nan")], r"arm.link_lengths.1: "),
    (POINT, "arm.max_speed", float("inf"), "arm.max_speed.*: "),
    (POINT, "arm.max_speed", True, "arm.max_speed.*: "),
    (POINT, "arm.max_speed", [1.0, 2.0], "arm.max_speed: 2 values for 4 links"),
    (POINT, "arm.joint_limits", [[0.0, 1.0]] * 3, "arm.joint_limits: 3 values for 4 links"),
    (POINT, "arm.joint_limits", [[1.0, 0.0]] * 4, "arm.joint_limits: joint 1"),
    (
        UP,
        "arm.joint_limits",
        [[-3.0, 3.0], [-1.0, -0.5], *[[-3.0, 3.0]] * 2],
        "arm.joint_limits: joint 2: with the elbow up",
    ),
    (POINT, "task.goal", [3.0, 0.0], "task.goal: .*3 m from the base, out of reach.*2 m"),
    (POINT, "task.goal", [0.0, float("nan")], "task.goal.1: "),
    (POINT, "task.goal", [1.0], "task.goal"),
    (POINT, "task.start", [0.8, 0.8], "task.start: .*inside the obstacle"),
    (POINT, "task.objective", "beauty", "task.objective: .*time"),
    (POINT, "task.elbow", "left", "task.elbow: "),
    (POINT, "task.segment_time", [1.0, 0.5], "task.segment_time: "),
    (POINT, "obstacles.0.center", [0.1, 0.0], "obstacles: the base lies inside"),
    (POINT, "obstacles.0.semi_axes", [0.0, 1.0], "obstacles.0.semi_axes.0: "),
    (POINT, "model.samples", 1, "model.samples: "),
    (POINT, "model.samples", 50.5, "model.samples: "),
    (POINT, "model.formulation", "poem", "model.formulation: "),
    (POINT, "solver.seed", -1, "solver.seed: "),
    (POINT, "solver.evaluations", 0, "solver.evaluations: "),
    (POINT, "solver.time_limit", 0.0, "solver.time_limit: "),
    (POINT, "arm.max_speed", 1e308, "arm.max_speed: .*less than or equal to 1"),
    (POINT, "arm.max_speed", 5e-324, "arm.max_speed: 4.94066e-324 is below the smallest positive number, 1e-12"),
    (POINT, "arm.max_speed", "fast", "arm.max_speed: a number is needed, not 'fast'"),
    (POINT, "arm.max_speed", float("inf"), "arm.max_speed: a finite number is needed, not inf"),
    (POINT, "arm.link_lengths", 3, "arm.link_lengths: a list is needed, not 3"),
    (POINT, "arm.link_lengths", [0.5] * 3000, "arm.link_lengths: .*at most 100 items"),
    (POINT, "task.start", [date(1979, 5, 27), 0.0], "task.start.0: a number is needed, not 1979-05-27"),
    (POINT, "task.start", [1e300, 0.0], "task.start.0: .*less than or equal to 1"),
    (POINT, "task.start", [10**400, 0.0], "task.start.0: "),
    (
        POINT,
        "task.start",
        [10**5000, 0.0],
        "task.start.0: .*not a number of thousands of digits",
    ),
    (POINT, "task.start", nested(5000), "task.start.1: missing key"),
    (POINT, "task.start", [nested(150), 0.0], "task.start.0: a number is needed"),
    (POINT, "task.elbow", "\udcff", "task.elbow: .*"),
    (POINT, "task.objective", "a" * 5000, "task.objective: a shorter word is needed, not 'aaa"),
    (POINT, "task.objective", "a{b}:c", "task.objective: cannot load objective 'a{b}:c'"),
    (POINT, "task.kind", "a{b}:c", "task: cannot load task 'a{b}:c'"),
    (POINT, "task", 3, "task: needs kind"),
    (POINT, "model", 3, "model: a table is needed"),
    (POINT, "model.samples", 50.5, "model.samples: a whole number is needed, not 50.5"),
    (POINT, "model.samples", 10_001, "model.samples: "),
    (changed(POINT, "arm.link_lengths", [0.02] * 100), "model.samples", 1000, "model.samples: .*at most 500"),
    (POINT, "obstacles", POINT["obstacles"] * 1001, "obstacles: .*at most 1000 items"),
    (POINT, "solver.seed", 2**63, "solver.seed: "),
    (POINT, "solver.population", 10**30, "solver.population: "),
    (POINT, "solver.polish_starts", 10**30, "solver.polish_starts: "),
    (POINT, "solver.evaluations", 10**10, "solver.evaluations: "),
    (POINT, "solver.time_limit", 1e308, "solver.time_limit: "),
    (
        PATH,
        "task.points",
        [[1.0, 0.001 * i] for i in range(1001)],
        "task.count: a path of 1001 points .*at most 1000",
    ),
    (PATH, "model.redundancy_values", 101, "model.redundancy_values: "),
    (STAR, "task.count", 1001, "task.count: "),
    (PATH, "task.accuracy", 0.0, "task.accuracy: "),
    (PATH, "task.accuracy", REMOVED, "task.accuracy: .*missing"),
    (PATH | {"model": {"motion": "paper"}}, "arm.link_lengths", [1.0, 1.0], "arm.link_lengths: .*at least 3 links"),
    (PATH, "task.points", [[1.0, 0.0]], "task.points: .*at least 2 points"),
    (PATH, "task.points", [[1.0, 0.0], [1.0, 0.0]], r"task.points: points\[0\] and points\[1\] are the same"),
    (PATH, "task.points", [[1.0, 0.0], [3.0, 0.0]], r"task.points: points\[1\].*3 m from the base.*2 m"),
    (PATH, "task.points", [[1.0, 0.0], [1.0]], "task.points"),
    (PATH, "task.points", "letter.csv", "task.points: .*has not been read"),
    (PATH, "task.shape", "heart", "task: needs kind"),
    (PATH, "task.count", 1, "task.count: "),
    (PATH, "model.knots", 1, "model.knots: "),
    (PATH, "model.knot_redundancy", "some", "model.knot_redundancy: "),
    (STAR, "task.radius", REMOVED, "task.radius: .*missing"),
    (STAR, "task.radius", -1.0, "task.radius: .*greater than 0"),
    (STAR, "task.count", 3, "task.count: "),
    (STAR, "task.waves", 3, "task.waves: "),
]


def test_what_is_wrong_is_named() -> None:
    for content, key, value, expected in WRONG:
        error = scenario_error(changed(content, key, value))
        assert re.match(expected, error), error


def test_too_close_to_the_base() -> None:
    hollow = changed(POINT, "arm.link_lengths", [1.5, 0.3, 0.2])
    assert "task.goal: (0.5, 0.5)" in scenario_error(changed(hollow, "task.goal", [0.5, 0.5]) | {"obstacles": []})
    assert "too close: the arm reaches from 1 m on" in scenario_error(
        changed(hollow, "task.start", [0.5, 0.5]) | {"obstacles": []}
    )


SOLVERS: list[tuple[dict[str, Any], str]] = [
    ({"name": "bos"}, "solver.name: no solver 'bos'; did you mean bso?"),
    ({"settings": {"lamda_": 0.5}}, "solver.settings.lamda_: bso has no such setting; did you mean lambda_?"),
    ({"settings": {"lambda_": 1.5}}, "solver.settings: lambda_ = 1.5 is not in [0, 1]"),
    ({"settings": {"c1": "much"}}, "solver.settings.c1: a number is needed, not 'much'"),
    ({"settings": {"antenna_sign": 1}}, "solver.settings.antenna_sign: a word is needed, not 1"),
    (
        {"name": "ga", "settings": {"tournament": 2.5}},
        "solver.settings.tournament: a whole number is needed, not 2.5",
    ),
    ({"settings": {"c1": 1e308}}, "solver.settings.c1: 1e+308 is not zero, nor between 1e-12 and 1e+12"),
    ({"settings": {"population": 10**30}}, "solver.settings.population: 1000"),
    (
        {"name": "lshade", "settings": {"memory_size": 10**9}},
        "solver.settings.memory_size: 1000000000 is more than",
    ),
    ({"population": 1}, "solver.settings: BSO needs a population of at least 2, not 1"),
    ({"name": "ipopt", "population": 20}, "solver.settings.population: ipopt has no such setting"),
    ({"name": "ipopt", "polish_starts": 2}, "solver.polish_starts: ipopt has nothing to polish"),
    ({"name": "ipopt", "settings": {"tolerance": 0.0}}, "solver.settings: tolerances are positive"),
]


def test_what_is_wrong_with_a_solver() -> None:
    for solver, expected in SOLVERS:
        error = line_of(parse_scenario(POINT | {"solver": solver}).solver.build)
        assert error.startswith(expected), error


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
    ("1,0\ninf,1\n", "is not finite"),
    ("1,0\n1,1e13\n", "larger than 1e+12"),
    ("x,y\n1,0\n", "at least 2 points"),
    ("", "at least 2 points"),
    ("1,0\n1,0\n", r"points[0] and points[1] are the same"),
    ("1,0\n1,1\n3,1\n", "points[2] = (3.0, 1.0) is 3.16228 m from the base, out of reach: the arm reaches 3 m"),
]


def test_what_is_wrong_with_a_file_of_points(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(FILE)
    for text, expected in POINTS:
        if text is not None:
            (tmp_path / "way.csv").write_text(text)
        error = line_of(lambda: read_scenario(tmp_path / "mine.toml").problem())
        assert expected in error and "task.points" in error
