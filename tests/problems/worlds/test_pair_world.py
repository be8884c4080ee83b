"""The world of pairs: margins and slopes against all pairs one by one, paths and proofs among them."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest

from problems import ConstantVelocity, Ellipse, MovingObstacle, Obstacle, PlanarArm
from problems.base import FloatArray, as_array
from problems.core import Schedule, Separation
from problems.limits import clearances, proximity_limits
from problems.motions import Trajectory
from problems.scene import Polygon
from problems.timing import rest_to_rest
from problems.worlds import PairWorld

ARM = PlanarArm((0.6, 0.5, 0.4), (4.0,) * 3, (20.0,) * 3, link_radius=(0.02,) * 3, margin=0.03, self_collision=True)
OVAL = Ellipse(center=(0.9, 0.8), semi_axes=(0.2, 0.1))
PASSING = MovingObstacle(OVAL, ConstantVelocity((-0.4, 0.1)), margin_rate=0.05)
TIMES = np.linspace(0.0, 1.0, 101)
THETA = np.array([0.1, -0.4, 0.3]) + TIMES[:, None] ** 2 * np.array([1.3, 1.2, -2.9])


def world_of(*obstacles: Obstacle) -> PairWorld:
    return PairWorld.of(ARM, proximity_limits(ARM, obstacles))


def every_margin(world: PairWorld, theta: FloatArray, times: FloatArray) -> FloatArray:
    pairs = [pair for limit in world.limits for pair in limit.pairs]
    return as_array(clearances(pairs, ARM.positions(ca.DM(theta)), ca.DM(times))) - ARM.margin


@pytest.mark.parametrize("obstacles", [(), (OVAL,), (PASSING,), (OVAL, PASSING)])
def test_margins_and_slopes_are_those_of_all_pairs(obstacles: tuple[Obstacle, ...]) -> None:
    world, h = world_of(*obstacles), 1e-6
    expected = every_margin(world, THETA, TIMES)
    assert world.clearance_margins(THETA, times=TIMES) == pytest.approx(expected.min(axis=1), abs=1e-12)
    near = world.nearby(THETA, 0.3, TIMES)
    rows, columns = np.nonzero(expected < 0.3)
    order = np.lexsort((rows, columns))
    assert near.samples.tolist() == rows[order].tolist()
    assert near.clearance_margins == pytest.approx(expected[rows[order], columns[order]], abs=1e-12)
    for joint in range(ARM.dof):
        more, less = (every_margin(world, THETA + s * h * np.eye(3)[joint], TIMES) for s in (1.0, -1.0))
        assert near.gradients[:, joint] == pytest.approx(((more - less) / (2.0 * h))[rows, columns][order], abs=1e-5)
    later, sooner = (every_margin(world, THETA, TIMES + s * h) for s in (1.0, -1.0))
    assert near.rates == pytest.approx(((later - sooner) / (2.0 * h))[rows, columns][order], abs=1e-5)
    assert near.rates.any() == world.moves == (PASSING in obstacles)


def test_kinds_of_pairs_are_told_apart_and_what_stands_still_is_a_world() -> None:
    world = world_of(OVAL, PASSING)
    each = [world.clearance_margins(THETA, which=which, times=TIMES) for which in world.margins]
    assert set(world.margins) == {Separation.FROM_OBSTACLES, Separation.FROM_EACH_OTHER}
    assert np.minimum(*each) == pytest.approx(world.clearance_margins(THETA, times=TIMES))
    assert not world.still.moves and world.still.still is world.still
    assert world.still.clearance_margins(THETA) == pytest.approx(world_of(OVAL).clearance_margins(THETA))
    assert world.fastest == pytest.approx(np.hypot(0.4, 0.1) + 0.05)
    assert world.clear(THETA, times=TIMES).tolist() == (world.clearance_margins(THETA, times=TIMES) >= 0.0).tolist()


def test_nothing_to_keep_clear_of_is_a_world_too() -> None:
    arm = PlanarArm((0.5, 0.5), (4.0,) * 2, (20.0,) * 2)
    world = PairWorld.of(arm, proximity_limits(arm, ()))
    assert world.clear(np.zeros((3, 2))).all() and np.isinf(world.clearance_margins(np.zeros((3, 2)))).all()
    assert world.nearby(np.zeros((3, 2)), 1.0).samples.size == 0
    assert world.prove(Trajectory.standing(np.zeros(2), 1.0)).status


def test_a_path_leads_around_and_is_the_same_every_time() -> None:
    wall = Polygon(((0.9, 0.6), (1.6, 0.6), (1.6, 0.7), (0.9, 0.7)))
    world, start, goal = world_of(wall), np.array([0.0, 0.2, 0.1]), np.array([1.4, 0.2, 0.1])
    assert not world.prove(rest_to_rest(start, goal, ARM.limits)).status
    box = np.array([[-3.0] * 3, [3.0] * 3])
    path = world.connect(start, goal, box, 1)
    assert path is not None and path[[0, -1]] == pytest.approx(np.stack([start, goal]))
    between = np.concatenate([np.linspace(one, two, 50) for one, two in pairwise(path)])
    assert world.clearance_margins(between).min() > -0.01
    again = world.connect(start, goal, box, 1)
    assert again is not None and (again == path).all()
    assert world.connect(start, np.array([0.55, 0.0, 0.0]), box, 1) is None  # inside the wall


def test_a_path_keeps_clear_of_what_moves_when_it_passes() -> None:
    crossing = MovingObstacle(
        Ellipse(center=(0.0, 0.0), semi_axes=(0.15, 0.15)), ConstantVelocity((0.0, -1.0), (1.0, 1.2))
    )
    world, start, goal = world_of(crossing), np.array([-0.6, 0.1, 0.1]), np.array([0.9, 0.1, 0.1])
    box = np.array([[-3.0] * 3, [3.0] * 3])
    soon, late = (Schedule(start, goal, begin, begin + 0.5) for begin in (0.9, 4.0))
    straight = world.connect(start, goal, box, 1, schedule=late)
    around = world.connect(start, goal, box, 1, schedule=soon)
    assert straight is not None and np.ptp(straight[:, 1:], axis=0).max() < 1e-12
    assert around is not None and np.ptp(around[:, 1:], axis=0).max() > 0.1


def test_what_a_formula_raises_reaches_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> FloatArray:
        raise KeyboardInterrupt

    world = world_of(OVAL)
    monkeypatch.setattr(PairWorld, "clear", interrupted)
    with pytest.raises(KeyboardInterrupt):
        world.connect(np.zeros(3), np.ones(3), np.array([[-3.0] * 3, [3.0] * 3]), 1)
