"""Postures at the stops of a move: variables, turns, choices."""

from __future__ import annotations

from math import pi

import casadi as ca
import numpy as np
import pytest

from problems import Joints, Move, PlanarArm, Position
from problems.base import FloatArray, as_array
from problems.families.splines.encoding import nominal, postures, spread, variables

TWO = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0))
FOUR = PlanarArm((0.5,) * 4, (4.0,) * 4, (20.0,) * 4)
CORNER = Position((1.0, 1.0))  # elbow up: (0, pi / 2), down: (pi / 2, -pi / 2)


def found(task: Move, x: list[float]) -> list[FloatArray]:
    return [as_array(posture).ravel() for posture in postures(task, ca.DM(x))]


def names(task: Move) -> list[str]:
    return [variable.name for variable in variables(task)]


def test_variables_are_those_of_the_places_in_order() -> None:
    start, goals = Position((1.0, 0.5)), (Position((0.5, 1.0)), Joints((0.0,) * 4))
    task = Move(FOUR, start, goals, vias=(Joints((0.1,) * 4), Position((1.0, 1.0))))
    redundant = ["x_phi_{}[3]", "x_phi_{}[4]", "elbow_{}"]
    expected = [name.format(stop) for stop in ("start", "via_2", "goal") for name in redundant] + ["which_goal"]
    assert names(task) == expected
    assert next(v for v in variables(task) if v.name == "which_goal").upper == 2.0
    fixed = Move(FOUR, start, goals[:1], elbow="down")
    assert names(fixed) == ["x_phi_start[3]", "x_phi_start[4]", "x_phi_goal[3]", "x_phi_goal[4]"]
    assert names(Move(TWO, Joints((0.0, 0.0)), (Joints((1.0, 1.0)),))) == []


def test_one_of_several_goals() -> None:
    task = Move(TWO, Joints((0.0, 0.0)), (CORNER, Joints((1.0, 2.0)), Joints((3.0, 4.0))), elbow="up")
    expected = ([0.0, pi / 2], [1.0, 2.0], [3.0, 4.0])
    for which, goal in ((0.0, 0), (0.999, 0), (1.0, 1), (1.999, 1), (2.0, 2), (3.0, 2)):
        assert found(task, [which])[1] == pytest.approx(np.array(expected[goal]), abs=1e-12)


ORIGIN, TURNED = Joints((0.0, 0.0)), Joints((6.0, -4.0))
NEAR_IT = [2 * pi, pi / 2 - 2 * pi]  # of the corner, elbow up, nearest to what is turned
POSTURES: dict[str, tuple[Move, list[float], list[list[float]]]] = {
    "a variable from 0 on: elbow up": (Move(TWO, ORIGIN, (CORNER,)), [0.4], [[0.0, 0.0], [0.0, pi / 2]]),
    "and below 0 down": (Move(TWO, ORIGIN, (CORNER,)), [-0.4], [[0.0, 0.0], [pi / 2, -pi / 2]]),
    "turns are those nearest to the stop before": (
        Move(TWO, TURNED, (CORNER,), vias=(CORNER,), elbow="up"), [], [[6.0, -4.0], NEAR_IT, NEAR_IT],
    ),
    "before the first given posture those nearest after": (
        Move(TWO, CORNER, (CORNER,), vias=(CORNER, TURNED), elbow="up"), [], [NEAR_IT, NEAR_IT, [6.0, -4.0], NEAR_IT],
    ),
    "without a given posture the start is in its first turn": (
        Move(TWO, Position((-1.0, -1.0)), (Position((-1.0, 1.0)),), elbow="up"), [], [[pi, pi / 2], [pi / 2, pi / 2]],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("task", "x", "expected"), POSTURES.values(), ids=POSTURES)
def test_postures_at_the_stops_by_hand(task: Move, x: list[float], expected: list[list[float]]) -> None:
    assert np.array(found(task, x)) == pytest.approx(np.array(expected), abs=1e-12)


def test_no_posture_is_farther_than_the_spread() -> None:
    vias = (Joints((1.0, -3.0, 0.0, 2.0)), Position((1.0, 1.0)))
    task = Move(FOUR, Position((1.0, 0.5)), (Position((0.5, 1.0)), Joints((5.0,) * 4)), vias=vias)
    lower, upper = (np.array(bound) for bound in zip(*((v.lower, v.upper) for v in variables(task)), strict=True))
    for x in np.random.default_rng(0).uniform(lower, upper, (50, lower.size)):
        away = np.array(found(task, x.tolist())) - np.array(vias[0].values)
        assert np.abs(away).max() <= spread(task)
    assert spread(Move(TWO, Joints((0.0, 1.0)), (Joints((1.0, -1.0)),))) == 2.0


def test_the_nominal_postures_are_at_the_places() -> None:
    task = Move(FOUR, Position((1.0, 0.5)), (Position((0.5, 1.0)),))
    start, goal = nominal(task)
    assert np.abs(as_array(task.start.miss(FOUR, ca.DM(start).T))).max() < 1e-12
    assert np.abs(as_array(task.goals[0].miss(FOUR, ca.DM(goal).T))).max() < 1e-12
