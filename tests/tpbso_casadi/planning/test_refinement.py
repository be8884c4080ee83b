"""Polishing by IPOPT: better, feasible for all t, never worse; and many starts without a swarm."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.waiting import PATIENCE
from oracles.csv_checker import check_run

from problems import Problem
from problems.limits import reachable_pairs
from solvers import IPOPT, Budget, DescentResult, StopReason
from tpbso_casadi import Scenario, builtin, parse_scenario
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import Polish, SearchedMotion, motion_of, plan
from tpbso_casadi.planning.finishing import Refinement, distinct
from tpbso_casadi.scenario import ScenarioError
from tpbso_casadi.scenario.cases import TITLES


def scenario_with(
    case: str, edit: Callable[[dict[str, Any]], object] = lambda content: None, **solver: object
) -> Scenario:
    content = builtin(case).model_dump()
    content["solver"] |= solver
    edit(content)
    return parse_scenario(content)


def free(content: dict[str, Any]) -> None:
    content["task"]["elbow"] = "free"


@pytest.mark.parametrize(
    "case", [c if n % 3 == 0 else pytest.param(c, marks=pytest.mark.slow) for n, c in enumerate(TITLES)]
)
def test_a_polish_is_feasible_and_never_worse(case: str) -> None:
    solution = plan(scenario_with(case, evaluations=8000, polish_starts=1))
    polish = solution.polish
    assert polish is not None
    assert solution.feasible
    assert solution.objective <= polish.before.objective or not polish.before.feasible
    found = solution.motion if solution.retiming is None else solution.retiming.before
    assert found is (polish.after if polish.accepted else polish.before)
    assert solution.problem.exact_time_scale(found.trajectory) <= 1.0
    if polish.search.stop_reason is StopReason.CONVERGED:
        assert max(polish.search.solution.residuals.values()) < 1e-3


@pytest.mark.parametrize(
    ("case", "elbow", "best"),
    [
        ("time-2", "up", 0.7016),
        ("rotation-2", "up", 2.4135),
        ("time-2", "free", 0.4909),
        ("rotation-2", "free", 1.6372),
    ],
)
def test_check_values_of_two_links_for_all_t(case: str, elbow: str, best: float) -> None:
    """At 50 samples a segment the least time is 0.7015 s; that it keeps its limits for all t takes it to 0.7016 s."""
    solution = plan(
        scenario_with(case, lambda content: content["task"].update(elbow=elbow), name="ipopt", iterations=12)
    )
    assert solution.objective == pytest.approx(best, abs=6e-5)
    if case == "time-2" and elbow == "up":
        assert isinstance(solution.search, DescentResult)
        assert solution.search.solution.objective == pytest.approx(0.7015, abs=5e-5)


def test_twelve_starts_of_three_links() -> None:
    solution = plan(scenario_with("time-3", free, polish_starts=12))
    assert solution.polish is not None
    assert solution.polish.search.iterations <= 12
    assert solution.objective < 0.45


def reduced(case: str) -> Problem[Any]:
    return scenario_with(case, lambda content: content["model"].update(formulation="reduced")).problem()


def polish_between(before: float, after: float, after_feasible: bool) -> Polish:
    """A polish of motions that take so many times the time of one that keeps its limits."""
    problem = reduced("time-2")
    motion = motion_of(problem, np.zeros(5) + 0.5)
    slow, fast = (replace(motion, trajectory=motion.trajectory.time_scaled(factor)) for factor in (before, after))
    assert fast.feasible is after_feasible
    refinement = Refinement(problem, IPOPT())
    search = refinement.descend(refinement.program.starts(np.random.default_rng(0)), Budget(iterations=1), 0)
    return Polish(slow, fast, search, 0.0, {})


@pytest.mark.parametrize(
    ("before", "after", "feasible", "accepted"),
    [
        (2.0, 1.5, True, True),
        (1.5, 2.0, True, False),
        (1.5, 0.9, False, False),
        (1.5, 1.5, True, False),
        (0.5, 0.9, False, False),
    ],
    ids=["better", "worse", "faster but too fast", "the same", "both too fast"],
)
def test_what_is_worse_or_breaks_a_limit_is_discarded(
    before: float, after: float, feasible: bool, accepted: bool
) -> None:
    polish = polish_between(before, after, feasible)
    assert polish.accepted is accepted
    assert polish.chosen is (polish.after if accepted else polish.before)


def test_starts_lie_apart_in_joint_space() -> None:
    problem = reduced("time-3")
    rng = np.random.default_rng(0)
    first, second = rng.uniform(*problem.bounds, (2, problem.bounds[0].size))
    chosen = distinct(problem, [first, first + 1e-3, second, first - 1e-3], 3)
    assert len(chosen) == 2
    assert (chosen[0] == first).all()
    assert (chosen[1] == second).all()


OBSTACLES = {
    "default": [([0.8, 0.8], [0.15, 0.25])],
    "in the way": [([0.85, 0.75], [0.15, 0.15])],
    "two": [([0.9, 0.9], [0.15, 0.25]), ([0.3, 1.2], [0.1, 0.15])],
}


def clear_at_100_000_times(solution: SearchedMotion) -> bool:
    robot, times = solution.problem.robot, np.linspace(0.0, solution.trajectory.duration, 100_000)
    positions = robot.positions(ca.DM(solution.trajectory.at(times)))
    clearance = ca.horzcat(*(pair.clearance(positions) for pair in reachable_pairs(robot, solution.problem.obstacles)))
    proven = next(verdict for verdict in solution.verdicts if verdict.name == "clearance").worst
    return float(ca.mmin(clearance)) >= proven >= 1e-4


@pytest.mark.parametrize("obstacles", OBSTACLES)
@pytest.mark.parametrize("links", [3, *(pytest.param(links, marks=pytest.mark.slow) for links in (4, 5))])
def test_plans_around_obstacles_are_clear_for_all_t(links: int, obstacles: str) -> None:
    def stated(content: dict[str, Any]) -> None:
        content["arm"]["link_lengths"] = [2.0 / links] * links
        content["obstacles"] = [{"center": center, "semi_axes": axes} for center, axes in OBSTACLES[obstacles]]
        content["model"]["formulation"] = "reduced"

    solution = plan(scenario_with("obstacle-3", stated, evaluations=8000, polish_starts=1))
    assert solution.polish is not None
    assert solution.feasible
    assert clear_at_100_000_times(solution)


def run(*arguments: str) -> int:
    return int(main([*arguments]))


@pytest.mark.usefixtures("in_an_empty_folder")
def test_the_polish_stands_in_the_table_and_in_the_result(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("time-3", "--polish", "--evaluations", "5000", "--out", "out") == 0
    output = capsys.readouterr().out
    assert "polish: kept" in output
    assert "before" in output
    polish = check_run(Path("out"))["polish"]
    assert polish["after"]["objective"] < polish["before"]["objective"]
    assert polish["accepted"] is True
    assert polish["after"]["worst_violation"] == 0.0
    assert {"iterations", "evaluations", "seconds", "status"} <= set(polish)


@pytest.mark.usefixtures("in_an_empty_folder")
@pytest.mark.parametrize("case", ["rotation-3", "closed-curve-time"])
def test_ipopt_alone(case: str) -> None:
    assert run(case, "--solver", "ipopt", "--iterations", "4", "--quiet", "--out", "out") == 0
    result = check_run(Path("out"))
    assert result["iterations"] == 4
    assert result["solver"]["name"] == "ipopt"
    assert result["solution"]["variables"] is None
    assert (Path("out") / "convergence.png").stat().st_size > 10_000
    assert run(case, "--solver", "ipopt", "--iterations", "4", "--quiet", "--no-plots", "--out", "again") == 0
    assert Path("out/trajectory.csv").read_text() == Path("again/trajectory.csv").read_text()


ANNOUNCED = """
import sys
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning.finishing import Refinement

