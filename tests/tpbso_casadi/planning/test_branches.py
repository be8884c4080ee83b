"""Goals that inverse kinematics reaches in several ways: the race of these, its record, an audit of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.slow import slow_except
from helpers.space_scenarios import GOAL, space_scenario

from problems.families.splines import MoveProblem
from solvers import StopReason
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.cli.commands.audit import main
from tpbso_casadi.planning import PlannedMotion, plan
from tpbso_casadi.planning.branches import FINALISTS
from tpbso_casadi.storage import sealed, write_plan


@cache
def planned() -> PlannedMotion:
    return plan(parse_scenario(space_scenario(solver={"evaluations": 100})))


def elbow_up(forward: float, height: float) -> tuple[float, float]:
    """Lift and bend of two links of 0.4 m that reach a point before the shoulder, by the law of cosines."""
    bend = np.arccos((forward**2 + height**2 - 2 * 0.4**2) / (2 * 0.4**2))
    return float(np.arctan2(forward, height) - bend / 2.0), float(bend)


def test_both_elbows_are_branches_and_the_better_one_is_planned() -> None:
    problem = parse_scenario(space_scenario(obstacles=[])).problem()
    lift, bend = elbow_up(np.hypot(0.3, 0.45), 0.3)
    turn = np.arctan2(0.45, 0.3)
    expected = {(turn, lift, bend), (turn, lift + bend, -bend)}
    found = {tuple(np.round(each.branch["goal"], 6)) for each in problem.branches}
    assert {tuple(np.round(theta, 6)) for theta in expected} <= found
    times = [each.direct.free_space_time for each in problem.branches]
    assert times == sorted(times)


def test_the_plan_ends_at_the_goal_and_says_which_branch_it_took() -> None:
    found, again = planned(), plan(parse_scenario(space_scenario(solver={"evaluations": 100})))
    assert found.feasible
    trajectory = found.trajectory
    end = trajectory.at(trajectory.breakpoints[-1:])
    assert found.motion.joint_positions(trajectory.breakpoints[-1:])[0, -1] == pytest.approx(GOAL["position"], abs=1e-8)
    assert np.abs(end[0] - found.problem.branch["goal"]).max() < 1.0
    assert not found.problem.branches
    assert 1 < found.rounds <= len(found.scenario.problem().branches) + FINALISTS
    assert again.trajectory.coefficients.tolist() == trajectory.coefficients.tolist()  # the same seed


def test_branches_share_one_program() -> None:
    problem = parse_scenario(space_scenario()).problem()
    first, second = problem.branches[:2]
    assert isinstance(first, MoveProblem)
    assert isinstance(second, MoveProblem)
    assert first.program.steps is second.program.steps
    candidates = np.random.default_rng(1).uniform(-0.3, 0.3, (5, len(second.variables)))
    alone = second.on_branch(second.branch)
    assert second.cost(candidates).tolist() == alone.cost(candidates).tolist()
    assert second.cost(candidates).tolist() != first.cost(candidates).tolist()
    model = second.program.inlined().map(5)(candidates.T)
    assert np.asarray(model).ravel() == pytest.approx(second.cost(candidates))


def wrong_posture(content: dict[str, Any]) -> None:
    content["solution"]["branches"]["goal"][0] += 0.1


def other_branch(content: dict[str, Any]) -> None:
    own = content["solution"]["branches"]["goal"]
    others = [each.branch["goal"] for each in planned().scenario.problem().branches]
    content["solution"]["branches"]["goal"] = max(others, key=lambda theta: np.abs(theta - own).max()).tolist()


EDITS: list[tuple[Callable[[dict[str, Any]], object], str]] = [
    (lambda content: None, ""),
    (other_branch, "solution.variables: a motion of"),
    (wrong_posture, "solution.branches: goal: the branch's posture misses it by"),
    (lambda content: content["solution"]["branches"].update(goal=[0.0]), "1 joints for a robot of 3"),
    (lambda content: content["solution"]["branches"].update(start=[0.0] * 3), "postures at goal are needed"),
    (lambda content: content["solution"].pop("branches"), "are all that the scenario asks for"),
]


@pytest.mark.parametrize(("edit", "reason"), slow_except(EDITS, 2))
def test_an_audit_computes_the_search_again_and_finds_a_false_branch_out(
    edit: Callable[[dict[str, Any]], object], reason: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_plan(tmp_path, planned())
    content = json.loads((tmp_path / "result.json").read_text())
    edit(content)
    resealed = sealed({key: value for key, value in content.items() if key != "seal"})
    (tmp_path / "result.json").write_text(json.dumps(resealed))
    status = main([str(tmp_path), "--json"])
    output = capfd.readouterr()
    if not reason:
        assert status == 0
        assert "goal" in [each["name"] for each in json.loads(output.out)["constraints"]]
    else:
        assert (status, output.err.count("\n")) == (2, 1)
        assert reason in output.err


@pytest.mark.slow
def test_starts_vias_and_lists_of_goals_may_be_poses() -> None:
    task = {
        "start": {"position": [0.5, -0.2, 0.5]},
        "via": [{"position": [0.5, 0.1, 0.7]}],
        "goal": [GOAL, {"joints": [0.9, 0.4, 1.0]}, {"position": [0.2, 0.5, 0.5]}],
    }
    found = plan(parse_scenario(space_scenario(task=task, solver={"evaluations": 40}, obstacles=[])))
    assert found.feasible
    assert set(found.problem.branch) == {"start", "via_1", "goal"}
    start = found.motion.joint_positions(np.zeros(1))[0, -1]
    assert start == pytest.approx([0.5, -0.2, 0.5], abs=1e-8)


def test_a_time_limit_is_that_of_everything() -> None:
    found = plan(parse_scenario(space_scenario(solver={"evaluations": None, "time_limit": 0.2}, obstacles=[])))
    assert found.search.stop_reason is StopReason.SECONDS
    assert found.scenario.solver.time_limit == 0.2


@pytest.mark.parametrize(
    ("tables", "reason"),
    [
        ({"task": {"goal": {"position": [0.3, 0.4, 0.5, 0.6]}}}, "task.goal.position"),
        ({"task": {"goal": {"position": [0.3, 0.4], "quaternion": [0, 0, 0, 1]}}}, "task.goal.position.2: missing key"),
        ({"task": {"goal": {"position": [0.3, 0.4, 0.5], "quaternion": [0, 0, 1]}}}, "task.goal.quaternion"),
        ({"task": {"goal": {"position": [0.3, 0.4]}}}, "task.goal: (0.3, 0.4) where the robot needs 3 coordinates"),
        ({"task": {"goal": {"position": [0.3, 0.4, 3.0]}}}, "out of reach"),
        ({"task": {"goal": {"position": [0.45, 0.25, 0.55]}}}, "is clear; hand"),
        ({"task": {"goal": {"joints": [0.0, 0.0, 0.0]}, "elbow": "up"}}, "task.elbow: 'up' does not apply"),
        ({"task": {"start": [0.5, 0.5], "goal": [0.4, 0.4]}, "model": {"motion": "paper"}}, "model.motion: 'paper' is"),
    ],
)
def test_what_cannot_be_is_one_line(tables: dict[str, Any], reason: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        parse_scenario(space_scenario(**tables)).problem()
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
