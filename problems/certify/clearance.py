"""Clearance proven for all t, and the closest approach.

Around the middle m of a cell of time of length h, no point of body b moves farther than

    sum over j of levers[b, j] (|u_j(m)| h / 2 + max |du_j/dt| h^2 / 8),

with the angular rates u = turns @ dq/dt: for a planar arm the turning of its links. Of two bodies only the joints
between them count. The distance changes by no more than the points move, and by what an obstacle moves by itself. A
cell is settled where the clearance in its middle exceeds that by the clearance to prove; the others are halved.
The proof holds up to rounding in floating point.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import Arguments, FloatArray, Reading, bernstein
from problems.certify.settings import DEFAULT_APPROACH, ApproachSettings
from problems.certify.verdict import CertificateStatus
from problems.evaluation import PARAMETERS, RowFunction
from problems.limits import Pair, Proximity
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
        return _turning(self.robot.bodies.turns, self.trajectory)

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
        return np.asarray(self.turns(cells) @ self.robot.bodies.levers.T)

    def turns(self, cells: FloatArray) -> FloatArray:
        """How far angles can be from where they are in the middle of cells, each within one piece, (n, m), rad or m."""
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        last = self.trajectory.breakpoints.size - 2
        pieces = np.clip(np.searchsorted(self.trajectory.breakpoints, middles, side="right") - 1, 0, last)
        return np.asarray(np.abs(self.turning.at(middles, 1)) * h / 2.0 + self.sharpest[pieces] * h**2 / 8.0)


def _turning(turns: FloatArray, trajectory: Trajectory) -> Trajectory:
    """Angles (m,) over time, made of those of the joints by turns (m, dof)."""
    return Trajectory(trajectory.breakpoints, np.einsum("mj,ipj->ipm", turns, trajectory.coefficients))


def halves(cells: FloatArray) -> FloatArray:
    """Every cell cut in two, (2 n, 2), s."""
    middles = cells.mean(axis=1)
    return np.concatenate([np.column_stack([cells[:, 0], middles]), np.column_stack([middles, cells[:, 1]])])


CACHED_PAIRS = 16  # robots with their pairs
CACHED_FORMULAS = 64  # of distances
DISTANCES_AT_ONCE = 1024


@dataclass(frozen=True)
class KnownPairs:
    """Pairs of a robot's bodies, or of them and obstacles."""

    robot: Robot
    pairs: tuple[Pair, ...]

    @classmethod
    @lru_cache(maxsize=CACHED_PAIRS)
    def of(cls, robot: Robot, pairs: tuple[Pair, ...]) -> KnownPairs:
        """The cached object of given pairs, so that nothing is computed twice."""
        return cls(robot, pairs)

    @cached_property
    def rates(self) -> tuple[FloatArray, FloatArray]:
        """All turns that move any pair, (m, dof), and their levers, (pairs, m), m."""
        numbers: dict[bytes, int] = {}  # of turns
        columns: dict[bytes, list[int]] = {}  # of all turns of a pair
        motions = [pair.motion(self.robot) for pair in self.pairs]
        for turns, _ in motions:
            if turns.tobytes() not in columns:
                columns[turns.tobytes()] = [numbers.setdefault(turn.tobytes(), len(numbers)) for turn in turns]
        levers = np.zeros((len(self.pairs), len(numbers)))
        for row, (turns, levers_of_pair) in zip(levers, motions, strict=True):
            row[columns[turns.tobytes()]] = levers_of_pair
        return np.array([np.frombuffer(turn) for turn in numbers]).reshape(-1, self.robot.dof), levers

    @cached_property
    def groups(self) -> list[PairGroup]:
        """Groups of pairs that are computed together."""
        groups: dict[Hashable, list[int]] = {}
        for number, pair in enumerate(self.pairs):
            groups.setdefault(pair.group, []).append(number)
        return [
            PairGroup(self.pairs[members[0]], np.array(members), np.array([self.pairs[k].frames for k in members]))
            for members in groups.values()
        ]

    @cached_property
    def thickness(self) -> FloatArray:
        """Widths of the bodies, by which distances of surfaces are less than those of middle lines, (pairs,), m."""
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
        """Distances of middle lines, (m,), m, less the part that grows with the time.

        Args:
            times: (n,), s.
            rows: at which of the times, (m,).
            ends: of the lines, each (m, dim), m.
        """
        view = self.first.view(times)
        seen = ends if view is None else [view.at(rows).seen(end) for end in ends]
        distances = self.first.exactly_apart(*seen)
        if distances is None:
            function, numbers = self._formula
            distances = np.asarray(function(np.vstack([end.T for end in seen]), numbers)[0])
        rate = self.first.growth_rate
        return distances - rate * times[rows] if rate else distances


