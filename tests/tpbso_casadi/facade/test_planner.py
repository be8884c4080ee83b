"""A planner for many plans: the plans are those of ``tp.plan``."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

import tpbso_casadi as tp

BOX = {"shape": "box", "center": [0.5, 0.0, 0.1], "size": [0.5, 1.2, 0.2], "name": "table"}
ONE, TWO = [-0.9, -0.3, 0.0, -2.0, 0.0, 1.7, 0.8], [0.9, -0.3, 0.0, -2.0, 0.0, 1.7, 0.8]


def joints(values: list[float]) -> dict[str, Any]:
    return {"joints": values}


def same(one: tp.Plan, two: tp.Plan) -> None:
    np.testing.assert_array_equal(one.trajectory.coefficients, two.trajectory.coefficients)
    assert one.verdicts == two.verdicts


def test_it_plans_what_plan_does() -> None:
    planner = tp.Planner("panda", obstacles=[BOX], margin=0.01)
    assert repr(planner) == "<planner: 'panda', obstacles, margin>"
    plan = planner.plan(joints(ONE), joints(TWO))
    assert plan.certified
    same(plan, tp.plan("panda", obstacles=[BOX], margin=0.01, start=joints(ONE), goal=joints(TWO)))
    assert planner.plan(joints(ONE), joints(TWO), margin=0.0).scenario.model.margin == 0.0


def test_the_second_plan_builds_nothing_symbolic(monkeypatch: pytest.MonkeyPatch) -> None:
    planner = tp.Planner("panda", obstacles=[BOX])
    assert planner.plan(joints(ONE), joints(TWO)).certified
    make, made = ca.Function.__init__, []

    def counted(function: ca.Function, *arguments: Any) -> None:
        made.extend(arguments[:1] if arguments and isinstance(arguments[0], str) else ())
        make(function, *arguments)

    monkeypatch.setattr(ca.Function, "__init__", counted)
    monkeypatch.setattr(ca, "jacobian", lambda *_: pytest.fail("derived again"))
    ca.Function("seen", [], [])
    assert made == ["seen"]
    assert planner.plan(joints(TWO), joints([0.8, *ONE[1:]])).certified
    assert made == ["seen"]


def test_many_are_planned_and_refusals_kept() -> None:
    planner = tp.Planner("panda", obstacles=[BOX])
    there, refused, back = planner.plan_many(
        [(joints(ONE), joints(TWO)), (joints(ONE), joints([0.0])), (joints(TWO), joints(ONE))]
    )
    assert isinstance(there, tp.Plan) and isinstance(back, tp.Plan)
    assert there.duration == pytest.approx(back.duration, rel=1e-3)
    assert isinstance(refused, tp.ScenarioError) and "joints" in str(refused)


@pytest.mark.process
def test_processes_change_nothing() -> None:
    planner, tasks = tp.Planner("panda", obstacles=[BOX]), [(joints(ONE), joints(TWO)), (joints(TWO), joints(ONE))]
    for one, two in zip(planner.plan_many(tasks), planner.plan_many(tasks, processes=2), strict=True):
        assert isinstance(one, tp.Plan) and isinstance(two, tp.Plan)
        same(one, two)


@pytest.mark.parametrize("processes", [0, -1, 1.5, "two"])
def test_a_wrong_number_of_processes_is_refused(processes: Any) -> None:
    with pytest.raises(tp.ScenarioError, match="processes"):
        tp.Planner("panda").plan_many([], processes=processes)
