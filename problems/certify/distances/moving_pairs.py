"""A trajectory as seen by pairs that have to keep a distance: how far they are apart, and how fast that can change."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.certify.distances.known_pairs import KnownPairs
from problems.evaluation.row_function import RowFunction
from problems.limits.distances.proximity import Pair
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

BLOCK = 1_000_000  # cells times pairs that are computed at once
ROBOTS = 32  # of which compiled functions are kept
AT_ONCE = 128  # postures that are computed at once


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
    return RowFunction(ca.Function("places", [theta], [ca.vertcat(*places)]), AT_ONCE)
