"""Starts of programs: end postures, postures at points, profiles, a grid over the redundancy; seeds say which."""

from __future__ import annotations

from itertools import islice, product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import following, moving
from helpers.slow import slow_except
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize

from problems import OBJECTIVES, Ellipse, PlanarArm, PointToPoint, Problem, closed_curve
from problems.base import FloatArray
from problems.certify import exact_time_scale
from problems.families.knots import starts
from problems.families.knots.starts import RedundancyGrid
from problems.families.two_segments.starts import PROFILES, SKEWED, EndPostures, Ends, PointToPointStarts, Profile
from problems.limits import limits_of
from problems.programs.starts import LONGEST, SUM, Displacement, PointPostures
from problems.tasks import Elbow

ARM = PlanarArm((0.6, 0.6, 0.5, 0.3), (4.0, 2.0, 4.0, 4.0), (20.0, 20.0, 40.0, 20.0))
CURVE = closed_curve((0.1, 0.0), 1.0, 0.0, 3, 0.1, 12)
CASES: dict[str, Problem[Any]] = {
    "time": moving(ARM, (1.0, 0.0), (0.5, 1.5), "time", "free"),
    "length": moving(ARM, (1.0, 0.0), (0.5, 1.5), "length", "up", obstacles=(Ellipse((0.8, 0.8), (0.15, 0.25)),)),
    "path": following(ARM, CURVE, 0.05, "time", "free"),
    "path, obstacle": following(ARM, CURVE, 0.05, "rotation", "up", obstacles=(Ellipse((0.4, 0.0), (0.1, 0.1)),)),
}


def first_starts(problem: Problem[Any], seed: int, count: int = 7) -> FloatArray:
    return np.array(list(islice(problem.nlp().starts(np.random.default_rng(seed)), count)))


@pytest.mark.parametrize("case", slow_except(CASES, ("time", "path")))
def test_a_seed_says_which(case: str) -> None:
    first, again, other = (first_starts(CASES[case], seed) for seed in (1, 1, 2))
    assert (first == again).all()
    assert not np.array_equal(first, other)
    assert np.isfinite(first).all()


def test_starts_of_few_values_meet_the_rows_that_tie_the_knots_to_them() -> None:
    problem = following(ARM, CURVE, 0.05, "rotation", "up", knot_redundancy="values")
    program = problem.nlp()
    rows = next(c for c in program.rows if c.name == "redundancy")
    miss = ca.Function("miss", [program.x], [rows.expression])
    _, *constants = first_starts(problem, 0, 4)  # the first is the cheapest over the grid
    for x in constants:
        assert np.asarray(miss(x)) == pytest.approx(0.0, abs=1e-9)


# End postures of least displacement: against SciPy, against the closed form of two links

START, GOAL = (1.0, 0.0), (0.5, 1.5)
SPEED, ACCELERATION = (4.0, 2.0, 6.0), (20.0, 30.0, 10.0)


def ends(displacement: Displacement, elbow: Elbow = "up", links: int = 3) -> EndPostures:
    arm = PlanarArm((2.0 / links,) * links, SPEED[:links], ACCELERATION[:links])
    return EndPostures(arm, START, GOAL, elbow, displacement, SKEWED)


def tip(arm: PlanarArm, theta: FloatArray) -> FloatArray:
    psi = np.cumsum(theta)
    return np.array(arm.link_lengths) @ np.column_stack([np.cos(psi), np.sin(psi)])


@pytest.mark.parametrize(("displacement", "elbow"), [(LONGEST, "up"), (SUM, "free")], ids=["longest", "sum"])
def test_no_other_solver_finds_a_shorter_way(displacement: Displacement, elbow: Elbow) -> None:
    program = ends(displacement, elbow)
    [best] = program.best(np.random.default_rng(0), 12, 1)
    assert tip(program.robot, best.theta_s) == pytest.approx(START, abs=1e-6)
    assert tip(program.robot, best.theta_f) == pytest.approx(GOAL, abs=1e-6)
    assert best.value == pytest.approx(program.value(best.theta_f - best.theta_s))

    def smooth(z: FloatArray) -> float:  # a p-norm close to the largest, or a rounded sum
        way = z[3:] - z[:3]
        if displacement.longest:
            each = np.maximum(
                SKEWED.peaks[0] * np.abs(way) / SPEED, np.sqrt(SKEWED.peaks[1] * (np.abs(way) + 1e-9) / ACCELERATION)
            )
            return float((each**40).sum() ** (1.0 / 40.0))
        return float(np.sqrt(way**2 + 1e-8).sum())

    def miss(z: FloatArray) -> FloatArray:
        return np.append(tip(program.robot, z[:3]), tip(program.robot, z[3:])) - [*START, *GOAL]

    on_points = {"type": "eq", "fun": miss}
    box = [(-9.0, 9.0), (0.0, np.pi) if elbow == "up" else (-9.0, 9.0), (-9.0, 9.0)] * 2
    theirs, rng = [], np.random.default_rng(1)
    for _ in range(12):
        start = program.draw(rng)
        z = np.concatenate([start.theta_s, start.theta_f])
        result = minimize(smooth, z, constraints=[on_points], bounds=box, method="SLSQP", options={"maxiter": 200})
        if result.success and np.abs(miss(result.x)).max() < 1e-6:
            theirs.append(program.value(result.x[3:] - result.x[:3]))
    assert theirs
    assert best.value <= min(theirs) * (1.0 + 1e-3)


