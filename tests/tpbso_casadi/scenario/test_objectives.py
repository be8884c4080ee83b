"""[task] objective: a name, or a table of weights; what is wrong with it in one line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tpbso_casadi.scenario import ScenarioError, parse_scenario

PATH = {"kind": "path", "points": [[0.5, 0.5], [0.6, 0.5], [0.7, 0.6]], "accuracy": 0.05}
MOVE = {"kind": "point-to-point", "start": [0.6, -0.3], "goal": [0.3, 0.6]}


def scenario(objective: Any, task: dict[str, Any] | None = None, **arm: Any) -> Any:
    links = {"link_lengths": [0.4] * 3, "max_speed": 4.0, "max_acceleration": 40.0, "link_masses": 2.0, **arm}
    return parse_scenario({"arm": links, "task": {**(task or MOVE), "objective": objective}})


@pytest.mark.parametrize("task", [MOVE, PATH])
@pytest.mark.parametrize("motion", ["paper", "spline"])
def test_a_table_of_weights_is_a_sum(task: dict[str, Any], motion: str) -> None:
    stated = scenario({"time": 1.0, "energy": 0.02}, task)
    problem = stated.model_copy(update={"model": stated.model.model_copy(update={"motion": motion})}).problem()
    assert [(weight, each.name) for weight, each in problem.objective.terms] == [(1.0, "time"), (0.02, "energy")]
    assert stated.model_dump(mode="json")["task"]["objective"] == {"time": 1.0, "energy": 0.02}


def test_one_entry_of_weight_one_is_the_objective_itself() -> None:
    assert scenario({"time": 1.0}).problem().objective.name == "time"
    assert scenario({"time": 2.0}).problem().objective.name == "2 time"
    assert scenario({"rotation": 1.0, "length": 1.0}, MOVE).model.retime
    assert not scenario({"time": 1.0, "energy": 1.0}, MOVE | {"segment_time": [0.1, 9.0]}).model.retime


@pytest.mark.parametrize(
    ("objective", "line"),
    [
        ({}, "task.objective: an objective with its weight is needed, such as { time = 1.0, energy = 0.02 }"),
        (
            {"tme": 1.0},
            "task.objective.tme: input should be 'time', 'rotation', 'length', 'energy' or 'work', not 'tme'",
        ),
        ({"time": -1.0}, "task.objective.time: input should be greater than 0, not -1.0"),
        ({"time": "a"}, "task.objective.time: a number is needed, not 'a'"),
        (3, "task.objective: a word is needed, not 3"),
        (["time"], "task.objective: a word is needed, not ['time']"),
    ],
)
def test_what_is_wrong_is_one_line(objective: Any, line: str) -> None:
    with pytest.raises(ScenarioError) as error:
        scenario(objective)
    assert str(error.value).startswith(line)
    assert "\n" not in str(error.value)


def test_what_the_problem_refuses_names_the_key() -> None:
    same = {"energy": 1.0, "problems.objectives:Energy": 2.0}
    with pytest.raises(ScenarioError, match=r"^task\.objective: the same objective twice: energy, energy$"):
        scenario(same).problem()
    with pytest.raises(ScenarioError, match=r"^task\.objective: 'energy' needs masses, and those of this robot"):
        scenario({"time": 1.0, "energy": 1.0}, link_masses=None).problem()


def test_a_plugin_may_be_weighed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "from problems import Objective\nclass Steps(Objective):\n    name, symbol, unit = 'steps', 'n', '1'\n"
    (tmp_path / "weighed_plugin.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    stated = scenario({"time": 1.0, "weighed_plugin:Steps": 0.5})
    assert stated.problem().objective.name == "time + 0.5 steps"
    assert stated.plugins == ["weighed_plugin:Steps"]
