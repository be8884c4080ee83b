"""The program's variables: pieces of constant jerk, their nodes, the times between.

Angles and velocities at the nodes; where jerk is limited, accelerations at the nodes and the jerk of each piece; else
accelerations at both ends of each piece, which may jump from one piece to the next; the durations. All are in units of
rad and of one typical time. A duration may shrink to nothing: no formula divides by it.

A solver leaves about 1e-8 of each equality. The pieces of a solution are integrated, which makes the motion smooth, and
their jerks (or accelerations) are changed by the least that removes what is left at the waypoints and at the end: a
linear system.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix, split
from problems.limits import Constraint
from problems.motions import Samples, Trajectory
from problems.programs import equality
from problems.robots import JointLimits, Robot
from problems.timing import AccelerationPieces

LEAST_SHARE = 1e-6  # of the duration, between two nodes of a start
CLEAR_JUMP = 0.1  # of a limit: smaller jumps are no reason for a node


def node_times(motion: Trajectory, passed: FloatArray, pieces: int, limits: JointLimits) -> FloatArray:
    """The times of nodes on a motion, s.

    Args:
        motion: whose own breakpoints are taken, those first where accelerations or jerks jump most.
        passed: when the waypoints are passed, (m,), s; they become nodes.
        pieces: between one waypoint and the next.
        limits: to which jumps are relative.

    Returns:
        Increasing times, ((m - 1) pieces + 1,).
    """
    least = LEAST_SHARE * motion.duration / passed.size
    bounds = ((2, limits.acceleration), (3, limits.jerk))
    jumps = np.array([_jumps(motion, order, bound) for order, bound in bounds if bound is not None])
    between = [
        _inner_times(motion.breakpoints[1:-1], jumps.max(axis=0), (first, last), pieces, least)
        for first, last in pairwise(passed)
    ]
    times = np.concatenate([passed[:1], *between])
    even = np.arange(times.size) * least
    return np.asarray(np.maximum.accumulate(times - even) + even)


def _jumps(motion: Trajectory, order: int, bound: tuple[float, ...]) -> FloatArray:
    """Jumps of a derivative at the inner breakpoints, the largest of any joint relative to its bound; (p - 1,)."""
    at = motion.breakpoints[1:-1]
    jumps = np.abs(motion.at(at, order) - motion.at(np.nextafter(at, 0.0), order)) / np.array(bound)
    return np.asarray(jumps.max(axis=1))


def _inner_times(
    breakpoints: FloatArray, jumps: FloatArray, ends: tuple[float, float], pieces: int, least: float
) -> FloatArray:
    """Times after the first of two ends up to the second, as many as pieces."""
    first, last = ends
    within = (breakpoints > first + least) & (breakpoints < last - least)
    inner, jumps = breakpoints[within], jumps[within]
    apart = np.diff(inner, prepend=first) > least
    inner, jumps = inner[apart], jumps[apart]
    if inner.size >= pieces:
        clear = np.flatnonzero(jumps > CLEAR_JUMP)
        inner = np.sort(inner[clear[np.argsort(-jumps[clear], kind="stable")[: pieces - 1]]])
    times = np.concatenate([[first], inner, [last]])
    while times.size <= pieces:
        longest = int(np.argmax(np.diff(times)))
        times = np.insert(times, longest + 1, (times[longest] + times[longest + 1]) / 2.0)
    return times[1:]


GAUSS_SHARES, GAUSS_WEIGHTS = (values / 2.0 for values in np.polynomial.legendre.leggauss(3))
GAUSS_SHARES = GAUSS_SHARES + 0.5  # of a piece
SHORTEST_SHARE, LONGEST_SHARE = 0.5, 2.0  # of the mean duration of pieces, where they have to be alike
SHORTEST = 1e-7  # of the time unit: the least duration of a piece


class Pieces(NamedTuple):
    """The parts of a vector of variables, scaled: rad, and times in the time unit; N pieces of k joints.

    Attributes:
        theta: at the nodes, (N + 1, k).
        speed: at the nodes, (N + 1, k).
        before: accelerations at the start of each piece, (N, k).
        after: at its end, (N, k).
        jerk: of each piece, (N, k); None where it is no variable.
        h: durations, (N, 1).
    """

    theta: Matrix
    speed: Matrix
    before: Matrix
    after: Matrix
    jerk: Matrix | None
    h: Matrix

    @property
    def middle(self) -> Matrix:
        """The middle Bezier coefficients of the speed, (N, k): with those at the nodes they bound it for all t."""
        return self.speed[:-1, :] + _times(self.h / 2.0, self.before)

    @property
    def inner_angles(self) -> tuple[Matrix, Matrix]:
        """The two inner Bezier coefficients of the angles, each (N, k)."""
        third = self.h / 3.0
        return self.theta[:-1, :] + _times(third, self.speed[:-1, :]), self.theta[1:, :] - _times(
            third, self.speed[1:, :]
        )


@dataclass(frozen=True)
class PieceVariables:
    """The layout of the variables.

    Args:
        robot: that moves.
        count: N, the number of pieces.
        smooth: whether accelerations are continuous, and zero at both ends.
        timed: whether durations are variables; else all pieces take the same share of one second.
        unit: of time, s.
    """

    robot: Robot
    count: int
    smooth: bool
    timed: bool
    unit: float

    @property
    def sizes(self) -> list[int]:
        """How many angles, speeds, accelerations at nodes or before, jerks or accelerations after, durations."""
        nodes, pieces = (self.count + 1) * self.robot.dof, self.count * self.robot.dof
        return [nodes, nodes, nodes if self.smooth else pieces, pieces, self.count if self.timed else 0]

    @property
    def slices(self) -> list[slice]:
        """Slices of the variables, one for each kind."""
        cuts = np.cumsum([0, *self.sizes]).tolist()
        return [slice(*cut) for cut in pairwise(cuts)]

    def end_postures(self, x: FloatArray) -> FloatArray:
        """The postures at both ends, (2, k), rad."""
        return x[self.slices[0]].reshape(self.robot.dof, -1).T[[0, -1]]

    @property
    def names(self) -> list[str]:
        """Names of the variables, joint after joint; nodes count from 0, pieces from 1."""
        joints, nodes, pieces = (range(1, self.robot.dof + 1), range(self.count + 1), range(1, self.count + 1))
        last = ("d2theta", nodes), ("d3theta", pieces)
        accelerations = last if self.smooth else (("d2theta before", pieces), ("d2theta after", pieces))
        columns = [("theta", nodes), ("dtheta", nodes), *accelerations]
        names = [f"{symbol}_{joint}[{row}]" for symbol, rows in columns for joint in joints for row in rows]
        return [*names, *(f"h[{piece}]" for piece in pieces if self.timed)]

    def split(self, x: Matrix) -> Pieces:
        """The parts of variables (n, 1), those of further kinds behind them left out."""
        k = self.robot.dof
        *parts, h = split(x[: sum(self.sizes)], self.sizes)
        theta, speed, first, second = (ca.reshape(part, -1, k) for part in parts)
        h = h if self.timed else ca.DM.ones(self.count, 1) / (self.count * self.unit)
        if self.smooth:
            return Pieces(theta, speed, first[:-1, :], first[1:, :], second, h)
        return Pieces(theta, speed, first, second, None, h)

    def joins(self, pieces: Pieces) -> list[Constraint]:
        """Constraints that each piece ends where the next one starts."""
        theta, speed, before, after, jerk, h = pieces
        names = self.robot.joints.names
        way = _times(h / 3.0, speed[:-1, :] + pieces.middle + speed[1:, :])
        gain = _times(h / 2.0, before + after)
        rows = [
            equality(
                "angles", theta[1:, :] - theta[:-1, :] - way, "rad", names, "theta_p+1 = theta_p + its piece's way"
            ),
            equality("speeds", speed[1:, :] - speed[:-1, :] - gain, "rad", names, "the same of dtheta"),
        ]
        if jerk is not None:
            change = after - before - _times(h, jerk)
            rows.append(equality("accelerations", change, "rad", names, "the same of d2theta"))
        return rows

    def evenness(self, pieces: Pieces, each: int) -> list[Constraint]:
        """Constraints that no piece is much shorter or longer than the mean of the ``each`` between two waypoints."""
        lengths = ca.reshape(pieces.h, each, -1)
        means = ca.repmat(ca.sum1(lengths) / each, each, 1)
        rows = ca.horzcat(ca.vec(lengths - SHORTEST_SHARE * means), ca.vec(LONGEST_SHARE * means - lengths))
        return [
            Constraint(
                name="piece durations",
                unit="1",
                expression=rows,
                lower=ca.DM.zeros(1, 2),
                upper=None,
                columns=("shortest", "longest"),
                for_all_t=False,
                formula=f"{SHORTEST_SHARE:g} <= h_p / mean(h) <= {LONGEST_SHARE:g} between two waypoints",
            )
        ]

    def samples(self, pieces: Pieces, steps: int) -> Samples:
        """The motion at so many times in each piece, from its start, and at the end: (N steps + 1, k)."""
        theta, speed, _, after, _, h = pieces
        rows = list(map(list, zip(*(self._at(pieces, share) for share in np.arange(steps) / steps), strict=True)))
        ends = theta[-1, :], speed[-1, :], after[-1, :], rows[3][0][-1, :]
        order = np.append(np.arange(steps * self.count).reshape(steps, -1).T.ravel(), steps * self.count).tolist()
        matrices = [ca.vertcat(*part, end)[order, :] for part, end in zip(rows, ends, strict=True)]
        lengths = ca.vec(ca.repmat(h.T / steps, steps, 1)) * self.unit
        nothing = ca.DM.zeros(1, 1)
        return Samples(
            robot=self.robot,
            derivatives=tuple(matrix / self.unit**n for n, matrix in enumerate(matrices)),
            duration=ca.sum1(h) * self.unit,
            times=ca.vertcat(nothing, ca.cumsum(lengths)),
            weights=(ca.vertcat(nothing, lengths) + ca.vertcat(lengths, nothing)) / 2.0,
        )

    def quadrature(self, pieces: Pieces) -> Samples:
        """The motion at Gauss's points of each piece, where accelerations may jump in between: (3 N, k)."""
        rows = zip(*(self._at(pieces, share) for share in GAUSS_SHARES), strict=True)
        h = pieces.h * self.unit
        return Samples(
            robot=self.robot,
            derivatives=tuple(ca.vertcat(*part) / self.unit**n for n, part in enumerate(rows)),
            duration=ca.sum1(h),
            times=ca.vertcat(*(ca.cumsum(h) - h + share * h for share in GAUSS_SHARES)),
            weights=ca.vertcat(*(weight * h for weight in GAUSS_WEIGHTS)),
        )

    def before_jumps(self, pieces: Pieces) -> Samples:
        """The motion at the end of each piece but the last: (N - 1, k)."""
        h = pieces.h * self.unit
        return Samples(
            robot=self.robot,
            derivatives=tuple(part[:-1, :] / self.unit**n for n, part in enumerate(self._at(pieces, 1.0))),
            duration=ca.sum1(h),
            times=ca.cumsum(h)[:-1],
            weights=ca.DM.zeros(self.count - 1, 1),
        )

    def _at(self, pieces: Pieces, share: float) -> tuple[Matrix, Matrix, Matrix, Matrix]:
        """Angles, speeds, accelerations and jerks at a share of each piece, each (N, k), in the time unit."""
        theta, speed, before, after, jerk, h = pieces
        since, bend = h * share, after - before
        return (
            theta[:-1, :] + _times(since, speed[:-1, :] + _times(since, before / 2.0 + share * bend / 6.0)),
            speed[:-1, :] + _times(since, before + share * bend / 2.0),
            before + share * bend,
            bend / ca.repmat(h, 1, self.robot.dof) if jerk is None else jerk,
        )

    def of(self, trajectory: Trajectory, times: FloatArray) -> FloatArray:
        """The variables, (n,), of a motion whose nodes are at given times (N + 1,) in s."""
        h = np.diff(times)
        theta, speed = trajectory.at(times), trajectory.at(times, 1)
        if not self.timed:
            uniform = 1.0 / self.count
            speed, h = speed * np.gradient(times)[:, None] / uniform, np.full(self.count, uniform)
        if self.smooth:
            first = trajectory.at(times, 2) if self.timed else np.gradient(speed, axis=0) / h[0]
            first[[0, -1]] = 0.0
            second = np.diff(first, axis=0) / h[:, None]
        else:
            slope, wide = np.diff(theta, axis=0) / h[:, None], h[:, None]
            first = (6.0 * slope - 4.0 * speed[:-1] - 2.0 * speed[1:]) / wide
            second = (2.0 * speed[:-1] + 4.0 * speed[1:] - 6.0 * slope) / wide
        orders = (0, 1, 2, 3 if self.smooth else 2)
        parts = [part * self.unit**n for part, n in zip((theta, speed, first, second), orders, strict=True)]
        return np.concatenate([*(part.ravel(order="F") for part in parts), h / self.unit if self.timed else []])

    def accelerations(self, x: FloatArray) -> AccelerationPieces:
        """The accelerations of a solution (n,), in s."""
        pieces = self.split(ca.DM(x))
        h = np.asarray(pieces.h).ravel()
        jerk = (
            (pieces.after - pieces.before) / ca.repmat(pieces.h, 1, self.robot.dof)
            if pieces.jerk is None
            else pieces.jerk
        )
        return AccelerationPieces(
            h * self.unit, np.asarray(pieces.before) / self.unit**2, np.asarray(jerk) / self.unit**3
        )


