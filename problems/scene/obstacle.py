"""What an obstacle is: how far a point or a segment is from it, with a sign; where it is at a time."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix, Operand, Parametric, check_fields, quantities_in, types_of


@dataclass(frozen=True, eq=False)
class Frames:
    """The poses of a frame at n times.

    Attributes:
        origins: (n, dim), m.
        axes: its axes, one in each column, (n, dim, dim); None where it does not turn.
    """

    origins: FloatArray
    axes: FloatArray | None = None

    def at(self, rows: NDArray[np.intp]) -> Frames:
        """The poses at some of the times."""
        return Frames(self.origins[rows], None if self.axes is None else self.axes[rows])

    def seen(self, points: FloatArray) -> FloatArray:
        """Points (n, dim), one for each time, as seen from the frame then, (n, dim), m."""
        away = points - self.origins
        return away if self.axes is None else np.asarray(np.einsum("ni,nij->nj", away, self.axes))

    def placed(self, points: FloatArray) -> FloatArray:
        """Points (m, dim) of the frame as seen from outside, (n, m, dim), m."""
        turned = points[None] if self.axes is None else np.einsum("mj,nij->nmi", points, self.axes)
        return np.asarray(turned + self.origins[:, None])


@dataclass(frozen=True)
class Obstacle(Parametric, ABC):
    """Something that no body of the robot may touch. A subclass is a frozen dataclass.

    The fields of that dataclass, with the units in their types, are the keys of the table in a scenario that states it.
    Those of them that are quantities are arguments of compiled code, and within the bounds that their types state.
    One that moves is seen from a frame that moves with it: :mod:`problems.scene.moving`.

    Args:
        name: for messages; its number stands in for it where it is empty.

    Attributes:
        not_stated: fields that are no keys, because they change nothing.

    Raises:
        InvalidProblem: a field is of another kind or length than its type says, or a number is out of range.
    """

    not_stated: ClassVar[tuple[str, ...]] = ()
    inert: ClassVar[tuple[str, ...]] = ("name",)

    name: str = field(default="", kw_only=True)

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "numbers" not in vars(cls):
            known = (*cls.numbers, *cls.inert)
            own = (name for name, hint in types_of(cls).items() if name not in known and quantities_in(hint))
            cls.numbers = (*cls.numbers, *own)

    def __post_init__(self) -> None:
        check_fields(self)

    def label(self, number: int) -> str:
        """The words by which messages call the obstacle of that number."""
        return self.unmoved.name or f"obstacle {number}"

    @property
    def dim(self) -> int:
        """The dimension: 2 in the plane, 3 in space."""
        return 2

    @property
    @abstractmethod
    def place(self) -> tuple[float, ...]:
        """A point of the obstacle, m, for messages."""

    @property
    def complexity(self) -> int:
        """The size that the obstacle adds to a model, in corners of a polygon; 1 by default."""
        return 1

    @property
    def moves(self) -> bool:
        """Whether the obstacle moves: not by default."""
        return False

    @property
    def unmoved(self) -> Obstacle:
        """The obstacle as seen from the frame in which it stands still; the obstacle itself by default."""
        return self

    @property
    def in_space(self) -> tuple[Obstacle, ...]:
        """Solids that are together as far from any point of the plane z = 0 as an obstacle in the plane; else none."""
        return ()

    def seen(self, points: Matrix, times: Matrix | None) -> Matrix:
        """Points (n, dim), m, as seen from that frame at times (n, 1) in s: the same points by default."""
        return points

    def frames(self, times: FloatArray) -> Frames | None:
        """Poses of that frame at times (n,) in s; None for the frame of the world."""
        return None

    def without_growth(self) -> Obstacle:
        """The obstacle with a distance to it that does not grow with time: itself by default."""
        return self

    @property
    def growth_rate(self) -> float:
        """The rate at which the distance to be kept from it grows, m/s: 0 by default."""
        return 0.0

    def growth(self, times: Matrix | None) -> Operand:
        """The distance to be kept at times (n, 1) in s on top of that from any obstacle, (n, 1), m."""
        return 0.0

    def travel(self, cells: FloatArray, around: float) -> FloatArray:
        """Bounds of how much a distance can change within cells of time because the obstacle moves; 0 by default.

        Args:
            cells: start and end of each, (n, 2), s.
            around: no point whose distance is meant is farther from the world's origin, m.

        Returns:
            (n,), m: an upper bound of the difference to the distance in the middle of each cell.
        """
        return np.zeros(len(cells))

    def quiet_after(self, around: float) -> float:
        """The time in s after which it comes no nearer to anything within so many m of the world's origin.

        At once by default; infinite where no such time is known.
        """
        return 0.0

    def at(self, time: float) -> Obstacle:
        """The obstacle where it is at one time in s."""
        return self

    def later(self, seconds: float) -> Obstacle:
        """The obstacle on a clock that starts so many seconds later."""
        return self

    def during(self, first: float, last: float) -> Obstacle:
        """The obstacle for times from ``first`` to ``last`` in s alone, which may be less to compute."""
        return self

    def less_certain(self, rate: float) -> Obstacle:
        """The obstacle if it may leave its motion at a rate in m/s in any direction; itself if it stands still."""
        return self

    @property
    def extent(self) -> float:
        """The largest distance of its points from the origin, m; of its bounding box by default."""
        return float(np.linalg.norm(np.abs(self.bounding_box()).max(axis=0)))

    @property
    @abstractmethod
    def width(self) -> float:
        """The least distance in m between two parallel planes that hold it: a bound for the steps of joints."""

    @abstractmethod
    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """The clearance of n straight segments.

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
        """The clearance of n points (n, dim), m: (n, 1), like :meth:`segment_distance`."""
        return self.segment_distance(points, points)

    def exact_distances(self, points: FloatArray) -> FloatArray | None:
        """Distances of n points (n, dim), m, as seen from the frame in which it stands still: (n,), m.

        For proofs, where :meth:`point_clearance` is only a lower bound; None by default: nothing is sharper.
        """
        return None

    def segment_distance(self, start: Matrix, end: Matrix) -> Matrix:
        """The clearance with a sharper lower bound, for a distance to be kept: a margin, or the width of a link.

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

    def distance_to(self, point: tuple[float, ...]) -> float:
        """A lower bound in m of the distance from a point; from the base, bodies that reach less never touch."""
        return max(0.0, self.distance_of(point, point))

    @abstractmethod
    def outline(self, count: int = 96) -> FloatArray:
        """Points on the boundary for drawing, counter-clockwise, (n, dim), m: corners, or ``count`` on a curve."""

    def bounding_box(self) -> FloatArray:
        """The smallest box around its outline with sides along the axes: lower and upper corner, (2, dim), m."""
        outline = self.outline()
        return np.array([outline.min(axis=0), outline.max(axis=0)])

    def surface(self) -> tuple[FloatArray, list[list[int]]]:
        """Vertices (n, 3), m, and polygons of their numbers, of an obstacle in space, for drawing.

        Raises:
            NotImplementedError: it is in the plane.
        """
        raise NotImplementedError


def standing(obstacles: Sequence[Obstacle]) -> tuple[Obstacle, ...]:
    """The obstacles that do not move."""
    return tuple(obstacle for obstacle in obstacles if not obstacle.moves)
