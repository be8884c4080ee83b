"""What comes after arrival: until when a robot that stands at its goal stays clear of obstacles that move."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from problems.base.matrix import FloatArray
from problems.certify.distances.moving_pairs import MovingPairs
from problems.certify.travel import halves
from problems.certify.verdict import Verdict
from problems.certify.verification import prove
from problems.limits.distances.proximity import Proximity
from problems.limits.limit import Limit
from problems.limits.staying import AT_GOAL, timed
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle

LOOKED_AHEAD = 60.0  # s after arrival, at most
INITIAL_CELLS = 200
RESOLUTION = 1e-3  # s, of when something comes near
MOST_CELLS = 20_000  # at a time


@dataclass(frozen=True)
class AtGoal:
    """How long a robot that stands at its goal is clear of what moves.

    Attributes:
        clear_until: it is, proven, from its arrival until then, s; infinite for ever.
        touched: whether something comes too near about then; if not, no farther was looked.
    """

    clear_until: float
    touched: bool


def stay_verdicts(limits: Iterable[Limit], trajectory: Trajectory, seconds: float) -> list[Verdict]:
    """The verdicts on what depends on the time itself, from the end of a motion on, for so many s; none for 0 s."""
    if seconds <= 0.0:
        return []
    standing = _standing(trajectory, seconds)
    return [
        replace(verdict, name=f"{verdict.name}{AT_GOAL}")
        for limit in timed(list(limits))
        for verdict in prove(limit, standing)
    ]


def _standing(trajectory: Trajectory, seconds: float) -> Trajectory:
    """The posture at the end of a motion, for the time after it."""
    end = trajectory.breakpoints[-1:]
    return Trajectory(np.append(end, end + seconds), trajectory.at(end)[None])


def at_goal(limits: Iterable[Limit], obstacles: Sequence[Obstacle], trajectory: Trajectory) -> AtGoal | None:
    """Until when the end of a motion stays clear; None where nothing moves that could come near.

    Proven as in :mod:`problems.certify.clearance`: where the distance in the middle of a time cell is larger than what
    the obstacle moves within it.
    """
    moving = [limit for limit in timed(list(limits)) if isinstance(limit, Proximity)]
    if not moving:
        return None
    arrival, around = trajectory.duration, max(_around(limit.robot) for limit in moving)
    one_look = arrival + RESOLUTION  # at what has come to rest
    quiet = max(one_look, *(obstacle.quiet_after(around) for obstacle in obstacles))
    horizon = min(quiet, arrival + LOOKED_AHEAD)
    until = min(_clear_until(limit, trajectory.at(np.array([arrival])), arrival, horizon) for limit in moving)
    if until < horizon:
        return AtGoal(until, touched=True)
    return AtGoal(np.inf if quiet <= horizon else horizon, touched=False)


def _around(robot: Robot) -> float:
    """No point that has to keep a distance is farther from the world's origin, nor what it keeps, m."""
    thickest = max(float(body.radius) for body in robot.bodies)
    return float(robot.reach()[1] + np.linalg.norm(robot.base) + thickest + robot.margin)


def _clear_until(limit: Proximity, theta: FloatArray, start: float, end: float) -> float:
    """Up to which time in s a posture (1, dof) is proven to keep a limit, at the latest ``end``."""
    edges = np.linspace(start, end, INITIAL_CELLS + 1)
    cells, until, touched = np.column_stack([edges[:-1], edges[1:]]), end, end
    while len(cells):
        nearest, low = _clearances(limit, theta, cells)
        touching = cells[nearest < limit.robot.margin].mean(axis=1)
        cells = cells[low < limit.robot.margin]
        until = min(until, *cells[np.diff(cells, axis=1)[:, 0] < RESOLUTION, 0], np.inf)
        first = touched = min([until, touched, *touching])
        cells = halves(cells[(cells[:, 0] < first) & (np.diff(cells, axis=1)[:, 0] >= RESOLUTION)])
        cells = cells[np.argsort(cells[:, 0])]
        if len(cells) > MOST_CELLS:
            cells, until = cells[:MOST_CELLS], min(until, float(cells[MOST_CELLS, 0]))
    return float(min(until, touched))  # what comes after a touch has not been looked at


def _clearances(limit: Proximity, theta: FloatArray, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The smallest clearance in the middle of each cell, and a lower bound of it all through, both (n,), m."""
    standing = Trajectory(np.array([cells.min(), cells.max()]), theta[None])
    everywhere = np.ones((len(cells), 1), dtype=bool)
    nearest, _, low = MovingPairs.of(limit.robot, limit.pairs, standing).around_middles(cells, everywhere)
    return nearest, low.min(axis=1)
