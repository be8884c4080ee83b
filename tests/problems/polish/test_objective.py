"""Objectives near a motion: values as of finished motions, slopes by differences, lengths never underestimated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.polish_objective import polish_objective

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.families.splines import move
from problems.motions import MotionView, traced
from problems.objectives import OBJECTIVES, ExpressionObjective, Objective, WeightedSum
from problems.polish import Deviations, IntegrandFunctions, ObjectiveSettings, PolishObjective
from problems.robots import SpatialArm
from problems.tasks import Joints, Move

START, GOAL = np.array([0.0, -0.8, 0.0, -2.2, 0.0, 1.5, 0.8]), np.array([0.9, -0.3, 0.2, -1.8, 0.3, 1.7, 0.2])


def panda() -> SpatialArm:
    model = tp.robot("panda").model
    assert isinstance(model, SpatialArm)
    return model


def own(rate: Callable[[MotionView], Any], terminal: Callable[[MotionView], Any] | None = None) -> Objective:
    arm = panda()
    of_duration = None if terminal is None else traced(terminal, arm, "objective")
    return ExpressionObjective("own", "1", traced(rate, arm, "objective"), of_duration)


OWN = {
    "own accelerations": own(lambda m: ca.sumsqr(m.acceleration)),
    "own height": own(lambda m: m.tool[2] ** 2 + 0.1 * m.time * m.speed[0], lambda m: m.duration**2),
    "own jerk": own(lambda m: 1e-4 * ca.sumsqr(m.jerk)),
    "own speed": own(lambda m: ca.norm_2(m.tool_velocity)),
}
EVERY: dict[str, Objective] = {
    **OBJECTIVES,
    "sum": WeightedSum((1.0, 0.01, 0.5), (OBJECTIVES["time"], OBJECTIVES["energy"], OBJECTIVES["length"])),
    **OWN,
}


@pytest.fixture(scope="module")
def motions() -> Deviations:
    return Deviations(START, GOAL, panda().limits)


def drawn(motions: Deviations, seed: int, size: float = 0.01) -> FloatArray:
    return size * np.random.default_rng(seed).normal(size=(motions.free, motions.dof))


@pytest.mark.parametrize("name", EVERY)
def test_what_a_motion_is_worth_is_the_objective_of_the_finished_motion(name: str, motions: Deviations) -> None:
    arm, objective = panda(), EVERY[name]
    worth = polish_objective(motions, arm, objective)
    x = drawn(motions, 1)
    longer = 1.4 * motions.least_duration(x, motions.direct.duration)
    trajectory = motions.trajectory(x, longer, longer)
    assert trajectory.duration == pytest.approx(longer, rel=1e-9)
    free = 0.0 if objective.is_time_dependent else 1e-3 * longer  # what time counts where it is not minimised
    value = (worth.value(x, longer) - free) / worth.scale
    assert value == pytest.approx(objective.of_motion(trajectory, arm, trajectory.breakpoints), rel=5e-3)


@pytest.mark.parametrize("name", EVERY)
def test_slopes_are_those_of_differences(name: str, motions: Deviations) -> None:
    sharp = ObjectiveSettings(corner=1e-6)  # absolute values are not rounded off
    worth = replace(polish_objective(motions, panda(), EVERY[name]), settings=sharp)
    x, duration, step = drawn(motions, 3), 2.5, 1e-5
    model = worth.quadratic_model(x, duration)
    for seed, longer in ((4, 0.0), (5, 1.0), (6, -2.0)):
        way = drawn(motions, seed, 0.2)
        expected = worth.value(x + step * way, duration + step * longer)
        expected -= worth.value(x - step * way, duration - step * longer)
        found = model.change(motions.padded(step * way), step * longer)
        found -= model.change(motions.padded(-step * way), -step * longer)
        assert found == pytest.approx(expected, rel=2e-3, abs=1e-9)


def test_rotation_is_never_less_than_it_is_held_to_be(motions: Deviations) -> None:
    """Speeds are linear in control points, so that only the way of taking absolute values counts."""
    worth, x = polish_objective(motions, panda(), OBJECTIVES["rotation"]), drawn(motions, 8, 0.3)
    model, now = worth.quadratic_model(x, 2.0), worth.value(x, 2.0)
    corners = 0.01 * worth.scale * np.abs(GOAL - START).sum()  # what is made of joints that hardly move
    for seed in range(20):
        way = drawn(motions, seed, 0.3)
        assert worth.value(x + way, 2.0) <= now + model.change(motions.padded(way), 0.0) + corners


def test_the_best_direct_motion_is_worth_its_time(motions: Deviations) -> None:
    x = np.zeros((motions.free, motions.dof))
    for name in ("time", "energy", "sum"):
        worth = polish_objective(motions, panda(), EVERY[name])
        best = worth.best_duration(x, motions.direct.duration)
        assert worth.value(x, best) == pytest.approx(motions.direct.duration, rel=1e-9)
        assert worth.value(x, best) <= min(worth.value(x, f * best) for f in (1.05, 1.2)) + 1e-12
        if best > motions.direct.duration:
            assert worth.value(x, best) <= worth.value(x, 0.95 * best)
    time = polish_objective(motions, panda())
    assert time.scale == 1.0 and time.bound == motions.bound and not time.chooses_duration
    assert polish_objective(motions, panda(), EVERY["energy"]).best_duration(x, 0.1) > motions.direct.duration


def test_what_is_too_late_pays(motions: Deviations) -> None:
    integrand = IntegrandFunctions.of(OBJECTIVES["energy"], panda())
    assert integrand is not None
    worth, x = PolishObjective(motions, integrand, (1.0, 2.0)), np.zeros((motions.free, motions.dof))
    free = PolishObjective(motions, integrand, (0.0, 9.0))
    assert worth.in_time(1.9) and not worth.in_time(2.1)
    assert worth.value(x, 2.1) / worth.scale > free.value(x, 2.1) / free.scale
    assert worth.duration(0.5, 0.7) == pytest.approx(1.0, rel=1e-5) and worth.duration(0.5, 0.7) >= 1.0
    assert worth.duration(0.5, 7.0) == pytest.approx(2.0, rel=1e-5) and worth.duration(0.5, 7.0) <= 2.0
    assert worth.duration(2.5, 1.0) == 2.5
    assert worth.duration_range(2.1, 0.25)[1] == 0.0 and worth.duration_range(1.5, 0.25)[1] <= 0.5
    assert worth.quadratic_model(x, 2.1).time_cost > worth.quadratic_model(x, 1.9).time_cost


def test_objectives_that_are_not_integrand_are_not_known() -> None:
    class Bumps(Objective):
        name, symbol, unit = "bumps", "B", "1"

        def between(self, before: Any, after: Any) -> Any:
            return ca.fabs(after.speed - before.speed)

    assert IntegrandFunctions.of(Bumps(), panda()) is None
    both = WeightedSum((1.0, 1.0), (OBJECTIVES["time"], Bumps()))
    assert IntegrandFunctions.of(both, panda()) is None


def test_what_a_search_does_better_is_left_to_it() -> None:
    task = Move(panda(), Joints(tuple(START.tolist())), (Joints(tuple(GOAL.tolist())),))
    assert move(task, "energy").direct.approaches()
    assert not move(task, "work").direct.approaches()
    assert not move(task, WeightedSum((1.0, 1.0), (OBJECTIVES["energy"], OBJECTIVES["work"]))).direct.approaches()
