"""The interface of obstacles."""

from __future__ import annotations

from abc import ABC, abstractmethod

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix


class Obstacle(Statement, ABC):
    """Something that no body of the robot may touch. A subclass is a frozen dataclass."""

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

    @abstractmethod
    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """Clearance of n straight segments.

        Args:
            start: of the segments, (n, dim), m.
            end: likewise.

        Returns:
            (n, 1), m: negative when a segment enters, 0 when it touches, else a lower bound of the distance. It
            changes by no more than the segment's points move.
        """

    def smooth(self, clearance: Matrix) -> Matrix:
        """An increasing function of a clearance in m that a nonlinear program bounds instead; itself by default."""
        return clearance

    @abstractmethod
    def distance_to(self, point: tuple[float, ...]) -> float:
        """A lower bound in m of the distance from a point; from the base, bodies that reach less can never touch."""

    @abstractmethod
    def outline(self, count: int = 96) -> FloatArray:
        """Points on the boundary for drawing, in order and counter-clockwise, (count, dim), m."""

    @abstractmethod
    def bounding_box(self) -> FloatArray:
        """The smallest box around it with sides along the axes: lower and upper corner, (2, dim), m."""
