"""The motion of an obstacle by rows of time, position and orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from math import factorial
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import (
    ANGLES,
    COORDINATES,
    TIMES,
    BSpline,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    PiecewisePolynomial,
    bernstein,
    check_within,
    columns,
    is_of_length_one,
    rotation_of,
)
from problems.scene.moving import ObstacleMotion
from problems.scene.obstacle import Frames


def piecewise(times: Matrix, breaks: Sequence[Operand], pieces: Sequence[Sequence[Operand]]) -> Matrix:
    """A continuous piecewise polynomial; before its first break and after its last it keeps its value there.

    Args:
        times: at which it is evaluated, (n, 1), s.
        breaks: p + 1, increasing, s.
        pieces: p times coefficients, highest power first; each piece starts its own time at 0.

    Returns:
        (n, 1).
    """
    value: Matrix = pieces[0][-1] + 0.0 * times
    for start, end, coefficients in zip(breaks[:-1], breaks[1:], pieces, strict=True):
        since = ca.fmin(ca.fmax(times - start, 0.0), end - start)
        *high, _ = coefficients
        value = value + since * reduce(lambda sum_, coefficient: sum_ * since + coefficient, high)
    return value


LEAST_STEP = 1e-6  # s, from one row to the next
LEAST_COSINE = 0.7  # between the quaternions of two rows: a turn of 90 degrees; farther, a spline of them is no turn


def first_fault(times: Sequence[float], positions: FloatArray, turns: FloatArray | None) -> tuple[int, str] | None:
    """The number of the first row that cannot be, from 0, and why; None where all can.

    Args:
        times: s, (n,).
        positions: (n, dim), m.
        turns: (n, 1), rad, in the plane, (n, 4), x, y, z, w, in space; None where nothing turns.
    """
    for number, time in enumerate(times):
        if not abs(time) <= TIMES[1]:
            return number, f"t = {time:g} s is not within {-TIMES[1]:g} and {TIMES[1]:g} s"
        if number and not time - times[number - 1] >= LEAST_STEP:
            return number, f"times have to increase, by {LEAST_STEP:g} s at least"
        reason = _outside(positions[number], COORDINATES, "m")
        if not reason and turns is not None:
            reason = _turn_fault(turns, number)
        if reason:
            return number, reason
    return None


def _outside(values: FloatArray, bounds: tuple[float, float], unit: str) -> str:
    try:
        check_within("", values.tolist(), bounds, unit)
    except InvalidProblem as error:
        return error.reason
    return ""


def _turn_fault(turns: FloatArray, number: int) -> str:
    """The fault of a row's turn in words; empty where there is none."""
    turn = turns[number]
    if turn.size == 1:
        return _outside(turn, ANGLES, "rad")
    if not is_of_length_one(turn):
        return f"quaternion of length {np.linalg.norm(turn):.6g}, not 1"
    if number and abs(float(_unit(turn) @ _unit(turns[number - 1]))) < LEAST_COSINE:
        return "turned by more than 90 degrees from the row before; more rows are needed"
    return ""


def _unit(quaternion: FloatArray) -> FloatArray:
    return np.asarray(quaternion / np.linalg.norm(quaternion))


def as_numbers(turns: FloatArray) -> FloatArray:
    """The numbers through which a spline runs: angles, or quaternions of length 1, each near the one before."""
    if turns.shape[1] == 1:
        return turns
    units = turns / np.linalg.norm(turns, axis=1, keepdims=True)
    cosines = (units[1:] * units[:-1]).sum(axis=1)
    return np.asarray(units * np.cumprod(np.append(1.0, np.where(cosines < 0.0, -1.0, 1.0)))[:, None])


