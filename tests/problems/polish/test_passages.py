"""Places that a motion passes on its way."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.core_robots import robot_of
from helpers.polish_objective import ASIDE, GOAL, START, WALL, polish_objective
from scipy.optimize import minimize_scalar

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.core import CompiledWorld
from problems.polish import Deviations, Passages, PathRefinement, joint_box
from problems.tasks import Joints, Pose
from problems.tasks.place import Place

LIFTED = np.array([0.0, 0.0, 0.0, 2.5, 0.0, -1.5, 0.0])


def passages(*places: Place) -> Passages:
    arm = robot_of("upright")
    return Passages(Deviations(START, GOAL, arm.limits), arm, places)


def some(motions: Deviations) -> FloatArray:
    return np.asarray(np.random.default_rng(5).uniform(-0.2, 0.2, (motions.free, motions.dof)))


def test_a_motion_comes_nearest_where_an_optimizer_says() -> None:
    passed = passages(Joints(tuple(ASIDE)))
    padded = passed.motions.padded(some(passed.motions))

    def away(u: float) -> float:
        return float(np.linalg.norm(passed.motions.postures(np.array([u])).values(padded)[0] - ASIDE))

    (one,) = passed.nearest(padded)
    by_scipy = minimize_scalar(away, bounds=(one.u - 0.02, one.u + 0.02), method="bounded", options={"xatol": 1e-10})
    assert one.u == pytest.approx(by_scipy.x, abs=1e-5)
    assert np.linalg.norm(one.missed) <= min(map(away, np.linspace(0.0, 1.0, 2001))) + 1e-12
    np.testing.assert_allclose(one.axes @ one.axes.T, np.eye(7), atol=1e-12)
    np.testing.assert_allclose(abs(one.axes[0] @ one.along), np.linalg.norm(one.along))


def test_places_are_passed_in_their_order() -> None:
    later, sooner = Joints(tuple(START + 0.7 * (GOAL - START))), Joints(tuple(START + 0.3 * (GOAL - START)))
    straight = np.zeros((passages(sooner).motions.free, 7))
    in_order = passages(sooner, later)
    assert [round(one.u, 1) for one in in_order.nearest(in_order.motions.padded(straight))] == [0.3, 0.7]
    other = passages(later, sooner)
    found = other.nearest(other.motions.padded(straight))
    assert found[0].u <= found[1].u


each_place = pytest.mark.parametrize(
    "place", [Joints(tuple(ASIDE)), Pose((0.5, 0.1, 0.5)), Pose((0.5, 0.1, 0.5), (1.0, 0.0, 0.0, 0.0))]
)


@each_place
def test_rows_say_what_a_small_change_leaves_missing(place: Place) -> None:
    passed = passages(place)
    x = some(passed.motions)
    (one,) = passed.nearest(passed.motions.padded(x))
    rows = passed.rows([one])
    change = 1e-6 * np.random.default_rng(6).standard_normal(x.shape)
    points = passed.motions.padded(change)[rows.first[:, None] + 3 + np.arange(4)]
    promised = np.einsum("mak,mak->m", rows.weights, points) - rows.bound
    (after,) = passed.nearest(passed.motions.padded(x + change))
    sideways = one.axes @ after.missed
    signed = np.concatenate([sideways, -sideways]).reshape(2, -1)[:, 1:]
    np.testing.assert_allclose(promised.reshape(2, -1)[:, 1:], signed, atol=1e-8)
    assert passed.left(rows, passed.motions.padded(change)) == pytest.approx(np.maximum(promised, 0.0).sum())


@each_place
def test_the_last_correction_passes_a_place_to_rounding(place: Place) -> None:
    passed = passages(place)
    x = passed.exact(some(passed.motions))
    assert x is not None
    (one,) = passed.nearest(passed.motions.padded(x))
    assert np.linalg.norm(one.missed) < 1e-12
    theta = passed.motions.postures(np.array([one.u])).values(passed.motions.padded(x))[0]
    assert place.is_at(passed.robot, theta)


@pytest.mark.parametrize(
    "place", [Joints(tuple(ASIDE), within=0.1), Pose((0.5, 0.1, 0.5), (1.0, 0.0, 0.0, 0.0), within=0.1)]
)
def test_what_may_be_missed_is_missed_by_no_more(place: Place) -> None:
    passed = passages(place)
    begun = some(passed.motions)
    assert passed.missing(passed.nearest(passed.motions.padded(begun))) > 0.0
    x = passed.exact(begun)
    assert x is not None
    (one,) = passed.nearest(passed.motions.padded(x))
    assert 0.099 < np.linalg.norm(one.missed) <= 0.1
    assert passed.missing([one]) == 0.0
    assert len(one.missed) == (7 if isinstance(place, Joints) else 3)


def test_a_place_out_of_reach_is_not_passed() -> None:
    passed = passages(Pose((9.0, 0.0, 0.0)))
    assert passed.exact(some(passed.motions)) is None


@pytest.mark.parametrize("goal", [GOAL, START])
def test_ways_around_a_wall_lead_through_stops(goal: FloatArray) -> None:
    arm, via = robot_of("upright"), Joints(tuple(ASIDE))
    world, motions = CompiledWorld.of(arm, (WALL,)), Deviations(START, goal, arm.limits)
    assert world is not None
    box, through = joint_box(arm, START, ASIDE, goal), ASIDE[None]
    trajectory = PathRefinement(
        world=world,
        motions=motions,
        objective=polish_objective(motions, arm),
        box=box,
        passages=Passages(motions, arm, (via,)),
        through=through,
    ).best_motion(1)
    assert trajectory is not None and world.prove(trajectory).status
    theta = trajectory.at(np.array([0.0, trajectory.duration]))
    np.testing.assert_allclose(theta, [START, goal], atol=1e-12)
    away = np.linalg.norm(trajectory.at(trajectory.times(4001)) - ASIDE, axis=1)
    assert away.min() < 2e-3


@pytest.mark.slow
def test_vias_in_space_need_no_search() -> None:
    plan = tp.plan(tp.robot("panda"), start=START - LIFTED, goal=GOAL - LIFTED, via=[ASIDE - LIFTED], obstacles=[WALL])
    assert plan.status == "certified"
    assert plan.planned.search.evaluations == 0
