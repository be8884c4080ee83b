"""The value of a finished motion: by hand, against SciPy, and however few rows are asked for; torques integrated."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from helpers.cases import builtin, equal_links, moving
from scipy.integrate import quad

from problems import OBJECTIVES, InvalidProblem, PlanarArm, Trajectory
from problems.base import FloatArray
from problems.objectives.integrals import integral

ARM = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0))
TWO_ROWS = np.array([0.0, 1.0])  # of a table that shows next to nothing


def motion(*pieces: FloatArray) -> Trajectory:
    """Pieces of a second each, lowest power of the time first, (order, joints)."""
    return Trajectory.from_pieces(np.ones(len(pieces)), list(pieces))


def value(name: str, trajectory: Trajectory, arm: PlanarArm = ARM) -> float:
    return OBJECTIVES[name].of_motion(trajectory, arm, TWO_ROWS)


def swing(*powers: float) -> FloatArray:
    """Of joint 1; joint 2 stays stretched."""
    return np.column_stack([powers, np.zeros(len(powers))])


def test_on_a_circle_the_length_is_radius_times_angle() -> None:
    there = motion(swing(0.2, 0.0, 3.0, -2.0))  # from rest to rest through 1 rad
    assert value("length", there) == pytest.approx(2.0, rel=1e-12)
    assert value("rotation", there) == pytest.approx(1.0, rel=1e-12)
    assert value("time", there) == 1.0


def test_back_and_forth_within_a_piece_counts() -> None:
    turning = motion(swing(0.0, 4.0, -4.0))  # to 1 rad at t = 1/2 and back, where it comes to rest for an instant
    assert value("rotation", turning) == pytest.approx(2.0, rel=1e-12)
    assert value("length", turning) == pytest.approx(4.0, rel=1e-9)
    wave = motion(swing(*np.polynomial.Polynomial.fromroots([0.05, 0.3, 0.31, 0.8, 0.9]).coef * 50.0))
    fine = wave.at(np.linspace(0.0, 1.0, 400_001))[:, 0]
    assert value("rotation", wave) == pytest.approx(np.abs(np.diff(fine)).sum(), rel=1e-8)
    assert value("length", wave) == pytest.approx(2.0 * value("rotation", wave), rel=1e-9)


def test_a_tip_that_stands_still_travels_nothing() -> None:
    assert value("length", motion(swing(0.7), swing(0.7))) == 0.0
    folded = motion(
        np.array([[0.3, np.pi], [0.0, 0.0], [3.0, 0.0], [-2.0, 0.0]])
    )  # about the base, on which the tip is
    assert value("length", folded) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("seed", range(3))
def test_the_length_agrees_with_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    trajectory = motion(*rng.normal(0.0, 2.0, (2, 5, 2)))

    def speed(t: float) -> float:
        theta, rates = (trajectory.at(np.array([t]), n)[0] for n in (0, 1))
        psi, turn = np.cumsum(theta), np.cumsum(rates)
        return float(np.hypot((np.sin(psi) * turn).sum(), (np.cos(psi) * turn).sum()))

    expected = sum(quad(speed, i, i + 1, epsabs=0.0, epsrel=1e-11, limit=2000)[0] for i in range(2))
    assert value("length", trajectory) == pytest.approx(expected, rel=1e-9)


def test_a_reported_objective_does_not_depend_on_the_rows() -> None:
    problem = builtin("obstacle-3")
    trajectory = problem.trajectory(np.mean(problem.bounds, axis=0))
    few, many = (problem.criteria.objective_value(trajectory, trajectory.times(count)) for count in (3, 999))
    assert few == many


def test_an_integral_of_a_kink_and_of_rounding_ends() -> None:
    edges = np.array([0.0, 0.4, 1.0])
    assert integral(lambda t: np.abs(t - 1.0 / 3.0), edges, 0.0) == pytest.approx(5.0 / 18.0, rel=1e-10)
    assert integral(lambda t: np.abs(np.sin(40.0 * t) + 1e-6), edges, 0.0) > 0.6
    noise = np.random.default_rng(0)
    assert integral(lambda t: noise.random(t.size), edges, 0.0) == pytest.approx(0.5, abs=0.05)
    assert np.isnan(integral(lambda t: np.full(t.size, np.nan), edges, 0.0))


# Energy and work: closed forms, SciPy on Lagrange's equations, friction, robots without masses

LENGTH, MASS = 0.5, 2.0
INERTIA = MASS * LENGTH**2 / 12.0  # of a uniform rod about its middle


def rods(**more: Any) -> PlanarArm:
    settings = {"link_masses": (MASS, MASS), "gravity": (0.0, 0.0)} | more
    return PlanarArm((LENGTH, LENGTH), (4.0, 4.0), (20.0, 20.0), **settings)


def torques(theta: FloatArray, v: FloatArray, a: FloatArray, g: float) -> FloatArray:
    """Of two uniform rods by Lagrange's equations, written out by hand."""
    c, h = LENGTH / 2.0, MASS * LENGTH * LENGTH / 2.0
    inner, cos, sin = INERTIA + MASS * c**2, np.cos(theta[1]), np.sin(theta[1])
    m11 = 2.0 * inner + MASS * LENGTH**2 + 2.0 * h * cos
    m12 = inner + h * cos
    weight2 = MASS * g * c * np.cos(theta[0] + theta[1])
    weight1 = weight2 + MASS * g * (c + LENGTH) * np.cos(theta[0])
    return np.array(
        [
            m11 * a[0] + m12 * a[1] - h * sin * (2.0 * v[0] * v[1] + v[1] ** 2) + weight1,
            m12 * a[0] + inner * a[1] + h * sin * v[0] ** 2 + weight2,
        ]
    )


