"""Balls that are fixed to each other, looked at one by one only where an obstacle is near all of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array

if TYPE_CHECKING:
    from problems.robots.robot import Body, Robot

MOST_BALLS = 8  # in a cluster
LEAST_PAIRS = 4  # for which the one around them is looked at first
ROUNDING = 1e-9  # m: what a distance may lack


@dataclass(frozen=True)
class Cluster:
    """Bodies that are balls.

    Attributes:
        bodies: the one in the middle first.
        radius: no point of theirs is farther from the centre of the first, m.
    """

    bodies: tuple[Body, ...]
    radius: float


def clusters_of(robot: Robot, bodies: Sequence[Body]) -> list[Cluster]:
    """Balls of a robot in clusters that move as one and are small.

    Args:
        robot: whose bodies.
        bodies: balls, in order.
    """
    places = [as_array(place)[0] for place in robot.positions(ca.DM.zeros(1, robot.dof))]
    groups: dict[int, list[Body]] = {}
    for body in bodies:
        groups.setdefault(robot.moved_by(body), []).append(body)
    return [_cluster(part, places) for group in groups.values() for part in _halved(group, places)]


def _halved(bodies: list[Body], places: Sequence[FloatArray]) -> list[list[Body]]:
    """Cut in two along the longest way through them until no part has too many."""
    if len(bodies) <= MOST_BALLS:
        return [bodies]
    centers = np.array([places[body.start] for body in bodies])
    order = np.argsort(centers[:, int(np.argmax(np.ptp(centers, axis=0)))], kind="stable")
    halves = order[: len(order) // 2], order[len(order) // 2 :]
    return [part for half in halves for part in _halved([bodies[k] for k in half], places)]


def _cluster(bodies: list[Body], places: Sequence[FloatArray]) -> Cluster:
    centers = np.array([places[body.start] for body in bodies])
    radii = np.array([float(body.radius) for body in bodies])
    farthest = (np.linalg.norm(centers[:, None] - centers, axis=2) + radii).max(axis=1)
    middle = int(np.argmin(farthest))
    others = [body for k, body in enumerate(bodies) if k != middle]
    return Cluster((bodies[middle], *others), float(farthest[middle]) + ROUNDING)
