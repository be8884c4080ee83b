"""Motion through the rows of a table, along a cubic spline, turning or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Self

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline, PPoly

from problems.base.bernstein import bernstein
from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, columns
from problems.base.ranges import COORDINATES
from problems.scene.moving.obstacle_motion import ObstacleMotion
from problems.scene.moving.piecewise import piecewise
from problems.scene.moving.rows import LEAST_COSINE, as_numbers, first_fault

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
        """Through the rows of a table.

        Args:
            times: s, increasing, two at least.
            positions: (n, dim), m.
            turns: (n, 1), rad, in the plane, (n, 4), x, y, z, w, in space; None where the frame does not turn.

        Raises:
            InvalidProblem: times do not increase, a number is out of range, a quaternion is not of length 1, two rows
                are turned by more than 90 degrees from each other, or the frame moves too fast in between.
        """
        if len(times) < 2:
            raise InvalidProblem("motion", "two rows at least are needed")
        fault = first_fault(times, positions, turns)
        if fault is not None:
            raise InvalidProblem("motion", f"row {fault[0] + 1}: {fault[1]}")
        values = positions if turns is None else np.hstack([positions, as_numbers(turns)])
        spline = CubicSpline(np.array(times, dtype=np.float64), values)
        coefficients = np.zeros((POWERS, len(times) - 1, values.shape[1]))
        coefficients[-len(spline.c) :] = spline.c
        pieces = tuple(tuple(map(tuple, rows)) for rows in coefficients.transpose(2, 1, 0).tolist())
        motion = cls(tuple(float(time) for time in times), pieces, positions.shape[1])
        if motion.dim == 3 and motion.turns and motion._least_length < LEAST_COSINE / 2.0:
            raise InvalidProblem("motion", "rows are turned too far from each other; more rows are needed")
        fastest = np.maximum(*motion._bounds)
        if fastest.max() > COORDINATES[1]:
            row, most = int(fastest.argmax()) + 2, COORDINATES[1]
            raise InvalidProblem("motion", f"row {row}: faster than {most:g} m/s or rad/s from the row before")
        return motion

    @property
    def dim(self) -> int:
        """That of the table."""
        return self.coordinates

    @property
    def turns(self) -> bool:
        """Whether the frame turns."""
        return len(self.pieces) > self.dim

    def _values(self, times: Matrix) -> list[Matrix]:
        """Coordinates and turn at times (n, 1), each (n, 1); of symbols each is written down once."""
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
        """By the identity of a symbolic time, which it keeps: that time, and the values then."""
        return {}

    def seen(self, points: Matrix, times: Matrix) -> Matrix:
        """Points less the frame's place, turned back."""
        values = self._values(times)
        away = [column - place for column, place in zip(columns(points), values[: self.dim], strict=True)]
        return ca.horzcat(*(turned_back(away, values[self.dim :]) if self.turns else away))

    def placed(self, points: FloatArray, time: float) -> FloatArray:
        """Points turned and moved to where the frame is."""
        origin, *units = (
            np.asarray(ca.DM(self.seen(ca.DM(point[None]), ca.DM(time))).full())[0]
            for point in (np.zeros(self.dim), *np.eye(self.dim))
        )
        axes = np.array([unit - origin for unit in units])  # of the world, as seen from the frame
        return np.asarray((points - origin) @ axes.T)

    @cached_property
    def _spline(self) -> PPoly:
        return PPoly(np.array(self.pieces).transpose(2, 1, 0), np.array(self.breaks))

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """In each piece, an upper bound of the speed of the origin, m/s, and of the turning, rad/s; (p,) each."""
        lengths = np.diff(self.breaks)
        rates = np.abs(bernstein(np.asarray(self._spline.derivative().c), lengths)).max(axis=0)
        speeds, turning = (np.linalg.norm(part, axis=1) for part in (rates[:, : self.dim], rates[:, self.dim :]))
        if self.dim == 3 and self.turns:
            turning = 2.0 * turning / self._least_length
        return speeds, turning

    @cached_property
    def _least_length(self) -> float:
        """A lower bound of the length of the quaternion over all times: by that of its part along the nearest row."""
        curves = bernstein(np.asarray(self._spline.c), np.diff(self.breaks))[..., self.dim :]
        middle = curves.mean(axis=0)
        along = middle / np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), np.finfo(float).tiny)
        return float(np.einsum("nps,ps->np", curves, along).min())

    def travel(self, cells: FloatArray, extent: float) -> FloatArray:
        """Half a cell at the largest speed of all pieces that it meets."""
        speeds, turning = self._bounds
        moving = np.concatenate([[0.0], speeds + (turning * extent if self.turns else 0.0), [0.0]])
        first = np.searchsorted(self.breaks, cells[:, 0], side="right")
        last = np.searchsorted(self.breaks, cells[:, 1], side="left")
        largest = np.array([moving[i : max(i, j) + 1].max() for i, j in zip(first, last, strict=True)])
        return np.asarray(largest * (cells[:, 1] - cells[:, 0]) / 2.0)

    def offset(self, first: float, last: float) -> float:
        """By the Bernstein coefficients of the whole table."""
        curves = bernstein(np.asarray(self._spline.c), np.diff(self.breaks))[..., : self.dim]
        return float(np.linalg.norm(np.abs(curves).max(axis=(0, 1))))

    def quiet_after(self, around: float) -> float:
        """The end of the table."""
        return max(0.0, self.breaks[-1])

    def later(self, seconds: float) -> Self:
        """The same table with earlier times."""
        return replace(self, breaks=tuple(time - seconds for time in self.breaks))


def turned_back(away: Sequence[Matrix], turn: Sequence[Matrix]) -> list[Matrix]:
    """The coordinates of vectors as seen from a frame that is turned: by an angle, or by a quaternion of any length."""
    if len(turn) == 1:
        cosine, sine = ca.cos(turn[0]), ca.sin(turn[0])
        x, y = away
        return [cosine * x + sine * y, cosine * y - sine * x]
    x, y, z, w = turn
    s = 2.0 / (x * x + y * y + z * z + w * w)
    u, v, t = away
    rotation = [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]
    return [u * rotation[0][axis] + v * rotation[1][axis] + t * rotation[2][axis] for axis in range(3)]
