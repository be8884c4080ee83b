"""The duration as a variable: where it is one, what it does, and that a candidate's motion has it."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links, following, moving

from problems import OBJECTIVES, Problem
from problems.assembly import Slowness
from problems.assembly.path_timing import MOST
from problems.families.splines import move
from problems.families.traced import tracing
from problems.tasks import Joints, Move, Path, PathTracing

ARM = equal_links(3, link_masses=(1.0, 2.0, 3.0))
LINE = Path(((1.0, 0.5), (1.1, 0.6), (1.2, 0.6)))


def made(kind: str, objective: str, bounds: tuple[float, float] | None = None) -> Problem[Any]:
    if kind == "segments":
        return moving(ARM, (1.0, 0.0), (0.5, 1.5), objective, "up", "reduced", samples=8, segment_time=bounds)
    if kind == "knots":
        return following(ARM, LINE, 0.1, objective, "up", "reduced", total_time=bounds)
    if kind == "tracing":
        return tracing(PathTracing(ARM, LINE, 0.1, "up", total_time=bounds), objective, 20, 3)
    ends = Joints((0.1, 0.2, 0.3)), (Joints((0.9, -0.4, 0.6)),)
    return move(Move(ARM, *ends, total_time=bounds), objective, 20)


each_kind = pytest.mark.parametrize("kind", ["segments", "knots", "tracing", "move"])


@each_kind
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_it_is_a_variable_where_sooner_may_be_worse(kind: str, objective: str) -> None:
    names = [variable.name for variable in made(kind, objective).variables]
    assert names.count("slowness") == int(OBJECTIVES[objective].chooses_duration)
    assert "slowness" not in names or names[-1] == "slowness"


@each_kind
@pytest.mark.parametrize("bounds", [None, (0.2, 40.0)])
def test_it_multiplies_the_least_duration(kind: str, bounds: tuple[float, float] | None) -> None:
    problem, least = made(kind, "energy", bounds), made(kind, "time", bounds)
    rng = np.random.default_rng(0)
    for _ in range(5):
        x = rng.uniform(*least.bounds)
        shortest = least.motion.durations(least.parameters_of(x))
        longest_part = float(ca.mmax(ca.DM(shortest)))
        most = MOST if bounds is None else float(problem.encoding.slowness.longest) / longest_part  # type: ignore[attr-defined]
        for share in (0.0, 0.5, 1.0):
            candidate = np.append(x, share)
            found = problem.motion.durations(problem.parameters_of(candidate))
            expected = np.asarray(ca.DM(shortest)) * (1.0 + (max(most, 1.0) - 1.0) * share**2)
            assert np.asarray(ca.DM(found)) == pytest.approx(expected, rel=1e-12)
    if bounds is not None:
        assert longest_part * most == pytest.approx(40.0, rel=1e-3)


@each_kind
def test_the_cost_is_that_of_the_slower_motion(kind: str) -> None:
    problem = made(kind, "energy")
    rng = np.random.default_rng(1)
    candidates = rng.uniform(*problem.bounds, (6, len(problem.variables)))
    costs = problem.cost(candidates)
    for x, cost in zip(candidates, costs, strict=True):
        if cost <= problem.objective_upper_bound:
            samples = problem.motion.samples(problem.parameters_of(x))
            assert cost == pytest.approx(float(problem.objective.value(samples)), rel=1e-9)
            assert problem.trajectory(x).duration == pytest.approx(float(ca.DM(samples.duration)), rel=0.05)


def test_none_between_moving_ends() -> None:
    task = Move(ARM, Joints((0.1, 0.2, 0.3)), (Joints((0.9, -0.4, 0.6)),), goal_velocity=(0.5, 0.0, 0.0))
    assert "slowness" not in [variable.name for variable in move(task, "energy", 20).variables]


def test_the_longest_duration_bounds_it() -> None:
    assert Slowness().longest_of(2.0) == 2.0 * MOST
    assert Slowness(5.0).longest_of(2.0) == 5.0
    assert float(Slowness(5.0).factor(ca.DM([0.3, 1.0]), ca.DM(2.0))) == 2.5
    assert float(Slowness(1.0).factor(ca.DM([0.3, 1.0]), ca.DM(2.0))) == 1.0