def test_joint_limits_hold_at_both_ends() -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), SPEED, ACCELERATION, ((-0.5, 1.2), (0.2, 2.8), (-2.0, 2.0)))
    low, high = np.array(arm.joint_limits).T
    for solution in EndPostures(arm, START, GOAL, "up", SUM, SKEWED).best(np.random.default_rng(0), 8, 8):
        for theta in (solution.theta_s, solution.theta_f):
            assert (theta >= low - 1e-6).all()
            assert (theta <= high + 1e-6).all()


# Postures at points: on their points by independent kinematics, nearest as the arm itself says


# Profiles keep the limits, and no more than that


POSITIVE = st.floats(0.1, 10.0)


@settings(max_examples=15, deadline=None)
@given(
    profile=st.sampled_from(PROFILES),
    way=st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3),
    speed=st.tuples(POSITIVE, POSITIVE, POSITIVE),
    acceleration=st.tuples(POSITIVE, POSITIVE, POSITIVE),
)
def test_a_motion_along_a_profile_keeps_its_limits_and_is_as_fast_as_they_allow(
    profile: Profile, way: list[float], speed: tuple[float, ...], acceleration: tuple[float, ...]
) -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), speed, acceleration)
    task = PointToPoint(arm, (1.0, 0.0), (0.5, 1.5))
    quantities = PointToPointStarts(task, OBJECTIVES["time"]).along(Ends(np.zeros(3), np.array(way), 0.0), profile)
    shortest = min(float(quantities.t1), float(quantities.t2))
    used = exact_time_scale(limits_of(arm, ()), quantities.trajectory())
    assert used <= 1.0 + 1e-9
    assert shortest >= task.time_box[0] - 1e-12
    assert max(used, task.time_box[0] / shortest) == pytest.approx(1.0, abs=1e-9)


# Dynamic programming over the redundancy: against every sequence there is, on a small grid

LIMITS = ((-3.0, 3.0), (0.0, 3.0), (-2.9, 2.9))
POINTS = [(1.0, 0.0), (1.0, 0.4), (0.7, 0.9), (0.2, 1.1)]
WEIGHTS = np.array([1.0, 0.5, 2.0])


def grid(elbows: tuple[float, ...] = (1.0,), limited: bool = False, exponent: float = 3.0) -> RedundancyGrid:
    arm = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, LIMITS if limited else None)
    return RedundancyGrid(PointPostures(arm, POINTS), elbows, (), WEIGHTS, exponent)


@pytest.mark.parametrize(
    ("elbows", "limited", "exponent"), [((1.0,), False, 1.5), ((-1.0, 1.0), False, 3.0), ((1.0,), True, 3.0)]
)
def test_no_sequence_is_cheaper(
    elbows: tuple[float, ...], limited: bool, exponent: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(starts, "MAX_POSTURES_PER_KNOT", 7)
    small, shift = grid(elbows, limited, exponent), np.array([0.3])
    way = small.cheapest(shift)
    theta, possible = small.table(shift)
    costs = {}
    for chosen in product(range(theta.shape[1]), repeat=len(POINTS)):
        if all(possible[knot, state] for knot, state in enumerate(chosen)):
            steps = np.diff([theta[knot, state] for knot, state in enumerate(chosen)], axis=0)
            short = steps if limited else (steps + np.pi) % (2.0 * np.pi) - np.pi
            costs[chosen] = float((np.abs(WEIGHTS * short) ** exponent).sum())
    assert way is not None
    assert (np.abs(WEIGHTS * np.diff(way, axis=0)) ** exponent).sum() == pytest.approx(min(costs.values()))
    best = theta[range(len(POINTS)), min(costs, key=lambda chosen: costs[chosen])]
    assert np.exp(1j * way) == pytest.approx(np.exp(1j * best))


def test_postures_that_touch_an_obstacle_are_left_out() -> None:
    free = grid()
    beside = Ellipse((0.45, 0.35), (0.1, 0.1))
    around = RedundancyGrid(free.postures, (1.0, -1.0), (beside,), WEIGHTS, 3.0)
    way = around.cheapest(np.zeros(1))
    assert way is not None
    for theta in way:
        corners = np.append(0.0, np.cumsum(np.array([0.7, 0.7, 0.6]) * np.exp(1j * np.cumsum(theta))))
        along = np.linspace(corners[:-1], corners[1:], 200)
        assert np.abs(along - (0.45 + 0.35j)).min() > 0.1 - 1e-3
    everywhere = Ellipse((0.6, 0.2), (0.55, 0.55))
    assert RedundancyGrid(free.postures, (1.0,), (everywhere,), WEIGHTS, 3.0).cheapest(np.zeros(1)) is None
