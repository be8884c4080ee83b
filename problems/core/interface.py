"""Questions to the core about a robot among solids, and its answers."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray


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
