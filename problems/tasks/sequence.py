"""Several stages one after the other, as one task."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.limits import Constraint
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle
from problems.tasks.task import Marker, MarkerKind, Task


@dataclass(frozen=True)
class Sequence(Task):
    """The task of a motion in stages, each with its own limits.

    Args:
        robot: that moves, with nothing in its hand.
        obstacles: that are there; those that are carried for a while move.
        scenery: what is drawn around the robot, where that differs: what is carried for a while moves.
        stops: where the tool is at the start and after each stage that moves it, (n, dim), m.
        notes: on what stages state, a line each.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...] = ()
    stops: tuple[tuple[float, ...], ...] = ()
    scenery: tuple[Obstacle, ...] = ()
    notes: tuple[str, ...] = ()

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        return []

    def markers(self) -> tuple[Marker, ...]:
        if not self.stops:
            return ()
        points = np.array(self.stops)
        ends = (
            Marker(label="start", points=points[:1], kind=MarkerKind.START),
            Marker(label="goal", points=points[-1:], kind=MarkerKind.GOAL),
        )
        between = Marker(label="stop", points=points[1:-1], kind=MarkerKind.POINTS)
        return (ends[0], between, ends[1]) if len(points) > 2 else ends
