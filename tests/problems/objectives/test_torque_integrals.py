"""Energy and work: closed forms, SciPy on Lagrange's equations, friction, robots without masses."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links, moving
from scipy.integrate import quad

from problems import OBJECTIVES, InvalidProblem, PlanarArm, Trajectory
from problems.base import FloatArray, as_array
from problems.objectives.catalogue import SMOOTHING

LENGTH, MASS = 0.5, 2.0
INERTIA = MASS * LENGTH**2 / 12.0  # of a uniform rod about its middle
TWO_ROWS = np.array([0.0, 1.0])


def rods(**more: Any) -> PlanarArm:
    settings = {"link_masses": (MASS, MASS), "gravity": (0.0, 0.0)} | more
    return PlanarArm((LENGTH, LENGTH), (4.0, 4.0), (20.0, 20.0), **settings)


def motion(*pieces: FloatArray) -> Trajectory:
    """Pieces of a second each, lowest power of the time first, (order, joints)."""
    return Trajectory.from_pieces(np.ones(len(pieces)), list(pieces))


def value(name: str, trajectory: Trajectory, arm: PlanarArm) -> float:
    return OBJECTIVES[name].of_motion(trajectory, arm, TWO_ROWS)


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


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("friction", [0.0, 0.7])
def test_they_agree_with_scipy(seed: int, friction: float) -> None:
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


@pytest.mark.parametrize("name", [name for name, objective in OBJECTIVES.items() if objective.needs_masses])
def test_a_robot_without_masses_is_refused(name: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^objective: {name!r} needs masses"):
        moving(equal_links(3), (1.0, 0.0), (0.5, 1.5), name)


def test_the_smooth_work_is_a_little_less() -> None:
    rng, arm = np.random.default_rng(0), rods()
    work = OBJECTIVES["work"]
    there = motion(rng.normal(0.0, 2.0, (5, 2)))
    samples = there.samples(np.linspace(0.0, 1.0, 60), arm)
    exact = float(work.value(samples))
    smooth = float(ca.evalf(work.smooth(samples, ca.DM(0, 2))))
    assert exact - SMOOTHING * work.size(arm) <= smooth < exact
    assert as_array(samples.torque).shape == (60, 2)