@dataclass(frozen=True)
class _Formula:
    """The formula of a distance, which pairs of one make share."""

    make: Hashable
    pair: Pair = field(compare=False)


@lru_cache(maxsize=CACHED_FORMULAS)
def _distances(formula: _Formula) -> RowFunction:
    """How far two middle lines are apart, (1,), m, given their ends as one sees the other, and the numbers of both."""
    arguments = Arguments()
    pair, dim = arguments.symbolic_copy(formula.pair), formula.pair.dim
    ends = ca.SX.sym("ends", dim * len(pair.frames))
    apart = ca.densify(pair.apart(*(end.T for end in ca.vertsplit(ends, dim))))
    return RowFunction(
        ca.Function("apart", [ends, arguments.symbols], [apart], ["ends", PARAMETERS], ["apart"]), DISTANCES_AT_ONCE
    )


BOUNDS_AT_ONCE = 1_000_000  # cells times pairs
CACHED_ROBOTS = 32
POSTURES_AT_ONCE = 128


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
        """The pairs that may meet."""
        return self.known.pairs

    @cached_property
    def turning(self) -> Trajectory:
        """The angles over time whose rates bound how the pairs move."""
        return _turning(self.known.rates[0], self.trajectory)

    @cached_property
    def sharpest(self) -> FloatArray:
        """The largest second derivatives of these angles over all t, (m,), rad/s^2; on both sides of jumps."""
        just_before = np.nextafter(self.trajectory.breakpoints[1:], 0.0)
        times = np.concatenate([self.turning.extreme_times(2), just_before])
        return np.asarray(np.abs(self.turning.at(times, 2)).max(axis=0))

    def places(self, times: FloatArray) -> FloatArray:
        """Positions of the robot's frames at times (n,) in s: (frames, n, dim), m."""
        robot = self.known.robot
        columns = _places(robot)(np.ascontiguousarray(self.trajectory.at(times).T))
        return columns.reshape(-1, robot.dim, len(times)).transpose(0, 2, 1)

    def distance(self, number: int, time: float) -> float:
        """The distance of one pair at a time in s, exact to rounding, m."""
        pair, places = self.pairs[number], self.places(np.array([time]))
        positions = [ca.DM()] * len(places)
        for frame in pair.frames:
            positions[frame] = ca.DM(places[frame])
        return pair.distance(positions, ca.DM(time))

    def around_middles(
        self, cells: FloatArray, chosen: NDArray[np.bool_]
    ) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        """Clearances of pairs in the middles of cells, and bounds of them all through.

        Args:
            cells: start and end of each, (n, 2), s.
            chosen: which pairs are evaluated in each, (n, pairs), or (n, 1) for all or none.

        Returns:
            The smallest clearance in the middle and its pair, both (n,); a lower bound of the clearance of each pair
            all through, (n, pairs), infinite of the others; m.
        """
        size = max(1, BOUNDS_AT_ONCE // len(self.pairs))
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
            if group.first.is_time_dependent:
                moves[:, group.members] += group.first.link_travel(self.known.robot, cells)[:, None]
        return moves

    def clearances(self, times: FloatArray, chosen: NDArray[np.bool_]) -> FloatArray:
        """Clearances of chosen pairs at times (n,) in s, (n, pairs), m; infinite of the others."""
        places, clearances = self.places(times), np.full(chosen.shape, np.inf)
        for group in self.known.groups:
            rows, which = np.nonzero(chosen[:, group.members])
            if rows.size:
                members = group.members[which]
                distances = group.distances(times, rows, [places[frame, rows] for frame in group.frames[which].T])
                clearances[rows, members] = distances - self.known.thickness[members]
        return clearances


@lru_cache(maxsize=CACHED_ROBOTS)
def _places(robot: Robot) -> RowFunction:
    """The function from a posture (dof,) to the positions of all frames, (frames * dim,), m."""
    theta = ca.SX.sym("theta", robot.dof)
    places = [ca.densify(place.T) for place in robot.positions(theta.T)]
    return RowFunction(ca.Function("places", [theta], [ca.vertcat(*places)]), POSTURES_AT_ONCE)


INITIAL_CELLS = {2: 400, 3: 100}  # in the plane, and in space, where there are many pairs and most are far apart
MOST_CELLS = 200_000


@dataclass(frozen=True)
class ClearanceProof:
    """Bounds of the clearance of a whole motion.

    Attributes:
        proven: the clearance of all pairs that could meet is at least this for all t, m; -inf when it is below the
            margin somewhere, or when as many cells as there may be were not enough.
        smallest: the smallest clearance at any time that was evaluated, m.
        time: at which it occurs, s.
        where: the pair that comes so near.
        broken: whether the distance itself is below the margin then, not only a lower bound of it.
        cell: start and end of one, s, in which it could not be decided; None where there is none, and where what is
            too near at that time is maybe not the body itself.
    """

    proven: float
    smallest: float
    time: float
    where: str
    broken: bool
    cell: tuple[float, float] | None = None

    @property
    def status(self) -> CertificateStatus:
        """The outcome: clear for all t, too near at some time, or undecided."""
        if self.proven > -np.inf:
            return CertificateStatus.CERTIFIED
        return CertificateStatus.VIOLATED if self.broken else CertificateStatus.UNDECIDED


def prove_clearance(
    limit: Proximity,
    trajectory: Trajectory,
    gap: float = Proximity.proof_gap,
    initial_cells: int | None = None,
    most_cells: int = MOST_CELLS,
    tell_broken: bool = True,
) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t, of all pairs of a limit; None when none of them can touch.

    Args:
        limit: on distances.
        trajectory: of the robot.
        gap: by which share of the smallest clearance seen beyond the margin the proven one may be smaller.
        initial_cells: of time, at least; as many as usual where None.
        most_cells: that are bounded; it is undecided where that is not enough.
        tell_broken: whether the distance itself is computed where a lower bound of it is below the margin.
    """
    robot, margin, pairs = limit.robot, limit.robot.margin, limit.pairs
    if not any(pair.can_touch(robot) for pair in pairs):
        return None
    motion = MovingPairs.of(robot, pairs, trajectory)
    edges = trajectory.times(initial_cells or INITIAL_CELLS[robot.dim])
    cells = np.column_stack([edges[:-1], edges[1:]])
    unsettled = np.ones((len(cells), len(pairs)), dtype=bool)
    minima: list[tuple[float, float, int]] = []
    cell_count = 0
    while True:
        nearest, column, low = motion.around_middles(cells, unsettled)
        cell = int(np.argmin(nearest))
        minima.append((float(nearest[cell]), float(cells[cell].mean()), int(column[cell])))
        (smallest, time, number), cell_count = min(minima), cell_count + len(cells)
        proven = margin + (smallest - margin) * (1.0 - gap)
        unsettled = low < proven
        left = np.asarray(unsettled.any(axis=1))
        cells, unsettled = halves(cells[left]), np.tile(unsettled[left] if robot.dim > 2 else left[left, None], (2, 1))
        if not len(cells) and smallest >= margin:
            return ClearanceProof(proven, smallest, time, str(pairs[number]), broken=False)
        if smallest < margin or cell_count + len(cells) > most_cells:
            broken = tell_broken and smallest < margin and motion.distance(number, time) < margin
            first = (float(cells[0, 0]), float(cells[0, 1])) if len(cells) and smallest >= margin else None
            return ClearanceProof(-np.inf, smallest, time, str(pairs[number]), broken, first)


DISTANCE_ROUNDING = 1e-9  # m


@dataclass(frozen=True)
class ClosestApproach:
    """The smallest distance of a motion.

    Attributes:
        distance: between the surfaces, m; not positive where they touch.
        time: at which it occurs, s.
        pair: that comes so near.
    """

    distance: float
    time: float
    pair: str


def closest_approach(
    limit: Proximity, trajectory: Trajectory, settings: ApproachSettings = DEFAULT_APPROACH
) -> ClosestApproach | None:
    """The closest approach of all pairs of a limit, found at many times and followed from there to about 1e-6 m.

    Obstacles that move are where they are predicted. This is no proof: :func:`prove_clearance` gives a lower bound.

    Args:
        limit: on distances, from obstacles or of the robot's own bodies.
        trajectory: of the robot.
        settings: of the search.

    Returns:
        None where there are no pairs.
    """
    if not limit.pairs:
        return None
    motion = MovingPairs.of(limit.robot, tuple(pair.without_growth() for pair in limit.pairs), trajectory)
    times = trajectory.times(settings.times)
    seen = motion.clearances(times, np.ones((len(times), len(motion.pairs)), dtype=bool))
    rows, numbers = np.array(_dips(seen, settings)).T
    spans = _around(np.broadcast_to(times, (len(rows), len(times))), rows)
    followed = _followed(motion, numbers, spans, settings)
    distance, time, number, row = min(
        (motion.distance(number, time), time, number, row)
        for number, row, time in zip(numbers.tolist(), rows.tolist(), followed.tolist(), strict=True)
    )
    before = motion.distance(number, float(times[row]))
    if distance >= before - DISTANCE_ROUNDING:  # as of a robot that stands: the first time
        distance, time = before, float(times[row])
    return ClosestApproach(distance, time, str(motion.pairs[number]))


def _dips(distances: FloatArray, settings: ApproachSettings) -> list[tuple[int, int]]:
    """Rows and pairs of the deepest minima over rows, of distances (n, pairs): few of each pair, one at least."""
    around = np.pad(distances, ((1, 1), (0, 0)), constant_values=np.inf)
    rows, numbers = np.nonzero((distances < around[:-2]) & (distances <= around[2:]))
    counts: Counter[int] = Counter()
    dips = []
    for k in np.argsort(distances[rows, numbers], kind="stable"):
        counts[int(numbers[k])] += 1
        if counts[int(numbers[k])] <= settings.minima_per_pair:
            dips.append((int(rows[k]), int(numbers[k])))
    return dips[: settings.candidates]


def _around(times: FloatArray, rows: NDArray[np.intp]) -> FloatArray:
    """The times before and after one of each row of times (k, n), the numbers of which are given, (k, 2), s."""
    sides = np.clip(rows[:, None] + np.array([-1, 1]), 0, times.shape[1] - 1)
    return np.take_along_axis(times, sides, axis=1)


def _followed(
    motion: MovingPairs, numbers: NDArray[np.intp], spans: FloatArray, settings: ApproachSettings
) -> FloatArray:
    """The times (k,), s, at which pairs (k,) are nearest within spans (k, 2), s, by passes over ever shorter ones."""
    chosen = np.repeat(numbers[:, None] == np.arange(len(motion.pairs)), settings.zoom_points, axis=0)
    for _ in range(settings.zooms):
        times = np.linspace(spans[:, 0], spans[:, 1], settings.zoom_points, axis=1)
        nearest = motion.clearances(times.ravel(), chosen).min(axis=1).reshape(times.shape).argmin(axis=1)
        spans = _around(times, nearest)
    return np.take_along_axis(times, nearest[:, None], axis=1)[:, 0]
