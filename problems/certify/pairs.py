"""Pairs of bodies over cells of time: distances at known times, and how far bodies can travel.

Around the middle m of a cell of length h, within one piece of the motion, no point of body b moves farther than

    sum over j of levers[b, j] (|u_j(m)| h / 2 + max |du_j/dt| h^2 / 8),

with the angular rates u = turns @ dq/dt. The maximum over the piece comes from Bernstein coefficients, so that it is a
bound and no root has to be found.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import Arguments, FloatArray, Reading, bernstein
from problems.evaluation.program import PARAMETERS, RowFunction
from problems.limits import Pair
from problems.motions import Trajectory
from problems.robots import Robot


@dataclass(frozen=True)
class Travel:
    """A trajectory seen by the bodies that it moves.

    Args:
        robot: whose bodies.
        trajectory: of its joints.
    """

    robot: Robot
    trajectory: Trajectory

    @cached_property
    def turning(self) -> Trajectory:
        """The angles over time whose rates bound how bodies move: for a planar arm the orientations of its links."""
        coefficients = np.einsum("mj,ipj->ipm", self.robot.turns, self.trajectory.coefficients)
        return Trajectory(self.trajectory.breakpoints, coefficients)

    @cached_property
    def sharpest(self) -> FloatArray:
        """Bounds of its second derivatives in each piece, (pieces, m), rad/s^2."""
        curves = bernstein(np.asarray(self.turning.derivative(2).c), np.diff(self.trajectory.breakpoints))
        return np.asarray(np.abs(curves).max(axis=0))

    def of_bodies(self, cells: FloatArray) -> FloatArray:
        """How far any point of each body can move from where it is in the middle of cells, (n, bodies), m.

        Args:
            cells: start and end of each, within one piece, (n, 2), s.
        """
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        last = self.trajectory.breakpoints.size - 2
        pieces = np.clip(np.searchsorted(self.trajectory.breakpoints, middles, side="right") - 1, 0, last)
        speeds = np.abs(self.turning.at(middles, 1))
        return np.asarray((speeds * h / 2.0 + self.sharpest[pieces] * h**2 / 8.0) @ self.robot.levers.T)


def halves(cells: FloatArray) -> FloatArray:
    """Every cell cut in two, (2 n, 2), s."""
    middles = cells.mean(axis=1)
    return np.concatenate([np.column_stack([cells[:, 0], middles]), np.column_stack([middles, cells[:, 1]])])


KEPT = 16  # robots with their pairs
COMPILED = 64  # formulas of distances, of which functions are kept
AT_ONCE = 1024  # distances that are computed at once


@dataclass(frozen=True)
class KnownPairs:
    """Pairs of a robot's bodies, or of them and obstacles."""

    robot: Robot
    pairs: tuple[Pair, ...]

    @classmethod
    @lru_cache(maxsize=KEPT)
    def of(cls, robot: Robot, pairs: tuple[Pair, ...]) -> KnownPairs:
        """The same object for the same pairs, so that nothing is computed twice."""
        return cls(robot, pairs)

    @cached_property
    def rates(self) -> tuple[FloatArray, FloatArray]:
        """All turns that move any pair, (m, dof), and their levers, (pairs, m), m."""
        numbers: dict[bytes, int] = {}  # of turns
        columns: dict[bytes, list[int]] = {}  # of all turns of a pair
        levers = np.zeros((len(self.pairs), len(self.pairs) * self.robot.dof))
        for row, pair in zip(levers, self.pairs, strict=True):
            turns, own = pair.motion(self.robot)
            key = turns.tobytes()
            if key not in columns:
                columns[key] = [numbers.setdefault(turn.tobytes(), len(numbers)) for turn in turns]
            row[columns[key]] = own
        turns = np.array([np.frombuffer(turn) for turn in numbers]).reshape(-1, self.robot.dof)
        return turns, levers[:, : len(numbers)].copy()

    @cached_property
    def groups(self) -> list[PairGroup]:
        """Pairs that are computed together."""
        groups: dict[Hashable, list[int]] = {}
        for number, pair in enumerate(self.pairs):
            groups.setdefault(pair.group, []).append(number)
        return [
            PairGroup(self.pairs[members[0]], np.array(members), np.array([self.pairs[k].frames for k in members]))
            for members in groups.values()
        ]

    @cached_property
    def thickness(self) -> FloatArray:
        """What their widths take from the distances between their middle lines, (pairs,), m."""
        return np.array([float(pair.thickness) for pair in self.pairs])


@dataclass(frozen=True, eq=False)
class PairGroup:
    """Pairs whose distances have one formula.

    Attributes:
        first: of them.
        members: their numbers, (members,).
        frames: numbers of the frames in which they end, (members, ends).
    """

    first: Pair
    members: NDArray[np.intp]
    frames: NDArray[np.intp]

    @cached_property
    def _formula(self) -> tuple[RowFunction, FloatArray]:
        form, arguments = self.first.form, Arguments()
        arguments.symbolic_copy(form)
        return _distances(_Formula(Reading(form).structure_key, form)), arguments.values

    def distances(self, times: FloatArray, rows: NDArray[np.intp], ends: list[FloatArray]) -> FloatArray:
        """How far middle lines are apart, (m,), m, less what is kept as time goes by.

        Args:
            times: (n,), s.
            rows: at which of the times, (m,).
            ends: of the lines, each (m, dim), m.
        """
        view, (function, numbers) = self.first.view(times), self._formula
        seen = ends if view is None else [view.at(rows).seen(end) for end in ends]
        distances = np.asarray(function(np.vstack([end.T for end in seen]), numbers)[0])
        rate = self.first.growth_rate
        return distances - rate * times[rows] if rate else distances


