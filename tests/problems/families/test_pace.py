"""How fast a path is run: shares of the speed limits where obstacles move, the duration where sooner may be worse."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links, following, moving
from helpers.moving_scenes import CROSSED, CROSSING, HERE, THERE, WAITING, WAITING_BOUND
from helpers.searching import VM, sampled
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import OBJECTIVES, Joints, Move, PlanarArm, Problem, move
from problems.assembly import LocalTimeScale
from problems.assembly.encoding import LARGEST_TIME_SCALE
from problems.assembly.path_timing import KNOTS, LEAST_SHARE
from problems.base import as_array
from problems.certify import CertificateStatus
from problems.families.traced import tracing
from problems.motions import PathSpline
from problems.tasks import Path, PathTracing
from solvers import LSHADE, Budget, SearchBox, minimize

MASSIVE = equal_links(3, link_masses=(1.0, 2.0, 3.0))
LINE = Path(((1.0, 0.5), (1.1, 0.6), (1.2, 0.6)))
AT_REST = (ca.DM(0.0), None)
STILL = replace(CROSSED, obstacles=(CROSSING.still,))
CROSSED_PROBLEM = move(CROSSED, samples=30)
MOTION = PathSpline(PlanarArm((1.0, 1.0), (1.0, 9.0), (2.5, 9.0)), (0.0, 0.5, 1.0), 10)


def test_a_variable_from_0_on_makes_use_of_all_and_minus_1_crawls() -> None:
    shares = np.exp(as_array(LocalTimeScale().logarithms(ca.DM([1.0, 0.0, -0.5, -1.0, 0.3]))).ravel())
    assert shares == pytest.approx([1.0, 1.0, np.sqrt(LEAST_SHARE), LEAST_SHARE, 1.0], rel=1e-12)


def test_a_line_at_half_of_the_speed_limits() -> None:
    """1 rad at 2.5 rad/s^2 up to 0.5 rad/s: two ramps of 0.2 s and 0.05 rad, 0.9 rad in 1.8 s."""
    line = ca.DM(MOTION.spline.greville[:, None] * np.array([1.0, 0.0]))
    timed = MOTION.timed(line, AT_REST, ca.DM.ones(MOTION.parameters_u.size, 1) / 2.0)
    assert float(timed.duration) == pytest.approx(2.2, rel=1e-9)


def test_a_graded_grid_is_passed_at_equal_times() -> None:
    """1 rad at 4 rad/s^2 takes 1 s and 0.5 s to its middle: each of the ten steps of either half takes 0.05 s."""
    motion = PathSpline(PlanarArm((1.0, 1.0), (9.0, 9.0), (4.0, 9.0)), (0.0, 0.5, 1.0), 10, graded=(True, True))
    assert np.diff(motion.parameters_u) == pytest.approx(motion.double_steps / 2.0, rel=1e-12)
    timed = motion.timed(ca.DM(motion.spline.greville[:, None] * np.array([1.0, 0.0])), AT_REST)
    assert float(timed.duration) == pytest.approx(1.0, rel=1e-9)
    times = motion.samples(timed).times
    assert times is not None
    assert as_array(times).ravel() == pytest.approx(np.linspace(0.0, 1.0, 21), abs=1e-7)


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10_000), st.lists(st.floats(LEAST_SHARE, 1.0), min_size=21, max_size=21))
def test_whatever_the_shares_limits_hold_and_less_is_slower(seed: int, shares: list[float]) -> None:
    points = ca.DM(np.random.default_rng(seed).uniform(-1.5, 1.5, (MOTION.spline.size, 2)))
    full, pace = MOTION.timed(points, AT_REST), np.array(shares)
    slowed = MOTION.timed(points, AT_REST, ca.DM(pace))
    unchanged = MOTION.timed(points, AT_REST, ca.DM.ones(21, 1))
    assert float(ca.norm_inf(unchanged.squared - full.squared)) == 0.0
    assert float(slowed.duration) >= float(full.duration) * (1.0 - 1e-9)
    samples, limits = MOTION.samples(slowed), MOTION.robot.limits
    assert (np.abs(as_array(samples.speed)) <= np.array(limits.speed) * pace[:, None] * (1.0 + 1e-9)).all()
    first, second = (as_array(MOTION.spline.sampling_matrix(MOTION.parameters_u, n)) @ as_array(points) for n in (1, 2))
    squared = as_array(slowed.squared)
    c = np.diff(squared, axis=0) / MOTION.double_steps[:, None]
    for end in (slice(None, -1), slice(1, None)):
        reached = np.abs(second[end] * squared[end] + first[end] * c) / np.array(limits.acceleration)
        assert reached.max() <= 1.0 + 1e-6


def test_only_where_an_obstacle_moves_there_is_something_to_wait_for() -> None:
    def names(task: Move) -> list[str]:
        return [variable.name for variable in move(task).variables]

    def without_local(listed: list[str]) -> list[str]:
        return [name for name in listed if not name.startswith("local_time_scale_")]

    assert sum(name.startswith("local_time_scale_") for name in names(CROSSED)) == KNOTS
    assert without_local(names(CROSSED)) == names(STILL)
    moving = replace(CROSSED, start_velocity=(0.5, 0.0))
    assert names(moving)[-KNOTS:] == ["time_scale_start", *(f"local_time_scale_{knot}" for knot in range(2, KNOTS + 1))]


def test_with_all_of_the_limits_an_obstacle_out_of_reach_changes_nothing_but_the_share_and_the_grid() -> None:
    x = np.random.default_rng(0).uniform(*move(STILL, samples=30).bounds)
    still, timed = move(STILL, samples=30), CROSSED_PROBLEM
    even = replace(still.motion, share=timed.motion.share, graded=timed.motion.graded)
    least = float(even.timed(*still.encoding.path(ca.DM(x))).duration)
    assert float(timed.parameters_of(np.append(x, np.ones(KNOTS))).duration) == least


def test_steps_over_samples_cost_what_the_model_costs_of_a_traced_path() -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3)
    task = PathTracing(arm, LINE, 0.1, "up", obstacles=(CROSSING,))
    problem = tracing(task, "time", 20, 3)
    assert len(problem.variables) == 3 + KNOTS
    x = sampled(problem, 20)
    function = problem.program.inlined()
    np.testing.assert_allclose(problem.evaluator(VM)(x), as_array(function.map(20)(x.T)).ravel(), rtol=1e-9)
    paces = (np.full(KNOTS, -0.5), np.ones(KNOTS))
    durations = [float(problem.parameters_of(np.append(x[0, :3], pace)).duration) for pace in paces]
    assert durations[0] > durations[1]


def test_the_motion_of_a_candidate_has_the_times_of_its_search_and_keeps_its_limits() -> None:
    box = SearchBox(*CROSSED_PROBLEM.bounds)
    for x in box.sample(np.random.default_rng(1), 5):
        searched = CROSSED_PROBLEM.motion.samples(CROSSED_PROBLEM.parameters_of(x))
        assert searched.times is not None
        trajectory = CROSSED_PROBLEM.trajectory(x)
        duration, times = float(searched.duration), as_array(searched.times).ravel()
        assert duration * (1.0 - 1e-4) <= trajectory.duration <= duration * 1.02
        assert CROSSED_PROBLEM.criteria.safe_time_scale(trajectory) <= 1.0 + 1e-6
        speeds = np.abs(as_array(searched.speed)).max()
        late = trajectory.at(times * trajectory.duration / duration) - as_array(searched.theta)
        assert np.abs(late).max() <= 0.02 * speeds * duration


@pytest.mark.slow
def test_it_waits_for_the_way_to_be_free() -> None:
    problem = move(WAITING)
    best = minimize(problem.evaluator(VM), SearchBox(*problem.bounds), LSHADE(), Budget(1500), 0)
    trajectory = problem.trajectory(best.x)
    assert {verdict.status for verdict in problem.criteria.verify(trajectory)} == {CertificateStatus.CERTIFIED}
    assert WAITING_BOUND <= trajectory.duration <= 1.04 * WAITING_BOUND
    hurried = problem.trajectory(np.append(best.x[:-KNOTS], np.ones(KNOTS)))
    assert hurried.duration < WAITING_BOUND - 0.5
    verdicts = problem.criteria.verify(hurried)
    assert any(v.status is CertificateStatus.VIOLATED for v in verdicts if v.name == "clearance")
    start, goal = trajectory.at(trajectory.breakpoints[[0, -1]])
    assert start == pytest.approx(np.array(HERE.values), abs=1e-12)
    assert goal == pytest.approx(np.array(THERE.values), abs=1e-9)


# The duration as a variable: where it is one, what it does, and that a candidate's motion has it


@cache
def made(kind: str, objective: str, bounds: tuple[float, float] | None = None) -> Problem[Any]:
    if kind == "segments":
        return moving(MASSIVE, (1.0, 0.0), (0.5, 1.5), objective, "up", "reduced", samples=8, segment_time=bounds)
    if kind == "knots":
        return following(MASSIVE, LINE, 0.1, objective, "up", "reduced", total_time=bounds)
    if kind == "tracing":
        return tracing(PathTracing(MASSIVE, LINE, 0.1, "up", total_time=bounds), objective, 20, 3)
    ends = Joints((0.1, 0.2, 0.3)), (Joints((0.9, -0.4, 0.6)),)
    return move(Move(MASSIVE, *ends, total_time=bounds), objective, 20)


each_kind = pytest.mark.parametrize("kind", ["segments", "knots", "tracing", "move"])


@each_kind
def test_it_is_a_variable_where_sooner_may_be_worse(kind: str) -> None:
    for name, objective in OBJECTIVES.items():
        names = [variable.name for variable in made(kind, name).variables]
        assert names.count("time_scale") == int(objective.chooses_duration)
        assert "time_scale" not in names or names[-1] == "time_scale"


@each_kind
@pytest.mark.parametrize("bounds", [None, (0.2, 40.0)])
def test_it_multiplies_the_least_duration(kind: str, bounds: tuple[float, float] | None) -> None:
    problem, least = made(kind, "energy", bounds), made(kind, "time", bounds)
    rng = np.random.default_rng(0)
    for _ in range(5):
        x = rng.uniform(*least.bounds)
        shortest = least.motion.durations(least.parameters_of(x))
        longest_part = float(ca.mmax(ca.DM(shortest)))
        most = LARGEST_TIME_SCALE if bounds is None else float(problem.encoding.time_scale.longest) / longest_part  # type: ignore[attr-defined]
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
            assert cost == pytest.approx(float(problem.criteria.objective.value(samples)), rel=1e-9)
            assert problem.trajectory(x).duration == pytest.approx(float(ca.DM(samples.duration)), rel=0.05)


def candidates_of(problem: Problem[Any], count: int) -> np.ndarray:
    """Paths that wind, a little slower than they could be run."""
    found = np.random.default_rng(2).uniform(*problem.bounds, (count, len(problem.variables)))
    found[:, -1] = 0.1
    return found


@pytest.mark.parametrize(("kind", "most"), [("tracing", 2e-3), ("move", 5e-3)])
def test_an_integral_is_that_of_the_motion_itself(kind: str, most: float) -> None:
    """Both sides of every jump of an acceleration count, and the finished motion keeps the timing of the search."""
    problem, robot = made(kind, "energy"), MASSIVE
    for x in candidates_of(problem, 4):
        value = float(problem.criteria.objective.value(problem.motion.samples(problem.parameters_of(x))))
        own = problem.motion.trajectory(problem.parameters_of(x))
        for motion in (own, problem.trajectory(x)):
            found = problem.criteria.objective.of_motion(motion, robot, motion.breakpoints)
            assert found == pytest.approx(value, rel=most)
            assert motion.duration == pytest.approx(own.duration, rel=1e-3)


@pytest.mark.slow
def test_under_a_jerk_limit_a_motion_has_a_timing_of_its_own() -> None:
    """It is the fastest smooth one, run in the search's duration where that is longer, and not one below it."""
    robot = replace(MASSIVE, max_jerk=(200.0,) * 3)
    ends = Joints((0.1, 0.2, 0.3)), (Joints((0.9, -0.4, 0.6)),)
    energy, time = (move(Move(robot, *ends), objective, 20) for objective in ("energy", "time"))
    x = np.append(candidates_of(time, 1)[0], 0.0)
    assert energy.trajectory(x).duration == pytest.approx(time.trajectory(x[:-1]).duration, rel=1e-9)


def test_none_between_moving_ends() -> None:
    task = Move(MASSIVE, Joints((0.1, 0.2, 0.3)), (Joints((0.9, -0.4, 0.6)),), goal_velocity=(0.5, 0.0, 0.0))
    assert "time_scale" not in [variable.name for variable in move(task, "energy", 20).variables]
