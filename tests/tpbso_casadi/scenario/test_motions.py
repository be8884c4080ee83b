"""Which motion and objective a scenario is planned with: by default, by its keys, by what it says; and places."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from problems.tasks import Joints, Position
from tpbso_casadi import ScenarioError, builtin, parse_scenario
from tpbso_casadi.cli.commands.solve import parser, with_options

ARM = {"link_lengths": [0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
POINTS = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.0]}
PATH = {"kind": "path", "accuracy": 0.05, "points": [[1.0, 0.0], [1.0, 0.5], [0.5, 1.0]]}
POSTURES = POINTS | {"start": {"joints": [0.1, 0.2, 0.3]}, "goal": {"joints": [0.5, 0.2, 0.1]}}
LEAVING = POSTURES | {"start_acceleration": [1.0, 0.0, 0.0]}
VIA = {"via": [{"joints": [0.1, 0.2, 0.3]}]}


def parsed(task: dict[str, Any], **model: Any) -> Any:
    return parse_scenario({"arm": ARM, "task": task, "model": model})


VIA_TIMES = POSTURES | VIA | {"kind": "via-times", "via": [{"joints": [0.3, 0.4, 0.0]}]}


MOTIONS: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    (POINTS, {}, "spline"),
    (POINTS, {"pieces": 8}, "spline"),
    (POINTS, {"motion": "paper"}, "paper"),
    (POINTS, {"formulation": "paper"}, "paper"),
    (POINTS, {"formulation": "reduced"}, "paper"),
    (POINTS | {"segment_time": [0.2, 1.0]}, {}, "paper"),
    (POINTS | VIA, {}, "spline"),
    (PATH, {}, "spline"),
    (PATH, {"knots": 3}, "paper"),
    (LEAVING, {}, "time-spline"),
    (POSTURES | {"start_acceleration": [1.0, 0.0, 0.0], "start_velocity": [0.1, 0.0, 0.0]}, {}, "time-spline"),
    (VIA_TIMES, {"formulation": "paper"}, "via-times"),
    (POSTURES | {"total_time": [0.5, 3.0]}, {"motion": "time-spline", "pieces": 4}, "time-spline"),
]


def test_the_motion_follows_from_the_keys() -> None:
    for task, model, motion in MOTIONS:
        scenario = parsed(task, **model)
        assert scenario.model.motion == motion
        assert parse_scenario(scenario.table()) == scenario


RETIMED: list[tuple[dict[str, Any], dict[str, Any], bool]] = [
    (POINTS, {}, True),
    (POINTS, {"motion": "paper"}, False),
    (POINTS | {"objective": "length"}, {"motion": "paper"}, True),
    (POINTS | {"objective": "rotation"}, {"motion": "paper", "retime": False}, False),
    (POINTS, {"motion": "paper", "retime": True}, True),
]


def test_plans_are_timed_anew_where_their_objective_leaves_time_free() -> None:
    for task, model, retime in RETIMED:
        assert parsed(task, **model).model.retime is retime


def test_a_spline_over_time_keeps_its_timing() -> None:
    scenario = parsed(POSTURES | {"objective": "length"}, motion="time-spline")
    assert not scenario.model.retime
    assert scenario.model.formulation == "reduced"


@pytest.mark.parametrize(
    ("task", "model", "message"),
    [
        ({"interpolation": "cubc"}, {}, "task.interpolation: .*cubic"),
        ({"interval_time": [2.0, 1.0]}, {}, "task.interval_time: the first number has to be less"),
        ({"interpolation": "3-5-3"}, {}, "task.interpolation: '3-5-3' passes 2 vias, not 1"),
        ({"goal": [0.5, 1.0]}, {}, "task.goal: kind 'via-times' needs joint values"),
        ({}, {"motion": "spline"}, "model.motion: kind = 'via-times' is planned with 'via-times'"),
        ({}, {"pieces": 4}, "model.pieces: needs motion"),
    ],
)
def test_interval_times_that_cannot_be_searched_are_refused(
    task: dict[str, Any], model: dict[str, Any], message: str
) -> None:
    assert parsed(VIA_TIMES).model.formulation == "reduced"
    with pytest.raises(ScenarioError, match=message):
        parsed(VIA_TIMES | task, **model).problem()


def test_places_of_all_kinds_are_read_and_written_back() -> None:
    task = POINTS | {
        "start": {"joints": [0.1, 0.2, 0.3]},
        "goal": [[0.5, 1.0], {"position": [0.4, 1.0], "within": 0.1}, {"joints": [0.0, 0.5, 0.5]}],
        "via": [[0.9, 0.2], {"joints": [0.2, 0.3, 0.4]}],
    }
    scenario = parsed(task)
    content = scenario.table()
    assert {key: content["task"][key] for key in ("start", "goal", "via")} == {
        key: task[key] for key in ("start", "goal", "via")
    }
    assert parse_scenario(content) == scenario
    assert scenario.task.start == Joints((0.1, 0.2, 0.3))
    assert scenario.task.goal[:2] == [Position((0.5, 1.0)), Position((0.4, 1.0), 0.1)]


def test_two_plain_numbers_are_a_point_and_a_list_of_points_are_goals() -> None:
    assert parsed(POINTS).task.goal == Position((0.5, 1.0))
    assert parsed(POINTS | {"goal": [[0.5, 1.0]]}).task.goal == [Position((0.5, 1.0))]


def test_degrees_are_read_in_places_and_velocities() -> None:
    task = POINTS | {"start": {"joints": [180.0, 0.0, 0.0]}, "goal": [{"joints": [90.0, 0.0, 0.0]}]}
    task |= {"goal_velocity": [90.0, 0.0, 0.0]}
    scenario = parse_scenario({"unit": "deg", "arm": ARM, "task": task})
    assert scenario.task.start.values[0] == pytest.approx(3.141592653589793)
    assert scenario.task.goal[0].values[0] == pytest.approx(1.5707963267948966)
    assert scenario.task.goal_velocity[0] == pytest.approx(1.5707963267948966)


def test_degrees_are_read_in_the_places_of_several_arms() -> None:
    """Places by the arms' names stayed as they were written: 90 degrees were read as 90 rad."""
    robots = {"left": {"model": "ur5e"}, "right": {"model": "ur5e", "base": {"position": [1.5, 0.0, 0.0]}}}
    pose = {"position": [1.0, 0.3, 0.4], "quaternion": [1.0, 0.0, 0.0, 0.0], "free": "z", "turn": [-30.0, 30.0]}
    postures = {"left": {"joints": [90.0] * 6}, "right": {"joints": [-45.0] * 6}}
    task = {"kind": "point-to-point", "start": postures, "goal": {"left": {"joints": [60.0] * 6}, "right": pose}}
    stated = parse_scenario({"unit": "deg", "robots": robots, "task": task}).task.table()
    assert stated["start"]["joints"] == pytest.approx(np.deg2rad([90.0] * 6 + [-45.0] * 6))
    assert stated["goal"]["left"]["joints"] == pytest.approx(np.deg2rad([60.0] * 6))
    assert stated["goal"]["right"]["turn"] == pytest.approx(np.deg2rad([-30.0, 30.0]))


