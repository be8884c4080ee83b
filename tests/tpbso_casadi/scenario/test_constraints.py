"""[[constraints]]: kinds of a hand beside expressions; degrees, both tables, what is stored, what is refused."""

from __future__ import annotations

import pickle
from math import radians
from typing import Any

import pytest

import tpbso_casadi as tp
from problems.limits import ExpressionLimit
from tpbso_casadi.scenario import Scenario, parse_scenario

ARM = {"link_lengths": [0.6, 0.5, 0.4], "max_speed": [4.0] * 3, "max_acceleration": [20.0] * 3}
TASK = {"kind": "point-to-point", "start": [0.9, 0.1], "goal": [0.4, 0.8]}
SPEED = {"kind": "tool speed", "max": 0.8}
UPRIGHT = {"kind": "upright", "axis": [1, 0], "toward": [0, 1], "tolerance": 30.0}
OWN = {"name": "floor", "lower": 0.0, "expression": "= tool[1]"}


def scenario(**keys: Any) -> Scenario:
    return parse_scenario({"arm": ARM, "task": TASK, **keys})


def test_both_tables_are_one_and_are_stored_as_one() -> None:
    found = scenario(model={"constraints": [OWN]}, constraints=[SPEED])
    assert [limit.name for limit in found.problem().criteria.limits[-2:]] == ["floor", "tool speed"]
    stored = found.table()
    assert "constraints" not in stored
    assert stored["model"]["constraints"] == [
        {"name": "floor", "unit": "1", "lower": 0.0, "upper": None, "expression": "= tool[1]"},
        {"kind": "tool speed", "max": 0.8, "name": "tool speed"},
    ]
    again = parse_scenario(stored)
    assert again == found == pickle.loads(pickle.dumps(found))


def test_angles_may_be_in_degrees() -> None:
    found = scenario(constraints=[UPRIGHT], unit="deg")
    [limit] = [limit for limit in found.problem().criteria.limits if limit.name == "upright"]
    assert isinstance(limit, ExpressionLimit) and limit.upper == pytest.approx((radians(30.0),))


def test_python_states_the_same() -> None:
    arm = tp.robot([0.6, 0.5, 0.4], max_speed=4.0, max_acceleration=20.0)
    own = tp.Constraint(lambda m: m.tool[1], lower=0.0, name="floor")
    region = tp.ToolRegion(center=(0.5, 0.5), size=(2.0, 1.0), angle=0.1, name="room")
    made = tp.scenario_of(arm, start=[0.9, 0.1], goal=[0.4, 0.8], constraints=[own, region, tp.ToolSpeed(max=0.8)])
    room, speed = made.table()["model"]["constraints"][1:]
    assert room == {"kind": "tool region", "center": [0.5, 0.5], "size": [2.0, 1.0], "angle": 0.1, "name": "room"}
    assert speed == {"kind": "tool speed", "max": 0.8, "name": "tool speed"}
    assert parse_scenario(made.table()) == made


def test_names_that_differ_are_there_beside_each_other() -> None:
    assert len(scenario(constraints=[SPEED, {**SPEED, "name": "slow"}]).model.constraints) == 2
