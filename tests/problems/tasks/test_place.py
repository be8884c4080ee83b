"""Places: postures by hand, turns, misses; what cannot be reached is refused by name."""

from __future__ import annotations

from math import pi

import casadi as ca
import numpy as np
import pytest

from problems import Ellipse, InvalidProblem, Joints, PlanarArm, Position
from problems.base import as_array

TWO = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0))
THREE = PlanarArm((1.0, 1.0, 0.5), (4.0,) * 3, (20.0,) * 3)
RANGED = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0), ((-1.0, 6.0), (-2.0, 2.0)))
NOTHING = ca.DM(0, 1)


@pytest.mark.parametrize(
    ("place", "robot", "reason"),
    [
        (Joints((0.1,)), TWO, "via[1]: 1 joints for a robot of 2"),
        (Joints((0.1, 2.5)), RANGED, "via[1]: joint 2: 2.5 is not within -2 and 2 rad"),
        (Joints((0.1, float("nan"))), TWO, "via[1]: nan is not within"),
        (Position((2.5, 0.0)), TWO, "out of reach"),
        (Position((0.2, 0.1)), PlanarArm((1.0, 0.5), (4.0, 4.0), (20.0, 20.0)), "too close"),
        (Position((1.0, 1.0)), TWO, "inside the obstacle"),
    ],
)
def test_places_that_cannot_be_are_refused_in_one_line(place: Joints, robot: PlanarArm, reason: str) -> None:
    with pytest.raises(InvalidProblem) as caught:
        place.check(robot, (Ellipse((1.0, 1.0), (0.1, 0.1)),), "via", "via[1]: ")
    assert str(caught.value).startswith("via: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_joints_are_taken_as_they_are_given() -> None:
    posture, reached = Joints((7.0, -4.0)).posture(TWO, NOTHING, 1.0, ca.DM([[0.0, 0.0]]))
    assert as_array(posture).tolist() == [[7.0, -4.0]]
    assert reached is None


@pytest.mark.parametrize(
    ("elbow", "near", "expected"),
    [
        (1.0, None, [0.0, pi / 2]),  # elbow at (1, 0)
        (-1.0, None, [pi / 2, -pi / 2]),  # elbow at (0, 1)
        (1.0, [6.0, -4.0], [2 * pi, pi / 2 - 2 * pi]),
    ],
)
def test_postures_at_a_point_by_hand(elbow: float, near: list[float] | None, expected: list[float]) -> None:
    before = None if near is None else ca.DM([near])
    posture, cosine = Position((1.0, 1.0)).posture(TWO, NOTHING, elbow, before)
    assert as_array(posture).ravel() == pytest.approx(np.array(expected), abs=1e-12)
    assert cosine is not None
    assert float(cosine) == pytest.approx(0.0, abs=1e-12)


def test_joint_limits_decide_about_turns_first() -> None:
    """0 is within -1 and 6, and so is what is nearest to 6: one turn less."""
    posture, _ = Position((1.0, 1.0)).posture(RANGED, NOTHING, 1.0, ca.DM([[6.0, 0.0]]))
    assert as_array(posture).ravel() == pytest.approx(np.array([0.0, pi / 2]), abs=1e-12)


@pytest.mark.parametrize("normalised", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("elbow", [-1.0, 1.0])
def test_every_redundancy_value_reaches_the_point(normalised: float, elbow: float) -> None:
    place = Position((1.2, -0.4))
    posture, cosine = place.posture(THREE, ca.DM([normalised]), elbow, None)
    assert cosine is not None
    assert abs(float(cosine)) <= 1.0 + 1e-12
    assert np.abs(as_array(place.miss(THREE, posture))).max() < 1e-7  # stretched out at both ends of the range


def test_misses_by_hand() -> None:
    theta = ca.DM([[0.0, pi / 2], [0.0, 0.0]])
    assert as_array(Position((1.0, 1.0)).miss(TWO, theta)) == pytest.approx(np.array([[0, 0], [1, -1]]), abs=1e-15)
    assert as_array(Joints((0.5, 0.0)).miss(TWO, theta)) == pytest.approx(np.array([[-0.5, pi / 2], [-0.5, 0.0]]))
    assert Position((1.0, 1.0)).tolerance(TWO) == pytest.approx(2e-9)
    assert Joints((0.5, 0.0)).tolerance(TWO) == 1e-9


def test_where_the_tool_is() -> None:
    assert Joints((0.0, pi / 2)).position(TWO) == pytest.approx(np.array([1.0, 1.0]))
    assert Position((1.0, 1.0)).position(TWO).tolist() == [1.0, 1.0]
