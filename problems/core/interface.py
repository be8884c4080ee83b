"""Questions to the core about a robot among solids, and its answers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.motions import Trajectory


class Separation(IntFlag):
    """The kinds of pairs that have to keep a distance."""

    FROM_OBSTACLES = 1
    FROM_EACH_OTHER = 2
    ALL = 3


@dataclass(frozen=True, eq=False)
class Nearby:
    """The pairs that come near in postures.

    Attributes:
        samples: numbers of the postures, (m,).
        is_link: whether it is another link, (m,).
        clearance_margins: distances less those that must be kept, (m,), m.
        rates: how that changes with the time, (m,), m/s; zero where nothing moves.
        gradients: how it changes with the joints, (m, dof), m/rad.
    """

    samples: NDArray[np.int32]
    is_link: NDArray[np.bool_]
    clearance_margins: FloatArray
    rates: FloatArray
    gradients: FloatArray


@dataclass(frozen=True, eq=False)
class MovingSolids:
    """Solids that move, without turning, at constant velocities.

    Attributes:
        drifts: of each where it is at t = 0, m, its velocity, m/s, and how much more is kept from it with every second,
            m/s, (solids, 7).
        times: at which each posture is looked at, (n,), s.
    """

    drifts: FloatArray
    times: FloatArray

    @cached_property
    def displacements(self) -> FloatArray:
        """The displacements of each solid, (3, solids, n), m."""
        return np.asarray(self.drifts[:, :3].T[..., None] + self.drifts[:, 3:6].T[..., None] * self.times)

    @cached_property
    def more(self) -> FloatArray:
        """The growth of the margin of each solid by then, (solids, n), m."""
        return np.asarray(self.drifts[:, 6:] * self.times)

    def part(self, chosen: slice) -> MovingSolids:
        """The solids at the times of some postures."""
        return MovingSolids(self.drifts, self.times[chosen])


@dataclass(frozen=True, eq=False)
class Schedule:
    """Approximate times of postures, by their place along the straight line between two.

    Attributes:
        start: (dof,), rad.
        goal: likewise.
        begin: when the first is left, s.
        end: when the second is reached, s.
    """

    start: FloatArray
    goal: FloatArray
    begin: float
    end: float

    @property
    def numbers(self) -> FloatArray:
        """The core's numbers: slopes, s/rad; time of the zero posture; first and last time; (dof + 3,), s."""
        way = self.goal - self.start
        slopes = (self.end - self.begin) / max(float(way @ way), np.finfo(float).tiny) * way
        return np.array([*slopes, self.begin - slopes @ self.start, self.begin, self.end])


@dataclass(frozen=True, eq=False)
class PathSearch:
    """The settings of a search for a path.

    Attributes:
        box: lower and upper bounds of what is tried, (2, dof), rad.
        step: between tested postures of an edge, rad of the joint that turns most.
        extra_margin: clearance margin of the postures that are tested, m.
        reach: longest edge of a tree, rad.
        extensions: of the trees, at most.
        shortcuts: that are tried.
        seed: of what is drawn.
        drifts: how solids move, (solids, 7); None where none does.
        schedule: when postures are passed, about; all at the beginning where None.
        errors: how far joints may be off, (dof,), rad or m; None where they are not.
        turns: when the way of each joint is looked for, from 0 on, (dof,); None where all are moved at once.
    """

    box: FloatArray
    step: float
    extra_margin: float
    reach: float
    extensions: int
    shortcuts: int
    seed: int
    drifts: FloatArray | None = None
    schedule: Schedule | None = None
    errors: FloatArray | None = None
    turns: NDArray[np.int32] | None = None


class ProofRequest(NamedTuple):
    """The question that a proof has to answer.

    Attributes:
        breaks: where polynomials begin and end, (pieces + 1,), s.
        coefficients: of the joints, the highest power first, of the time since a piece began, (order, pieces, dof).
        which: what has to keep a distance.
        gap: by which share of the least margin that was seen the proven one may be smaller.
        cells: of time, at least, at the beginning.
        most_items: that are looked at.
        drifts: how solids move, (solids, 7); None where none does.
        rounding: how much farther than the description says distances may be off then, m.
        tracking: how far joints may be off: a constant, shares of speed and acceleration, (3, dof); None of exact ones.
    """

    breaks: FloatArray
    coefficients: FloatArray
    which: Separation
    gap: float
    cells: int
    most_items: int
    drifts: FloatArray | None
    rounding: float
    tracking: FloatArray | None = None


class ProofResult(NamedTuple):
    """The result of a proof.

    Attributes:
        status: 1 where it is proven, 0 where something is too near at some time, -1 where that is not known.
        proven: clearance margin at all times, m; -inf where none is proven.
        smallest: least clearance margin that was seen, m; infinite where nothing was looked at.
        time: of that, s.
        one: node of that; negative where there is none.
        two: solid or other node.
        kind: 0 of a solid, 1 of two nodes.
        start: of a cell of time in which it is not known, s; 0 where none is to blame, and so is its end.
        end: likewise.
    """

    status: int
    proven: float
    smallest: float
    time: float
    one: int
    two: int
    kind: int
    start: float = 0.0
    end: float = 0.0


@dataclass(frozen=True)
class ClosestPair:
    """The two objects that are nearest to each other.

    Attributes:
        links: names: of the one that an obstacle comes near, or of both, that nearer the base first.
        obstacle: number, from 0 on; None where it is a link.
    """

    links: tuple[str, ...]
    obstacle: int | None


@dataclass(frozen=True, eq=False)
class ClosestPairs:
    """The objects that come nearest to each other in each of n postures.

    Attributes:
        pairs: of objects; None where there is nothing.
        clearance_margins: (n,), m; infinite where there is nothing.
        points: of both surfaces, where they are nearest, (n, 2, 3), m.
    """

    pairs: tuple[ClosestPair | None, ...]
    clearance_margins: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class Proof:
    """A proof about the clearance margin of a motion for all t.

    Attributes:
        status: whether it is proven; None where that is not known.
        proven: clearance margin at all times, m; -inf where none is proven.
        smallest: least clearance margin that was seen, m; infinite where nothing was looked at.
        time: of that, s.
        where: of that; None where nothing was.
        cell: start and end, s, of a cell of time in which it is not known; None where there is none.
    """

    status: bool | None
    proven: float
    smallest: float
    time: float
    where: ClosestPair | None
    cell: tuple[float, float] | None = None


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
