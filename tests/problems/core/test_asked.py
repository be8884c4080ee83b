"""Solids that the core asks for: shapes and motions of users, and tables, against what it knows itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from helpers.core_robots import EXAMPLES, postures, robot_of, world_of
from scipy.spatial.transform import Rotation

from problems.base import Matrix
from problems.core import Separation
from problems.motions import Trajectory
from problems.scene import Box, ConstantVelocity, MovingObstacle, Obstacle, Tabulated
from problems.timing import rest_to_rest

BOX = Box(center=(0.4, 0.1, 0.6), size=(0.3, 0.2, 0.4))


@dataclass(frozen=True, kw_only=True)
class OwnBox(Box):
    """A box whose formula is a user's."""

    def point_clearance(self, points: Matrix) -> Matrix:
        return super().point_clearance(points)


class OwnMotion(ConstantVelocity):
    """A motion that may be another."""


OWN = OwnBox(center=BOX.center, size=BOX.size)
DRIFT = ConstantVelocity((-0.2, 0.1, 0.05), (0.3, 0.0, 0.0))
HULL, OWN_DRIFT = EXAMPLES["polytope"], OwnMotion(DRIFT.velocity, DRIFT.origin)
TWINS: dict[str, tuple[Obstacle, Obstacle]] = {
    "shape": (BOX, OWN),
    "shape that moves": (MovingObstacle(BOX, DRIFT, 0.02), MovingObstacle(OWN, DRIFT, 0.02)),
    "motion": (MovingObstacle(BOX, DRIFT), MovingObstacle(BOX, OWN_DRIFT)),
    "polytope that moves": tuple(
        MovingObstacle(EXAMPLES["polytope"], motion, 0.01)
        for motion in (DRIFT, OwnMotion(DRIFT.velocity, DRIFT.origin))
    ),  # type: ignore[dict-item]
}


@pytest.mark.parametrize("name", TWINS)
def test_what_is_asked_is_what_the_core_knows_itself(name: str) -> None:
    robot, rng = robot_of("upright"), np.random.default_rng(4)
    known, asked = (world_of(robot, (each,)) for each in TWINS[name])
    theta, times = postures(robot, rng, 60), rng.uniform(0.0, 2.0, 60)
    assert known.moves == asked.moves and known.fastest == pytest.approx(asked.fastest, rel=1e-6)
    for which in (Separation.FROM_OBSTACLES, Separation.ALL):
        margins = [world.clearance_margins(theta, which=which, times=times) for world in (known, asked)]
        np.testing.assert_allclose(*margins, rtol=0.0, atol=1e-8)
    one, two = (world.nearby(theta, 0.2, times) for world in (known, asked))
    assert one.samples.tolist() == two.samples.tolist()
    np.testing.assert_allclose(one.clearance_margins, two.clearance_margins, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(one.gradients, two.gradients, rtol=0.0, atol=1e-3)
    np.testing.assert_allclose(one.rates, two.rates, rtol=0.0, atol=1e-3)
    found = set()
    for start, goal in theta[:24].reshape(12, 2, -1):
        motion = rest_to_rest(start, goal, robot.limits)
        proofs = [world.prove(motion) for world in (known, asked)]
        assert proofs[0].status == proofs[1].status
        assert proofs[0].smallest == pytest.approx(proofs[1].smallest, abs=1e-6)
        found.add(proofs[0].status)
    assert found == {True, False}


@pytest.mark.slow
def test_a_table_that_turns_is_where_it_says_at_every_time() -> None:
    turns = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.0, 0.3, 0.5], [0.2, 0.9, 0.0]]).as_quat()
    places = np.array([[-0.2, 0.3, 0.0], [0.1, 0.3, 0.2], [0.3, -0.2, 0.4]])
    rising = Tabulated.through((0.0, 0.4, 1.0), places, turns)
    table = MovingObstacle(Box(center=(0.0, 0.0, 0.3), size=(0.1, 0.2, 0.3)), rising)
    robot = replace(robot_of("upright"), self_collision=False)
    world, theta = world_of(robot, (table,)), postures(robot, np.random.default_rng(5), 40)
    for time in (-0.1, 0.2, 0.7, 1.5):
        frame = table.frames(np.array([time]))
        assert frame.axes is not None
        quaternion = tuple(Rotation.from_matrix(frame.axes[0]).as_quat().tolist())
        center = tuple((frame.axes[0] @ np.array([0.0, 0.0, 0.3]) + frame.origins[0]).tolist())
        there = world_of(robot, (Box(center=center, size=(0.1, 0.2, 0.3), quaternion=quaternion),))
        margins = world.clearance_margins(theta, times=np.full(40, time))
        np.testing.assert_allclose(margins, there.clearance_margins(theta), rtol=0.0, atol=1e-8)
    for start, goal in theta.reshape(20, 2, -1):
        motion = rest_to_rest(start, goal, robot.limits)
        proof, times = world.prove(motion), np.linspace(0.0, motion.duration, 2000)
        there = np.array([proof.time])
        assert proof.smallest == pytest.approx(world.clearance_margins(motion.at(there), times=there)[0], abs=1e-8)
        assert proof.status is (proof.smallest >= 0.0)
        assert not proof.status or proof.proven <= world.clearance_margins(motion.at(times), times=times).min()


@dataclass(frozen=True, kw_only=True)
class Broken(Box):
    """A box whose formula is at fault."""

    number: float | None = None

    def point_clearance(self, points: Matrix) -> Matrix:
        if self.number is None:
            raise ZeroDivisionError("a user's mistake")
        return super().point_clearance(points) * self.number


def test_a_formula_that_raises_or_knows_no_number_hides_nothing() -> None:
    robot = robot_of("upright")
    theta, motion = np.zeros((1, robot.dof)), Trajectory.standing(np.zeros(robot.dof), 1.0)
    raises = world_of(robot, (Broken(center=(2.0, 0.0, 0.5), size=(0.1, 0.1, 0.1)),))
    for asked in (lambda: raises.clear(theta), lambda: raises.prove(motion), lambda: raises.nearby(theta, 10.0)):
        with pytest.raises(ZeroDivisionError, match="mistake"):
            asked()
    unknown = world_of(robot, (Broken(center=(2.0, 0.0, 0.5), size=(0.1, 0.1, 0.1), number=float("nan")),))
    assert not unknown.clear(theta)[0] and unknown.clearance_margins(theta)[0] == -np.inf
    assert not unknown.prove(motion).status
