"""The interface of the motions of obstacles: where a frame is over time, and how fast its points move at most."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self

import numpy as np

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix
from problems.scene.moving.frames import Frames


class ObstacleMotion(Statement, ABC):
    """How a frame moves in which an obstacle stands still. A subclass is a frozen dataclass.

    Times are absolute: at t = 0 the robot starts.
    """

    @property
    @abstractmethod
    def dim(self) -> int:
        """2 in the plane, 3 in space."""

    @abstractmethod
    def seen(self, points: Matrix, times: Matrix) -> Matrix:
        """Points (n, dim), m, at times (n, 1) in s, or all at one, as seen from the frame at that time: (n, dim), m."""

    @abstractmethod
    def frames(self, times: FloatArray) -> Frames:
        """Where the frame is at times (n,) in s."""

    def placed(self, points: FloatArray, time: float) -> FloatArray:
        """Points (n, dim) of the frame as seen from outside at a time in s: (n, dim), m."""
        return np.asarray(self.frames(np.array([time])).placed(points)[0])

    @abstractmethod
    def travel(self, cells: FloatArray, extent: float) -> FloatArray:
        """How far points of the frame can be from where they are in the middle of cells of time.

        Args:
            cells: start and end of each, (n, 2), s.
            extent: no point is farther from the frame's origin, m.

        Returns:
            (n,), m: an upper bound.
        """

    @abstractmethod
    def offset(self, first: float, last: float) -> float:
        """An upper bound of how far the frame's origin is from that of the world from one time in s to another, m."""

    @abstractmethod
    def later(self, seconds: float) -> Self:
        """The same motion on a clock that starts so many seconds later."""

    def during(self, first: float, last: float) -> Self:
        """The same motion for those who ask about times from ``first`` to ``last`` in s alone; itself by default."""
        return self
