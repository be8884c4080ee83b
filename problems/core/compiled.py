"""The compiled core, called by ctypes: arrays in, arrays out."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from ctypes import CDLL, c_double, c_void_p, cast
from functools import cache as once
from typing import Any

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.answers import Answers
from problems.core.asked import AskedSolids
from problems.core.description import RobotNumbers, described
from problems.core.interface import MovingSolids, Nearby, PathSearch, ProofRequest, ProofResult, Separation
from problems.core.rows import ProgramData, WholeRows
from problems.core.segments import Guards, SegmentCells, SegmentMotion, Stops
from problems.library import IS_CLEAR, loaded_core, needed_core
from problems.robots import NEWTON, Bounds, FoundPostures, JointTurns, Poses, SpatialArm, Steps

MOST_STOPS = 1_000  # postures of a way for which there is room at first
MOST_INVERSE = 100_000  # postures that reach poses, for which there is room at a time


class Core:
    """The compiled core, called with arrays.

    Args:
        library: the core as a library.
    """

    def __init__(self, library: CDLL) -> None:
        self.library = library

    def world(self, counts: NDArray[np.int64], numbers: FloatArray, asked: AskedSolids | None = None) -> CoreWorld:
        """The world of a description, and of solids that are asked."""
        return CoreWorld(self.library, counts, numbers, asked)

    def steps(self, geometry: SpatialArm) -> CoreSteps:
        """Damped Newton steps of an arm, of which nothing counts but its tool's place."""
        return CoreSteps(self.library, geometry)

    def solve_program(self, program: ProgramData) -> tuple[FloatArray, float] | None:
        """The solution of a program, control points (n, k) and tau; None where nothing was found."""
        n, k = program.lower.shape
        x, tau = np.empty((n, k)), np.empty(1)
        one, reach = program.single, program.single.weights.shape[1]
        squares = WholeRows.none(reach, k) if program.squares is None else program.squares
        single: list[NDArray[Any]] = [
            *_whole_numbers(one.joint, one.first),
            *_numbers(one.weights, one.by_time, one.bound),
        ]
        whole, squared = map(_parts, (program.whole, squares))
        box = _numbers(program.lower, program.upper, *(() if program.cost is None else (program.cost,)))
        steps = self.library.core_program(
            reach, k, n, len(one.bound), *(part.ctypes.data for part in single),
            len(program.whole.bound), *(part.ctypes.data for part in whole),
            len(squares.bound), *(part.ctypes.data for part in squared), *(part.ctypes.data for part in box),
            *((None,) if program.cost is None else ()), program.time_cost, *program.times, x.ctypes.data,
            tau.ctypes.data,
        )  # fmt: skip
        return (x, float(tau[0])) if steps > 0 else None

    def connect_asking(
        self, start: FloatArray, goal: FloatArray, search: PathSearch, clear: Callable[[FloatArray, FloatArray], bool]
    ) -> FloatArray:
        """A path as of :meth:`CoreWorld.connect`, among surroundings that the core does not know.

        Args:
            start: (dof,), rad.
            goal: likewise.
            search: its settings; of an edge's step, extra margin, drifts, schedule and errors the core makes no use.
            clear: whether the straight way from one posture (dof,) to another is, the first of them excluded.
        """
        dof, answers = len(start), Answers()

        def is_clear(origin: int, end: int) -> int:
            ends = (np.ctypeslib.as_array((c_double * dof).from_address(each)) for each in (origin, end))
            return int(answers.attempted(lambda: clear(*ends), False))

        numbers = np.ascontiguousarray(np.stack([start, goal, *search.box]), dtype=np.float64)
        path, (begin, end, low, high) = np.empty((MOST_STOPS, dof)), (row.ctypes.data for row in numbers)
        count = self.library.core_connect_asking(
            dof, begin, end, low, high, search.reach, search.extensions, search.shortcuts, search.seed,
            IS_CLEAR(is_clear), MOST_STOPS, path.ctypes.data,
        )  # fmt: skip
        answers.check()
        return path[: count if count <= MOST_STOPS else 0].copy()

    def pass_through(
        self, stops: Stops, cells: SegmentCells, guards: Guards, start: SegmentMotion
    ) -> tuple[SegmentMotion, bool]:
        """The motion of least time through places, from another one, and whether it is a solution."""
        segments, joints = len(stops.places) - 1, stops.places.shape[1]
        given = _numbers(stops.places, stops.limits, stops.ends, stops.turns)
        rows: list[NDArray[Any]] = [
            *_whole_numbers(cells.orders, cells.first),
            *_numbers(cells.weights, cells.bends, cells.ranges),
        ]
        guarded: list[NDArray[Any]] = [
            *_whole_numbers(guards.segments, guards.first),
            *_numbers(guards.slopes, guards.by_log_duration, guards.least),
        ]
        found = SegmentMotion(*(np.array(part, dtype=np.float64, order="C") for part in start))
        solved = self.library.core_through(
            len(stops.limits), segments, joints, *(part.ctypes.data for part in given), cells.count, stops.price,
            len(cells.orders), *(part.ctypes.data for part in rows), len(guards.least),
            *(part.ctypes.data for part in guarded), *(part.ctypes.data for part in found),
        )  # fmt: skip
        return found, bool(solved)


