"""The interface of families of motions: samples, exact pieces, and the data of a single sample."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

P = TypeVar("P")


@dataclass(frozen=True, kw_only=True)
class SampleGrid:
    """The samples of a motion as numbers: the rows of a compiled loop.

    Attributes:
        rows: what is different from sample to sample, (n, r).
        pieces: of each row, the number of the piece of the motion's blocks with which its part begins, (n,).
    """

    rows: FloatArray
    pieces: NDArray[np.intp]


class Motion(Statement, ABC, Generic[P]):
    """A family of motions with parameters P. A subclass is a frozen dataclass.

    The same motion is sampled in two ways: all rows at once (:meth:`samples`), and row by row, as compiled code does:
    :meth:`blocks` prepares numbers once for a candidate, :meth:`at` makes one row of a part of them.
    """

    robot: Robot
    orders: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)  # of the derivatives that it can be sampled for

    @abstractmethod
    def samples(self, parameters: P) -> Samples:
        """All samples, n rows."""

    @property
    @abstractmethod
    def grid(self) -> SampleGrid:
        """The rows of these samples, for :meth:`at`."""

    @abstractmethod
    def blocks(self, parameters: P, orders: tuple[int, ...]) -> Matrix:
        """The numbers from which all samples are computed, as one vector (b, 1), for the given derivative orders."""

    @abstractmethod
    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """Entries of one piece of the blocks, and of the window that a row sees: the pieces that shape a sample."""

    @abstractmethod
    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        """One sample.

        Args:
            window: the part of the blocks that belongs to this row, (width, 1).
            row: of the grid, (r, 1).
            durations: of :meth:`durations`, (m, 1), s.
            orders: of the derivatives in the blocks; the others are left out.
        """

    @abstractmethod
    def durations(self, parameters: P) -> Matrix:
        """The durations of the motion's parts, (m, 1), s; they add up to its duration."""

    @property
    @abstractmethod
    def duration_count(self) -> int:
        """The number m of these times."""

    def duration(self, durations: Matrix) -> Matrix:
        """The duration of the whole motion, s, from its parts."""
        return sum(ca.vertsplit(durations), ca.DM(0))

    @abstractmethod
    def as_matrices(self, parameters: P) -> list[Matrix]:
        """The parameters as a list of matrices."""

    @abstractmethod
    def from_matrices(self, matrices: Sequence[Matrix]) -> P:
        """The inverse of :meth:`as_matrices`."""

    @abstractmethod
    def trajectory(self, parameters: P) -> Trajectory:
        """The exact motion of numeric parameters."""

    @abstractmethod
    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Times in s at which to tabulate a trajectory, those of the samples among them."""
