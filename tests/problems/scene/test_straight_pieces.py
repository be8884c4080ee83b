"""Motions in straight lines between rows, and the pieces of a table that meet a time."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from problems import Ellipse
from problems.scene import Tabulated
from problems.scene.moving import ConstantVelocity, MovingObstacle

TIMES = [0.0, 1.0, 1.5, 4.0]
PLACES = np.array([[0.0, 0.0], [2.0, -1.0], [2.0, 1.0], [-3.0, 1.0]])
LINES = Tabulated.along_lines(TIMES, PLACES)


def place_at(motion: Tabulated, time: float) -> np.ndarray:
    return motion.placed(np.zeros((1, motion.dim)), time)[0]


@pytest.mark.parametrize("time", [-1.0, 0.0, 0.3, 1.0, 1.2, 1.5, 3.9, 4.0, 7.0])
def test_between_rows_it_goes_straight(time: float) -> None:
    expected = [np.interp(time, TIMES, PLACES[:, axis]) for axis in (0, 1)]
    assert place_at(LINES, time) == pytest.approx(expected)


def test_travel_is_bounded_by_the_fastest_line_that_is_met() -> None:
    speeds = np.linalg.norm(np.diff(PLACES, axis=0), axis=1) / np.diff(TIMES)
    cells = np.array([[0.2, 0.4], [1.1, 1.3], [2.0, 3.0], [0.9, 1.1]])
    expected = np.array([0.1 * speeds[0], 0.1 * speeds[1], 0.5 * speeds[2], 0.1 * speeds[1]])
    assert LINES.travel(cells, 1.0) == pytest.approx(expected)


@pytest.mark.parametrize(("first", "last", "kept"), [
    (0.2, 0.8, (0.0, 1.0)), (0.2, 1.2, (0.0, 1.0, 1.5)), (1.0, 1.5, (1.0, 1.5)), (5.0, 6.0, (1.5, 4.0)),
    (-2.0, -1.0, (0.0, 1.0)), (1.5, 1.5, (1.5, 4.0)), (-1.0, 9.0, (0.0, 1.0, 1.5, 4.0)),
])  # fmt: skip
def test_during_a_time_it_is_the_same_with_the_pieces_that_meet_it(
    first: float, last: float, kept: tuple[float, ...]
) -> None:
    fewer = LINES.during(first, last)
    assert fewer.breaks == kept
    for time in np.linspace(first, last, 7):
        assert place_at(fewer, time) == pytest.approx(place_at(LINES, time))


def test_a_moving_obstacle_is_the_same_during_a_time() -> None:
    still = Ellipse((1.0, 0.5), (0.3, 0.2), 0.4)
    obstacle = MovingObstacle(still, LINES)
    fewer = obstacle.during(1.1, 1.4)
    points, times = ca.DM([[0.3, 0.4]]), ca.DM([1.2])
    assert np.array(fewer.seen(points, times)) == pytest.approx(np.array(obstacle.seen(points, times)))
    assert len(fewer.motion.breaks) == 2  # type: ignore[attr-defined]


def test_what_has_no_pieces_stays_as_it_is() -> None:
    motion, still = ConstantVelocity((1.0, 0.0)), Ellipse((1.0, 0.5), (0.3, 0.2), 0.4)
    assert motion.during(0.0, 1.0) is motion
    assert still.during(0.0, 1.0) is still