def options(*arguments: str) -> Any:
    return parser().parse_args(list(arguments))


def test_the_command_line_overrides_what_the_keys_would_say() -> None:
    stated = parsed(POINTS)
    assert with_options(stated, options("--motion", "paper")).model.motion == "paper"
    assert with_options(stated, options("--motion", "paper")).model.retime is False
    assert with_options(stated, options("--motion", "paper", "--retime")).model.retime is True
    assert with_options(stated, options("--no-retime")).model.retime is False
    assert with_options(stated, options("--formulation", "paper")).model.motion == "paper"
    assert with_options(builtin("time-3"), options("--objective", "length")).model.retime is True
    with pytest.raises(ScenarioError, match=r"model\.formulation: 'paper' needs motion = 'paper'"):
        with_options(parsed(POINTS, motion="spline"), options("--formulation", "paper"))


def test_another_number_of_links_does_not_fit_given_joints() -> None:
    stated = parsed(POINTS | {"start": {"joints": [0.0, 0.0, 0.0]}})
    with pytest.raises(ScenarioError, match=r"task\.start: 3 joints for a robot of 4"):
        with_options(stated, options("--links", "4")).problem()


MASSIVE = {"kind": "point-to-point", "start": [0.6, -0.3], "goal": [0.3, 0.6]}


def weighed(objective: Any, task: dict[str, Any] | None = None, **arm: Any) -> Any:
    links = {"link_lengths": [0.4] * 3, "max_speed": 4.0, "max_acceleration": 40.0, "link_masses": 2.0, **arm}
    return parse_scenario({"arm": links, "task": {**(task or MASSIVE), "objective": objective}})


@pytest.mark.parametrize("task", [MASSIVE, PATH])
@pytest.mark.parametrize("motion", ["paper", "spline"])
def test_a_table_of_weights_is_a_sum(task: dict[str, Any], motion: str) -> None:
    stated = weighed({"time": 1.0, "energy": 0.02}, task)
    problem = stated.replaced(model=stated.model.replaced(motion=motion)).problem()
    assert [(weight, each.name) for weight, each in problem.criteria.objective.terms] == [
        (1.0, "time"),
        (0.02, "energy"),
    ]
    assert stated.table()["task"]["objective"] == {"time": 1.0, "energy": 0.02}


def test_one_entry_of_weight_one_is_the_objective_itself() -> None:
    assert weighed({"time": 1.0}).problem().criteria.objective.name == "time"
    assert weighed({"time": 2.0}).problem().criteria.objective.name == "2 time"
    assert weighed({"rotation": 1.0, "length": 1.0}).model.retime
    assert not weighed({"time": 1.0, "energy": 1.0}, MASSIVE | {"segment_time": [0.1, 9.0]}).model.retime


def test_a_plugin_may_be_weighed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = "from problems import Objective\nclass Steps(Objective):\n    name, symbol, unit = 'steps', 'n', '1'\n"
    (tmp_path / "weighed_plugin.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    stated = weighed({"time": 1.0, "weighed_plugin:Steps": 0.5})
    assert stated.problem().criteria.objective.name == "time + 0.5 steps"
    assert stated.plugins == ["weighed_plugin:Steps"]
