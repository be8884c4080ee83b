"""Axes of the tool that leave it free to turn: about them, within a range, or leaning within a cone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, sin
from typing import Literal, Self, TypeAlias, get_args

import casadi as ca
import numpy as np

from problems.base import Angle, FloatArray, InvalidProblem, Matrix, as_array, check_within
from problems.robots import turned_by

AxisName: TypeAlias = Literal["x", "y", "z"]
TurnRange: TypeAlias = tuple[Angle, Angle]

WHOLE_TURN = 2.0 * pi
LEAST_TILT, MOST_TILT = 1e-6, 1.5  # rad
LEAST_SQUARE = 1e-60  # keeps a root's derivative finite


@dataclass(frozen=True, kw_only=True)
class FreeAxisSettings:
    """Settings of the turns and leans that are looked at.

    Values are chosen.

    Attributes:
        turn_step: rad, from one turn to the next.
        leans: directions in which the axis leans.
        lean_share: of the cone's angle, by which it does at most.
        lean_step: rad, at most, from one lean to the next.
    """

    turn_step: float = pi / 12.0
    leans: int = 6
    lean_share: float = 0.9
    lean_step: float = 0.5


SETTINGS = FreeAxisSettings()


@dataclass(frozen=True)
class DirectionBound:
    """A direction of the tool near one of a stated orientation.

    Attributes:
        axis: of the tool, 0 to 2.
        wanted: in the tool's frame as it is stated, of length 1.
        angle: largest angle between the two, rad.
    """

    axis: int
    wanted: tuple[float, float, float]
    angle: float

    def at(self, stated: Matrix, rotation: Matrix) -> tuple[Matrix, Matrix]:
        """The directions as they are and as they are stated, (n, 3) and (1 or n, 3), of rotations row by row."""
        wanted = sum((part * _direction(stated, axis) for axis, part in enumerate(self.wanted)), ca.DM(0.0))
        return _direction(rotation, self.axis), wanted


@dataclass(frozen=True)
class FreeAxis:
    """An axis of the tool that leaves it free to turn against a stated orientation.

    Turns, then leans, are those of the tool's own axes. A turn and two components of a lean, (3,), rad, are the
    coordinates of an orientation.

    Args:
        axis: of the tool's frame.
        turn: the least and the most turn about it, rad; None where any will do.
        tilt: how far the axis may lean, rad; any turn about it will do then.

    Raises:
        InvalidProblem: there is no such axis, a range is none, or both a range and a tilt are stated.
    """

    axis: AxisName
    turn: TurnRange | None = None
    tilt: float = 0.0

    def __post_init__(self) -> None:
        if self.axis not in get_args(AxisName):
            raise InvalidProblem("free", f"{self.axis!r} is no axis of the tool: x, y or z is needed")
        if self.turn is not None and self.tilt:
            raise InvalidProblem("tilt", "an axis that leans leaves the turn about it free; leave turn or tilt out")
        if self.turn is not None and not self.turn[0] < self.turn[1]:
            raise InvalidProblem("turn", f"{self.turn[0]:g} is not below {self.turn[1]:g}")

    def check(self) -> None:
        """Check that angles are of the size that they may have in rad.

        Raises:
            InvalidProblem: one is not.
        """
        if self.turn is not None:
            check_within("turn", self.turn, (-WHOLE_TURN, WHOLE_TURN), "rad")
            low, high = self.turn
            if high - low > WHOLE_TURN:
                raise InvalidProblem("turn", f"from {low:g} to {high:g} rad is beyond a whole turn; leave it out")
        if self.tilt:
            check_within("tilt", (self.tilt,), (LEAST_TILT, MOST_TILT), "rad")

    @classmethod
    def stated(cls, free: AxisName | None, turn: TurnRange | None, tilt: float) -> Self | None:
        """The free axis of three keys of a table; None where nothing is free.

        Raises:
            InvalidProblem: a turn or a tilt is stated, and not of which axis.
        """
        if free is not None:
            return cls(free, turn, tilt)
        if turn is not None or tilt:
            raise InvalidProblem("turn" if turn is not None else "tilt", "of which axis? say free = 'x', 'y' or 'z'")
        return None

    @property
    def index(self) -> int:
        """The number of the axis, 0 to 2."""
        return get_args(AxisName).index(self.axis)

    @property
    def _across(self) -> tuple[int, int]:
        """The numbers of the other axes, the first of which turns to the second."""
        return (self.index + 1) % 3, (self.index + 2) % 3

    @property
    def _middle(self) -> tuple[float, float]:
        """The middle of the range of turns and half of its width, rad."""
        low, high = (-pi, pi) if self.turn is None else self.turn
        return (low + high) / 2.0, (high - low) / 2.0

    @property
    def bounds(self) -> tuple[DirectionBound, ...]:
        """The bounds that are stated: the axis within a cone, and another one near the middle of a range of turns."""
        middle, half = self._middle
        own, beside = np.eye(3)[self.index], turned_by(middle * np.eye(3)[[self.index]])[0][:, self._across[0]]
        found = [DirectionBound(self.index, _three(own), self.tilt)]
        if self.turn is not None and half < pi:
            found.append(DirectionBound(self._across[0], _three(beside), half))
        return tuple(found)

    def misses(self, stated: Matrix, rotation: Matrix) -> Matrix:
        """Distances of rotations (n, 9), row by row, from what is free about a stated one (1, 9): (n, m), about rad."""
        parts = []
        for bound in self.bounds:
            found, wanted = bound.at(stated, rotation)
            chord = found - ca.repmat(wanted, rotation.shape[0], 1)
            size = ca.sqrt(ca.sum2(chord**2) + LEAST_SQUARE) - 2.0 * sin(bound.angle / 2.0)
            parts.append(ca.fmax(0.0, size) if bound.angle else chord)
        return ca.horzcat(*parts)

    def limits(self, stated: Matrix, rotation: Matrix, accuracy: float) -> list[tuple[ca.SX, tuple[float, ...]]]:
        """Smooth expressions of a rotation (1, 9) about a stated one, and what each value is at most.

        Args:
            stated: row by row.
            rotation: likewise.
            accuracy: of the axis where it does not lean, and what a range of turns is wider by at both ends, rad.
        """
        found: list[tuple[ca.SX, tuple[float, ...]]] = []
        for bound in self.bounds:
            one, other = bound.at(stated, rotation)
            angle = max(self.tilt, accuracy) if bound.axis == self.index else bound.angle + accuracy
            if angle >= pi:  # any direction will do
                continue
            cosine = ca.dot(one, other)
            if angle < pi / 2.0:
                found.append((ca.vertcat(ca.norm_2(ca.cross(one.T, other.T)), -cosine), (sin(angle), 0.0)))
            else:
                found.append((-cosine, (-cos(angle),)))
        return found

    def nearest(self, stated: Matrix, rotation: Matrix) -> Matrix:
        """The rotation next to one (3, 3) that is free about a stated one (3, 3)."""
        axis, wanted = rotation[:, self.index], stated[:, self.index]
        crossed = ca.cross(axis, wanted)
        sine = ca.sqrt(ca.sumsqr(crossed) + LEAST_SQUARE)
        angle = ca.atan2(sine, ca.dot(axis, wanted))
        upright = _about(crossed / sine, ca.fmax(0.0, angle - self.tilt)) @ rotation
        if self.turn is None:
            return upright
        middle, half = self._middle
        back = self._turn_between(stated, upright, middle)
        return _about(wanted, ca.fmin(half, ca.fmax(-half, back)) - back) @ upright

    def _turn_between(self, stated: Matrix, upright: Matrix, since: float = 0.0) -> Matrix:
        """The turn about the axis from a stated rotation, turned by an angle since, to an upright one, rad."""
        one, two = self._across
        seen = stated.T @ upright[:, one]
        x, y = cos(since) * seen[one] + sin(since) * seen[two], cos(since) * seen[two] - sin(since) * seen[one]
        angle: Matrix = ca.atan2(y, x)
        return angle

    def nearest_of(self, stated: FloatArray, rotations: FloatArray) -> FloatArray:
        """The rotations next to some (n, 3, 3) that are free about a stated one (3, 3)."""
        found = _nearest(self).map(len(rotations))(ca.repmat(ca.vec(stated), 1, len(rotations)), _columns(rotations))
        return as_array(found).T.reshape(-1, 3, 3).transpose(0, 2, 1)

    def taken(self, stated: FloatArray, rotation: FloatArray) -> tuple[float, float]:
        """The turn about the axis, and by how much it leans, rad, of a rotation (3, 3) against a stated one."""
        cosine = float(np.clip(rotation[:, self.index] @ stated[:, self.index], -1.0, 1.0))
        lean = float(np.linalg.norm(np.cross(rotation[:, self.index], stated[:, self.index])))
        upright, middle = FreeAxis(self.axis).nearest_of(stated, rotation[None])[0], self._middle[0]
        turn = middle + float(self._turn_between(ca.DM(stated), ca.DM(upright), middle))
        return turn, float(np.arctan2(lean, cosine))

    @property
    def grid(self) -> FloatArray:
        """Coordinates of orientations that are looked at, (n, 3); those as stated first, where that is free."""
        low, high = (-pi, pi) if self.turn is None else self.turn
        count = int(np.ceil((high - low) / SETTINGS.turn_step)) + 1
        turns = np.linspace(low, high, count)[: count - (self.turn is None)]
        leans = np.zeros((1, 2))
        most = SETTINGS.lean_share * self.tilt
        around = np.linspace(0.0, WHOLE_TURN, SETTINGS.leans, endpoint=False)
        ring = np.column_stack([np.cos(around), np.sin(around)])
        count = int(np.ceil(most / SETTINGS.lean_step))
        leans = np.vstack([np.zeros((1, 2)), *(most * number / count * ring for number in range(1, count + 1))])
        found = np.column_stack([np.tile(turns, len(leans)), np.repeat(leans, len(turns), axis=0)])
        return found[np.argsort(np.linalg.norm(found, axis=1), kind="stable")]

    def within(self, coordinates: FloatArray) -> FloatArray:
        """The coordinates (n, 3) next to others that are free."""
        low, high = (-np.inf, np.inf) if self.turn is None else self.turn
        sizes = np.linalg.norm(coordinates[:, 1:], axis=1)
        shares = np.minimum(1.0, SETTINGS.lean_share * self.tilt / np.maximum(sizes, np.finfo(float).tiny))
        return np.column_stack([np.clip(coordinates[:, 0], low, high), shares[:, None] * coordinates[:, 1:]])

    def offsets(self, coordinates: FloatArray) -> FloatArray:
        """Rotations (n, 3, 3) in the stated frame, of coordinates (n, 3)."""
        axes = np.eye(3)
        leans = coordinates[:, 1:] @ axes[list(self._across)]
        return np.asarray(turned_by(coordinates[:, :1] * axes[self.index]) @ turned_by(leans))


def _direction(rotation: Matrix, axis: int) -> Matrix:
    """An axis of the tool, (n, 3), of rotations (n, 9) row by row."""
    return rotation[:, [axis, 3 + axis, 6 + axis]]


def _three(direction: FloatArray) -> tuple[float, float, float]:
    x, y, z = map(float, direction)
    return x, y, z


def _about(axis: Matrix, angle: Matrix) -> Matrix:
    """The rotation about an axis (3, 1) of length 1 by an angle in rad, (3, 3)."""
    cross = ca.skew(axis)
    return ca.DM.eye(3) + ca.sin(angle) * cross + (1.0 - ca.cos(angle)) * (cross @ cross)


def _columns(rotations: FloatArray) -> FloatArray:
    """Rotations (n, 3, 3) as CasADi stacks their columns, (9, n)."""
    return np.asarray(rotations.transpose(0, 2, 1).reshape(-1, 9).T)


@lru_cache(maxsize=32)
def _nearest(free: FreeAxis) -> ca.Function:
    stated, rotation = ca.SX.sym("stated", 3, 3), ca.SX.sym("rotation", 3, 3)
    return ca.Function("nearest", [ca.vec(stated), ca.vec(rotation)], [ca.vec(free.nearest(stated, rotation))])
