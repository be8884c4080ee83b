"""The interface of obstacles."""

from __future__ import annotations

from abc import ABC, abstractmethod

import casadi as ca

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix


class Obstacle(Statement, ABC):
    """Something that no body of the robot may touch. A subclass is a frozen dataclass."""

    @property
    def dim(self) -> int:
        """2 in the plane, 3 in space."""
        return 2

    @property
    @abstractmethod
    def place(self) -> tuple[float, ...]:
        """A point of it, m, for messages."""

    @property
    @abstractmethod
    def width(self) -> float:
        """The least distance in m between two parallel planes that hold it: a bound for the steps of joints."""

    @abstractmethod
    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """Clearance of n straight segments.

        Args:
            start: of the segments, (n, dim), m.
            end: likewise.

        Returns:
            (n, 1), m: negative when a segment enters, 0 when it touches, else a lower bound of the distance. It
            changes by no more than the segment's points move.

        Raises:
            NotImplementedError: it knows of points alone.
        """
        raise NotImplementedError

    def point_clearance(self, points: Matrix) -> Matrix:
        """Clearance of n points (n, dim), m: (n, 1), like :meth:`segment_distance`."""
        return self.segment_distance(points, points)

    def segment_distance(self, start: Matrix, end: Matrix) -> Matrix:
        """The same with a sharper lower bound, for those who keep a distance: a margin, or the width of a link.

        Args:
            start: of the segments, (n, dim), m.
            end: likewise.

        Returns:
            (n, 1), m: the sign of :meth:`segment_clearance`; where it is positive, no more than the distance, which
            changes by no more than the segment's points move.
        """
        return self.segment_clearance(start, end)

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        """The distance of one segment in m, exact to rounding; 0 or less where it enters."""
        return float(self.segment_distance(ca.DM([start]), ca.DM([end])))

    def smooth(self, clearance: Matrix) -> Matrix:
        """An increasing function of a clearance in m that a nonlinear program bounds instead; itself by default."""
        return clearance

    @abstractmethod
    def distance_to(self, point: tuple[float, ...]) -> float:
        """A lower bound in m of the distance from a point; from the base, bodies that reach less can never touch."""

    @abstractmethod
    def outline(self, count: int = 96) -> FloatArray:
        """Points on the boundary for drawing, counter-clockwise, (n, dim), m: corners, or ``count`` on a curve."""

    @abstractmethod
    def bounding_box(self) -> FloatArray:
        """The smallest box around it with sides along the axes: lower and upper corner, (2, dim), m."""

    def surface(self) -> tuple[FloatArray, list[list[int]]]:
        """Of an obstacle in space, for drawing: vertices (n, 3), m; polygons of their numbers.

        Raises:
            NotImplementedError: it is in the plane.
        """
        raise NotImplementedError
