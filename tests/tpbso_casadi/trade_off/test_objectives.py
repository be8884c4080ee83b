"""Scenarios of the points of a front: those of both objectives are timed alike."""

from __future__ import annotations

from typing import Any

import pytest

import tpbso_casadi as tp
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import overridden, parse_scenario
from tpbso_casadi.trade_off import ENDS, Objectives
from tpbso_casadi.trade_off.front import Request, Scalarisation

PLACED = (*ENDS, (1.0, 0.5))


@pytest.mark.parametrize(
    ("objectives", "stated", "anew"),
    [
        (("time", "length"), {}, True),  # the shortest path leaves its time free
        (("rotation", "time"), {}, True),
        (("rotation", "length"), {}, True),
        (("time", "length"), {"retime": False}, False),
        (("time", "length"), {"motion": "spline"}, True),
        (("time", "length"), {"motion": "time-spline"}, False),
    ],
)
def test_points_of_a_front_are_timed_alike(objectives: tuple[str, str], stated: dict[str, Any], anew: bool) -> None:
    content = tp.builtin("time-2").model_dump()
    content["model"] = stated
    if "motion" in stated:
        content["task"]["elbow"] = "free"
    front = Objectives(parse_scenario(content), objectives)
    asked = [front.asked_for(Request(scalarisation=Scalarisation(weights))) for weights in PLACED]
    assert [scenario.model.retime for scenario in asked] == [anew] * len(PLACED)


def test_the_plan_for_the_least_time_of_the_papers_motions_is_the_fastest() -> None:
    scenario = overridden(tp.builtin("time-2"), solver={"evaluations": 60}, polish=False)
    front = Objectives(scenario, ("time", "length"))
    fastest, shortest = (plan(front.asked_for(Request(scalarisation=Scalarisation(end)))).motion for end in ENDS)
    assert fastest.feasible and shortest.feasible
    assert fastest.trajectory.duration < shortest.trajectory.duration
