"""Courses of obstacles: straight lines, in a region, with changes that are no larger than said."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import FloatArray
from problems.scene import Tabulated
from tpbso_casadi.simulation.world import Wandering

EVERYWHERE = np.array([[-np.inf, -np.inf], [np.inf, np.inf]])
ROUNDING = 1e-9


def wandering(**changed: object) -> Wandering:
    stated: dict[str, object] = {
        "velocity": np.array([0.5, 0.25]),
        "center": np.zeros(2),
        "radius": 1.0,
        "changes_every": np.inf,
        "room": EVERYWHERE,
    }
    return Wandering(**(stated | changed))  # type: ignore[arg-type]


def rows(course: Tabulated) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Times (p + 1,), places (p + 1, dim) and velocities (p, dim) of a course, read from its coefficients."""
    times = np.array(course.breaks)
    pieces = np.array(course.pieces)  # (dim, p, 4)
    assert not pieces[..., :2].any(), "a piece is no straight line"
    starts, velocities = pieces[..., 3].T, pieces[..., 2].T
    return times, np.vstack([starts, starts[-1] + velocities[-1] * np.diff(times)[-1]]), velocities


def test_without_changes_and_walls_it_goes_straight_on() -> None:
    times, places, velocities = rows(wandering().course(4.0, np.random.default_rng(1)))
    assert times.tolist() == [0.0, 4.0]
    assert places.tolist() == [[0.0, 0.0], [2.0, 1.0]]
    assert velocities.tolist() == [[0.5, 0.25]]


def test_it_turns_around_at_walls_when_it_meets_them() -> None:
    room = np.array([[-1.0, -0.25], [1.0, 0.75]])
    times, places, _ = rows(wandering(room=room).course(6.5, np.random.default_rng(1)))
    # x: wall at 1 m after 2 s, back at -1 m after 6 s; y: wall at 0.75 m after 3 s
    assert times == pytest.approx([0.0, 2.0, 3.0, 6.0, 6.5])
    assert places == pytest.approx(np.array([[0.0, 0.0], [1.0, 0.5], [0.5, 0.75], [-1.0, 0.0], [-0.75, -0.125]]))


def test_a_corner_is_left_in_the_direction_from_which_it_was_met() -> None:
    room = np.array([[-1.0, -1.0], [1.0, 0.5]])
    _, places, velocities = rows(wandering(room=room).course(3.0, np.random.default_rng(1)))
    assert places[-1] == pytest.approx([0.5, 0.25])
    assert velocities[-1] == pytest.approx([-0.5, -0.25])


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 1000),
    dim=st.sampled_from([2, 3]),
    radius=st.floats(0.05, 3.0),
    changes_every=st.floats(0.05, 5.0),
    width=st.floats(0.2, 4.0),
)
def test_courses_stay_in_their_room_and_velocities_in_their_ball(
    seed: int, dim: int, radius: float, changes_every: float, width: float
) -> None:
    room = np.array([[-width] * dim, [width / 2.0] * dim])
    course = Wandering(
        velocity=np.full(dim, radius / dim), center=np.zeros(dim), radius=radius, changes_every=changes_every, room=room
    ).course(8.0, np.random.default_rng(seed))
    times, places, velocities = rows(course)
    assert times[0] == 0.0
    assert times[-1] == 8.0
    assert (places >= room[0] - ROUNDING).all()
    assert (places <= room[1] + ROUNDING).all()
    long = np.diff(times) > 1e-6  # of shorter ones the velocity is mostly rounding
    assert (np.linalg.norm(velocities[long], axis=1) <= radius + ROUNDING).all()
    assert places[:-1] + np.diff(times)[:, None] * velocities == pytest.approx(places[1:], abs=ROUNDING)


def test_changes_come_as_often_as_said_and_are_as_large() -> None:
    center = np.array([1.0, 0.0])
    course = wandering(velocity=center, center=center, radius=0.1, changes_every=0.5)
    times, _, velocities = rows(course.course(2000.0, np.random.default_rng(3)))
    waits, changes = np.diff(times), velocities - center
    assert len(waits) == pytest.approx(4000, rel=0.1)
    assert waits.std() == pytest.approx(waits.mean(), rel=0.1)  # as of an exponential distribution
    sizes = np.linalg.norm(changes[1:], axis=1)
    assert sizes.max() <= 0.1 + 1e-6
    assert np.mean(sizes < 0.1 / np.sqrt(2.0)) == pytest.approx(0.5, abs=0.05)  # half of the area
    assert np.abs(changes[1:].mean(axis=0)).max() < 0.01


def test_a_seed_decides() -> None:
    course = wandering(changes_every=0.3)
    one, same, other = (course.course(5.0, np.random.default_rng(seed)) for seed in (4, 4, 5))
    assert one == same
    assert one != other