def _times(h: Matrix, matrix: Matrix) -> Matrix:
    """Each row of a matrix (N, k) times its own factor (N, 1)."""
    return ca.repmat(h, 1, matrix.shape[1]) * matrix


CORRECTIONS = 3  # each leaves about 1e-12 of what it corrects


@dataclass(frozen=True)
class Waypoints:
    """Postures, times and rates that a motion through nodes has to meet.

    Attributes:
        nodes: numbers of the nodes that are waypoints, increasing, the first 0 and the last one that of the end, (m,).
        theta: angles there, (m, k), rad.
        velocities: at both ends, (2, k), rad/s.
    """

    nodes: NDArray[np.intp]
    theta: FloatArray
    velocities: FloatArray


def through(pieces: AccelerationPieces, waypoints: Waypoints, smooth: bool) -> Trajectory:
    """The motion nearest to given pieces that meets waypoints and end velocities.

    Args:
        pieces: of N durations.
        waypoints: to meet.
        smooth: whether accelerations are continuous, and zero at both ends.
    """
    h = pieces.durations
    controls = (
        pieces.jerks if smooth else np.vstack([pieces.accelerations, pieces.accelerations + h[:, None] * pieces.jerks])
    )
    effects = _effects(h, waypoints.nodes, smooth)
    shares = np.sqrt(np.tile(h, len(controls) // h.size))  # a control weighs as much as the time for which it acts
    for _ in range(CORRECTIONS):
        missing = _missing(_motion(h, controls, waypoints, smooth), waypoints, smooth)
        controls = controls + np.linalg.lstsq(effects / shares, missing, rcond=None)[0] / shares[:, None]
    return _motion(h, controls, waypoints, smooth)


def _motion(h: FloatArray, controls: FloatArray, waypoints: Waypoints, smooth: bool) -> Trajectory:
    if smooth:
        gains = h[:, None] * controls
        pieces = AccelerationPieces(h, np.cumsum(gains, axis=0) - gains, controls)
    else:
        before, after = np.split(controls, 2)
        pieces = AccelerationPieces(h, before, (after - before) / h[:, None])
    return pieces.trajectory(waypoints.theta[0], waypoints.velocities[0])


def _missing(motion: Trajectory, waypoints: Waypoints, smooth: bool) -> FloatArray:
    """The error that is left in the ways between waypoints, in the last velocity, and in the last acceleration."""
    theta = motion.at(motion.breakpoints[waypoints.nodes])
    end = motion.breakpoints[-1:]
    ways = np.diff(waypoints.theta, axis=0) - np.diff(theta, axis=0)
    rates = [waypoints.velocities[1:] - motion.at(end, 1), *([-motion.at(end, 2)] if smooth else [])]
    return np.vstack([ways, *rates])


def _effects(h: FloatArray, nodes: NDArray[np.intp], smooth: bool) -> FloatArray:
    """The matrix from controls to what :func:`_missing` lists."""
    count = h.size
    identity, zero = np.eye(count), np.zeros((count, count))
    chain = np.tril(np.ones((count, count)), -1) * h
    before, after = (
        (chain, chain + np.diag(h)) if smooth else (np.hstack([identity, zero]), np.hstack([zero, identity]))
    )
    gains = h[:, None] * (before + after) / 2.0
    speeds = np.vstack([np.zeros((1, gains.shape[1])), np.cumsum(gains, axis=0)])
    ways = h[:, None] * speeds[:-1] + h[:, None] ** 2 * (2.0 * before + after) / 6.0
    angles = np.vstack([np.zeros((1, gains.shape[1])), np.cumsum(ways, axis=0)])
    return np.vstack([np.diff(angles[nodes], axis=0), speeds[-1:], *([after[-1:]] if smooth else [])])
