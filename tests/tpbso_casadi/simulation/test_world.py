"""What the planner sees of obstacles, and what they really do: courses of straight lines in a region."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.simulations import setting
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import FloatArray
from problems.scene import Obstacle, Tabulated
from tpbso_casadi import ScenarioError
from tpbso_casadi.simulation.world import SimulatedWorld, Wandering

BOX = {"shape": "box", "center": [3.0, 0.5], "size": [0.4, 0.2], "velocity": [-0.3, 0.4]}
STILL = {"shape": "box", "center": [-3.0, 0.5], "size": [0.4, 0.2]}
REGION = [[-4.0, -4.0], [4.0, 4.0]]
ROWS = [[0.0, 1.0, 0.0], [1.0, 2.0, 0.0], [2.0, 2.0, 3.0], [4.0, -1.0, 3.0]]


def world(*obstacles: dict[str, Any], seed: int = 1, **table: Any) -> SimulatedWorld:
    return setting(obstacles=list(obstacles), simulation=table, solver={"seed": seed}).world


def place(obstacle: Obstacle, time: float) -> np.ndarray:
    return np.array(obstacle.at(time).place)  # type: ignore[attr-defined]


def test_an_obstacle_keeps_its_velocity_where_nothing_else_is_said() -> None:
    scene = world(BOX)
    for now in (0.0, 0.75, 2.5):
        [seen] = scene.observed(now)
        assert place(seen, 0.5) == pytest.approx(np.array([3.0, 0.5]) + (now + 0.5) * np.array([-0.3, 0.4]))


def test_what_stands_still_and_what_keeps_to_a_table_are_known() -> None:
    scene = world(STILL, {**STILL, "motion_rows": ROWS}, changes_every=0.2, course_rate=1.0)
    still, tabulated = scene.true
    for now in (0.0, 0.75, 2.5):
        assert scene.observed(now)[0] == still
        for later in (0.0, 0.6, 1.4):
            assert place(scene.observed(now)[1], later) == pytest.approx(place(tabulated, now + later))


def test_of_a_wanderer_place_and_velocity_of_the_moment_are_seen() -> None:
    scene = world(BOX, changes_every=0.3, course_rate=1.0, region=REGION)
    [true] = scene.true
    for now in np.arange(0.0, 3.0, 0.25):
        [seen] = scene.observed(float(now))
        assert place(seen, 0.0) == pytest.approx(place(true, float(now)))
        rate = (place(true, float(now) + 1e-7) - place(true, float(now))) / 1e-7
        predicted = place(seen, 1.0) - place(seen, 0.0)
        assert predicted == pytest.approx(rate, abs=1e-6)


def test_no_obstacle_leaves_what_is_predicted_faster_than_the_course_rate() -> None:
    scene = world(BOX, changes_every=0.1, course_rate=1.2, region=REGION)
    [true] = scene.true
    for now in np.arange(0.0, 2.0, 0.25):
        [seen] = scene.observed(float(now))
        for later in np.linspace(0.0, 3.0 - now, 9):
            away = place(true, float(now + later)) - place(seen, float(later))
            assert np.linalg.norm(away) <= 1.2 * later + 1e-9


def test_without_a_region_velocities_stay_near_the_stated_one() -> None:
    scene = world(BOX, changes_every=0.05, course_rate=0.2)
    [true] = scene.true
    assert np.linalg.norm(place(true, 3.0) - place(true, 0.0) - 3.0 * np.array([-0.3, 0.4])) <= 0.1 * 3.0


def test_the_whole_obstacle_stays_in_the_region() -> None:
    region = [[2.5, 0.0], [3.5, 1.0]]
    [true] = world(BOX, changes_every=0.1, course_rate=4.0, region=region).true
    boxes = np.array([true.at(time).bounding_box() for time in np.linspace(0.0, 3.0, 200)])
    assert (boxes[:, 0] >= np.array(region[0]) - 1e-9).all()
    assert (boxes[:, 1] <= np.array(region[1]) + 1e-9).all()
    assert np.ptp(boxes[:, 0, 0]) > 0.4  # it uses the 0.6 m that it has


def test_the_same_seed_is_the_same_world_and_obstacles_are_independent() -> None:
    table: dict[str, Any] = {"changes_every": 0.2, "course_rate": 1.0}
    one, same, other = (world(BOX, seed=seed, **table).true for seed in (1, 1, 2))
    assert one == same
    assert one != other
    scene = world(BOX, {**BOX, "margin_rate": 0.3}, **table)
    first, second = scene.true
    assert first == one[0]
    assert first.motion != second.motion  # type: ignore[attr-defined]
    assert [seen.margin_rate for seen in scene.observed(1.0)] == [0.0, 0.3]  # type: ignore[attr-defined]


@pytest.mark.parametrize(("table", "message"), [
    ({"changes_every": 0.5}, "simulation.course_rate: missing key; changes_every needs to know"),
    ({"changes_every": 1e-5, "course_rate": 1.0}, "simulation.changes_every: more than 10000 changes of course"),
    ({"course_rate": 0.9, "region": REGION}, "obstacles.0.velocity: 0.5 m/s; turning around takes twice that"),
    ({"course_rate": 1.0, "region": [[0.0, 0.0], [3.0, 1.0]]}, "obstacles.0: is not within the simulation.region"),
    ({"course_rate": 1.0, "region": [[0.0] * 3, [3.0] * 3]}, "simulation.region: 3 coordinates where obstacles have 2"),
    ({"course_rate": 1.0, "region": [[0.0, 0.0], [3.0]]}, "simulation.region.1: "),
    ({"course_rate": 1.0, "region": [[0.0] * 2, [3.0] * 3]}, "simulation.region: corners of 2 and of 3 coordinates"),
    ({"course_rate": 1.0, "region": [[0.0, 2.0], [4.0, 1.0]]}, "simulation.region: the first corner has to be below"),
    ({"course_rate": 1.0, "region": [[2.8, 0.4], [3.2, 0.9]]}, "obstacles.0: fits the simulation.region so closely"),
    ({"every": 4.0}, "simulation.every: 4 s is more than the 3 s that are simulated"),
    ({"every": 1e-5}, "simulation.every: 300000 replans; at most 100000"),
    ({"seconds": -1.0}, "simulation.seconds: "),
    ({"course_rat": 1.0}, "simulation.course_rat: unknown key; did you mean course_rate?"),
    ({"goals": []}, "simulation.goals: a list of"),
    ({"goals": [[9.0, 0.0]]}, "simulation.goals.0: (9.0, 0.0) is 9 m from the base, out of reach"),
    ({"goals": [{"joints": [0.0]}]}, "simulation.goals.0: 1 joints for a robot of 2"),
    ({"evaluations": 0}, "simulation.evaluations: "),
])  # fmt: skip
def test_bad_tables_name_the_key(table: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        world(BOX, **table)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


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
    assert (times.tolist(), places.tolist()) == ([0.0, 4.0], [[0.0, 0.0], [2.0, 1.0]])
    assert velocities.tolist() == [[0.5, 0.25]]


def test_it_turns_around_at_walls_when_it_meets_them() -> None:
    room = np.array([[-1.0, -0.25], [1.0, 0.75]])
    times, places, _ = rows(wandering(room=room).course(6.5, np.random.default_rng(1)))
    # x: wall at 1 m after 2 s, back at -1 m after 6 s; y: wall at 0.75 m after 3 s
    assert times == pytest.approx([0.0, 2.0, 3.0, 6.0, 6.5])
    assert places == pytest.approx(np.array([[0.0, 0.0], [1.0, 0.5], [0.5, 0.75], [-1.0, 0.0], [-0.75, -0.125]]))
    corner = np.array([[-1.0, -1.0], [1.0, 0.5]])  # is left in the direction from which it was met
    _, places, velocities = rows(wandering(room=corner).course(3.0, np.random.default_rng(1)))
    assert places[-1] == pytest.approx([0.5, 0.25])
    assert velocities[-1] == pytest.approx([-0.5, -0.25])


@settings(max_examples=30, deadline=None)
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


def test_two_changes_at_almost_one_time_are_one() -> None:
    width = 0.47933560042194717
    room = np.array([[-width] * 3, [width / 2.0] * 3])
    course = Wandering(
        velocity=np.full(3, 0.478515625 / 3), center=np.zeros(3), radius=0.478515625, changes_every=3.0, room=room
    ).course(8.0, np.random.default_rng(0))
    times, places, _ = rows(course)
    assert times[-1] == 8.0 and (np.diff(times) >= 1e-6).all()
    assert (places >= room[0] - ROUNDING).all() and (places <= room[1] + ROUNDING).all()


def test_changes_come_as_often_as_said_and_are_as_large() -> None:
    center = np.array([1.0, 0.0])
    course = wandering(velocity=center, center=center, radius=0.1, changes_every=0.5)
    times, _, velocities = rows(course.course(1000.0, np.random.default_rng(3)))
    waits, changes = np.diff(times), velocities - center
    assert len(waits) == pytest.approx(2000, rel=0.1)
    assert waits.std() == pytest.approx(waits.mean(), rel=0.1)  # as of an exponential distribution
    sizes = np.linalg.norm(changes[1:], axis=1)
    assert sizes.max() <= 0.1 + 1e-6
    assert np.mean(sizes < 0.1 / np.sqrt(2.0)) == pytest.approx(0.5, abs=0.05)  # half of the area
    assert np.abs(changes[1:].mean(axis=0)).max() < 0.01
