"""Places and moves: postures by hand, what is refused by name, conditions on motions, when vias are passed."""

from __future__ import annotations

from dataclasses import replace
from math import pi
from typing import Any

import casadi as ca
import numpy as np
import pytest

from problems import Ellipse, InvalidProblem, Joints, Move, PlanarArm, PointToPoint, Position, Trajectory
from problems.base import FloatArray, as_array
from problems.tasks import MarkerKind
from problems.tasks.move import passing_times

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


ROD = {"max_speed": (4.0,) * 2, "max_acceleration": (40.0,) * 2}
WEAK = PlanarArm((0.5, 0.5), **ROD, link_masses=(2.0, 2.0), max_torque=(12.0, 20.0))
STRETCHED = "joint 1 needs 19.62 N m to hold the arm there, more than its 12 N m"
HANGING, BESIDE = Joints((-np.pi / 2, 0.0)), Joints((-np.pi / 2 + 0.3, 0.0))
OUT = Joints((0.0, 0.0))


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


def test_redundant_arms_and_arms_without_limits_of_torque_are_not_judged() -> None:
    PointToPoint(replace(THREE, link_masses=(2.0,) * 3, max_torque=(0.1,) * 3), (1.0, 0.0), (0.0, 1.0))
    Move(PlanarArm((0.5, 0.5), **ROD, link_masses=(2.0, 2.0)), OUT, (HANGING,))


ARM = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0))
HOME, AWAY, POINT = Joints((0.0, 0.5)), Joints((1.0, -0.5)), Position((1.0, 1.0))
DISC = Ellipse((1.0, 1.0), (0.05, 0.05))


def made(**changes: Any) -> Move:
    return Move(**({"robot": ARM, "start": HOME, "goals": (AWAY,)} | changes))


@pytest.mark.parametrize(
    ("changes", "field", "reason"),
    [
        ({"goals": ()}, "goal", "there is none"),
        ({"elbow": "left"}, "elbow", "'left' is not one of up, down, free"),
        ({"goals": (Position((3.0, 0.0)),)}, "goal", "out of reach"),
        ({"goals": (AWAY, Position((3.0, 0.0)))}, "goal", "goal[1]: "),
        ({"vias": (POINT,), "obstacles": (DISC,)}, "via", "inside the obstacle"),
        ({"vias": (HOME, AWAY, Joints((1.0, 2.0, 3.0)))}, "via", "via[2]: 3 joints"),
        ({"start_velocity": (1.0,)}, "start_velocity", "1 values for 2 joints"),
        ({"start_acceleration": (1.0,)}, "start_acceleration", "1 values for 2 joints"),
        ({"start_acceleration": (0.0, 20.5)}, "start_acceleration", "joint 2: 20.5 is not within -20 and 20 rad/s^2"),
        ({"start_acceleration": (0.0, -20.1)}, "start_acceleration", "joint 2: -20.1 is 0.5 % beyond 20 rad/s^2, as a"),
        ({"total_time": (2.0, 1.0)}, "total_time", "0 < 2 < 1 does not hold"),
        ({"obstacles": (Ellipse((0.0, 0.0), (0.1, 0.1)),)}, "obstacles", "the base lies inside"),
    ],
)
def test_what_cannot_be_stated_is_refused_in_one_line(changes: dict[str, Any], field: str, reason: str) -> None:
    with pytest.raises(InvalidProblem) as caught:
        made(**changes)
    assert str(caught.value).startswith(f"{field}: ")
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)


def test_velocities_left_out_are_zero() -> None:
    assert made().at_rest
    assert made(start_velocity=(0.0, 0.0)).at_rest
    assert made(start_acceleration=(0.0, 0.0)).at_rest
    assert not made(start_acceleration=(0.0, 0.1)).at_rest
    moving = made(goal_velocity=(0.0, -1.0))
    assert not moving.at_rest
    assert moving.end_velocities.tolist() == [[0.0, 0.0], [0.0, -1.0]]


def test_the_goal_that_is_missed_least_is_the_one_that_counts() -> None:
    move = made(goals=(AWAY, POINT))
    at_point = np.array([0.0, np.pi / 2])
    assert move.reached_goal(at_point) is POINT
    assert move.reached_goal(np.array([1.0, -0.5 + 1e-9])) is AWAY


def blend(start: FloatArray, goal: FloatArray, offset: float = 0.0) -> Trajectory:
    """At rest at both ends, by way of what lies half-way; ``offset`` moves all of it."""
    shape = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])[:, None] * (goal - start)
    shape[0] += start + offset
    return Trajectory.from_pieces(np.array([2.0]), [shape])


