"""Solids that the core does not know, as formulas that it asks: shapes and motions that users make, and tables."""

from __future__ import annotations

from collections.abc import Mapping
from ctypes import c_double
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from problems.base import CACHE_SIZE, FloatArray
from problems.core.answers import Answers
from problems.evaluation import RowFunction
from problems.library import DISTANCES, LANES, TRAVEL
from problems.scene import Obstacle


@dataclass(frozen=True)
class AskedSolid:
    """An obstacle that the core does not know.

    Args:
        obstacle: itself; a point sees it where it is at a time, and larger by what more is kept from it then.
    """

    obstacle: Obstacle

    @classmethod
    @lru_cache(maxsize=CACHE_SIZE)
    def of(cls, obstacle: Obstacle) -> AskedSolid:
        """The cached object of an obstacle, whose formula is made once."""
        return cls(obstacle)

    @cached_property
    def _formula(self) -> RowFunction:
        given = ca.SX.sym("given", 4)
        seen = self.obstacle.seen(given[:3].T, given[3])
        distance = ca.densify(self.obstacle.unmoved.point_clearance(seen) - self.obstacle.growth(given[3]))
        return RowFunction(ca.Function("distance", [given], [distance], {"cse": True}), LANES)

    def distances(self, given: FloatArray) -> FloatArray:
        """The distances of points at times (4, n), m and s, less the growth of margins, (n,), m; -inf for no number."""
        shape, (points, times) = self.obstacle.unmoved, (given[:3].T, given[3])
        if type(shape).exact_distances is Obstacle.exact_distances:
            found = self._formula(given)[0]
        else:
            frames = self.obstacle.frames(times)
            exact = shape.exact_distances(points if frames is None else frames.seen(points))
            assert exact is not None
            found = exact - self.obstacle.growth_rate * times
        return np.where(np.isnan(found), -np.inf, found)


class AskedSolids:
    """The solids of a world that the core does not know, as it asks for them.

    Args:
        obstacles: by their numbers.
        around: no ball that keeps clear of them is farther from the origin, m.

    Attributes:
        answers: to its questions, which may have raised something.
        functions: that it calls: distances of points, and travels in cells of time.
    """

    def __init__(self, obstacles: Mapping[int, Obstacle], around: float) -> None:
        solids = {number: AskedSolid.of(obstacle) for number, obstacle in obstacles.items()}
        self.answers, unknown, farthest = Answers(), np.full(LANES, -np.inf), np.full(LANES, np.inf)

        def distances(number: int, points: int, found: int) -> None:
            def answer() -> FloatArray:
                return solids[number].distances(_numbers(points, 4).reshape(4, LANES))

            _numbers(found, 1)[:] = self.answers.attempted(answer, unknown)

        def travel(number: int, cells: int, found: int) -> None:
            def answer() -> FloatArray:
                return obstacles[number].travel(np.ascontiguousarray(_numbers(cells, 2).reshape(2, LANES).T), around)

            _numbers(found, 1)[:] = self.answers.attempted(answer, farthest)

        self.functions = DISTANCES(distances), TRAVEL(travel)


def _numbers(address: int, rows: int) -> FloatArray:
    """The numbers at an address in the core's memory, so many rows of eight one after the other."""
    return np.ctypeslib.as_array((c_double * (rows * LANES)).from_address(address))
