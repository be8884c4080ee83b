"""Bounds of durations: symbolic, numeric, in search, program and verdict, for both kinds of tasks."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import OVAL, THREE_METRES, changed, equal_links, following, moving
from helpers.slow import slow_except

from problems import CertificateStatus, Problem, Trajectory, Verdict, pentagram
from problems.base import as_array
from problems.certify import verdict
from problems.evaluation import EvaluationOptions
from problems.limits import SAMPLING_MARGIN, DurationBounds
from solvers import BSO, IPOPT, Budget, Descent, SearchBox, minimize

START, GOAL = (1.0, 0.0), (0.5, 1.5)
STAR = pentagram((0.0, 0.0), 0.9)
BOUNDS = DurationBounds("segment time", "t{}", 0.2, 0.5)
VM = EvaluationOptions("vm")


def test_the_constraint_of_durations() -> None:
    constraint = BOUNDS.at(ca.DM([[0.3, 0.7]]))
    assert (constraint.name, constraint.unit, constraint.columns) == ("segment time", "s", ("t1", "t2"))
    assert as_array(constraint.graded_penalty()) == pytest.approx(np.array([[0.4]]))  # 0.2 s beyond, of 0.5 s
    outcome = verdict(constraint, np.array([1.0]))
    assert (outcome.worst, outcome.bound, outcome.where) == (0.7, 0.5, "t2")
    assert outcome.status is CertificateStatus.VIOLATED
    assert verdict(BOUNDS.at(ca.DM([[0.2, 0.5]])), np.array([0.7])).satisfied
    assert not verdict(BOUNDS.at(ca.DM([[0.2 - 1e-6, 0.5]])), np.array([0.7])).satisfied


def test_a_margin_is_kept_below_the_longest_but_not_more_than_half_the_way() -> None:
    assert BOUNDS.search_box(0.0) == (0.2, 0.5)
    assert BOUNDS.search_box(0.01) == (0.2, pytest.approx(0.495))
    assert DurationBounds("total time", "t_T", 1.0, 1.001).search_box(0.01) == (1.0, pytest.approx(1.0005))


def test_the_time_scale_of_what_is_too_short() -> None:
    assert BOUNDS.time_scale(np.array([0.1, 0.4])) == pytest.approx(2.0)
    assert BOUNDS.time_scale(np.array([0.4, 0.8])) == pytest.approx(0.5)


def about_time(problem: Problem[Any], trajectory: Any) -> Verdict:
    [outcome] = [v for v in problem.criteria.verify(trajectory) if v.name in {"segment time", "total time"}]
    return outcome


CASES: dict[str, Callable[[str], Problem[Any]]] = {
    "segments": lambda form: moving(equal_links(3), START, GOAL, "rotation", "up", form, segment_time=(0.5, 0.6)),
    "segments around an obstacle": lambda form: moving(
        equal_links(3), START, GOAL, "length", "up", form, segment_time=(0.6, 0.8), obstacles=(OVAL,)
    ),
    "path": lambda form: following(THREE_METRES, STAR, 0.1, "rotation", "up", form, total_time=(0.9, 1.0)),
    "path in least time": lambda form: following(THREE_METRES, STAR, 0.1, "time", "up", form, total_time=(0.9, 1.0)),
}


@cache
def case(name: str, formulation: str = "paper") -> Problem[Any]:
    return CASES[name](formulation)


def kept(problem: Problem[Any], x: np.ndarray) -> Trajectory:
    """A candidate's motion, slowed down as far as is needed."""
    motion = problem.trajectory(x)
    return motion.time_scaled(max(1.0, problem.criteria.safe_time_scale(motion)))


@pytest.mark.parametrize(
    ("name", "formulation"),
    slow_except(
        zip(CASES, ("paper", "reduced", "paper", "reduced"), strict=True),
        [("segments around an obstacle", "reduced"), ("path", "paper")],
    ),
)
def test_a_search_keeps_them(name: str, formulation: str) -> None:
    problem = case(name, formulation)
    found = minimize(problem.evaluator(VM), SearchBox(*problem.bounds), BSO(), Budget(2000), 1)
    motion = kept(problem, found.x)
    assert about_time(problem, motion).satisfied
    bounds = problem.criteria.task.duration_bounds
    assert bounds is not None
    durations = problem.criteria.task.durations(motion)
    assert (durations >= bounds.shortest * (1.0 - 1e-12)).all()
    assert (durations <= bounds.longest).all()


@pytest.mark.parametrize("name", ["segments", "path"])
def test_ipopt_keeps_them(name: str) -> None:
    problem = case(name)
    program = problem.nlp()
    starts = program.starts(np.random.default_rng(1))
    motions = (program.trajectory(Descent(program, IPOPT())(next(starts)).x) for _ in range(3))
    assert any(about_time(problem, motion).satisfied for motion in motions)


@pytest.mark.parametrize(
    ("name", "formulation", "impossible"),
    [("segments", "paper", {"segment_time": (0.01, 0.05)}), ("path", "reduced", {"total_time": (0.1, 0.2)})],
)
def test_a_search_that_cannot_keep_them_says_so(name: str, formulation: str, impossible: dict[str, Any]) -> None:
    problem = changed(case(name, formulation), **impossible)
    candidates = SearchBox(*problem.bounds).sample(np.random.default_rng(0), 50)
    assert (problem.evaluator(VM)(candidates) > problem.objective_upper_bound).all()
    motion = kept(problem, candidates[0])
    outcome = about_time(problem, motion)
    assert outcome.status is CertificateStatus.VIOLATED
    assert outcome.worst == pytest.approx(problem.criteria.task.durations(motion).max())


@pytest.mark.parametrize(("name", "expected"), [("segments", "segment time"), ("path", "total time")])
def test_search_and_program_list_them(name: str, expected: str) -> None:
    problem = case(name)
    [ours] = [c for c in problem.model.constraints if c.name == expected]
    [row] = [c for c in problem.nlp().constraints(SAMPLING_MARGIN) if c.name == expected]
    assert (row.lower, row.columns) == (None, ours.columns)
    wide = [c for c in problem.nlp().constraints(10.0 * SAMPLING_MARGIN) if c.name == expected]
    assert (wide[0].bounds[1] < row.bounds[1]).all()


def test_what_is_not_stated_is_not_promised() -> None:
    slow = equal_links(3)
    arm = type(slow)(slow.link_lengths, (0.05,) * 3, slow.max_acceleration)
    for formulation in ("paper", "reduced"):
        problem = moving(arm, START, GOAL, "time", "up", formulation)
        assert problem.criteria.task.duration_bounds is None
        motion = kept(problem, np.mean(problem.bounds, axis=0))
        assert motion.duration > 8.0
        assert {v.name for v in problem.criteria.verify(motion)} == {"speed", "acceleration", "start", "goal"}


@pytest.mark.parametrize("formulation", ["paper", "reduced"])
def test_a_motion_that_is_too_short_is_slowed(formulation: str) -> None:
    problem = case("segments", formulation)
    motion = problem.trajectory(np.mean(problem.bounds, axis=0)).time_scaled(0.1)
    assert not about_time(problem, motion).satisfied
    slowed = motion.time_scaled(problem.criteria.safe_time_scale(motion))
    assert problem.criteria.task.durations(slowed).min() >= 0.5 * (1.0 - 1e-12)
