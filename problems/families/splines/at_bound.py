"""Motions that nothing can beat: as fast as the slowest joint alone would be.

Between two postures at rest the slowest joint decides the least duration, and how it moves. All others have time: they
may run their own motions slower, and wait before or after. Most ways between two postures that are free at all are so
in one of these; they are drawn at random, and looked at in a few postures before anything is proven.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca
import numpy as np

from problems.base import FloatArray, as_array
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle
from problems.tasks import Place, Surroundings
from problems.timing import Phasing, rest_to_rest

DRAWS, AT_ONCE = 500, 100
GOALS = 5  # of the postures at the goal, at the most
AROUND = 200  # postures that are drawn where the goal is a pose
LOOKS = (0.5, 0.25, 0.75, 0.375, 0.625, 0.125, 0.875, 0.3125, 0.6875, 0.4375, 0.5625, 0.1875, 0.8125)  # of the time
OWN = 0.5  # of the draws: joints that run as fast as they can


def at_the_bound(
    robot: Robot, obstacles: Sequence[Obstacle], start: FloatArray, goals: FloatArray, rng: np.random.Generator
) -> Iterator[Trajectory]:
    """The direct motion and others as fast as it, as far as they are clear in the postures that are looked at.

    Args:
        robot: with its margin.
        obstacles: to keep clear of.
        start: at rest, (dof,), rad.
        goals: of which any will do, the soonest reached first, (n, dof), rad.
        rng: of the draws.
    """
    goals, around = goals[:GOALS], Surroundings(robot, tuple(obstacles))
    yield from _clear(around, [rest_to_rest(start, goal, robot.limits) for goal in goals])
    for goal in goals:
        for _ in range(DRAWS // AT_ONCE // len(goals)):
            drawn = [rest_to_rest(start, goal, robot.limits, _drawn(robot.dof, rng)) for _ in range(AT_ONCE)]
            yield from _clear(around, drawn)


def postures_around(robot: Robot, place: Place) -> FloatArray:
    """Postures at a place: its own, and of a pose others around that, the same ones every time; (n, dof), rad."""
    rng = np.random.default_rng(0)
    choices = place.choices(robot)
    low, high = np.array([(choice.lower, choice.upper) for choice in choices]).reshape(-1, 2).T
    chosen = np.vstack([(low + high) / 2.0, rng.uniform(low, high, (AROUND if choices else 0, len(choices)))])
    x = ca.SX.sym("x", len(choices))
    theta = place.posture(robot, x, 1.0, None)[0]
    there = ca.Function("there", [x], [ca.densify(ca.SX(theta)).T, ca.densify(ca.SX(place.miss(robot, theta))).T])
    found, missed = (as_array(part).T for part in there(chosen.T))
    reached = np.abs(missed).max(axis=1) <= place.tolerance(robot)
    for joint, (least, most) in enumerate(robot.limits.position or ()):
        reached &= (found[:, joint] >= least) & (found[:, joint] <= most)
    reached[0] = True
    return np.asarray(found[reached])


def _drawn(dof: int, rng: np.random.Generator) -> Phasing:
    stretches = np.where(rng.random(dof) < OWN, 0.0, rng.random(dof))
    waits = rng.random(dof)
    early_or_late = rng.random() < OWN
    return Phasing(stretches, np.round(waits) if early_or_late else waits)


def _clear(around: Surroundings, drawn: list[Trajectory]) -> list[Trajectory]:
    """Those that are clear at all looks, the likeliest contact first."""
    for share in LOOKS:
        if not drawn:
            break
        times = np.array([share * trajectory.duration for trajectory in drawn])
        theta = np.concatenate([each.at(time[None]) for each, time in zip(drawn, times, strict=True)])
        keep = around.room(theta, times) >= 0.0
        drawn = [each for each, clear in zip(drawn, keep, strict=True) if clear]
    return drawn
