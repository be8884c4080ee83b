"""Plans without a search: motions that nothing can beat, where one is clear."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from problems.objectives import OBJECTIVES
from problems.timing import least_durations
from tpbso_casadi.figures.run import drawings_of
from tpbso_casadi.plain import as_json, sealed

START, GOAL = [0.0, -0.8, 0.0, -2.2, 0.0, 1.5, 0.8], [0.9, -0.3, 0.2, -1.8, 0.3, 1.7, 0.2]
ENDS: dict[str, Any] = {"start": {"joints": START}, "goal": {"joints": GOAL}}


WALL = {"shape": "box", "center": [0.45, 0.25, 0.55], "size": [0.5, 0.02, 0.7]}
POLISHED = [name for name, objective in OBJECTIVES.items() if objective.polish_suffices]


@cache
def planned(walled: bool = False, objective: str = "time") -> tp.Plan:
    return tp.plan("panda", **ENDS, obstacles=[WALL] if walled else [], objective=objective)


def bound(plan: tp.Plan) -> float:
    limits = plan.motion.criteria.robot.limits
    return float(least_durations(np.array(GOAL) - np.array(START), limits).max())


def same(one: tp.Plan, other: tp.Plan) -> None:
    np.testing.assert_array_equal(one.motion.trajectory.coefficients, other.motion.trajectory.coefficients)


def test_where_nothing_is_in_the_way_nothing_is_searched() -> None:
    plan = planned()
    assert plan.certified and plan.scenario.solver.name == "direct"
    assert plan.motion.trajectory.duration == pytest.approx(bound(plan), rel=1e-9)
    assert plan.search is not None
    assert (plan.search.evaluations, plan.search.stop_reason) == (0, tp.StopReason.TARGET)
    first = tp.plan("panda", **ENDS, first=True)
    assert first.search is not None and first.search.stop_reason == "target"
    same(first, plan)


def test_joints_wait_for_each_other_at_the_bound() -> None:
    direct = planned().motion.trajectory
    half = np.array([0.5 * direct.duration])
    place = planned().motion.criteria.robot.tool.at(direct.at(half))[0][0]
    post = {"shape": "box", "center": place.tolist(), "size": [0.05] * 3}
    plan = tp.plan("panda", **ENDS, obstacles=[post], seed=1)
    assert plan.certified and plan.search is not None and plan.search.evaluations == 0
    assert plan.motion.trajectory.duration == pytest.approx(bound(plan), rel=1e-9)
    assert np.abs(direct.at(half) - plan.motion.trajectory.at(half)).max() > 0.01
    assert tp.audit(plan).certified


def test_a_run_that_names_ladder_is_one_of_direct(tmp_path: Path) -> None:
    stored = tp.plan("panda", **ENDS, solver="ladder").save(tmp_path / "run", figures=()) / "result.json"
    content = json.loads(stored.read_text())
    del content["seal"]
    assert content["solver"]["name"] == content["scenario"]["solver"]["name"] == "direct"
    content["solver"]["name"] = content["scenario"]["solver"]["name"] = "ladder"
    stored.write_text(as_json(sealed(content), 2))
    assert tp.read_run(tmp_path / "run").scenario.solver.name == "direct"
    assert tp.audit(tmp_path / "run").certified


def test_ways_around_are_polished_where_no_bound_is_reached_and_time_enough_changes_nothing(tmp_path: Path) -> None:
    plan = planned(walled=True)
    assert plan.certified and plan.search is not None
    assert (plan.search.evaluations, plan.search.stop_reason) == (0, "converged")
    assert plan.motion.trajectory.duration > bound(plan)
    assert tp.audit(plan.save(tmp_path / "run", figures=())).certified
    same(plan, tp.plan("panda", **ENDS, obstacles=[WALL], within=600.0))


def test_the_first_certified_plan_is_enough_where_it_is_asked_for() -> None:
    first = tp.plan("panda", **ENDS, obstacles=[WALL], first=True)
    near = 1e-4  # relative: so near to each other refinements of one way end
    assert first.certified and first.duration >= (1.0 - near) * planned(walled=True).duration


@pytest.mark.parametrize("what", [{"solver": "bso"}, {"solver": "ipopt"}])
def test_a_search_has_no_first_plan(what: dict[str, Any]) -> None:
    with pytest.raises(tp.ScenarioError, match=r"first: \w+ searches for the best; name direct"):
        tp.plan("panda", **ENDS, first=True, **what)


def test_no_joint_turns_farther_than_it_has_to_at_the_bound() -> None:
    plan = planned(objective="rotation")
    assert plan.certified and plan.search is not None
    assert (plan.search.evaluations, plan.search.stop_reason) == (0, "target")
    assert plan.result.objective.value == pytest.approx(np.abs(np.array(GOAL) - START).sum(), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("objective", [{"time": 1.0, "energy": 0.01}, *POLISHED], ids=str)
def test_objectives_are_planned_around_a_wall_without_a_search(objective: Any) -> None:
    plan = tp.plan("panda", **ENDS, obstacles=[WALL], objective=objective)
    assert plan.certified and plan.search is not None and plan.search.evaluations == 0
    criteria, motion = plan.motion.criteria, planned(walled=True).motion
    assert plan.result.objective.value <= criteria.objective_value(motion.trajectory, motion.times) * (1.0 + 1e-6)


@pytest.mark.slow
def test_the_total_time_is_kept_where_more_would_be_better() -> None:
    free = planned(objective="energy")
    short, late = (tp.plan("panda", **ENDS, objective="energy", total_time=times) for times in ((0.1, 0.7), (2.5, 3.0)))
    assert short.certified and short.duration <= 0.7
    assert short.result.objective.value >= free.result.objective.value * (1.0 - 1e-2)
    assert late.certified and 2.5 <= late.duration <= 3.0


def test_it_is_stored_without_a_convergence(tmp_path: Path) -> None:
    plan = planned()
    assert "convergence" not in drawings_of(plan.planned)
    stored = tp.read_run(plan.save(tmp_path / "run", figures=()))
    assert stored.result.evaluations == 0 and stored.result.stop_reason == "target"
    assert tp.audit(tmp_path / "run").certified


@pytest.mark.slow
def test_it_starts_another_which_a_named_solver_searches() -> None:
    after = tp.plan("panda", **ENDS, warm_start=planned(), solver="abso", evaluations=20)
    assert after.certified and after.search is not None and after.search.evaluations == 20


def pose_of(theta: list[float]) -> np.ndarray:
    frame = np.eye(4)
    place, rotation = tp.robot("panda").model.tool.at(np.array([theta]))  # type: ignore[attr-defined]
    frame[:3, :3], frame[:3, 3] = rotation[0], place[0]
    return frame


def test_a_pose_is_reached_in_the_posture_that_is_reached_soonest(tmp_path: Path) -> None:
    plan = tp.plan("panda", start={"joints": START}, goal=pose_of(GOAL))
    assert plan.certified and plan.search is not None and plan.search.evaluations == 0
    assert plan.motion.trajectory.duration <= bound(plan) * (1.0 + 1e-9)  # any other posture will do
    own = least_durations(
        plan.motion.trajectory.at(plan.motion.trajectory.breakpoints[-1:])[0] - START, plan.motion.criteria.robot.limits
    )
    assert plan.motion.trajectory.duration == pytest.approx(own.max(), rel=1e-9)
    plan.save(tmp_path / "run", figures=())
    assert tp.audit(tmp_path / "run").certified


def test_any_of_several_goals(tmp_path: Path) -> None:
    far = {"joints": [1.5, 0.2, 1.0, -1.5, 1.0, 2.5, 2.0]}
    plan = tp.plan("panda", start={"joints": START}, goal=[far, {"joints": GOAL}])
    assert plan.search is not None and plan.search.evaluations == 0
    assert plan.motion.trajectory.duration == pytest.approx(bound(plan), rel=1e-9)
    plan.save(tmp_path / "run", figures=())
    assert tp.audit(tmp_path / "run").certified


def two_link_postures(point: tuple[float, float], elbows: str) -> list[tuple[float, float]]:
    """Postures of links of 0.5 and 0.4 m with the tool at a point, by the law of cosines."""
    bend = np.arccos((point[0] ** 2 + point[1] ** 2 - 0.5**2 - 0.4**2) / (2.0 * 0.5 * 0.4))
    bends = [{"up": bend, "down": -bend}[elbow] for elbow in elbows.split()]
    shoulder = [np.arctan2(point[1], point[0]) - np.arctan2(0.4 * np.sin(b), 0.5 + 0.4 * np.cos(b)) for b in bends]
    return list(zip(shoulder, bends, strict=True))


@pytest.mark.parametrize(("elbow", "branches"), [("free", "up down"), ("down", "down")])
def test_in_the_plane_the_soonest_pair_of_branches_is_taken(elbow: str, branches: str) -> None:
    robot = tp.robot([0.5, 0.4], max_speed=[1.0, 2.0], max_acceleration=10.0)
    starts, goals = (two_link_postures(point, branches) for point in ((0.4, -0.6), (-0.5, 0.55)))
    turns = np.array([np.subtract(goal, start) for start in starts for goal in goals])
    turns -= 2.0 * np.pi * np.round(turns / (2.0 * np.pi))
    plan = tp.plan(robot, start=[0.4, -0.6], goal=[-0.5, 0.55], elbow=elbow, solver="direct")
    assert plan.certified
    assert plan.duration == pytest.approx(least_durations(turns, robot.model.limits).max(axis=1).min(), rel=1e-6)
