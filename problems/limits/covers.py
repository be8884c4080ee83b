"""Clearance of covers of an arm's links from obstacles and from each other, for verdicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, as_array
from problems.core import ClosestPairs, CompiledWorld, Separation
from problems.limits.limit import Constraint, Limit, WorldQuestion
from problems.motions import Samples, Trajectory
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle


@dataclass(frozen=True)
class CoverLimit(Limit):
    """A limit on covers, which keep the robot's margin.

    Args:
        robot: whose cover.

    Attributes:
        proof_gap: what is proven is lower than the smallest clearance by so much, relative, beyond the margin.
        which: kind of pairs that it is about.
    """

    within_tracking: ClassVar[bool] = True
    proof_gap: ClassVar[float] = 0.1
    which: ClassVar[Separation]

    robot: SpatialArm

    @property
    def margin(self) -> float:
        """The margin to be kept, m: the robot's by default."""
        return self.robot.margin

    @property
    def obstacles_around(self) -> tuple[Obstacle, ...]:
        """The obstacles that it is about: none by default."""
        return ()

    @property
    def world_question(self) -> WorldQuestion:
        own = self.which is Separation.FROM_EACH_OTHER
        return WorldQuestion(self.robot, self.obstacles_around, own, self.proof_gap)

    @property
    def world(self) -> CompiledWorld:
        """The arm among these obstacles.

        Raises:
            InvalidProblem: the arm is of a class of its own, or there is no compiled core.
        """
        found = CompiledWorld.of(self.robot, self.obstacles_around)
        if found is None:
            raise InvalidProblem("robot", f"the core knows no cover of a {type(self.robot).__name__}; give it spheres")
        return found

    def clearances(self, theta: FloatArray, times: FloatArray) -> FloatArray:
        """The clearances of covers in postures (n, dof), rad, at times (n,), s: (n,), m; infinite without any pair."""
        return self.margin + self.world.clearance_margins(theta, which=self.which, times=times)

    def closest(self, theta: FloatArray, times: FloatArray) -> ClosestPairs:
        """The pairs that come nearest in postures (n, dof), rad, at times (n,), s."""
        return self.world.closest(theta, self.which, times)

    def nearest(self, trajectory: Trajectory, times: FloatArray) -> tuple[float, float, str]:
        """The least clearance of a motion at times (n,) in s, m; its time, s, and what comes so near."""
        time = times[[np.argmin(self.clearances(trajectory.at(times), times))]]
        found = self.closest(trajectory.at(time), time)
        (pair,), (left,) = found.pairs, found.clearance_margins
        return self.margin + float(left), float(time[0]), "" if pair is None else self.world.described(pair)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        theta = as_array(samples.theta)
        times = np.zeros(len(theta)) if samples.times is None else as_array(samples.times).ravel()
        return [
            Constraint(
                name=self.name,
                unit="m",
                expression=ca.DM(self.clearances(theta, np.broadcast_to(times, len(theta)))),
                lower=ca.DM(self.margin + margin * float(self.robot.radius)),
                upper=None,
                columns=("the nearest of all",),
                scale=ca.DM(float(self.robot.radius) / 2.0),
                formula="clearance(cover of any link at t_j, what it must not touch) >= margin",
            )
        ]


@dataclass(frozen=True)
class CoverClearance(CoverLimit):
    """No link's cover comes nearer to an obstacle than the robot's margin.

    Args:
        robot: whose cover.
        obstacles: to keep clear of.
    """

    name: ClassVar[str] = "clearance"
    which: ClassVar[Separation] = Separation.FROM_OBSTACLES

    obstacles: tuple[Obstacle, ...]

    @classmethod
    def for_robot(cls, robot: SpatialArm, obstacles: Sequence[Obstacle]) -> Self | None:  # type: ignore[override]
        moves = robot.cover is not None and any(link.body > 0 for link in robot.cover.links)
        return cls(robot, tuple(obstacles)) if obstacles and moves else None

    @property
    def obstacles_around(self) -> tuple[Obstacle, ...]:
        return self.obstacles

    def obstacles_travel(self, cells: FloatArray) -> FloatArray:
        """Bounds of how far any obstacle moves within cells of time (n, 2), s, from the middle of each, (n,), m."""
        around = self.world.farthest
        moving = [obstacle.travel(cells, around) for obstacle in self.obstacles if obstacle.moves]
        return np.asarray(np.max([np.zeros(len(cells)), *moving], axis=0))

    @property
    def time_dependent_part(self) -> Limit | None:
        return CoverClearance.for_robot(self.robot, [obstacle for obstacle in self.obstacles if obstacle.moves])

    @property
    def time_independent_part(self) -> Limit | None:
        return CoverClearance.for_robot(self.robot, [obstacle for obstacle in self.obstacles if not obstacle.moves])

    def without_growth(self) -> CoverClearance:
        """The limit of planned postures, among obstacles where they are predicted."""
        exact = replace(self.robot, tracking=None)
        return CoverClearance(exact, tuple(obstacle.without_growth() for obstacle in self.obstacles))


@dataclass(frozen=True)
class CoverSelfClearance(CoverLimit):
    """No two links that must keep apart come nearer to each other than the robot's margin for that.

    Neighbours of neighbours are as near in every posture, with much of their surfaces: a sharper proof would take long.
    """

    name: ClassVar[str] = "self clearance"
    which: ClassVar[Separation] = Separation.FROM_EACH_OTHER
    proof_gap: ClassVar[float] = 0.5

    @property
    def margin(self) -> float:
        return self.robot.self_margin

    @classmethod
    def for_robot(cls, robot: SpatialArm, obstacles: Sequence[Obstacle]) -> Self | None:  # type: ignore[override]
        return cls(robot) if robot.self_collision and robot.cover is not None and robot.cover.pairs else None


POSTURES, ALWAYS = 100, 0.95  # at random, and of them: links that touch at so many belong together


def touching_links(arm: SpatialArm) -> list[tuple[str, str]]:
    """Names of links that have to keep apart and touch at almost all random postures, of an arm with a cover."""
    assert arm.cover is not None
    low, high = np.array(arm.position_limits or [(-np.pi, np.pi)] * arm.dof).T
    theta = np.random.default_rng(0).uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (POSTURES, arm.dof))
    found = []
    for one, two in arm.cover.pairs:
        pair = CoverSelfClearance(replace(arm, cover=replace(arm.cover, pairs=((one, two),))))
        if (pair.clearances(theta, np.zeros(POSTURES)) < 0.0).mean() >= ALWAYS:
            found.append((arm.cover.links[one].name, arm.cover.links[two].name))
    return found


def cover_limits(robot: Robot, obstacles: Sequence[Obstacle]) -> tuple[CoverLimit, ...]:
    """The limits on the cover of an arm; none of a robot without one."""
    makers: tuple[Callable[..., CoverLimit | None], ...] = (CoverClearance.for_robot, CoverSelfClearance.for_robot)
    made = (make(robot, obstacles) for make in makers if robot.cover is not None)
    return tuple(limit for limit in made if limit is not None)
