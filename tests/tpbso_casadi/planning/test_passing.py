"""What is told of motions through given postures: the numbers of papers' tables, other durations, a lower bound."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from problems.timing import fastest_through, rest_to_rest
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.display.passing_tables import durations_through, interval_times, joint_peaks, print_passing
from tpbso_casadi.scenario import read_scenario

PAPERS = Path(__file__).parents[3] / "examples" / "papers"
LIN = PAPERS / "lin-1983.toml"


@pytest.fixture(scope="module")
def plan() -> Any:
    return tp.plan(LIN, solver="lshade", evaluations=600)


def test_peaks_and_mean_jerks_are_those_of_many_samples(plan: Any) -> None:
    peaks, times = joint_peaks(plan.trajectory), np.linspace(0.0, plan.duration, 40_001)
    for order in (1, 2, 3):
        assert peaks[:, order - 1] == pytest.approx(np.abs(plan.trajectory.at(times, order)).max(axis=0), rel=1e-3)
    assert peaks[:, 3] == pytest.approx(np.abs(plan.trajectory.at(times, 3)).mean(axis=0), rel=1e-3)
    assert interval_times(plan.motion) == pytest.approx(np.diff(plan.trajectory.breakpoints))


def test_the_fastest_and_the_bound_stand_beside_the_duration(plan: Any) -> None:
    task, limits = plan.motion.criteria.task, plan.motion.criteria.robot.limits
    own, fastest, least = (duration for _, duration in durations_through(plan.motion))
    assert own == plan.duration and fastest == fastest_through(task.passed_postures, limits).duration
    assert own > fastest > least == plan.motion.least_duration > 0.9 * fastest
    told = io.StringIO()
    print_passing(plan.motion, OutputConsole(file=told, width=120))
    assert "interval times: " in told.getvalue() and f"{least:.6g}" in told.getvalue()
    assert "mean |jerk|" in told.getvalue()
    free = tp.plan(task, solver="direct")
    assert free.certified and len(list(durations_through(free.motion))) == 2  # it is the fastest that is found itself


@pytest.mark.parametrize(("case", "duration"), [("fang-2020-task-1", 4.0), ("fang-2020-task-2", 1.9299)])
def test_what_a_paper_states_in_closed_form_is_the_least(case: str, duration: float) -> None:
    task = read_scenario(PAPERS / f"{case}.toml").criteria().task
    assert rest_to_rest(*task.given_postures, task.robot.limits).duration == pytest.approx(duration, abs=5e-5)


def test_all_cases_of_papers_can_be_read() -> None:
    assert len([read_scenario(file).criteria() for file in PAPERS.glob("*.toml")]) == 9


def test_nothing_is_told_of_motions_that_may_pass_other_postures() -> None:
    arm = tp.PlanarArm((0.5, 0.4), (2.0, 2.0), (9.0, 9.0))
    start, goal = tp.Joints((0.0, 0.3)), tp.Joints((1.0, 0.5))
    for vias in ((), (tp.Joints((0.5, 0.9), 0.1),), (tp.Position((0.5, 0.5)),)):
        assert tp.Move(arm, start, (goal,), vias).passed_postures is None
    given = tp.Move(arm, start, (goal,), (tp.Joints((0.5, 0.9)),)).passed_postures
    assert given == pytest.approx(np.array([[0.0, 0.3], [0.5, 0.9], [1.0, 0.5]]))
