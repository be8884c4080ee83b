"""``tp.replan`` of plans, with scenes of every form."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import tpbso_casadi as tp

ARM = tp.robot([0.7, 0.6], max_speed=2.0, max_acceleration=8.0)
START, GOAL = tp.Joints((0.0, 0.5)), tp.Joints((1.5, 0.3))


@cache
def planned() -> tp.Plan:
    return tp.plan(ARM, start=START, goal=GOAL, solver="pso", evaluations=100, polish=False)


def test_a_plan_goes_on_where_nothing_has_changed() -> None:
    plan = planned()
    for scene in ([], plan, plan.scenario):
        step = tp.replan(plan, 0.2, scene)
        assert step.certified
        assert step.trajectory.duration == pytest.approx(plan.duration - 0.2, abs=1e-6)
        np.testing.assert_allclose(step.trajectory(0.0), plan.trajectory(0.2), atol=1e-12)
    assert tp.replan(plan.trajectory, 0.2, plan).certified


def test_a_wall_in_the_way_is_not_touched() -> None:
    wall = (tp.Rectangle(center, (0.05, 0.05)) for center in [(0.85, 0.85)])
    step = tp.replan(planned(), 0.1, wall)
    assert step.certified
    assert step.kind in {"new", "stop"}
    joints = ARM.model.skeleton(step.trajectory.at(step.trajectory.times(500)))
    assert np.abs(joints - [0.85, 0.85]).max(axis=2).min() > 0.025  # no joint enters it


@pytest.mark.parametrize(
    ("at_time", "scene", "expected"),
    [
        (9.0, [], "at_time: 9 s is not within the motion"),
        (0.1, [3], "obstacles: obstacle 1: int is not an Obstacle"),
        (0.1, tp.builtin("time-3"), "arm: not the one of the motion"),
    ],
)
def test_mistakes_take_one_line(at_time: float, scene: object, expected: str) -> None:
    with pytest.raises(ValueError, match=f"^{expected}"):
        tp.replan(planned(), at_time, scene)  # type: ignore[arg-type]