def worst(move: Move, trajectory: Trajectory) -> dict[str, float]:
    """By condition, the largest of its values over the bound, and that it has one row at one time."""
    found = {}
    for constraint, times in move.conditions(trajectory):
        assert constraint.rows == times.size == 1
        found[constraint.name] = float((np.abs(as_array(constraint.expression)) / constraint.bounds[1]).max())
    return found


def test_conditions_of_a_motion() -> None:
    start, goal = np.array([0.0, 0.5]), np.array([1.0, -0.5])
    move = made(vias=(Joints((0.5, 0.0)),))
    kept = worst(move, blend(start, goal))
    assert list(kept) == ["start", "via 1", "goal", "start velocity", "goal velocity"]
    assert max(kept.values()) < 1.0
    broken = worst(move, blend(start, goal, 1e-8))
    assert broken["start"] == pytest.approx(10.0 * np.sqrt(2.0), rel=1e-6)
    assert broken["goal"] > 1.0
    assert broken["via 1"] == pytest.approx(10.0 * np.sqrt(2.0), rel=1e-3)  # the offset is across the path
    too_fast = worst(made(goal_velocity=(0.5, 0.0)), blend(start, goal))
    assert too_fast["start velocity"] < 1.0 < too_fast["goal velocity"]
    assert made(vias=(Joints((0.5, 0.0)),)).via_times(blend(start, goal)) == pytest.approx(np.array([1.0]), abs=1e-9)


def test_bounds_of_durations_and_markers() -> None:
    assert made().duration_bounds is None
    bounds = made(total_time=(1.0, 2.0)).duration_bounds
    assert bounds is not None
    assert (bounds.name, bounds.shortest, bounds.longest) == ("total time", 1.0, 2.0)
    start, via, goals = made(vias=(POINT,), goals=(AWAY, POINT)).markers()
    assert (start.kind, via.kind, goals.kind) == (MarkerKind.START, MarkerKind.VIA, MarkerKind.GOAL)
    assert via.points.tolist() == [[1.0, 1.0]]
    assert goals.points.shape == (2, 2)
    assert len(made().markers()) == 2


def motion(*pieces: list[list[float]], durations: list[float] | None = None) -> Trajectory:
    """Pieces in powers of their own normalised time, lowest first: lists of rows of two joints."""
    return Trajectory.from_pieces(np.array(durations or [1.0] * len(pieces)), [np.array(piece) for piece in pieces])


LINE = motion([[0.0, 0.0], [1.0, 2.0]], [[1.0, 2.0], [1.0, -2.0]], durations=[0.3, 0.7])  # a corner at (1, 2)
CIRCLE = motion([[0.0, 0.3], [2.0 * np.pi, 0.0]], durations=[2.0])


@pytest.mark.parametrize("share", [0.0, 0.123456, 0.98765])
def test_a_via_at_a_breakpoint_or_between_grid_times_is_found_exactly(share: float) -> None:
    assert passing_times(ARM, LINE, ()).shape == (0,)
    via = Joints((1.0 + share, 2.0 - 2.0 * share))
    assert passing_times(ARM, LINE, (via,)) == pytest.approx(np.array([0.3 + 0.7 * share]), abs=1e-12)


def test_points_are_found_by_the_tool() -> None:
    point = as_array(ARM.tool.position(ca.DM([[1.2345, 0.3]]))).ravel()
    assert passing_times(ARM, CIRCLE, (Position(tuple(point.tolist())),)) == pytest.approx([1.2345 / np.pi], abs=1e-9)


def test_a_place_passed_twice_is_passed_in_order() -> None:
    """There and back: 0.5 on the way out, 1 at the turn, 0.5 on the way back."""
    out = motion([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [-1.0, 0.0]])
    half, far = Joints((0.5, 0.0)), Joints((1.0, 0.0))
    assert passing_times(ARM, out, (half, far, half)) == pytest.approx(np.array([0.5, 1.0, 1.5]), abs=1e-12)
    assert passing_times(ARM, out, (far, half)) == pytest.approx(np.array([1.0, 1.5]), abs=1e-12)


def test_what_is_missed_is_missed_least() -> None:
    """The foot of the perpendicular on the line through 0 in the direction (1, 2)."""
    via = Joints((0.4, 1.2))
    u = (0.4 * 1.0 + 1.2 * 2.0) / 5.0
    assert passing_times(ARM, LINE, (via,)) == pytest.approx(np.array([0.3 * u]), abs=1e-9)


def test_a_motion_that_stands_still_passes_at_any_time() -> None:
    still = motion([[0.1, 0.2]])
    (time,) = passing_times(ARM, still, (Joints((0.1, 0.2)),))
    assert 0.0 <= time <= 1.0
