"""Objectives by hand, row by row, against their bounds and their smooth forms."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin, equal_links, moving

from problems import OBJECTIVES, Objective, PlanarArm
from problems.base import Matrix, as_array
from problems.motions import Samples
from problems.objectives import MotionBounds
from problems.objectives.catalogue import (
    SMOOTHING,
    SMOOTHING_LENGTH,
    Energy,
    ExecutionTime,
    JointRotation,
    TipTravel,
    Work,
)
from problems.objectives.objective import UNKNOWN_UPPER_BOUND
from solvers import Box

ARM = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0), link_masses=(1.0, 2.0))


class Effort(Objective):
    """An integral, as an objective of a new kind would be: of the squared speeds."""

    name = "effort"
    symbol = "E"
    unit = "rad^2/s"

    def at(self, samples: Samples) -> Matrix:
        return samples.weights * ca.sum2(samples.speed**2)


EVERY: dict[str, Objective] = {**OBJECTIVES, "effort": Effort()}
ROUNDED = {"length": SMOOTHING_LENGTH, "work": SMOOTHING}  # corners, by so much of a value of the usual size
each_objective = pytest.mark.parametrize("objective", EVERY.values(), ids=EVERY)


def bent(theta: Sequence[Sequence[float]]) -> Samples:
    """Postures of the arm of two links, half a second apart."""
    angles = ca.DM(theta)
    rows = angles.shape[0]
    weights = ca.DM(np.full(rows, 0.5))
    speed = ca.DM(np.arange(2.0 * rows).reshape(rows, 2))
    acceleration = ca.DM(np.linspace(-3.0, 5.0, 2 * rows).reshape(rows, 2))
    duration = ca.DM(0.5 * (rows - 1))
    return Samples(robot=ARM, derivatives=(angles, speed, acceleration), duration=duration, weights=weights)


def test_values_by_hand() -> None:
    samples = bent([[0.0, 0.0], [np.pi / 2, 0.0], [np.pi / 2, np.pi / 2], [np.pi / 2, 0.0]])
    kinematic = {name: objective for name, objective in EVERY.items() if not objective.needs_masses}
    values = {name: float(objective.value(samples)) for name, objective in kinematic.items()}
    root = np.sqrt(2.0)
    assert values == {
        "time": 1.5,
        "rotation": pytest.approx(1.5 * np.pi),
        "length": pytest.approx(2.0 * root + root + root),
        "effort": 0.5 * (0 + 1 + 4 + 9 + 16 + 25 + 36 + 49),
    }


def test_they_are_found_by_name() -> None:
    assert {name: type(objective) for name, objective in OBJECTIVES.items()} == {
        "time": ExecutionTime,
        "rotation": JointRotation,
        "length": TipTravel,
        "energy": Energy,
        "work": Work,
    }
    assert [(o.name, o.unit, o.symbol) for o in OBJECTIVES.values()] == [
        ("time", "s", "T"),
        ("rotation", "rad", "F_q"),
        ("length", "m", "F_d"),
        ("energy", "N^2 m^2 s", "E"),
        ("work", "J", "W"),
    ]


@each_objective
def test_rows_one_by_one_add_up(objective: Objective) -> None:
    samples = bent(np.random.default_rng(0).normal(size=(12, 2)).tolist())
    rows = [samples.rows(slice(i, i + 1)) for i in range(12)]
    parts = [objective.at(row) for row in rows]
    parts += [objective.between(before, after) for before, after in pairwise(rows)]
    summed = float(objective.terminal(samples.duration)) + sum(float(ca.sum2(p)) for p in parts if p is not None)
    assert summed == pytest.approx(float(objective.value(samples)), rel=1e-12)


@each_objective
def test_nothing_moves_nothing_counts(objective: Objective) -> None:
    still = bent([[0.3, 0.4]] * 5)
    moved = objective.between(*still.steps)
    assert moved is None or (as_array(moved) == 0.0).all()


@pytest.mark.parametrize("objective", OBJECTIVES.values(), ids=OBJECTIVES)
def test_smooth_forms_are_near(objective: Objective) -> None:
    samples = bent(np.random.default_rng(1).normal(size=(20, 2)).tolist())
    value, steps = float(objective.value(samples)), samples.count - 1
    size = objective.slack_count(ARM, steps)
    least = ca.reshape(ca.DM(objective.slack_values(as_array(samples.theta))), -1, 2) if size else ca.DM(0, 2)
    smooth = float(ca.DM(ca.evalf(objective.smooth(samples, least))))
    if objective.name in ROUNDED:  # downwards
        assert value - steps * ROUNDED[objective.name] * objective.size(ARM) <= smooth <= value
    else:
        assert smooth == pytest.approx(value, rel=1e-12)
    rows = objective.slack_rows(samples, least)
    assert len(rows) == (2 if size else 0)
    assert all(float(ca.mmin(row)) >= 0.0 for _, _, row in rows)
    if size:
        assert objective.slack_values(as_array(samples.theta)).shape == (size,)
        assert float(objective.smooth(samples, least + 0.1)) > value
        assert any(float(ca.mmin(row)) < 0.0 for _, _, row in objective.slack_rows(samples, least - 0.1))


def test_upper_bounds_by_hand() -> None:
    bounds = MotionBounds(duration=3.0, rotation=5.0, radius=2.0)
    assert [objective.upper_bound(bounds) for objective in EVERY.values()] == [
        3.0,
        5.0,
        10.0,
        *[UNKNOWN_UPPER_BOUND] * 3,
    ]


CASES: list[tuple[str, str, str]] = list(product(BUILTIN, ("paper", "reduced"), ("up", "free")))


@pytest.mark.parametrize(("name", "formulation", "elbow"), CASES)
def test_no_candidate_exceeds_the_upper_bound(name: str, formulation: str, elbow: str) -> None:
    check_bound(builtin(name, formulation, elbow))


@pytest.mark.parametrize("objective", [name for name, each in OBJECTIVES.items() if not each.needs_masses])
@pytest.mark.parametrize("formulation", ["paper", "reduced"])
def test_joint_limits_and_long_times_keep_the_upper_bound(objective: str, formulation: str) -> None:
    arm = equal_links(3, joint_limits=((-4.0, 5.0), (-2.0, 2.5), (-1.0, 6.0)))
    check_bound(moving(arm, (1.0, 0.0), (0.5, 1.5), objective, "free", formulation, segment_time=(0.3, 9.0)))


def check_bound(problem: Any) -> None:
    model = problem.model
    objective = ca.Function("objective", [model.x], [model.objective])
    box = Box(*problem.bounds)
    points = box.sample(np.random.default_rng(0), 60)
    corners = np.where(np.random.default_rng(1).random((40, box.dimension)) < 0.5, box.lower, box.upper)
    values = [float(objective(x)) for x in (*points, *corners)]
    assert np.isfinite(values).all()
    assert 0.0 < max(values) <= problem.objective_upper_bound * (1.0 + 1e-12)


def test_an_integral_may_be_minimised() -> None:
    problem = moving(equal_links(3), (1.0, 0.0), (0.5, 1.5), Effort(), "up", "reduced")
    points = Box(*problem.bounds).sample(np.random.default_rng(0), 20)
    costs = problem.cost(points)
    for x, cost in zip(points, costs, strict=True):
        samples = problem.motion.samples(problem.parameters_of(x))
        assert cost == pytest.approx(float(problem.objective.value(samples)), rel=1e-9)
        times = np.linspace(0.0, float(samples.duration), 20_001)
        exact = np.trapezoid((problem.trajectory(x).at(times, 1) ** 2).sum(axis=1), times)
        assert cost == pytest.approx(exact, rel=0.01)
