"""Random scenes of the benchmark: hard and fair as they promise, and judged by distances that are right."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from benchmarks.moving_scenes.__main__ import line, table
from benchmarks.moving_scenes.coal_check import check_with_coal
from benchmarks.moving_scenes.judge import Outcome, least_room
from benchmarks.moving_scenes.scenes import CLEAR, WAITS, Scene, random_scenes
from problems import Trajectory
from problems.base import as_array
from problems.scene import Obstacle
from tpbso_casadi import read_scenario


@pytest.fixture(scope="module", params=[2, 3], ids=["plane", "space"])
def scene(request: pytest.FixtureRequest) -> Scene:
    """The second of random ones."""
    *_, last = random_scenes(request.param, 2, 7)
    return last


def obstacles(scene: Scene, folder: Path) -> tuple[Obstacle, ...]:
    path = folder / "scene.toml"
    path.write_text(scene.scenario(100, 1))
    return tuple(part for table in read_scenario(path).obstacles for part in table.built(1))[-len(scene.things) :]


def test_the_scenario_states_the_same_things(scene: Scene, tmp_path: Path) -> None:
    """The room that NumPy sees around points and segments is that of the product where both are exact."""
    rng = np.random.default_rng(3)
    times = rng.uniform(0.0, 3.0, 50)
    for thing, obstacle in zip(scene.things, obstacles(scene, tmp_path), strict=True):
        assert obstacle.moves == thing.moves or thing.course.turns is not None
        near = thing.course.frames(times)[0][:, None] + rng.uniform(-0.4, 0.4, (50, 2, scene.dim))
        if scene.dim == 2:
            seen = [obstacle.seen(ca.DM(near[:, k]), ca.DM(times)) for k in (0, 1)]
            own = as_array(obstacle.unmoved.segment_clearance(*seen))[:, 0]
            assert (thing.room(near, times)[:, 0] > 0.0).tolist() == (own > 0.0).tolist()
        else:
            own = as_array(obstacle.unmoved.point_clearance(obstacle.seen(ca.DM(near[:, 0]), ca.DM(times))))[:, 0]
            assert thing.room(near[:, :1], times)[:, 0] == pytest.approx(own, abs=1e-9)


def test_they_are_hard_and_fair(scene: Scene) -> None:
    moving = tuple(thing for thing in scene.things if thing.moves)
    assert moving
    assert all(scene.room(0.0, (thing,)) < 0.0 for thing in moving)
    assert any(scene.room(float(wait), scene.things) >= CLEAR for wait in WAITS)
    assert scene.arm.room(scene.start[None], np.zeros(1), scene.things)[0] >= CLEAR


def test_they_are_the_same_for_the_same_seed() -> None:
    first, again, other = (next(iter(random_scenes(2, 1, seed))).scenario(10, 1) for seed in (7, 7, 8))
    assert first == again != other


def test_the_straight_line_at_once_is_found_to_be_hit(scene: Scene) -> None:
    times, theta = scene.line(0.0)
    rests = [np.array([a, b - a]) for a, b in pairwise(theta)]
    trajectory = Trajectory.from_pieces(np.diff(times), rests)
    assert least_room(scene, trajectory) < 0.0


def test_coal_agrees_and_disagreement_is_an_error() -> None:
    pytest.importorskip("coal")
    (scene,) = random_scenes(3, 1, 7)
    times, theta = scene.line(0.0)
    check_with_coal(scene.things, theta[:5], times[:5])
    with pytest.raises(AssertionError, match="coal"):
        check_with_coal(scene.things, theta[:5], times[:5], shift=0.01)


def test_the_table_counts_what_happened() -> None:
    outcomes = [
        Outcome("plane 1", 2, 1, True, True, 2.0, 1.5, 1.0, 4.0, 0.01, True, True),
        Outcome("plane 2", 2, 1, False, True, 4.0, 1.5, 1.0, 4.0, -0.01, True, False),
        Outcome("space 1", 3, 1, error="ScenarioError: no"),
    ]
    plane, space = table(outcomes).splitlines()[2:]
    assert plane == "| plane | 2 | 1 | 1 | 1.500 | 1.500 | 3.0 | 3.8 | 1 of 2 |"
    assert space == "| space | 1 | 0 | 0 | nan | nan | nan | nan | 0 of 0 |"
    assert line(outcomes[0]) == "plane 1: certified, T = 1.500 s of 1.000, 2.0 s, 10.0 mm left"
    assert line(outcomes[2]) == "space 1: ScenarioError: no"
