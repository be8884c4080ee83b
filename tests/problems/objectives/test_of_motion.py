"""The value of a finished motion: by hand, against SciPy, and however few rows are asked for."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.cases import builtin
from scipy.integrate import quad

from problems import OBJECTIVES, PlanarArm, Trajectory
from problems.base import FloatArray, as_array
from problems.objectives.objective import integral

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


@pytest.mark.parametrize("seed", range(6))
def test_the_length_agrees_with_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    trajectory = motion(*rng.normal(0.0, 2.0, (2, 5, 2)))

    def speed(t: float) -> float:
        theta, rates = (trajectory.at(np.array([t]), n)[0] for n in (0, 1))
        psi, turn = np.cumsum(theta), np.cumsum(rates)
        return float(np.hypot((np.sin(psi) * turn).sum(), (np.cos(psi) * turn).sum()))

    expected = sum(quad(speed, i, i + 1, epsabs=0.0, epsrel=1e-11, limit=2000)[0] for i in range(2))
    assert value("length", trajectory) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("name", ["time-3", "rotation-4", "obstacle-3", "pentagram-time", "closed-curve-rotation"])
def test_chords_grow_towards_it(name: str) -> None:
    problem = builtin(name, "reduced")
    trajectory = problem.trajectory(np.mean(problem.bounds, axis=0))
    for objective in ("length", "rotation"):
        exact = OBJECTIVES[objective].of_motion(trajectory, problem.robot, TWO_ROWS)
        coarse, fine = (
            float(OBJECTIVES[objective].value(trajectory.samples(trajectory.times(n), problem.robot)))
            for n in (500, 50_000)
        )
        assert coarse <= fine * (1.0 + 1e-12)
        assert fine <= exact * (1.0 + 1e-12)
        assert fine == pytest.approx(exact, rel=1e-6)


def test_a_reported_objective_does_not_depend_on_the_rows() -> None:
    problem = builtin("obstacle-3")
    trajectory = problem.trajectory(np.mean(problem.bounds, axis=0))
    assert problem.objective_value(trajectory, trajectory.times(3)) == problem.objective_value(
        trajectory, trajectory.times(999)
    )


def test_an_integral_of_a_kink_and_of_rounding_ends() -> None:
    edges = np.array([0.0, 0.4, 1.0])
    assert integral(lambda t: np.abs(t - 1.0 / 3.0), edges, 0.0) == pytest.approx(5.0 / 18.0, rel=1e-10)
    assert integral(lambda t: np.abs(np.sin(40.0 * t) + 1e-6), edges, 0.0) > 0.6
    noise = np.random.default_rng(0)
    assert integral(lambda t: noise.random(t.size), edges, 0.0) == pytest.approx(0.5, abs=0.05)
    assert np.isnan(integral(lambda t: np.full(t.size, np.nan), edges, 0.0))


def test_a_longer_arm_travels_farther_in_proportion() -> None:
    trajectory = motion(np.array([[0.1, 0.9], [0.0, 0.0], [3.0, -2.0], [-2.0, 1.0]]))
    lengths = [
        value("length", trajectory, PlanarArm((scale,) * 2, (4.0,) * 2, (20.0,) * 2)) for scale in (1.0, 1e7, 1e-9)
    ]
    assert lengths == pytest.approx([lengths[0], 1e7 * lengths[0], 1e-9 * lengths[0]], rel=1e-12)
    tip = as_array(ARM.tool(ca.DM(trajectory.at(np.linspace(0.0, 1.0, 20_001)))))
    assert lengths[0] == pytest.approx(np.hypot(*np.diff(tip, axis=0).T).sum(), rel=1e-7)
