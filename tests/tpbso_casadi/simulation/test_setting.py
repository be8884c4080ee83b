"""Where a simulation starts and what it visits."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest

from tests.helpers.simulations import content, setting
from tests.helpers.space_scenarios import space_scenario
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.simulation import SimulationSetting


def test_goal_and_start_are_visited_where_no_goals_are_stated() -> None:
    made = setting()
    assert made.start.values == (0.0, 0.0)
    assert [goal.values for goal in made.goals] == [(1.5, 0.0), (0.0, 0.0)]


def test_goals_are_visited_as_stated_and_in_degrees() -> None:
    stated = content(simulation={"goals": [{"joints": [90.0, 0.0]}, {"joints": [45.0, -90.0]}]})
    stated["task"] |= {"goal": {"joints": [30.0, 0.0]}}
    made = SimulationSetting.of(parse_scenario({"unit": "deg"} | stated))
    assert made.goals[0].values == pytest.approx((pi / 2, 0.0))
    assert made.goals[1].values == pytest.approx((pi / 4, -pi / 2))


def test_points_become_the_nearest_postures_there() -> None:
    made = setting(task={"start": {"joints": [0.0, 0.5]}}, simulation={"goals": [[1.0, 1.0]]})
    [goal] = made.goals
    q = np.array(goal.values)
    tip = np.array([np.cos(q[0]) + np.cos(q.sum()), np.sin(q[0]) + np.sin(q.sum())])
    assert tip == pytest.approx([1.0, 1.0])
    assert q == pytest.approx([0.0, pi / 2])  # the other elbow is at [pi / 2, -pi / 2]


def test_a_posture_that_is_blocked_is_not_taken() -> None:
    blocked = {"shape": "box", "center": [1.0, 0.5], "size": [0.2, 0.2]}
    made = setting(task={"start": {"joints": [0.0, -0.5]}}, obstacles=[blocked], simulation={"goals": [[1.0, 1.0]]})
    assert made.goals[0].values == pytest.approx((pi / 2, -pi / 2))


def test_redundant_links_are_turned_until_they_are_clear() -> None:
    stated = content(obstacles=[{"shape": "box", "center": [1.7, 0.6], "size": [0.8, 0.2]}])
    stated["arm"] |= {"link_lengths": [0.7, 0.7, 0.7]}
    stated["task"] |= {"start": {"joints": [-0.5, 0.0, 0.0]}, "goal": {"joints": [1.5, 0.0, 0.0]}}
    stated["simulation"] |= {"goals": [[1.7, 0.75]]}
    [goal] = SimulationSetting.of(parse_scenario(stated)).goals
    psi = np.cumsum(goal.values)
    assert 0.7 * np.array([np.cos(psi).sum(), np.sin(psi).sum()]) == pytest.approx([1.7, 0.75])


def test_poses_in_space_become_postures() -> None:
    stated = space_scenario() | {
        "simulation": {"goals": [{"position": [0.3, 0.45, 0.6]}, {"joints": [-0.5, 0.8, 0.6]}]}
    }
    made = SimulationSetting.of(parse_scenario(stated))
    assert made.goals[0].position(made.robot) == pytest.approx([0.3, 0.45, 0.6])


def test_the_scenario_of_a_simulation_is_complete() -> None:
    made = setting(task={"goal": [1.0, 1.0]})
    again = SimulationSetting.of(parse_scenario(made.scenario.model_dump(mode="json")))
    assert again.scenario == made.scenario
    assert again.goals == made.goals


@pytest.mark.parametrize(("task", "message"), [
    ({"via": [[1.0, 1.0]]}, "task.via: is for a move from rest to rest"),
    ({"start_velocity": [0.1, 0.0]}, "task.start_velocity: is for a move from rest to rest"),
    ({"start_acceleration": [0.1, 0.0]}, "task.start_acceleration: "),
    ({"goal": [[1.0, 1.0], [0.5, 1.0]]}, "task.goal: is a list; state in simulation.goals"),
    ({"goal": [1.0, 9.0]}, "task.goal: (1.0, 9.0) is 9.05539 m from the base"),
])  # fmt: skip
def test_other_moves_are_refused(task: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        setting(task=task)
    assert str(caught.value).startswith(message)


def test_other_tasks_are_refused() -> None:
    stated = content() | {"task": {"kind": "path", "accuracy": 0.05, "points": [[1.0, 1.0], [1.0, 0.5]]}}
    with pytest.raises(ScenarioError, match=r"^task.kind: 'path' is no move from one place to another$"):
        SimulationSetting.of(parse_scenario(stated))


def test_without_a_table_a_scenario_has_none() -> None:
    stated = content()
    del stated["simulation"]
    scenario = parse_scenario(stated)
    assert "simulation" not in scenario.model_dump()
    assert SimulationSetting.of(scenario).settings.ticks == 100


@pytest.mark.parametrize(("seconds", "every", "ticks"), [(1.0, 0.1, 10), (0.3, 0.1, 3), (1.0, 0.3, 3), (0.1, 0.1, 1)])
def test_whole_periods_are_simulated(seconds: float, every: float, ticks: int) -> None:
    assert setting(simulation={"seconds": seconds, "every": every}).settings.ticks == ticks
