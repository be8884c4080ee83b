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


def test_the_sign_of_a_variable_chooses_the_elbow() -> None:
    task = Move(TWO, Joints((0.0, 0.0)), (CORNER,))
    for branch, expected in ((0.4, [0.0, pi / 2]), (-0.4, [pi / 2, -pi / 2])):
        assert found(task, [branch])[1] == pytest.approx(np.array(expected), abs=1e-12)


def test_one_of_several_goals() -> None:
    task = Move(TWO, Joints((0.0, 0.0)), (CORNER, Joints((1.0, 2.0)), Joints((3.0, 4.0))), elbow="up")
    expected = ([0.0, pi / 2], [1.0, 2.0], [3.0, 4.0])
    for which, goal in ((0.0, 0), (0.999, 0), (1.0, 1), (1.999, 1), (2.0, 2), (3.0, 2)):
        assert found(task, [which])[1] == pytest.approx(np.array(expected[goal]), abs=1e-12)


def test_angles_are_in_the_turns_nearest_to_the_stop_before() -> None:
    """From 6 rad on, 0 is 2 pi; and so on from there."""
    task = Move(TWO, Joints((6.0, -4.0)), (CORNER,), vias=(CORNER,), elbow="up")
    via, goal = found(task, [])[1:]
    assert via == pytest.approx(np.array([2 * pi, pi / 2 - 2 * pi]), abs=1e-12)
    assert goal == pytest.approx(via, abs=1e-12)


def test_before_the_first_given_posture_turns_are_those_nearest_after() -> None:
    task = Move(TWO, CORNER, (CORNER,), vias=(CORNER, Joints((6.0, -4.0))), elbow="up")
    start, via, given, goal = found(task, [])
    assert given.tolist() == [6.0, -4.0]
    for posture in (start, via, goal):
        assert posture == pytest.approx(np.array([2 * pi, pi / 2 - 2 * pi]), abs=1e-12)


def test_without_a_given_posture_the_start_is_in_its_first_turn() -> None:
    task = Move(TWO, Position((-1.0, -1.0)), (Position((-1.0, 1.0)),), elbow="up")
    start, goal = found(task, [])
    assert start == pytest.approx(np.array([pi, pi / 2]), abs=1e-12)
    assert goal == pytest.approx(np.array([pi / 2, pi / 2]), abs=1e-12)


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
    assert np.abs(as_array(task.start.miss(FOUR, start))).max() < 1e-12
    assert np.abs(as_array(task.goals[0].miss(FOUR, goal))).max() < 1e-12
