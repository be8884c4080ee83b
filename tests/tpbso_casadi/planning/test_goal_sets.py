"""Sets of goals with costs: which goal is reached, in space, in the plane and in sequences; what is refused."""

from __future__ import annotations

from typing import Any

import pytest

import tpbso_casadi as tp

UR5E = tp.robot("ur5e")
START = [0.0, -1.2, 1.5, -1.9, -1.5, 0.3]
NEAR, FAR = ([turn, *START[1:]] for turn in (0.5, -0.6))
DOWN = [1.0, 0.0, 0.0, 0.0]


def number(plan: tp.Plan) -> int:
    """The number of the goal that is reached, from 1 on."""
    (line,) = plan.taken
    return int(line.partition("number ")[2].partition(" of ")[0])


@pytest.mark.parametrize(
    "goals",
    [
        [{"joints": NEAR}, {"joints": FAR}],
        [{"position": [0.4, y, 0.4], "quaternion": DOWN} for y in (0.3, -0.3)],
    ],
    ids=["joints", "poses"],
)
def test_a_goal_costs_as_much_as_its_motion_saves(goals: list[dict[str, Any]]) -> None:
    first, second = (tp.plan(UR5E, start=START, goal=[goal]).duration for goal in goals)
    saved = second - first
    assert saved > 0.05
    for cost, reached in ((0.0, 1), (0.9 * saved, 1), (1.1 * saved, 2)):
        stated = [goals[0] | {"cost": cost}, goals[1]]
        plan = tp.plan(UR5E, start=START, goal=stated)
        assert number(plan) == reached and plan.certified
        assert plan.duration == pytest.approx((first, second)[reached - 1], rel=1e-3)
        assert number(tp.sequence(UR5E, start=START, stages=[tp.MoveTo(stated)])) == reached


@pytest.mark.slow
def test_in_the_plane_goals_cost_too() -> None:
    arm = tp.robot([0.5, 0.4, 0.3], max_speed=2.0, max_acceleration=10.0)
    goals = [{"position": [0.6, 0.5], "cost": 1.0}, {"position": [0.5, 0.6]}]
    for expensive, reached in ((0, 2), (1, 1)):
        stated = [goal | {"cost": float(index == expensive)} for index, goal in enumerate(goals)]
        assert number(tp.plan(arm, start={"joints": [0.3, 0.9, -0.4]}, goal=stated, evaluations=300)) == reached


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"goal": [{"joints": NEAR, "cost": -1.0}, {"joints": FAR}]}, r"goal\[0\].cost: .* greater than or equal to 0"),
        (
            {"goal": {"joints": NEAR}, "via": [{"joints": FAR, "cost": 1.0}]},
            "via: cost is that of a goal among several",
        ),
        ({"goal": [{"joints": NEAR, "cost": 1.0}], "motion": "time-spline"}, "goal: .*compares no costs"),
    ],
)
def test_costs_elsewhere_are_refused_in_one_line(keys: dict[str, Any], reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason) as caught:
        tp.plan(UR5E, start=START, **keys)
    assert "\n" not in str(caught.value)
