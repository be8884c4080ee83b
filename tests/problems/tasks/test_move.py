"""Moves: what is refused, by name; which goal counts; conditions on finished motions; what is drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from problems import Ellipse, InvalidProblem, Joints, Move, PlanarArm, Position
from problems.base import FloatArray, as_array
from problems.motions import Trajectory
from problems.tasks import MarkerKind

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
        ({"start": Joints((0.0,))}, "start", "1 joints for a robot of 2"),
        ({"goals": (Position((3.0, 0.0)),)}, "goal", "out of reach"),
        ({"goals": (AWAY, Position((3.0, 0.0)))}, "goal", "goal[1]: "),
        ({"vias": (POINT,), "obstacles": (DISC,)}, "via", "inside the obstacle"),
        ({"vias": (HOME, AWAY, Joints((1.0, 2.0, 3.0)))}, "via", "via[2]: 3 joints"),
        ({"start_velocity": (1.0,)}, "start_velocity", "1 values for 2 joints"),
        ({"start_acceleration": (1.0,)}, "start_acceleration", "1 values for 2 joints"),
        ({"start_acceleration": (0.0, 20.5)}, "start_acceleration", "joint 2: 20.5 is not within -20 and 20 rad/s^2"),
        ({"goal_velocity": (1.0, -4.5)}, "goal_velocity", "joint 2: -4.5"),
        ({"goal_velocity": (float("nan"), 0.0)}, "goal_velocity", "joint 1: nan"),
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


def test_durations_are_bounded_where_that_is_asked_for() -> None:
    assert made().duration_bounds is None
    bounds = made(total_time=(1.0, 2.0)).duration_bounds
    assert bounds is not None
    assert (bounds.name, bounds.shortest, bounds.longest) == ("total time", 1.0, 2.0)


def test_markers() -> None:
    start, via, goals = made(vias=(POINT,), goals=(AWAY, POINT)).markers()
    assert (start.kind, via.kind, goals.kind) == (MarkerKind.START, MarkerKind.POINTS, MarkerKind.GOAL)
    assert via.points.tolist() == [[1.0, 1.0]]
    assert goals.points.shape == (2, 2)
    assert len(made().markers()) == 2
