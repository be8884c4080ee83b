"""Questions about a robot among obstacles: distances of postures, proofs about motions, paths between postures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core import Nearby, Proof, Schedule, Separation
from problems.motions import Trajectory


class World(Protocol):
    """A robot among obstacles that stand still or move.

    Where some move, it matters when postures are tested: at the beginning by default. A clearance margin is a distance
    less what is kept.
    """

    @property
    def dof(self) -> int:
        """The number of joints."""

    @property
    def margins(self) -> Mapping[Separation, float]:
        """The distances that are kept, m, by from what."""

    @property
    def fastest(self) -> float:
        """The largest pace at which an obstacle comes nearer, about, m/s."""

    @property
    def moves(self) -> bool:
        """Whether an obstacle moves."""

    @property
    def still(self) -> World:
        """The world of the obstacles that stand still; this world where all do."""

    @property
    def is_exact(self) -> bool:
        """Whether joints are where they are planned, or are off by as much at any speed."""

    def errors(self, speed: FloatArray, acceleration: FloatArray) -> FloatArray | None:
        """Errors of joints at speeds and accelerations (n, dof): (n, dof), rad or m; None of exact ones."""

    def clearance_margins(
        self,
        theta: FloatArray,
        most: float = np.inf,
        which: Separation = Separation.ALL,
        times: FloatArray | None = None,
        errors: FloatArray | None = None,
    ) -> FloatArray:
        """The clearance margins of postures, no larger than asked for, (n,), m.

        Args:
            theta: (n, dof), rad.
            most: that is asked for, m.
            which: what has to keep a distance.
            times: at which they are looked at, (n,), s.
            errors: by which joints may be off there, (n, dof), rad or m.
        """

    def clear(self, theta: FloatArray, extra_margin: float = 0.0, times: FloatArray | None = None) -> NDArray[np.bool_]:
        """Whether postures (n, dof), rad, at times (n,), s, have a clearance margin of so much, m: (n,)."""

    def nearby(
        self, theta: FloatArray, below: float, times: FloatArray | None = None, errors: FloatArray | None = None
    ) -> Nearby:
        """The pairs with smaller clearance margins in postures; arguments as of :meth:`clearance_margins`."""

    def prove(self, trajectory: Trajectory) -> Proof:
        """Bound the clearance margin of a motion for all t; its clock is that of the obstacles."""

    def connect(
        self,
        start: FloatArray,
        goal: FloatArray,
        box: FloatArray,
        seed: int,
        *,
        schedule: Schedule | None = None,
    ) -> FloatArray | None:
        """A path between two postures (dof,), rad, by RRT-Connect and shortcuts; None where none was found.

        Args:
            start: of the way.
            goal: its end.
            box: lower and upper bounds of what is tried, (2, dof), rad.
            seed: of what is drawn.
            schedule: when postures are passed, about; that of the beginning where obstacles move and None is given.

        Returns:
            (m, dof), rad: where the way bends, start and goal included.
        """
