"""A motion stated by rows, each a time and the state of the joints then, as polynomial pieces between them.

Between two rows that state positions alone the joints move at constant velocity; with velocities they follow the cubic,
with accelerations too the quintic that has all these values at both rows. This is what the joint trajectory controller
of ros2_control does with a message [1], pair of rows by pair of rows.

[1] https://control.ros.org, joint_trajectory_controller, "Trajectory Representation".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem
from problems.motions.trajectory import Trajectory

RowInterpolation: TypeAlias = Literal["auto", "linear", "cubic", "quintic"]
NAMES = ("linear", "cubic", "quintic")  # by how many derivatives both rows of a piece state besides the position
STATES = ("positions", "velocities", "accelerations")
LEAST_STEP = 1e-9  # s, between two rows: a nanosecond, the resolution of ROS


@dataclass(frozen=True, eq=False)
class MotionRows:
    """A motion of k joints stated by rows.

    Args:
        times: (n,), s, increasing; the first is when the motion begins.
        positions: (n, k), rad or m.
        velocities: (n, k), rad/s or m/s, not a number in rows that state none; None where none does.
        accelerations: likewise, rad/s^2 or m/s^2.
        interpolation: between rows; ``auto`` takes of each two rows what both state.

    Raises:
        InvalidProblem: the rows do not fit each other, are fewer than two, or lack what the interpolation needs.
    """

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray | None = None
    accelerations: FloatArray | None = None
    interpolation: RowInterpolation = "auto"

    def __post_init__(self) -> None:
        if self.interpolation not in get_args(RowInterpolation):
            known = ", ".join(get_args(RowInterpolation))
            raise InvalidProblem("interpolation", f"{self.interpolation!r} is not one of {known}")
        if self.times.ndim != 1 or self.times.size < 2:
            raise InvalidProblem("times", f"two rows at least are needed, not {self.times.size}")
        _check_finite("times", self.times[:, None])
        late = np.flatnonzero(~(np.diff(self.times) >= LEAST_STEP))
        if late.size:
            before, after = self.times[late[0]], self.times[late[0] + 1]
            reason = f"have to increase; row {late[0] + 2} is at {after:.9g} s, the row before at {before:.9g} s"
            raise InvalidProblem("times", reason)
        if self.positions.ndim != 2 or len(self.positions) != self.times.size or not self.positions.size:
            needed = f"{self.times.size} rows of joints are needed"
            raise InvalidProblem("positions", f"{needed}, not an array {self.positions.shape}")
        _check_finite("positions", self.positions)
        for name in STATES[1:]:
            values = getattr(self, name)
            if values is not None and values.shape != self.positions.shape:
                raise InvalidProblem(name, f"rows {self.positions.shape} are needed, not {values.shape}")
            if values is not None:
                _check_finite(name, values[_stated(values)], np.flatnonzero(_stated(values)))
        self._check_stated()

    def _check_stated(self) -> None:
        """Check that the rows state what the interpolation needs."""
        stated = {name: self._states(name) for name in STATES[1:]}
        lonely = stated["accelerations"] & ~stated["velocities"]
        if self.interpolation == "auto" and lonely.any():
            reason = f"row {np.argmax(lonely) + 1} states accelerations without velocities, which joins no rows"
            raise InvalidProblem("velocities", reason)
        if self.interpolation == "auto":
            return
        for name in STATES[1 : 1 + NAMES.index(self.interpolation)]:
            if not stated[name].all():
                row = int(np.argmin(stated[name])) + 1
                raise InvalidProblem(name, f"row {row} states none; {self.interpolation} pieces need them in every row")

    def _states(self, name: str) -> NDArray[np.bool_]:
        """Whether each row states velocities or accelerations, (n,)."""
        values = getattr(self, name)
        return np.zeros(self.times.size, dtype=bool) if values is None else _stated(values)

    @cached_property
    def derivatives(self) -> NDArray[np.intp]:
        """The number of derivatives that both rows of a piece state: 0 linear, 1 cubic, 2 quintic; (n - 1,)."""
        if self.interpolation != "auto":
            return np.full(self.times.size - 1, NAMES.index(self.interpolation))
        has_velocity, has_acceleration = (self._states(name) for name in STATES[1:])
        both = [stated[:-1] & stated[1:] for stated in (has_velocity, has_velocity & has_acceleration)]
        return np.asarray(np.sum(both, axis=0))

    @property
    def said(self) -> str:
        """The interpolation between the rows, in words."""
        counts = [(name, int((self.derivatives == number).sum())) for number, name in enumerate(NAMES)]
        used = [(name, count) for name, count in counts if count]
        pieces = f"{self.derivatives.size} piece{'s' * (self.derivatives.size > 1)}"
        if len(used) == 1:
            return f"{used[0][0]} between {self.times.size} rows"
        return f"{' and '.join(f'{count} {name}' for name, count in used)} of {pieces}"

    @cached_property
    def trajectory(self) -> Trajectory:
        """The motion, from t = 0 on, exact to rounding."""
        lengths = np.diff(self.times)
        nothing = np.zeros_like(self.positions)
        states = [self.positions, *(nothing if v is None else v for v in (self.velocities, self.accelerations))]
        coefficients = np.zeros((2 * len(NAMES), lengths.size, self.positions.shape[1]))
        for number in np.unique(self.derivatives).tolist():
            chosen = np.flatnonzero(self.derivatives == number)
            ends = [(state[chosen], state[chosen + 1]) for state in states[: number + 1]]
            coefficients[: 2 * (number + 1), chosen] = PIECES[number](lengths[chosen, None], *ends)
        highest = 2 * (int(self.derivatives.max()) + 1)
        return Trajectory(self.times - self.times[0], coefficients[:highest][::-1])


def _stated(values: FloatArray) -> NDArray[np.bool_]:
    """Whether each row of (n, k) states anything."""
    return np.asarray(~np.isnan(values).all(axis=1))


def _check_finite(name: str, values: FloatArray, rows: Sequence[int] | NDArray[np.intp] | None = None) -> None:
    wrong = np.flatnonzero(~np.isfinite(values).all(axis=1))
    if wrong.size:
        row = wrong[0] if rows is None else rows[wrong[0]]
        raise InvalidProblem(name, f"row {row + 1} has a number that is none")


Ends: TypeAlias = tuple[FloatArray, FloatArray]  # of pieces: values at their starts and at their ends, both (p, k)


def linear_pieces(lengths: FloatArray, positions: Ends) -> FloatArray:
    """Coefficients (2, p, k), lowest power first, of straight lines.

    Args:
        lengths: of the pieces, (p, 1), s.
        positions: at their ends.
    """
    return np.stack([positions[0], (positions[1] - positions[0]) / lengths])


def cubic_pieces(lengths: FloatArray, positions: Ends, velocities: Ends) -> FloatArray:
    """Coefficients (4, p, k), lowest power first, of cubics with given velocities at both ends."""
    slope = (positions[1] - positions[0]) / lengths
    (v, w), h = velocities, lengths
    return np.stack([positions[0], v, (3.0 * slope - 2.0 * v - w) / h, (v + w - 2.0 * slope) / h**2])


def quintic_pieces(lengths: FloatArray, positions: Ends, velocities: Ends, accelerations: Ends) -> FloatArray:
    """Coefficients (6, p, k), lowest power first, of quintics with given velocities and accelerations at both ends."""
    slope = (positions[1] - positions[0]) / lengths
    (v, w), (a, b), h = velocities, accelerations, lengths
    third = (10.0 * slope - 6.0 * v - 4.0 * w) / h**2 + (b - 3.0 * a) / (2.0 * h)
    fourth = (-15.0 * slope + 8.0 * v + 7.0 * w) / h**3 + (3.0 * a - 2.0 * b) / (2.0 * h**2)
    fifth = (6.0 * slope - 3.0 * v - 3.0 * w) / h**4 + (b - a) / (2.0 * h**3)
    return np.stack([positions[0], v, a / 2.0, third, fourth, fifth])


PIECES: tuple[Callable[..., FloatArray], ...] = (linear_pieces, cubic_pieces, quintic_pieces)