@once
def found_core() -> Core | None:
    """The core of this process; None where there is none, and no compiler to make it."""
    library = loaded_core().library
    return None if library is None else Core(library)


def core() -> Core:
    """The core of this process.

    Raises:
        NoCore: there is none; the message says why, and how to get it.
    """
    return found_core() or Core(needed_core())


def _parts(rows: WholeRows) -> list[NDArray[Any]]:
    """The arrays of rows of all joints, as the core reads them."""
    return [*_whole_numbers(rows.first), *_numbers(rows.weights, rows.by_time, rows.bound, rows.price)]


def _whole_numbers(*parts: NDArray[Any]) -> list[NDArray[np.int32]]:
    return [np.ascontiguousarray(part, dtype=np.int32) for part in parts]


def _numbers(*parts: FloatArray) -> list[FloatArray]:
    return [np.ascontiguousarray(part, dtype=np.float64) for part in parts]


def _handle_of(
    owner: object, library: CDLL, counts: NDArray[np.int64], numbers: FloatArray, asked: AskedSolids | None = None
) -> c_void_p:
    """The core's object for a description, released together with its owner."""
    functions = (None, None) if asked is None else tuple(cast(each, c_void_p) for each in asked.functions)
    known = c_void_p(library.core_world(counts.ctypes.data, numbers.ctypes.data, *functions))
    weakref.finalize(owner, library.core_forget, known)
    return known


def _place(numbers: NDArray[Any] | None) -> int | None:
    """The address of numbers in memory."""
    return None if numbers is None else int(numbers.ctypes.data)


def _at(moving: MovingSolids | None) -> tuple[int | None, int | None]:
    """The addresses of drifts and times."""
    return (None, None) if moving is None else (_place(moving.drifts), _place(moving.times))


class CoreWorld:
    """A robot among solids in the compiled core.

    Args:
        library: the core.
        counts: of a description.
        numbers: of the same.
        asked: the solids that are not in it; None where all are.
    """

    def __init__(
        self, library: CDLL, counts: NDArray[np.int64], numbers: FloatArray, asked: AskedSolids | None = None
    ) -> None:
        self._library, self._asked = library, asked
        self._world = _handle_of(self, library, counts, numbers, asked)
        self._dof = int(counts[0])

    def _answered(self) -> None:
        """Raise what a formula of a solid has raised."""
        if self._asked is not None:
            self._asked.answers.check()

    def lower_to_clearance_margins(
        self,
        theta: FloatArray,
        found: FloatArray,
        which: Separation,
        first_hit: bool,
        moving: MovingSolids | None = None,
        errors: FloatArray | None = None,
    ) -> None:
        """Lower numbers (n,), m, to the clearance margins of postures (n, dof), rad.

        Args:
            theta: postures.
            found: what is replaced.
            which: what has to keep a distance.
            first_hit: whether less than what was there is enough, however much less.
            moving: how solids move; None where they stand still.
            errors: how far joints may be off, (n, dof), rad or m; None where they are not.
        """
        self._library.core_rooms(
            self._world, which, first_hit, len(theta), theta.ctypes.data, *_at(moving), _place(errors),
            found.ctypes.data,
        )  # fmt: skip
        self._answered()

    def nearest(
        self,
        theta: FloatArray,
        below: float,
        which: Separation,
        moving: MovingSolids | None = None,
        errors: FloatArray | None = None,
    ) -> Nearby:
        """The two nearest balls of each link and each solid, and of each two links, with margins below a bound, m."""
        capacity = 16 * len(theta)
        while True:
            places, values = np.empty((capacity, 2), dtype=np.int32), np.empty((capacity, 2 + self._dof))
            count = self._library.core_nearest(
                self._world, which, below, len(theta), theta.ctypes.data, *_at(moving), _place(errors), capacity,
                places.ctypes.data, values.ctypes.data,
            )  # fmt: skip
            self._answered()
            if count <= capacity:
                margins, rates, gradients = values[:count, 0], values[:count, 1], values[:count, 2:]
                return Nearby(places[:count, 0], places[:count, 1] == 1, margins, rates, gradients)
            capacity = count

    def closest(
        self,
        theta: FloatArray,
        which: Separation,
        moving: MovingSolids | None = None,
        errors: FloatArray | None = None,
    ) -> tuple[NDArray[np.int32], FloatArray]:
        """The pairs that are nearest of all in postures (n, dof), rad.

        Returns:
            Node, solid or other node, and kind, (n, 3), the first negative where there is nothing; the clearance margin
            and the nearest points on both surfaces, (n, 7), m.
        """
        places, values = np.empty((len(theta), 3), dtype=np.int32), np.full((len(theta), 7), np.inf)
        self._library.core_closest(
            self._world, which, len(theta), theta.ctypes.data, *_at(moving), _place(errors), places.ctypes.data,
            values.ctypes.data,
        )  # fmt: skip
        self._answered()
        return places, values

    def prove(self, asked: ProofRequest) -> ProofResult:
        """Bound the clearance margin of a motion for all t."""
        values, places = np.empty(5), np.empty(3, dtype=np.int32)
        order, pieces, _ = asked.coefficients.shape
        drifts = _place(asked.drifts)
        status = self._library.core_prove(
            self._world, asked.which, asked.gap, asked.cells, asked.most_items, pieces, order,
            asked.breaks.ctypes.data, asked.coefficients.ctypes.data, drifts, asked.rounding, _place(asked.tracking),
            values.ctypes.data, places.ctypes.data,
        )  # fmt: skip
        self._answered()
        (proven, smallest, time, start, end), (one, two, kind) = values.tolist(), places.tolist()
        return ProofResult(int(status), proven, smallest, time, one, two, kind, start, end)

    def connect(self, start: FloatArray, goal: FloatArray, search: PathSearch) -> FloatArray:
        """A path between two postures (dof,), rad, by RRT-Connect and shortcuts, (m, dof); m = 0 if none is found."""
        numbers = np.ascontiguousarray(np.stack([start, goal, *search.box]), dtype=np.float64)
        path, width = np.empty((MOST_STOPS, self._dof)), 8 * self._dof
        first, passed = numbers.ctypes.data, None if search.schedule is None else search.schedule.numbers
        count = self._library.core_connect(
            self._world, first, first + width, first + 2 * width, first + 3 * width, search.step, search.extra_margin,
            search.reach, search.extensions, search.shortcuts, search.seed, _place(search.drifts),
            _place(passed), _place(search.errors), _place(search.turns), MOST_STOPS, path.ctypes.data,
        )  # fmt: skip
        self._answered()
        return path[: count if count <= MOST_STOPS else 0].copy()


