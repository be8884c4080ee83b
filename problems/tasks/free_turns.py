"""Turns of the tool along a curve that leaves them free: even ones, else those that a dynamic program finds.

An even turn grows with the length along the curve, up to each of a grid of orientations at its end. Where joints can
follow none of them, every posture at a point is led to the next one with each of the neighbouring orientations of the
grid, and of all that arrive at an orientation the nearest from the start is kept (Descartes of ROS-Industrial searches
such graphs). Polynomials near what leads to the end are laws that joints can follow smoothly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.robots import SpatialArm
from problems.tasks.checks import Surroundings
from problems.tasks.place import ANGLE_TOLERANCE
from problems.tasks.pose import Projection
from problems.tasks.tool_path import ToolPath
from problems.timing import least_durations


@dataclass(frozen=True, kw_only=True)
class FreeTurnsSettings:
    """Settings of the search for turns along a curve.

    Values are chosen.

    Attributes:
        steps: from the start of the curve to its end.
        farthest_turn: rad, from one point to the next; the same for leans.
        farthest_joints: rad or m: joints that go farther from one point to the next have jumped.
        degrees: of the polynomials near what the dynamic program finds.
        most_even: orientations at the end, those next to the stated one, to which even turns are looked at.
        most_ends: orientations at the end that are led to.
        apart: rad: orientations at the end that are less are much the same.
    """

    steps: int = 24
    farthest_turn: float = 0.6
    farthest_joints: float = 0.8
    degrees: tuple[int, ...] = (1, 3, 6)
    most_even: int = 48
    most_ends: int = 3
    apart: float = 0.5


SETTINGS = FreeTurnsSettings()


@dataclass(frozen=True, eq=False)
class FreeTurns:
    """Orientations of the tool along a curve with a free axis.

    Args:
        path: with a free axis.
        robot: that moves.
        around: what postures keep clear of.
    """

    path: ToolPath
    robot: SpatialArm
    around: Surroundings

    def even(self, start: FloatArray) -> Iterator[ToolPath]:
        """The curve with even turns to a few orientations at its end, from a posture (dof,) at its start.

        The one comes first along which the slowest joint has to move for the least time in free space.
        """
        laws = [replace(self.path, law=end[None]) for end in self._grid[: SETTINGS.most_even]]
        ways = np.array([self._way_along(law, start) for law in laws])
        led = np.isfinite(ways).all(axis=1)
        durations = least_durations(np.where(led[:, None], ways, 0.0), self.robot.limits).max(axis=1)
        for end in self._chosen_ends(np.where(led, durations, np.inf)):
            yield laws[end]

    def _way_along(self, law: ToolPath, start: FloatArray) -> FloatArray:
        """How far each joint moves along the curve, back and forth, (dof,); infinite where it cannot, or touches."""
        rotations, theta = law.rotations(self._shares), [start]
        assert rotations is not None
        for point, rotation in zip(self._points, rotations, strict=True):
            found, near = self._led(theta[-1][None], start, point, rotation)
            if not near[0]:
                return np.full(self.robot.dof, np.inf)
            theta.append(found[0])
        clear = self._clear(np.array(theta[1:])).all()
        return np.abs(np.diff(theta, axis=0)).sum(axis=0) if clear else np.full(self.robot.dof, np.inf)

    def searched(self, start: FloatArray) -> Iterator[ToolPath]:
        """The curve with turns near those of a dynamic program, the shortest way of the joints first."""
        costs, before = self._shortest(start)
        for end in self._chosen_ends(costs):
            coordinates = self._traced(before, end)
            yield from (self._near(coordinates, degree) for degree in SETTINGS.degrees)

    def _chosen_ends(self, costs: FloatArray) -> list[int]:
        """The numbers of a few orientations of the grid with the least costs (n,), apart from each other."""
        chosen: list[int] = []
        for end in np.argsort(costs, kind="stable").tolist():
            apart = np.linalg.norm(self._grid[chosen] - self._grid[end], axis=1)
            if np.isfinite(costs[end]) and (apart > SETTINGS.apart).all() and len(chosen) < SETTINGS.most_ends:
                chosen.append(end)
        return chosen

    @cached_property
    def _onto(self) -> Projection:
        return Projection.of(self.robot)

    @cached_property
    def _shares(self) -> FloatArray:
        return np.linspace(0.0, 1.0, SETTINGS.steps + 1)[1:]

    @cached_property
    def _points(self) -> FloatArray:
        return self.path.way.points(self._shares)

    def _led(
        self, before: FloatArray, start: FloatArray, point: FloatArray, rotation: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """The postures (n, dof) next to those at the point before, and whether they are there without a jump."""
        theta, missing = self._onto(before, start, point, rotation)
        farthest = np.abs(theta - before).max(axis=1)
        return theta, (missing <= ANGLE_TOLERANCE) & (farthest <= SETTINGS.farthest_joints)

    def _clear(self, theta: FloatArray) -> NDArray[np.bool_]:
        return self.around.clear(theta, np.zeros(len(theta)))

    @cached_property
    def _grid(self) -> FloatArray:
        """Coordinates of the orientations, (n, 3), the first as stated."""
        assert self.path.free is not None
        grid = self.path.free.grid
        return np.vstack([np.zeros(3), grid[np.linalg.norm(grid, axis=1) > ANGLE_TOLERANCE]])

    @cached_property
    def _neighbours(self) -> list[NDArray[np.intp]]:
        apart = np.abs(self._grid[:, None] - self._grid).max(axis=2)
        return [np.flatnonzero(row <= SETTINGS.farthest_turn) for row in apart]

    def _shortest(self, start: FloatArray) -> tuple[FloatArray, NDArray[np.intp]]:
        """The costs of the orientations at the end, (n,), and at each point where they come from, (steps, n)."""
        assert self.path.free is not None
        stated, offsets = self.path.stated_rotations(self._shares), self.path.free.offsets(self._grid)
        count, speed = len(self._grid), np.array(self.robot.limits.speed)
        costs, postures = np.full(count, np.inf), np.tile(start, (count, 1))
        costs[0], before = 0.0, np.zeros((len(stated), count), dtype=np.intp)
        for number, (point, rotation) in enumerate(zip(self._points, stated, strict=True)):
            reached, found = np.full(count, np.inf), postures.copy()
            for node, neighbours in enumerate(self._neighbours):
                sources = neighbours[np.isfinite(costs[neighbours])]
                if not len(sources):
                    continue
                theta, near = self._led(postures[sources], start, point, rotation @ offsets[node])
                steps = np.linalg.norm((theta - postures[sources]) / speed, axis=1)
                total = np.where(near, costs[sources] + steps, np.inf)
                best = int(np.argmin(total))
                reached[node], found[node], before[number, node] = total[best], theta[best], sources[best]
            reached[~self._clear(found)] = np.inf
            costs, postures = reached, found
        return costs, before

    def _traced(self, before: NDArray[np.intp], end: int) -> FloatArray:
        """Coordinates at all points, (steps + 1, 3), of what leads to an orientation at the end."""
        nodes = [end]
        for row in before[::-1]:
            nodes.append(int(row[nodes[-1]]))
        return self._grid[nodes[::-1]]

    def _near(self, coordinates: FloatArray, degree: int) -> ToolPath:
        """The curve with the polynomial of a degree that is nearest to coordinates, and zero at the start."""
        powers = np.append(0.0, self._shares)[:, None] ** np.arange(1, degree + 1)
        return replace(self.path, law=np.asarray(np.linalg.lstsq(powers, coordinates, rcond=None)[0], dtype=np.float64))
