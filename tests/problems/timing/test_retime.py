"""Least time along a path: optimal where the optimum is known, limits kept for all t, corners stopped at."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.slow import slow_except
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from problems import InvalidProblem, Trajectory
from problems.base import FloatArray
from problems.core import LinearProgram
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import SpeedProfile, departure, retime
from problems.timing.free_space import least_durations, rest_to_rest
from problems.timing.parametrisation import DEGREE, Parametrisation, ParametrisationEnds
from problems.timing.prepared import peak_ratios
from problems.timing.smooth_timing import ParametrisationSearch

LIMITS = JointLimits(speed=(2.0, 3.0), acceleration=(10.0, 5.0))
SMOOTH = replace(LIMITS, jerk=(200.0, 100.0))
WAYPOINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (6, 2))


def polyline(waypoints: FloatArray, u: FloatArray | None = None) -> JointPath:
    u = np.arange(float(len(waypoints))) if u is None else u
    return JointPath(u, np.stack([np.diff(waypoints, axis=0) / np.diff(u)[:, None], waypoints[:-1]]))


def curve() -> JointPath:
    spline = CubicSpline(np.arange(6.0), WAYPOINTS)
    return JointPath(spline.x, spline.c)


def shaped(shape: list[float]) -> JointPath:
    """A straight line whose share is a polynomial of the parameter, lowest power first."""
    start, goal = WAYPOINTS[:2]
    coefficients = np.multiply.outer(np.array(shape[::-1]), goal - start)[:, None]
    coefficients[-1] += start
    return JointPath(np.array([0.0, 1.0]), coefficients)


def along_line(start: FloatArray, goal: FloatArray) -> float:
    """The least duration on a straight line: of one joint with the tightest limits."""
    way = np.abs(goal - start)
    speed, acceleration = (float((np.array(limit) / way).min()) for limit in (LIMITS.speed, LIMITS.acceleration))
    one = JointLimits(speed=(speed,), acceleration=(acceleration,))
    return float(least_durations(np.ones(1), one)[0])


def check_kept(trajectory: Trajectory, limits: JointLimits = LIMITS) -> None:
    """Limits at 20,000 times, by NumPy alone; no jump of velocity, nor of acceleration where there is a jerk."""
    times = np.linspace(0.0, trajectory.duration, 20_000)
    inner = trajectory.breakpoints[1:-1]
    jumps = [(limits.speed, 1e-10)] if limits.jerk is None else [(limits.speed, 1e-10), (limits.acceleration, 1e-8)]
    for order, (bound, spare) in enumerate(((limits.speed, 1e-9), (limits.acceleration, 1e-9), (limits.jerk, 1e-8)), 1):
        if bound is not None:
            assert (np.abs(trajectory.at(times, order)) <= np.array(bound) * (1.0 + spare)).all()
    for order, (bound, rounding) in enumerate(jumps, start=1):
        before, after = trajectory.at(np.nextafter(inner, 0.0), order), trajectory.at(inner, order)
        np.testing.assert_allclose(before, after, atol=rounding * max(bound))


@pytest.mark.parametrize(
    ("shape", "loss"),
    [
        ([0.0, 1.0], 1e-4),
        ([0.0, 0.0, 3.0, -2.0], 3e-4),  # at rest at both ends
        ([0.0, 0.0, 0.0, 10.0, -15.0, 6.0], 4e-3),
    ],
)
def test_straight_line_needs_its_closed_form(shape: list[float], loss: float) -> None:
    trajectory = retime(shaped(shape), LIMITS)
    check_kept(trajectory)
    assert 1.0 - 1e-9 <= trajectory.duration / along_line(*WAYPOINTS[:2]) < 1.0 + loss
    np.testing.assert_allclose(trajectory.at(trajectory.breakpoints[[0, -1]], 1), 0.0, atol=1e-12)


def test_corners_are_stops() -> None:
    trajectory = retime(polyline(WAYPOINTS), LIMITS)
    check_kept(trajectory)
    stops = sum(along_line(*pair) for pair in pairwise(WAYPOINTS))
    assert stops * (1.0 - 1e-9) <= trajectory.duration < stops * 1.001
    for waypoint in WAYPOINTS:
        at = trajectory.breakpoints[np.abs(trajectory.at(trajectory.breakpoints) - waypoint).max(axis=1).argmin()]
        np.testing.assert_allclose(trajectory.at(np.array([at])), [waypoint], atol=1e-12)
        np.testing.assert_allclose(trajectory.at(np.array([at]), 1), 0.0, atol=1e-12)


def test_a_jump_of_the_parametrisation_is_no_corner() -> None:
    waypoints = np.multiply.outer([0.0, 1.0, 1.5, 4.0], [1.0, 2.0])
    uneven = retime(polyline(waypoints, np.array([0.0, 1.0, 5.0, 5.5])), LIMITS)
    assert uneven.duration == pytest.approx(along_line(waypoints[0], waypoints[-1]), rel=1e-4)


def test_pieces_that_stand_still_cost_nothing() -> None:
    with_pauses = retime(polyline(WAYPOINTS[[0, 0, 1, 2, 2, 3]]), LIMITS)
    assert with_pauses.duration == pytest.approx(retime(polyline(WAYPOINTS[:4]), LIMITS).duration, rel=1e-9)


def test_a_curve_touches_its_limits() -> None:
    trajectory = retime(curve(), LIMITS)
    check_kept(trajectory)
    assert LIMITS.time_scale(peak_ratios(trajectory, LIMITS)) == pytest.approx(1.0, abs=1e-10)


@pytest.mark.parametrize(("share", "limits"), [(0.3, LIMITS), (1.0, LIMITS), (0.6, SMOOTH)])
def test_velocities_at_the_ends_are_exact(share: float, limits: JointLimits) -> None:
    path = curve() if limits.jerk is None else JointPath.through(WAYPOINTS)
    slopes = path.at(path.breakpoints[[0, -1]], 1)
    rates = share * (np.array(LIMITS.speed) / np.abs(slopes)).min(axis=1)
    trajectory = retime(path, limits, (float(rates[0]), float(rates[1])))
    check_kept(trajectory, limits)
    found = trajectory.at(trajectory.breakpoints[[0, -1]], 1)
    np.testing.assert_allclose(found, slopes * rates[:, None], atol=1e-13 if limits.jerk is None else 1e-10)


@pytest.mark.parametrize("factor", [1e-6, 1e6])
def test_units_do_not_matter(factor: float) -> None:
    unit = retime(curve(), LIMITS).duration
    path = curve()
    in_other_units = JointPath(
        path.breakpoints * factor, path.coefficients / factor ** np.arange(3, -1, -1)[:, None, None]
    )
    assert retime(in_other_units, LIMITS).duration == pytest.approx(unit, rel=1e-6)
    turned = JointPath(path.breakpoints, path.coefficients * factor)
    faster = JointLimits(speed=(2.0 * factor, 3.0 * factor), acceleration=(10.0 * factor, 5.0 * factor))
    assert retime(turned, faster).duration == pytest.approx(unit, rel=1e-6)


def test_without_the_linear_program_slower_but_valid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LinearProgram, "solved", lambda self: None)
    for path, limits in ((curve(), LIMITS), (polyline(WAYPOINTS), LIMITS), (JointPath.through(WAYPOINTS), SMOOTH)):
        check_kept(retime(path, limits), limits)


def test_a_move_retimed_is_that_move() -> None:
    move = rest_to_rest(np.zeros(2), np.array([1.0, 0.2]), LIMITS)
    again = retime(JointPath.of(move), LIMITS)
    assert again.duration == pytest.approx(move.duration, rel=2e-3)


# With jerk limits


SPLINED, SLOW = JointPath.through(WAYPOINTS), replace(SMOOTH, jerk=(2.0, 1.0))
CORNERS, BLENDED = polyline(WAYPOINTS), JointPath.blended(WAYPOINTS, 0.1)


@pytest.mark.parametrize(
    ("path", "limits", "beside", "most"),  # longer than another motion, but not as many times as long
    [
        (SPLINED, SMOOTH, (SPLINED, LIMITS), 1.06),
        (SPLINED, SLOW, (SPLINED, SMOOTH), np.inf),
        (CORNERS, SMOOTH, (BLENDED, SMOOTH), np.inf),
        (shaped([0.0, 0.0, 3.0, -2.0]), SMOOTH, (polyline(WAYPOINTS[:2]), SMOOTH), 1.03),
    ],
    ids=["limited", "jerk alone", "stops at corners", "at rest at its ends"],
)
def test_jerk_limits_are_kept_and_cost_little(
    path: JointPath, limits: JointLimits, beside: tuple[JointPath, JointLimits], most: float
) -> None:
    trajectory, other = retime(path, limits), retime(*beside)
    check_kept(trajectory, limits)
    check_kept(other, beside[1])
    assert trajectory.largest_jump() < 1e-9
    assert other.duration < trajectory.duration < most * other.duration


def test_near_the_optimum_where_that_is_known() -> None:
    line = polyline(WAYPOINTS[:2])
    rounded = JointPath(line.breakpoints, np.concatenate([np.full((1, 1, 2), 1e-7), line.coefficients]))
    best = retime(line, SMOOTH)
    found = retime(rounded, SMOOTH)
    check_kept(found, SMOOTH)
    assert best.duration == pytest.approx(
        rest_to_rest(np.zeros(1), np.ones(1), limits_along(WAYPOINTS[1] - WAYPOINTS[0])).duration, rel=1e-12
    )
    assert best.duration * (1.0 - 1e-5) < found.duration < best.duration * 1.01


def limits_along(way: FloatArray) -> JointLimits:
    """What is left of the limits for the share of a line."""
    speed, acceleration, jerk = (
        (float((np.array(limit) / np.abs(way)).min()),) for limit in (SMOOTH.speed, SMOOTH.acceleration, SMOOTH.jerk)
    )
    return JointLimits(speed=speed, acceleration=acceleration, jerk=jerk)


def test_velocities_that_jerk_limits_do_not_allow() -> None:
    path = polyline(WAYPOINTS[:2])
    short = JointPath(path.breakpoints, path.coefficients * 0.2)
    with pytest.raises(InvalidProblem, match=r"^rates: no motion was found that keeps the jerk limits"):
        retime(short, JointLimits(speed=(9.0, 9.0), acceleration=(1e3, 1e3), jerk=(10.0, 10.0)), (8.0, 0.0))


@pytest.mark.parametrize("seed", [0, 2])
def test_motions_between_moving_ends_are_found_where_programs_contradict_themselves(seed: int) -> None:
    """A step without a solution is tried again nearer by; neither of these was found before."""
    rng = np.random.default_rng(seed)
    path = JointPath.through(np.cumsum(rng.uniform(-1.0, 1.0, (3 + seed, 2 + seed)), axis=0))
    speed, acceleration = rng.uniform(1.0, 3.0, 2 + seed), rng.uniform(4.0, 15.0, 2 + seed)
    limits = JointLimits(speed=tuple(speed), acceleration=tuple(acceleration), jerk=tuple(10.0 * acceleration))
    rates = rng.uniform(0.05, 0.5, 2) * (speed / np.abs(path.at(path.breakpoints[[0, -1]], 1))).min(axis=1)
    check_kept(retime(path, limits, (float(rates[0]), 0.0)), limits)


@pytest.mark.parametrize("slow", [1e-2, 1e-4])
def test_where_a_given_motion_crawls_is_no_limit(slow: float) -> None:
    """From a moving start, where the parameter is the time, on at a crawl."""
    u = np.cumsum([0.0, 0.1, 0.8 / slow, 0.1])
    q = np.array([[0.0, 0.0], [0.05, 0.06], [0.85, 0.96], [0.95, 1.01]])
    v = np.array([[1.0, 1.2], [slow, 1.125 * slow], [slow, 1.125 * slow], [0.0, 0.0]])
    given = CubicHermiteSpline(u, q, v)
    limits = JointLimits(speed=(3.0, 3.0), acceleration=(15.0, 15.0))
    trajectory = retime(JointPath(given.x, given.c), limits, (1.0, 0.0))
    check_kept(trajectory, limits)
    assert trajectory.duration < 5.0


# What cannot be timed


def jumping() -> JointPath:
    path = polyline(WAYPOINTS)
    coefficients = path.coefficients.copy()
    coefficients[-1, 2, 0] += 0.1
    return JointPath(path.breakpoints, coefficients)


@pytest.mark.parametrize(
    ("path", "rates", "message"),
    [
        (polyline(WAYPOINTS[[0, 0]]), (0.0, 0.0), "path: it stands still: there is nothing to time"),
        (jumping(), (0.0, 0.0), "path: joint 1 jumps by 0.1 rad where the parameter is 2"),
        (polyline(WAYPOINTS * np.nan), (0.0, 0.0), "path: a coefficient is not a number, or the parameter does not"),
        (polyline(WAYPOINTS[:, :1]), (0.0, 0.0), "path: 1 joints for limits of 2"),
        (curve(), (-1.0, 0.0), "rates: du/dt at an end is negative or not a number"),
        (curve(), (0.0, np.inf), "rates: du/dt at an end is negative or not a number"),
        (curve(), (9.0, 0.0), r"rates: start: joint 1 at .* rad/s may not exceed 2 rad/s"),
        (polyline(WAYPOINTS[:2] * 0.01), (50.0, 0.0), "rates: the limits allow no motion along the path with these"),
    ],
)
def test_what_cannot_be_timed(path: JointPath, rates: tuple[float, float], message: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^{message}"):
        retime(path, LIMITS, rates)


@pytest.mark.parametrize("seed", slow_except([63, 119, 169], [119, 169]))
def test_a_start_too_fast_for_so_short_a_path_is_refused_or_slowed_in_time(seed: int) -> None:
    """Laws that would have to turn back are none."""
    rng = np.random.default_rng(seed)
    k, m = int(rng.integers(1, 7)), int(rng.integers(3, 9))
    scale = 10 ** rng.uniform(-5, 1)
    waypoints = np.cumsum(scale * rng.normal(size=(m, k)) * 10 ** rng.uniform(-3, 1, (m, 1)), axis=0)
    most = rng.uniform(4, 20, k)
    speed, jerk = tuple(rng.uniform(1, 4, k)), tuple(rng.choice([5, 50, 500]) * most)
    limits = JointLimits(speed=speed, acceleration=tuple(most), jerk=jerk)
    with suppress(InvalidProblem):
        motion = retime(JointPath.through(waypoints), limits, rates=(float(10 ** rng.uniform(-3, 1)), 0.0))
        assert limits.time_scale(peak_ratios(motion, limits)) <= 1.0 + 1e-9


def test_a_law_that_would_turn_back_neither_does_nor_stands_still() -> None:
    path = JointPath(np.array([0.0, 1.0]), np.array([[[1.0, -0.5]], [[0.0, 0.0]]]))
    limits = JointLimits(speed=(2.0, 3.0), acceleration=(10.0, 8.0), jerk=(100.0, 90.0))
    knots = np.concatenate([np.zeros(4), np.linspace(0.0, 1.0, 13), np.ones(4)])
    search = ParametrisationSearch(path, limits, ParametrisationEnds((0.0,), (0.0,)), knots)
    controls = np.linspace(0.0, 1.0, 16) + np.where(np.arange(16) == 4, 0.6, 0.0)  # one far ahead of the next eight
    law = search.candidate(controls, 1.0).law
    assert (np.diff(law.at(np.linspace(0.0, 1.0, 1001))) > 0.0).all()


def test_many_corners_after_pieces_that_grow_faster_do_not_add_up() -> None:
    """Each piece ends a hundred times as fast as the next begins, which turns another way."""
    pieces = 40
    coefficients = np.zeros((3, pieces, 2))
    for i in range(pieces):
        coefficients[:2, i, i % 2] = 1.0, 0.02
        coefficients[2, i + 1 :, i % 2] += 1.02
    path = JointPath(np.arange(pieces + 1.0), coefficients)
    limits = JointLimits(speed=(2.0, 2.0), acceleration=(8.0, 8.0))
    each = 2.0 * 0.25 + (1.02 - 2.0 * 0.25) / 2.0  # a trapezoid of speed
    assert retime(path, limits).duration == pytest.approx(pieces * each, rel=0.02)


# Not faster than a given profile


def ceiling(path: JointPath, seed: int, least: float, most: float) -> SpeedProfile:
    nodes = np.linspace(*path.breakpoints[[0, -1]], 31)
    squares = np.random.default_rng(seed).uniform(least, most, nodes.size)
    squares[[0, -1]] = 0.0
    return SpeedProfile(nodes, squares)


@pytest.mark.parametrize("jerk", [None, (400.0, 400.0)])
@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_a_ceiling_is_not_exceeded(seed: int, jerk: tuple[float, float] | None) -> None:
    path, limits = curve(), replace(LIMITS, jerk=jerk)
    below = ceiling(path, seed, 0.05, 4.0)
    trajectory, least = retime(path, limits, ceiling=below), retime(path, limits)
    check_kept(trajectory)
    assert departure(path, trajectory) < 1e-9
    assert trajectory.duration >= max(float(below.times[-1]), least.duration) * (1.0 - 1e-3)


def test_a_ceiling_that_can_be_followed_is_followed() -> None:
    """Much slower than any limit asks for: nothing is changed but the shape of the ceiling at its own nodes."""
    path = curve()
    below = ceiling(path, 0, 0.010, 0.012)
    trajectory = retime(path, LIMITS, ceiling=below)
    check_kept(trajectory)
    assert trajectory.duration == pytest.approx(float(below.times[-1]), rel=2e-3)
    times = np.linspace(0.0, 1.0, 50) * trajectory.duration
    assert trajectory.at(times) == pytest.approx(path.at(below.parameters(times)), abs=5e-3)


def test_a_ceiling_above_every_limit_changes_nothing() -> None:
    path = curve()
    high = SpeedProfile(path.breakpoints[[0, -1]], np.array([1e6, 1e6]))
    assert retime(path, LIMITS, ceiling=high).duration == pytest.approx(retime(path, LIMITS).duration, rel=1e-6)


def test_a_ceiling_of_a_path_that_stands_still_in_places_is_refused() -> None:
    path = polyline(np.repeat(WAYPOINTS[:3], [1, 2, 1], axis=0))
    with pytest.raises(InvalidProblem, match=r"^path: it stands still in places"):
        retime(path, LIMITS, ceiling=SpeedProfile(path.breakpoints, np.array([0.0, 1.0, 1.0, 0.0])))


def test_a_path_of_a_high_degree_in_very_short_intervals() -> None:
    """Where the highest powers of an interval in s are no numbers any more."""
    path = JointPath(np.array([0.0, 1.0]), np.random.default_rng(3).uniform(-1.0, 1.0, (21, 1, 2)))
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, 41), np.ones(DEGREE)])
    law = Parametrisation(knots, np.linspace(0.0, 1.0, knots.size - DEGREE - 1) ** 2)
    duration, tau = 1e-3, np.linspace(0.0, 1.0, 1001)
    trajectory = law.trajectory(path, duration)
    assert (trajectory.breakpoints[1] ** (len(trajectory.coefficients) - 1)) == 0.0
    np.testing.assert_allclose(trajectory.at(tau * duration), path.at(law.at(tau)), rtol=0.0, atol=1e-12)