class CoreSteps(Steps):
    """Damped Newton steps of an arm.

    Args:
        library: the core.
        geometry: an arm, of which nothing else counts.
    """

    def __init__(self, library: CDLL, geometry: SpatialArm) -> None:
        self._library = library
        self._arm = _handle_of(self, library, *described(geometry, RobotNumbers.of(geometry), ()))
        self._carrier, frame = geometry.chain.carrier, geometry.tool.frame
        turned = [float(part) for row in frame.rotation for part in row]
        self._tool = np.array([*turned, *map(float, frame.translation)])

    def __call__(
        self, theta: FloatArray, position: FloatArray, rotation: FloatArray | None, bounds: Bounds, steps: int
    ) -> tuple[FloatArray, FloatArray]:
        """The postures that steps from (n, dof) lead to, and what each lacks, m and rad together, (n,)."""
        found = np.array(theta, dtype=np.float64, order="C")
        missing = np.empty(len(found))
        target = [np.ascontiguousarray(part, dtype=np.float64) for part in (position, *bounds)]
        turn = np.zeros(9) if rotation is None else np.ascontiguousarray(rotation, dtype=np.float64)
        place, low, high = (part.ctypes.data for part in target)
        self._library.core_reach(
            self._arm, self._carrier, self._tool.ctypes.data, place, turn.ctypes.data, rotation is not None, low, high,
            steps, len(found), found.ctypes.data, missing.ctypes.data,
        )  # fmt: skip
        return found, missing

    def inverse(self, poses: Poses, starts: FloatArray, turns: JointTurns, near: FloatArray) -> FoundPostures:
        """The postures that reach poses, of some poses at a time: there is room for all that could be."""
        room = max(1, MOST_INVERSE // max(1, len(starts)))
        parts = [self._inverse(poses.part(slice(k, k + room)), starts, turns, near) for k in range(0, len(poses), room)]
        return FoundPostures(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _inverse(self, poses: Poses, starts: FloatArray, turns: JointTurns, near: FloatArray) -> FoundPostures:
        numbers = _numbers(*poses.arrays, turns.low, turns.high, near, starts)
        *given, low, high, middle, begun = (part.ctypes.data for part in numbers)
        (winding,) = _whole_numbers(turns.winding)
        counts = np.empty(len(poses), dtype=np.int32)
        most = len(poses) * len(starts)
        found = np.empty((most, starts.shape[1] + 1))
        count = self._library.core_inverse(
            self._arm, self._carrier, self._tool.ctypes.data, len(poses), *given, *[None] * (2 - len(given)),
            low, high, winding.ctypes.data, middle, len(starts), begun, NEWTON.steps, NEWTON.tolerance,
            NEWTON.least_difference, most, counts.ctypes.data, found.ctypes.data,
        )  # fmt: skip
        return FoundPostures(found[:count, :-1].copy(), counts, found[:count, -1].copy())
