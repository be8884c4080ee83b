"""Distances and gradients of many pairs along a path, against all of them computed one by one."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from problems import Box, ConstantVelocity, Ellipse, MovingObstacle, Obstacle, PlanarArm, Robot, Tabulated
from problems.base import FloatArray, as_array
from problems.limits import Clearance, clearances
from problems.limits.proximity import SelfClearance
from problems.robots import Sphere
from problems.sequential.pair_clearances import PairClearances
from tests.helpers.space import small_arm

SPHERES = tuple(Sphere(i, (0.02, 0.0, 0.1), 0.06, f"ball {i}") for i in range(2, 8))
ROOM: tuple[Obstacle, ...] = (
    Box(center=(0.5, 0.1, 0.6), size=(0.2, 0.3, 0.4), quaternion=(0.0, 0.0, 0.3826834, 0.9238795)),
    Box(center=(-0.4, 0.3, 0.3), size=(0.3, 0.1, 0.2)),
)
TIMES = np.linspace(0.0, 1.0, 101)


ARM = small_arm(spheres=SPHERES, kept_pairs=((0, 4), (1, 5)), self_collision=True)
PLANAR = PlanarArm((0.6, 0.5, 0.4), (4.0,) * 3, (20.0,) * 3, link_radius=(0.02,) * 3)
OVAL = Ellipse(center=(0.9, 0.8), semi_axes=(0.2, 0.1))


def made(robot: Robot, *room: Obstacle) -> tuple[Robot, PairClearances]:
    limits = [Clearance.for_robot(robot, room), SelfClearance.for_robot(robot, room)]
    return robot, PairClearances(robot, tuple(limit for limit in limits if limit is not None))


def space() -> tuple[Robot, PairClearances]:
    return made(ARM, *ROOM)


def plane() -> tuple[Robot, PairClearances]:
    return made(PLANAR, OVAL)


def moving_space() -> tuple[Robot, PairClearances]:
    rises = Tabulated.through(
        (0.0, 0.4, 1.0),
        np.array([[-0.2, 0.3, 0.0], [0.1, 0.3, 0.2], [0.3, -0.2, 0.4]]),
        Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.3, 0.5], [0.2, 0.9, 0.0]]).as_quat(),
    )
    rising = MovingObstacle(Box(center=(0.0, 0.0, 0.3), size=(0.1, 0.2, 0.3)), rises, margin_rate=0.05)
    return made(ARM, ROOM[0], rising)


def moving_plane() -> tuple[Robot, PairClearances]:
    return made(PLANAR, MovingObstacle(OVAL, ConstantVelocity((-0.4, 0.1))))


CASES = (space, plane, moving_space, moving_plane)


@pytest.fixture(params=CASES, ids=[make.__name__ for make in CASES])
def case(request: pytest.FixtureRequest) -> tuple[Robot, PairClearances]:
    made: tuple[Robot, PairClearances] = request.param()
    return made


def path(robot: Robot) -> FloatArray:
    first, last = np.random.default_rng(2).uniform(-0.5, 1.2, (2, robot.dof))
    return np.asarray(first + np.linspace(0.0, 1.0, 101)[:, None] ** 2 * (last - first))


def all_clearances(robot: Robot, near: PairClearances, theta: FloatArray, times: FloatArray = TIMES) -> FloatArray:
    return as_array(clearances(near.pairs, robot.positions(ca.DM(theta)), ca.DM(times)))


@pytest.mark.parametrize("cutoff", [0.05, 0.2, 10.0])
def test_all_pairs_nearer_than_the_cutoff_are_found(case: tuple[Robot, PairClearances], cutoff: float) -> None:
    robot, nearness = case
    theta = path(robot)
    expected = all_clearances(robot, nearness, theta)
    near = nearness.near(theta, TIMES, cutoff)
    found = np.full_like(expected, np.inf)
    found[near.samples, near.pairs] = near.clearances
    assert (np.isfinite(found) == (expected < cutoff)).all()
    assert near.clearances == pytest.approx(expected[near.samples, near.pairs], abs=1e-12)


def test_gradients_are_finite_differences(case: tuple[Robot, PairClearances]) -> None:
    robot, nearness = case
    theta = path(robot)
    near = nearness.near(theta, TIMES, 1.0)
    assert near.samples.size > 20
    (gradients, by_time), h = nearness.gradients(theta, TIMES, near), 1e-6
    for joint in range(robot.dof):
        moved = [all_clearances(robot, nearness, theta + s * h * np.eye(robot.dof)[joint]) for s in (1.0, -1.0)]
        expected = ((moved[0] - moved[1]) / (2.0 * h))[near.samples, near.pairs]
        assert np.abs(gradients[:, joint] - expected).max() < 1e-5
    later = [all_clearances(robot, nearness, theta, TIMES + s * h) for s in (1.0, -1.0)]
    expected = ((later[0] - later[1]) / (2.0 * h))[near.samples, near.pairs]
    assert np.abs(by_time - expected).max() < 1e-5
    assert by_time.any() == nearness.is_time_dependent