@dataclass(frozen=True)
class _Formula:
    """That of a distance; pairs of the same make have the same."""

    make: Hashable
    pair: Pair = field(compare=False)


@lru_cache(maxsize=COMPILED)
def _distances(formula: _Formula) -> RowFunction:
    """How far two middle lines are apart, (1,), m, given their ends as one sees the other, and the numbers of both."""
    arguments = Arguments()
    pair, dim = arguments.symbolic_copy(formula.pair), formula.pair.dim
    ends = ca.SX.sym("ends", dim * len(pair.frames))
    apart = ca.densify(pair.apart(*(end.T for end in ca.vertsplit(ends, dim))))
    return RowFunction(
        ca.Function("apart", [ends, arguments.symbols], [apart], ["ends", PARAMETERS], ["apart"]), AT_ONCE
    )


BLOCK = 1_000_000  # cells times pairs that are computed at once
ROBOTS = 32  # of which compiled functions are kept
PAIRS_AT_ONCE = 128  # postures that are computed at once


@dataclass(frozen=True, eq=False)
class MovingPairs:
    """A trajectory seen by pairs that may meet.

    Args:
        known: of the pairs.
        trajectory: of the robot's joints.
    """

    known: KnownPairs
    trajectory: Trajectory

    @classmethod
    def of(cls, robot: Robot, pairs: tuple[Pair, ...], trajectory: Trajectory) -> MovingPairs:
        """Pairs of a robot's bodies, or of them and obstacles, on a trajectory."""
        return cls(KnownPairs.of(robot, pairs), trajectory)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """The pairs."""
        return self.known.pairs

    @cached_property
    def turning(self) -> Trajectory:
        """The angles over time whose rates bound how bodies move: for a planar arm the orientations of its links."""
        coefficients = np.einsum("mj,ipj->ipm", self.known.rates[0], self.trajectory.coefficients)
        return Trajectory(self.trajectory.breakpoints, coefficients)

    @cached_property
    def sharpest(self) -> FloatArray:
        """Its largest second derivatives over all t, (m,), rad/s^2; on both sides of where they may jump."""
        just_before = np.nextafter(self.trajectory.breakpoints[1:], 0.0)
        times = np.concatenate([self.turning.extreme_times(2), just_before])
        return np.asarray(np.abs(self.turning.at(times, 2)).max(axis=0))

    def places(self, times: FloatArray) -> FloatArray:
        """Where the robot's frames are at times (n,) in s: (frames, n, dim), m."""
        robot = self.known.robot
        columns = _places(robot)(np.ascontiguousarray(self.trajectory.at(times).T))
        return columns.reshape(-1, robot.dim, len(times)).transpose(0, 2, 1)

    def distance(self, number: int, time: float) -> float:
        """Of one pair at a time in s, exact to rounding, m."""
        pair, places = self.pairs[number], self.places(np.array([time]))
        positions = [ca.DM()] * len(places)
        for frame in pair.frames:
            positions[frame] = ca.DM(places[frame])
        return pair.distance(positions, ca.DM(time))

    def around_middles(
        self, cells: FloatArray, chosen: NDArray[np.bool_]
    ) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        """What pairs keep around the middles of cells.

        Args:
            cells: start and end of each, (n, 2), s.
            chosen: which pairs are looked at in each, (n, pairs), or (n, 1) for all or none.

        Returns:
            The smallest clearance in the middle and its pair, both (n,); a lower bound of the clearance of each pair
            all through, (n, pairs), infinite of those that are not looked at; m.
        """
        size = max(1, BLOCK // len(self.pairs))
        blocks = [self._block(cells[k : k + size], chosen[k : k + size]) for k in range(0, len(cells), size)]
        nearest, column, low = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        return nearest, column, low

    def _block(self, cells: FloatArray, chosen: NDArray[np.bool_]) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        clearance = self.clearances(cells.mean(axis=1), np.broadcast_to(chosen, (len(cells), len(self.pairs))))
        return clearance.min(axis=1), clearance.argmin(axis=1), clearance - self.moves(cells)

    def moves(self, cells: FloatArray) -> FloatArray:
        """How much the distance of each pair can change within cells (n, 2), s, from that in the middle, (n, pairs)."""
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        speeds = np.abs(self.turning.at(middles, 1))
        moves = np.asarray((speeds * h / 2.0 + self.sharpest * h**2 / 8.0) @ self.known.rates[1].T)
        for group in self.known.groups:
            if group.first.timed:
                moves[:, group.members] += group.first.own_travel(self.known.robot, cells)[:, None]
        return moves

    def clearances(self, times: FloatArray, chosen: NDArray[np.bool_]) -> FloatArray:
        """Of the pairs that are looked at, (n, pairs), m; infinite of the others."""
        places, found = self.places(times), np.full(chosen.shape, np.inf)
        for group in self.known.groups:
            rows, which = np.nonzero(chosen[:, group.members])
            if rows.size:
                members = group.members[which]
                distances = group.distances(times, rows, [places[frame, rows] for frame in group.frames[which].T])
                found[rows, members] = distances - self.known.thickness[members]
        return found


@lru_cache(maxsize=ROBOTS)
def _places(robot: Robot) -> RowFunction:
    """Where all frames are, (frames * dim,), m, in a posture (dof,)."""
    theta = ca.SX.sym("theta", robot.dof)
    places = [ca.densify(place.T) for place in robot.positions(theta.T)]
    return RowFunction(ca.Function("places", [theta], [ca.vertcat(*places)]), PAIRS_AT_ONCE)
