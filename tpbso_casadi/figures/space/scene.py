"""What is seen of a robot in space and its surroundings, as plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import casadi as ca
import numpy as np

from problems import Robot
from problems.base.matrix import FloatArray, as_array
from problems.robots.robot import Body
from problems.scene.obstacle import Obstacle
from problems.tasks.drawing import Marker
from tpbso_casadi.figures.courses import Course, placed
from tpbso_casadi.figures.space.polyhedron import Polyhedron, polyhedron_of, separating_planes
from tpbso_casadi.figures.space.view import AZIMUTH, View, perspective

PADDING = 0.05  # around everything that moves, of its largest side
SURROUNDINGS = 0.35  # beyond what moves, of its largest side: what obstacles are shown of
GRID = 0.25  # m: of the ground
MOST_LINES = 40  # of the grid
TURN = 15.0  # degrees between views to choose from
POSTURES = 9  # that have to be seen
BESIDE = 60.0  # degrees by which the eye is beside the line from the obstacles to the robot


@dataclass(frozen=True)
class Scene:
    """A robot, obstacles, and positions that the tool has to reach.

    Attributes:
        robot: in space, whose bodies are balls.
        obstacles: in space.
        markers: of the task.
        courses: of the obstacles that move.
    """

    robot: Robot
    obstacles: Sequence[Obstacle] = ()
    markers: Sequence[Marker] = ()
    courses: Sequence[Course] = ()

    @cached_property
    def balls(self) -> tuple[Body, ...]:
        """The bodies that are thicker than a point."""
        return tuple(body for body in self.robot.bodies if float(body.radius) > 0.0)

    @cached_property
    def radii(self) -> FloatArray:
        """Of the balls, (balls,), m."""
        return np.array([float(body.radius) for body in self.balls])

    @cached_property
    def solids(self) -> tuple[Polyhedron, ...]:
        """The obstacles, those that move as seen from the frames that move with them."""
        return tuple(polyhedron_of(obstacle.unmoved) for obstacle in self.obstacles)

    @cached_property
    def moving(self) -> tuple[int, ...]:
        """The numbers 0, 1, ... of the obstacles that move."""
        return tuple(number for number, obstacle in enumerate(self.obstacles) if obstacle.moves)

    @cached_property
    def planes(self) -> dict[tuple[int, int], int]:
        """That part the obstacles that stand."""
        return separating_planes(self.solids, self._pairs(moving=False))

    def solids_at(self, time: float) -> tuple[Polyhedron, ...]:
        """The obstacles where they are at a time in s."""
        return tuple(
            replace(solid, vertices=placed(obstacle, solid.vertices, np.array([time]))[0]) if obstacle.moves else solid
            for solid, obstacle in zip(self.solids, self.obstacles, strict=True)
        )

    def planes_of(self, solids: Sequence[Polyhedron]) -> dict[tuple[int, int], int]:
        """That part the obstacles where they are at some time."""
        return self.planes | separating_planes(solids, self._pairs(moving=True))

    def _pairs(self, *, moving: bool) -> list[tuple[int, int]]:
        """Numbers of all pairs of obstacles of which one moves, or of which none does."""
        pairs = combinations(range(len(self.obstacles)), 2)
        return [pair for pair in pairs if bool(set(pair) & set(self.moving)) == moving]

    def centers(self, theta: FloatArray) -> FloatArray:
        """Of the balls in n postures (n, dof), rad: (n, balls, 3), m."""
        frames = self.robot.positions(ca.DM(theta))
        found = [as_array(frames[body.start]) for body in self.balls]
        return np.stack(found, axis=1) if found else np.empty((len(theta), 0, 3))

    def bounds(self, theta: FloatArray) -> FloatArray:
        """Lower and upper corner of what is shown of postures (n, dof), (2, 3), m.

        All of the robot and the markers; of obstacles what is near.
        """
        skeleton = self.robot.skeleton(theta).reshape(-1, 3)
        centers, radii = self.centers(theta), self.radii[:, None]
        balls = [(centers + side * radii).reshape(-1, 3) for side in (-1.0, 1.0)]
        lower, upper = corners(np.vstack([skeleton, *balls, *(marker.points for marker in self.markers)]))
        near = SURROUNDINGS * float((upper - lower).max())
        still = [solid for number, solid in enumerate(self.solids) if number not in self.moving]
        shown = [np.clip(solid.vertices, lower - near, upper + near) for solid in still]
        shown += [course.within(lower - near, upper + near) for course in self.courses]
        lower, upper = corners(np.vstack([lower, upper, *shown]))
        padding = PADDING * float((upper - lower).max())
        return np.array([lower - padding, upper + padding])

    def view(self, theta: FloatArray, bounds: FloatArray) -> View:
        """The view in perspective that obstacles hide least in of postures (n, dof), rad, within bounds (2, 3), m.

        Of several as good it is the one nearest to that from behind the robot, a little beside it.
        """
        center, radius = bounds.mean(axis=0), float(np.linalg.norm(bounds[1] - bounds[0])) / 2.0
        shown = theta[np.linspace(0, len(theta) - 1, min(len(theta), POSTURES)).astype(int)]
        points, solids = self.robot.skeleton(shown).reshape(-1, 3), self._solids_halfway

        def hidden(view: View) -> int:
            return sum(int(solid.hides(points, view.eye).sum()) for solid in solids)

        turns = sorted(np.arange(-180.0, 180.0, TURN), key=abs)
        return min((perspective(center, radius, self._behind(bounds) + turn) for turn in turns), key=hidden)

    @cached_property
    def _solids_halfway(self) -> tuple[Polyhedron, ...]:
        """The obstacles in the middle of the time for which their courses are known."""
        ends = [course.times[[0, -1]] for course in self.courses]
        return self.solids_at(float(np.mean(ends))) if ends else self.solids

    def _behind(self, bounds: FloatArray) -> float:
        """Degrees at which an eye has the robot before the obstacles, and sees both."""
        if not self.solids:
            return AZIMUTH
        middles = [np.clip(solid.vertices, *bounds).mean(axis=0) for solid in self._solids_halfway]
        x, y, _ = np.array(self.robot.base) - np.mean(middles, axis=0)
        return float(np.degrees(np.arctan2(y, x))) + BESIDE


def corners(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The lower and the upper corner of the box around points (n, 3), each (3,)."""
    return points.min(axis=0), points.max(axis=0)


def ground(bounds: FloatArray) -> FloatArray:
    """Lines of a grid below everything within bounds (2, 3), m: (lines, 2, 3)."""
    low, high = bounds
    step = GRID * max(1.0, np.ceil(float((high - low)[:2].max()) / GRID / MOST_LINES))
    lines = []
    for axis in (0, 1):
        for place in np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step:
            lines.append(bounds.copy())
            lines[-1][:, axis], lines[-1][:, 2] = place, low[2]
    return np.array(lines).reshape(-1, 2, 3)