def test_a_cubic_turn_of_a_stretched_arm_takes_twelve_inertias_squared() -> None:
    """One body of inertia I about joint 1, theta = D (3 s^2 - 2 s^3): 12 I^2 D^2 / T^3 at joint 1 alone."""
    turn = 1.3
    both = np.array([(INERTIA + MASS * d**2) for d in (LENGTH / 2.0, 1.5 * LENGTH)])
    of_second = INERTIA + MASS * LENGTH**2 / 4.0 + MASS * LENGTH**2 / 2.0  # m12: what joint 2 holds against
    there = motion(np.array([[0.2, 0.0], [0.0, 0.0], [3.0 * turn, 0.0], [-2.0 * turn, 0.0]]))
    expected = 12.0 * turn**2 * (both.sum() ** 2 + of_second**2)  # stretched: nothing pulls across
    for duration in (1.0, 2.5):
        found = value("energy", there.time_scaled(duration), rods())
        assert found == pytest.approx(expected / duration**3, rel=1e-12)
    kinetic = 0.5 * both.sum() * (1.5 * turn) ** 2  # at half time; given once and taken once
    assert value("work", there, rods()) == pytest.approx(2.0 * kinetic, rel=1e-9)


def test_holding_against_gravity_costs_energy_and_no_work() -> None:
    still = motion(np.array([[0.0, 0.0]]))
    held = torques(np.zeros(2), np.zeros(2), np.zeros(2), 9.81)
    assert held == pytest.approx([MASS * 9.81 * (0.25 + 0.75), MASS * 9.81 * 0.25])
    arm = rods(gravity=(0.0, -9.81))
    assert value("energy", still, arm) == pytest.approx((held**2).sum(), rel=1e-12)
    assert value("energy", still.time_scaled(3.0), arm) == pytest.approx(3.0 * (held**2).sum(), rel=1e-12)
    assert value("work", still, arm) == 0.0


@pytest.mark.parametrize(("seed", "friction"), [(0, 0.0), (1, 0.7)])
def test_energy_and_work_agree_with_scipy(seed: int, friction: float) -> None:
    rng = np.random.default_rng(seed)
    trajectory = motion(*rng.normal(0.0, 2.0, (2, 5, 2)))
    arm = rods(gravity=(0.0, -9.81), coulomb_friction=(friction, friction), viscous_friction=(0.1, 0.2))

    def at(t: float) -> tuple[FloatArray, FloatArray]:
        theta, v, a = (trajectory.at(np.array([t]), n)[0] for n in range(3))
        return torques(theta, v, a, 9.81) + friction * np.sign(v) + np.array([0.1, 0.2]) * v, v

    cuts = np.unique(np.concatenate([trajectory.breakpoints, *_turns(trajectory)]))
    squared, power = (
        sum(quad(f, *cut, epsabs=0.0, epsrel=1e-11, limit=500)[0] for cut in pairwise(cuts))
        for f in (lambda t: float((at(t)[0] ** 2).sum()), lambda t: float(np.abs(at(t)[0] * at(t)[1]).sum()))
    )
    assert value("energy", trajectory, arm) == pytest.approx(squared, rel=1e-9)
    assert value("work", trajectory, arm) == pytest.approx(power, rel=1e-9)


def _turns(trajectory: Trajectory) -> list[FloatArray]:
    """When a joint stands still, by bisection on a fine grid."""
    times = np.linspace(0.0, trajectory.duration, 4001)
    found = []
    for joint in range(2):
        speed = trajectory.at(times, 1)[:, joint]
        lower, upper = (times[i : times.size - 1 + i][speed[:-1] * speed[1:] < 0.0] for i in (0, 1))
        sign = np.sign(trajectory.at(lower, 1)[:, joint])
        for _ in range(60):
            middle = (lower + upper) / 2.0
            same = np.sign(trajectory.at(middle, 1)[:, joint]) == sign
            lower, upper = np.where(same, middle, lower), np.where(same, upper, middle)
        found.append(lower)
    return found


def test_a_robot_without_masses_is_refused() -> None:
    for name in ("energy", "work"):
        with pytest.raises(InvalidProblem, match=f"^objective: {name!r} needs masses"):
            moving(equal_links(3), (1.0, 0.0), (0.5, 1.5), name)