def _columns(times: Any, positions: Any, turns: Any) -> tuple[list[float], FloatArray, FloatArray | None]:
    """The columns of a table of motion, each with as many rows, two at least.

    Raises:
        InvalidProblem: they are no numbers, of other shapes, or a row is at fault.
    """
    try:
        stated = np.asarray(times, dtype=np.float64)
        places = np.asarray(positions, dtype=np.float64)
        angles = None if turns is None else np.asarray(turns, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidProblem("motion", f"numbers are needed: {error}") from error
    width = {2: 1, 3: 4}.get(places.shape[-1] if places.ndim == 2 else 0)
    if stated.ndim != 1 or places.shape[:1] != stated.shape or width is None:
        raise InvalidProblem("motion", "times (n,) and positions (n, 2) or (n, 3) are needed")
    if angles is not None and angles.shape != (len(stated), width):
        raise InvalidProblem("motion", f"turns of the shape {(len(stated), width)} are needed, not {angles.shape}")
    if len(stated) < 2:
        raise InvalidProblem("motion", "two rows at least are needed")
    fault = first_fault(stated.tolist(), places, angles)
    if fault is not None:
        raise InvalidProblem("motion", f"row {fault[0] + 1}: {fault[1]}")
    return stated.tolist(), places, angles


POWERS = 4  # coefficients of a piece


@dataclass(frozen=True)
class Tabulated(ObstacleMotion):
    """A frame on a cubic spline; before the first time and after the last it stands still.

    A turn is an angle in the plane; in space it is a quaternion whose four components are splines, and whose length
    does not count.

    Args:
        breaks: p + 1 increasing times, s.
        pieces: of each of the coordinates, then of the numbers of the turn: p times four coefficients, highest power
            first, each piece with a time of its own from 0; m, rad, quaternions x, y, z, w.
        coordinates: 2 in the plane, 3 in space.
    """

    numbers: ClassVar[tuple[str, ...]] = ("breaks", "pieces")

    breaks: tuple[float, ...]
    pieces: tuple[tuple[tuple[float, ...], ...], ...]
    coordinates: int

    @classmethod
    def through(cls, times: Sequence[float], positions: FloatArray, turns: FloatArray | None = None) -> Self:
        """A frame on a spline through the rows of a table.

        Args:
            times: s, increasing, two at least.
            positions: (n, dim), m.
            turns: (n, 1), rad, in the plane, (n, 4), x, y, z, w, in space; None where the frame does not turn.

        Raises:
            InvalidProblem: times do not increase, a number is out of range, a quaternion is not of length 1, two rows
                are turned by more than 90 degrees from each other, or the frame moves too fast in between.
        """
        times, positions, turns = _columns(times, positions, turns)
        values = positions if turns is None else np.hstack([positions, as_numbers(turns)])
        rows, degree = np.array(times, dtype=np.float64), min(POWERS - 1, len(times) - 1)
        first, last = np.full((2, degree + 1), rows[[0, -1], None])  # no knots at the rows next to the ends
        spline = BSpline.through(np.concatenate([first, rows[2:-2], last]), rows, values, degree)
        coefficients = np.zeros((POWERS, len(times) - 1, values.shape[1]))
        for order in range(degree + 1):
            coefficients[-1 - order] = spline(rows[:-1], order) / factorial(order)
        pieces = tuple(tuple(map(tuple, each)) for each in coefficients.transpose(2, 1, 0).tolist())
        motion = cls(tuple(float(time) for time in times), pieces, positions.shape[1])
        if motion.dim == 3 and motion.turns and motion._least_length < LEAST_COSINE / 2.0:
            raise InvalidProblem("motion", "rows are turned too far from each other; more rows are needed")
        fastest = np.maximum(*motion._bounds)
        if fastest.max() > COORDINATES[1]:
            row, most = int(fastest.argmax()) + 2, COORDINATES[1]
            raise InvalidProblem("motion", f"row {row}: faster than {most:g} m/s or rad/s from the row before")
        return motion

    @classmethod
    def along_lines(cls, times: Sequence[float], positions: FloatArray) -> Self:
        """A frame on straight lines from row to row without a turn; its velocity jumps at each row.

        Args:
            times: s, increasing, two at least.
            positions: (n, dim), m.

        Raises:
            InvalidProblem: they are no table of numbers, or times do not increase.
        """
        times, positions, _ = _columns(times, positions, None)
        rates = np.diff(positions, axis=0) / np.diff(times)[:, None]
        zeros = np.zeros_like(rates)
        coefficients = np.stack([zeros, zeros, rates, positions[:-1]], axis=-1)  # (p, dim, POWERS)
        pieces = tuple(tuple(map(tuple, each)) for each in coefficients.transpose(1, 0, 2).tolist())
        return cls(tuple(float(time) for time in times), pieces, positions.shape[1])

    @property
    def dim(self) -> int:
        return self.coordinates

    @property
    def turns(self) -> bool:
        """Whether the frame turns."""
        return len(self.pieces) > self.dim

    def _values(self, times: Matrix) -> list[Matrix]:
        """Coordinates and turn at times (n, 1), each (n, 1); expressions of symbols are made once."""
        if not isinstance(times, ca.SX):
            return [piecewise(times, self.breaks, pieces) for pieces in self.pieces]
        each = [self._values_at(time) for time in ca.vertsplit(ca.densify(times))]
        return [ca.vertcat(*values) for values in zip(*each, strict=True)]

    def _values_at(self, time: ca.SX) -> list[Matrix]:
        known = self._written.get(time.element_hash())
        if known is None:
            known = time, [piecewise(time, self.breaks, pieces) for pieces in self.pieces]
            self._written[time.element_hash()] = known
        return known[1]

    @cached_property
    def _written(self) -> dict[int, tuple[ca.SX, list[Matrix]]]:
        """Symbolic times by their identity, each with the values then."""
        return {}

    def seen(self, points: Matrix, times: Matrix) -> Matrix:
        values = self._values(times)
        away = [column - place for column, place in zip(columns(points), values[: self.dim], strict=True)]
        return ca.horzcat(*(turned_back(away, values[self.dim :]) if self.turns else away))

    def frames(self, times: FloatArray) -> Frames:
        values = self._spline(np.clip(times, self.breaks[0], self.breaks[-1]))
        return Frames(values[:, : self.dim], axes_of(values[:, self.dim :]) if self.turns else None)

    @cached_property
    def _spline(self) -> PiecewisePolynomial:
        return PiecewisePolynomial(np.array(self.pieces).transpose(2, 1, 0), np.array(self.breaks))

    @cached_property
    def _bounds(self) -> FloatArray:
        """Upper bounds of speeds and accelerations, of origin and turning, in each piece: (2, p, 2); see ``_sizes``."""
        lengths = np.diff(self.breaks)
        curves = [bernstein(np.asarray(self._spline.derivative(order).c), lengths) for order in (1, 2)]
        return np.stack([self._sizes(np.abs(curve).max(axis=0)) for curve in curves])

    def _sizes(self, derivatives: FloatArray) -> FloatArray:
        """The largest speeds of the origin, m/s, and of turning, rad/s: (n, 2); of derivatives (n, c)."""
        origin, turn = (
            np.linalg.norm(part, axis=1) for part in (derivatives[:, : self.dim], derivatives[:, self.dim :])
        )
        if self.turns and self.dim == 3:
            turn = 2.0 * turn / self._least_length  # a unit quaternion moves half as fast as what it turns
        return np.column_stack([origin, turn])

    @cached_property
    def _least_length(self) -> float:
        """A lower bound of the quaternion's length over all times, by its component along the nearest row."""
        curves = bernstein(np.asarray(self._spline.c), np.diff(self.breaks))[..., self.dim :]
        middle = curves.mean(axis=0)
        along = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), np.finfo(float).tiny)
        return float(np.einsum("nps,ps->np", curves, along).min())

    def travel(self, cells: FloatArray, extent: float) -> FloatArray:
        """Half a cell at the largest speed of all pieces that it meets; within one piece, what is less than that.

        There the speed in the middle and the largest acceleration bound the way: ``|v| h / 2 + max |a| h^2 / 8``.
        """
        middles, h, lever = cells.mean(axis=1), cells[:, 1] - cells[:, 0], np.array([1.0, extent])
        speeds, accelerations = (np.pad(bounds @ lever, 1) for bounds in self._bounds)  # it stands still outside
        first = np.searchsorted(self.breaks, cells[:, 0], side="right")
        last = np.maximum(first, np.searchsorted(self.breaks, cells[:, 1], side="left"))
        spans = np.column_stack([first, last + 1]).ravel()
        coarse = np.maximum.reduceat(np.append(speeds, 0.0), spans)[::2] * h / 2.0
        now = np.where(speeds[first] > 0.0, self._sizes(self._spline(middles, 1)) @ lever, 0.0)
        return np.where(first == last, np.minimum(coarse, now * h / 2.0 + accelerations[first] * h**2 / 8.0), coarse)

    def offset(self, first: float, last: float) -> float:
        curves = bernstein(np.asarray(self._spline.c), np.diff(self.breaks))[..., : self.dim]
        return float(np.linalg.norm(np.abs(curves).max(axis=(0, 1))))

    def quiet_after(self, around: float) -> float:
        return max(0.0, self.breaks[-1])

    def later(self, seconds: float) -> Self:
        return replace(self, breaks=tuple(time - seconds for time in self.breaks))

    def during(self, first: float, last: float) -> Self:
        most = len(self.breaks) - 2
        low = min(max(int(np.searchsorted(self.breaks, first, side="right")) - 1, 0), most)
        high = min(max(int(np.searchsorted(self.breaks, last, side="left")), low + 1), most + 1)
        pieces = tuple(rows[low:high] for rows in self.pieces)
        return replace(self, breaks=self.breaks[low : high + 1], pieces=pieces)


def turned_back(away: Sequence[Matrix], turn: Sequence[Matrix]) -> list[Matrix]:
    """The coordinates of vectors as seen from a frame that is turned: by an angle, or by a quaternion of any length."""
    if len(turn) == 1:
        cosine, sine = ca.cos(turn[0]), ca.sin(turn[0])
        x, y = away
        return [cosine * x + sine * y, cosine * y - sine * x]
    u, v, t = away
    rotation = rotation_of(turn)
    return [u * rotation[0][axis] + v * rotation[1][axis] + t * rotation[2][axis] for axis in range(3)]


def axes_of(turns: FloatArray) -> FloatArray:
    """The axes of turned frames, one in each column, (n, dim, dim); angles (n, 1), or quaternions of any length."""
    if turns.shape[1] == 1:
        cosine, sine = np.cos(turns[:, 0]), np.sin(turns[:, 0])
        return np.moveaxis(np.array([[cosine, -sine], [sine, cosine]]), 2, 0)
    return np.array([rotation_of(turn) for turn in turns.tolist()], dtype=np.float64)
