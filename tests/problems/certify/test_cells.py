"""Proofs by interval arithmetic over cells of time: right where they decide, undecided where a bound is touched."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import CertificateStatus, Constraint, Limit, PlanarArm, Trajectory
from problems.base import Matrix, as_array
from problems.certify import limit_verdicts
from problems.certify.interval import prove_by_cells
from problems.families.two_segments import Quantities
from problems.motions import Samples

CERTIFIED, VIOLATED, UNDECIDED = CertificateStatus
CHECK_SAMPLES = 20_000
SEEN = 1e-6  # of the largest value: equally spaced times may miss so much of it
ARM = equal_links(2)


@dataclass(frozen=True)
class Toy(Limit):
    """``|formula| <= bound``, in whatever a sample has."""

    name: ClassVar[str] = "toy"

    robot: PlanarArm
    formula: Callable[[Samples], Matrix]
    bound: float

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        bound = ca.DM(self.bound)
        return [
            Constraint(
                name=self.name,
                unit="1",
                expression=self.formula(samples),
                lower=-bound,
                upper=bound,
                symmetric=True,
                columns=("toy",),
            )
        ]


FORMULAS: dict[str, Callable[[Samples], Any]] = {
    "sum of angles": lambda s: s.theta[:, 0] + s.theta[:, 1],
    "speed of the wrist": lambda s: s.speed[:, 0] * ca.cos(s.theta[:, 1]),
    "product of speeds": lambda s: s.speed[:, 0] * s.speed[:, 1] / 10.0,
    "a torque": lambda s: (2.0 + ca.cos(s.theta[:, 1])) * s.acceleration[:, 0] / 10.0 - s.speed[:, 1] ** 2 / 10.0,
    "jerk": lambda s: s.derivatives[3][:, 0] / 100.0 + s.theta[:, 1],
    "tool": lambda s: s.tool[:, 0] * s.tool[:, 1],
    "per duration": lambda s: s.theta[:, 0] / s.duration,
}
number = st.floats(-2.0, 2.0)


def motion_of(numbers: list[float], t1: float = 0.8, t2: float = 1.1) -> Trajectory:
    """A two-segment motion of two joints."""
    parts = [ca.DM(numbers[i : i + 2]).T for i in range(0, 8, 2)]
    return Quantities(*parts, ca.DM(t1), ca.DM(t2)).trajectory()


def densest(formula: Callable[[Samples], Any], trajectory: Trajectory, count: int = CHECK_SAMPLES) -> float:
    """The largest absolute value at equally spaced times, and just before the pieces join."""
    times = np.linspace(0.0, trajectory.duration, count)
    times = np.unique(np.concatenate([times, trajectory.breakpoints, np.nextafter(trajectory.breakpoints[1:-1], 0.0)]))
    return float(np.abs(as_array(formula(trajectory.samples(times, ARM)))).max())


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
@settings(max_examples=12, deadline=None)
@given(st.lists(number, min_size=8, max_size=8), st.floats(-0.5, 0.5))
def test_a_certificate_is_never_false(formula: Callable[[Samples], Any], numbers: list[float], room: float) -> None:
    trajectory = motion_of(numbers)
    largest = densest(formula, trajectory)
    if largest < 1e-3:
        return
    bound = largest * (1.0 + room)
    [verdict] = prove_by_cells(Toy(ARM, formula, bound), trajectory)
    assert (verdict.name, verdict.unit) == ("toy", "1")
    if largest > bound + 1e-9:
        assert verdict.status is not CERTIFIED
    elif largest < (1.0 - SEEN) * bound:
        assert verdict.status is not VIOLATED
        assert abs(verdict.worst) <= bound + 1e-9
    if verdict.status is VIOLATED:
        assert abs(verdict.worst) > bound
        assert verdict.excess == pytest.approx(abs(verdict.worst) - bound)


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
@pytest.mark.parametrize("seed", range(5))
def test_what_is_far_from_its_bound_is_decided(formula: Callable[[Samples], Any], seed: int) -> None:
    trajectory = motion_of(np.random.default_rng(seed).uniform(-2.0, 2.0, 8).tolist())
    largest = densest(formula, trajectory)
    assert [v.status for v in prove_by_cells(Toy(ARM, formula, 1.1 * largest), trajectory)] == [CERTIFIED]
    if formula is not FORMULAS["jerk"]:  # which is largest just before a breakpoint, between two samples
        assert [v.status for v in prove_by_cells(Toy(ARM, formula, 0.98 * largest), trajectory)] == [VIOLATED]


def test_a_bound_that_is_touched_stays_undecided() -> None:
    """Two angles turn in opposite directions where their sum is largest: no cell there is ever narrow enough."""
    trajectory = motion_of([0.0, 0.0, 1.0, 0.5, 3.0, -2.0, 0.5, -1.0])
    largest = densest(FORMULAS["sum of angles"], trajectory, 200_001)
    [verdict] = prove_by_cells(Toy(ARM, FORMULAS["sum of angles"], largest), trajectory)
    assert verdict.status is UNDECIDED
    assert not verdict.satisfied
    assert verdict.excess == 0.0


def test_a_violation_is_named_with_its_time() -> None:
    trajectory = motion_of([0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 2.0, 0.75])
    [verdict] = prove_by_cells(Toy(ARM, FORMULAS["sum of angles"], 2.0), trajectory)
    assert verdict.status is VIOLATED
    assert (verdict.worst, verdict.bound) == (pytest.approx(2.75), 2.0)
    assert verdict.where == f"toy, t = {trajectory.duration:.4g} s"


def test_a_spike_between_two_samples_is_no_certificate() -> None:
    """Breaks its bound for a hundredth of the distance between two of the times that are evaluated."""
    trajectory = motion_of([0.0, 0.0, 1.0, 0.5, 0.5, 0.2, 2.0, 0.75], 1.0, 1.0)
    hidden = (trajectory.times(401)[100] + trajectory.times(401)[101]) / 2.0
    angle = float(trajectory.at(np.array([hidden]))[0, 0])

    def spike(samples: Samples) -> Any:
        return 1.0 / (1.0 + (1e6 * (samples.theta[:, 0] - angle)) ** 2)

    [verdict] = prove_by_cells(Toy(ARM, spike, 0.5), trajectory)
    assert verdict.status is not CERTIFIED


def test_limits_without_a_proof_of_their_own_are_proven_by_cells() -> None:
    trajectory = motion_of([0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 2.0, 0.75])
    loose, tight = (Toy(ARM, FORMULAS["sum of angles"], bound) for bound in (4.0, 1.0))
    assert [v.status for v in limit_verdicts([loose, tight], trajectory)] == [CERTIFIED, VIOLATED]