descend = Refinement.__call__

def announced(self, start):
    print("descending", flush=True)
    return descend(self, start)

Refinement.__call__ = announced
sys.exit(main(sys.argv[1:]))
"""  # the command line, which says when IPOPT begins


@pytest.mark.usefixtures("in_an_empty_folder")
@pytest.mark.parametrize(
    ("how", "reason"),
    [
        (["--solver", "ipopt", "--time-limit", "200"], "interrupted"),
        (["--polish-starts", "64", "--evaluations", "3000"], "evaluations"),
    ],
    ids=["alone", "polishing"],
)
def test_interruption_of_ipopt_keeps_the_best(how: list[str], reason: str) -> None:
    command = [sys.executable, "-c", ANNOUNCED, "obstacle-5", *how, "--out", "out", "--no-plots", "--quiet"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == "descending\n"
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert json.loads(Path("out/result.json").read_text())["stop_reason"] == reason


def test_the_best_within_a_time(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(perf_counter=count(1000.0, 1.0).__next__)  # a second every time somebody looks
    monkeypatch.setattr("tpbso_casadi.planning.branches.time", clock)
    solution = plan(scenario_with("time-3", name="abso", evaluations=1000, within=20.0))
    once = plan(scenario_with("time-3", name="abso", evaluations=1000, polish_starts=3))
    assert 2 < solution.rounds < 10
    assert solution.feasible
    assert solution.objective <= once.objective
    assert solution.search.evaluations == 1000


def test_no_time_at_all_still_gives_a_plan() -> None:
    solution = plan(scenario_with("time-2", evaluations=500, within=1e-6))
    assert (solution.rounds, solution.polish) == (1, None)


@pytest.mark.parametrize(
    ("solver", "reason"),
    [({"name": "ipopt"}, "say time_limit"), ({"name": "bso", "time_limit": 1.0}, "leave time_limit out")],
)
def test_what_does_not_go_with_within(solver: dict[str, Any], reason: str) -> None:
    with pytest.raises(ScenarioError, match=reason):
        scenario_with("time-2", within=1.0, **solver).solver.build()
