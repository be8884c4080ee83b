"""Postures that the motors cannot hold are refused at start, goal and vias in one line; only what is certain is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from problems import InvalidProblem, Joints, Move, PlanarArm, PointToPoint, Position

ROD = {"max_speed": (4.0,) * 2, "max_acceleration": (40.0,) * 2}
WEAK = PlanarArm((0.5, 0.5), **ROD, link_masses=(2.0, 2.0), max_torque=(12.0, 20.0))
STRETCHED = "joint 1 needs 19.62 N m to hold the arm there, more than its 12 N m"
HANGING, BESIDE = Joints((-np.pi / 2, 0.0)), Joints((-np.pi / 2 + 0.3, 0.0))
OUT = Joints((0.0, 0.0))
THREE: dict[str, Any] = {"max_speed": (4.0,) * 3, "max_acceleration": (40.0,) * 3, "link_masses": (2.0,) * 3}


@pytest.mark.parametrize(
    ("field", "places"),
    [
        ("start", {"start": OUT, "goals": (HANGING,)}),
        ("goal", {"start": HANGING, "goals": (OUT,)}),
        ("via", {"start": HANGING, "goals": (BESIDE,), "vias": (OUT,)}),
    ],
)
def test_moves(field: str, places: dict[str, Any]) -> None:
    with pytest.raises(InvalidProblem) as caught:
        Move(WEAK, **places)
    assert str(caught.value) == f"{field}: {STRETCHED}"
    rest = {"start": HANGING, "goals": (BESIDE,)} | places
    Move(WEAK, **rest, start_velocity=(0.1, 0.0))  # passed in motion, where inertia may help


def test_one_of_several_goals_is_named() -> None:
    with pytest.raises(InvalidProblem, match=r"^goal: goal\[1\]: joint 1 needs"):
        Move(WEAK, HANGING, (BESIDE, OUT))


def test_points_with_a_single_posture() -> None:
    for field, ends in (("start", ((0.999999, 0.0), (0.0, -0.9))), ("goal", ((0.0, -0.9), (0.999999, 0.0)))):
        with pytest.raises(InvalidProblem, match=f"^{field}: joint 1 needs 19.6"):
            PointToPoint(WEAK, *ends)
        with pytest.raises(InvalidProblem, match=f"^{field}: joint 1 needs 19.6"):
            Move(WEAK, Position(ends[0]), (Position(ends[1]),))


def test_a_point_is_refused_only_where_no_branch_can_be_held() -> None:
    """Joint 1 carries m g (x of the elbow + x of the tool / 2): 11 N m with the elbow up, 5.1 N m with it down."""
    arm = PlanarArm((0.5, 0.5), **ROD, link_masses=(2.0, 2.0), max_torque=(7.0, 20.0))
    beside, below = (-0.15, -0.5), (0.0, -0.5)
    assert [elbow for elbow in ("up", "down", "free") if _is_held(arm, beside, elbow)] == ["down", "free"]
    assert [elbow for elbow in ("up", "down", "free") if _is_held(arm, below, elbow)] == []


def _is_held(arm: PlanarArm, point: tuple[float, float], elbow: Any) -> bool:
    try:
        PointToPoint(arm, (0.0, -0.999), point, elbow)
    except InvalidProblem:
        return False
    return True


def test_redundant_arms_are_not_judged_by_a_point() -> None:
    PointToPoint(PlanarArm((0.4,) * 3, **THREE, max_torque=(0.1,) * 3), (1.0, 0.0), (0.0, 1.0))


def test_arms_without_limits_of_torque_are_not_asked() -> None:
    Move(PlanarArm((0.5, 0.5), **ROD, link_masses=(2.0, 2.0)), OUT, (HANGING,))
