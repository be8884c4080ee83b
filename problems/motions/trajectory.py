"""A motion as exact polynomial pieces of every joint, and the matrices that make it of a search vector."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import ClassVar, Generic, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix, Parametric, PiecewisePolynomial, bernstein, real_roots, unproven_part
from problems.motions.samples import SAMPLED_ORDERS, Samples
from problems.robots import Robot

SMOOTH_ORDERS = 3  # of which all but the jerks are continuous where nothing else is said
CONTINUOUS_ORDERS = 2  # of which at least angles and speeds have to be
JUMP_ROUNDING = 1e-12  # relative to a derivative's largest value: smaller jumps are none
NO_SIGN = 1e-9  # of the largest: coefficients nearer to zero have no sign
JUMP = 1e-6  # of the scale of jumps: an acceleration that jumps by less is continuous; timed pieces can be short
ROUNDED_TIME = 1e-9  # s, and relative to T: a time that is outside the motion by less is at its end
SLIVER = 1e-12  # s: shorter ends of pieces are left out where a motion is cut
LARGEST_JUMP_SCALE, LEAST_JUMP_SCALE = 1.0, 1e-6  # rad: jumps are relative to what lies between


@dataclass(frozen=True, repr=False)
class Trajectory:
    """Joint angles as piecewise polynomials of time.

    Args:
        breakpoints: p + 1 increasing times, s, the first 0.
        coefficients: (order, p, k), rad / s^n; as in SciPy's PPoly the highest power comes first and each piece
            starts its own time at 0.
    """

    breakpoints: FloatArray
    coefficients: FloatArray

    def __repr__(self) -> str:
        pieces, joints = self.coefficients.shape[1:]
        return f"<trajectory: {joints} joints, {pieces} pieces, T = {self.breakpoints[-1]:.6g} s>"

    @classmethod
    def from_pieces(cls, durations: FloatArray, scaled: list[FloatArray]) -> Trajectory:
        """Join pieces given in normalised time.

        Args:
            durations: of the p pieces, s.
            scaled: p coefficient arrays (order_i, k) in rad, lowest power first, in powers of tau = t / duration.
        """
        order = max(piece.shape[0] for piece in scaled)
        coefficients = np.zeros((order, len(scaled), scaled[0].shape[1]))
        for index, (duration, piece) in enumerate(zip(durations, scaled, strict=True)):
            powers = np.arange(piece.shape[0])
            coefficients[order - 1 - powers, index] = piece / (duration**powers)[:, None]
        return cls(np.concatenate([[0.0], np.cumsum(durations)]), coefficients)

    @classmethod
    def standing(cls, posture: FloatArray, seconds: float) -> Trajectory:
        """A trajectory that stays in a posture (k,), rad, for so many seconds."""
        return cls(np.array([0.0, seconds]), np.asarray(posture, dtype=np.float64)[None, None])

    @property
    def duration(self) -> float:
        """The duration T, s."""
        return float(self.breakpoints[-1])

    @cached_property
    def _derivatives(self) -> tuple[PiecewisePolynomial, ...]:
        theta = PiecewisePolynomial(self.coefficients, self.breakpoints)
        return theta, *(theta.derivative(order) for order in range(1, SAMPLED_ORDERS + 1))

    def derivative(self, order: int) -> PiecewisePolynomial:
        """The joint angles (0), or a derivative of them, as a piecewise polynomial."""
        return self._derivatives[order]

    def at(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Joint angles or a derivative of them, (n, k), at times (n,) in s; rad / s^derivative."""
        return np.asarray(self._derivatives[derivative](times))

    def __call__(self, times: float | FloatArray, derivative: int = 0) -> FloatArray:
        """Joint values or a derivative of them at a time in s, (k,), or at times (n,), (n, k); rad / s^derivative.

        Raises:
            ValueError: there is no such derivative, or a time is outside 0 to T by more than rounding.
        """
        if derivative not in range(SAMPLED_ORDERS + 1):
            raise ValueError(f"derivative: {derivative} is none; there are those from 0 to {SAMPLED_ORDERS}")
        return self.at(self.checked_times(times), int(derivative))

    def checked_times(self, times: float | FloatArray) -> FloatArray:
        """Times in s, moved into 0 to T where they are outside by no more than rounding.

        Raises:
            ValueError: one is outside by more.
        """
        given = np.asarray(times, dtype=np.float64)
        inside = np.clip(given, 0.0, self.duration)
        outside = given[~(np.abs(given - inside) <= ROUNDED_TIME * max(1.0, self.duration))]
        if outside.size:
            raise ValueError(f"times: {outside[0]:g} s is not within the motion, 0 to {self.duration:.6g} s")
        return inside

    @property
    def moves(self) -> bool:
        """Whether any joint moves at any time."""
        return bool(self.coefficients[:-1].any())

    def value_at_end(self, derivative: int = 0) -> FloatArray:
        """Joint angles or a derivative of them, (k,), at the end: where that jumps, what comes before."""
        return np.asarray(self._sides(derivative)[0][-1])

    def of_joints(self, joints: Sequence[int]) -> Trajectory:
        """The motion of some joints, by their numbers from 0."""
        return Trajectory(self.breakpoints, self.coefficients[:, :, list(joints)])

    def part(self, first: float, last: float) -> Trajectory:
        """The section from one time in s to another, on a clock of its own; exact up to rounding.

        Raises:
            ValueError: 0 <= first < last <= T does not hold.
        """
        if not 0.0 <= first < last <= self.duration:
            raise ValueError(f"from {first:g} to {last:g} s is no part of 0 to {self.duration:g} s")
        inner = self.breakpoints[(self.breakpoints > first + SLIVER) & (self.breakpoints < last - SLIVER)]
        return self.cut(np.concatenate([[first], inner, [last]]))

    def cut(self, edges: FloatArray) -> Trajectory:
        """The section with pieces between increasing times in s, none of which spans a breakpoint, from t = 0 on."""
        pieces = np.searchsorted(self.breakpoints[1:-1], (edges[:-1] + edges[1:]) / 2.0, side="right")
        shifts, n = edges[:-1] - self.breakpoints[pieces], self.coefficients.shape[0] - 1
        powers = self.coefficients[::-1, pieces]
        taylor = [
            sum(comb(j, i) * shifts[:, None] ** (j - i) * powers[j] for j in range(i, n + 1)) for i in range(n + 1)
        ]
        return Trajectory(edges - edges[0], np.array(taylor[::-1]))

    def followed_by(self, then: Trajectory) -> Trajectory:
        """The motion and, from its end on, another one of the same joints, which begins with the same state."""
        order = max(motion.coefficients.shape[0] for motion in (self, then))
        padded = [
            np.pad(motion.coefficients, ((order - motion.coefficients.shape[0], 0), (0, 0), (0, 0)))
            for motion in (self, then)
        ]
        times = np.concatenate([self.breakpoints, self.duration + then.breakpoints[1:]])
        return Trajectory(times, np.concatenate(padded, axis=1))

    def reversed(self) -> Trajectory:
        """The motion from its end to its start; exact up to rounding."""
        n, lengths = self.coefficients.shape[0] - 1, np.diff(self.breakpoints)[:, None]
        powers = self.coefficients[::-1]
        taylor = [
            (-1.0) ** i * sum(comb(j, i) * lengths ** (j - i) * powers[j] for j in range(i, n + 1))
            for i in range(n + 1)
        ]
        return Trajectory(self.breakpoints[-1] - self.breakpoints[::-1], np.array(taylor[::-1])[:, ::-1])

    def samples(self, times: FloatArray, robot: Robot | None = None, order: int | None = None) -> Samples:
        """Angles, speeds, accelerations and jerks at times (n,) in s, increasing; numeric matrices (n, k).

        Args:
            times: of the samples.
            robot: that moves.
            order: of the derivative that alone is needed, the others being no numbers; None for all.
        """
        shape = (times.size, self.coefficients.shape[2])
        derivatives = tuple(
            ca.DM(self.at(times, n)) if order in (n, None) else ca.DM.nan(*shape) for n in range(SAMPLED_ORDERS)
        )
        weights = np.convolve(np.pad(np.diff(times), 1), [0.5, 0.5], mode="valid")
        return Samples(
            robot=robot,
            derivatives=derivatives,
            duration=ca.DM(self.duration),
            times=ca.DM(np.asarray(times)),
            weights=ca.DM(weights),
        )

    def times(self, at_least: int) -> FloatArray:
        """Times in s, so many at least, equally spaced in each piece, every breakpoint among them."""
        pieces = self.breakpoints.size - 1
        intervals = int(np.ceil(max(at_least - 1, 1) / pieces))
        starts, durations = self.breakpoints[:-1, None], np.diff(self.breakpoints)[:, None]
        inner = starts + durations * np.arange(intervals) / intervals
        return np.append(inner.ravel(), self.duration)

    def extreme_times(self, derivative: int) -> FloatArray:
        """All times in s at which any joint's angle (0), speed (1), acceleration (2) or jerk (3) can be extreme.

        These are the breakpoints and the roots of the next derivative; the extremes over all t are at some of them.
        Where a derivative jumps it is evaluated just before the breakpoint too.
        """
        if derivative not in self._extreme_times:
            self._extreme_times[derivative] = self._found_extreme_times(derivative)
        return self._extreme_times[derivative]

    @cached_property
    def _extreme_times(self) -> dict[int, FloatArray]:
        """The extreme times that were asked for already, by derivative."""
        return {}

    def _found_extreme_times(self, derivative: int) -> FloatArray:
        curve = self._derivatives[derivative + 1]
        form = bernstein(np.asarray(curve.c), np.diff(self.breakpoints))
        largest = np.abs(form).max(axis=0)
        may_turn = (form.min(axis=0) <= NO_SIGN * largest) & (form.max(axis=0) >= -NO_SIGN * largest)
        times = [self.breakpoints]
        if derivative >= CONTINUOUS_ORDERS:
            times.append(np.nextafter(self.breakpoints[1:-1][self._is_jump(derivative)], 0.0))
        turning = may_turn & (largest > 0.0)
        piece = np.nonzero(turning)[0]
        times.append(real_roots(curve.c[:, turning], curve.x[piece], curve.x[piece + 1]))
        return np.unique(np.concatenate(times))

    def _is_jump(self, order: int) -> NDArray[np.bool_]:
        """Whether a derivative jumps by more than rounding at each inner breakpoint, (p - 1,)."""
        before, after = self._sides(order)
        largest = max(float(np.abs(before).max(initial=0.0)), float(np.abs(after).max(initial=0.0)))
        return np.asarray((np.abs(after[1:] - before[:-1]) > JUMP_ROUNDING * largest).any(axis=1))

    @cached_property
    def is_finite(self) -> bool:
        """Whether its times, and the coefficients of its derivatives too, are numbers."""
        with np.errstate(over="ignore", invalid="ignore"):
            return all(np.isfinite(part).all() for part in (self.breakpoints, *(d.c for d in self._derivatives)))

    def largest_jump(
        self,
        end_velocities: FloatArray | None = None,
        smooth_orders: int = SMOOTH_ORDERS,
        end_accelerations: FloatArray | None = None,
    ) -> float:
        """The largest jump of a derivative that has to be continuous, at the ends included; dimensionless.

        Args:
            end_velocities: of the joints before the start and after the end, (2, k), rad/s; at rest if None.
            smooth_orders: how many derivatives have to be continuous, the angle the first.
            end_accelerations: likewise, rad/s^2; zero if None.

        Returns:
            A jump is relative to the largest value over all t of its kind, but never to more than 1 rad, for speeds and
            accelerations 1 rad in the mean duration h of a piece, 1 / h and 1 / h^2: what turns far or fast somewhere
            may not jump farther elsewhere. Nor to less than 1e-6 rad, over the duration of the motion: what hardly
            moves is mostly rounding. Infinite where the motion is no number.
        """
        if not self.is_finite:
            return np.inf
        with np.errstate(over="ignore", invalid="ignore"):
            rest = np.zeros((2, self.coefficients.shape[2]))
            stated = {1: end_velocities, 2: end_accelerations}
            outside = {order: rest if values is None else values for order, values in stated.items()}
            relative = [self.jump(n, outside.get(n)) / self._jump_scale(n) for n in range(smooth_orders)]
        return float(max(np.inf if np.isnan(jump) else jump for jump in relative))

    def jump_times(self, order: int, end_accelerations: FloatArray | None = None) -> FloatArray:
        """Times at which a derivative jumps, the largest jump first, (n,), s.

        Accelerations also from and to what they are before and after the motion: zero, or ``end_accelerations``
        (2, k), rad/s^2. Where joints move at an end, only the acceleration along their velocity counts: what is across
        it is the curvature of a path that goes on. Jumps are relative as in :meth:`largest_jump`, and none up to 1e-6:
        rounding of pieces of a microsecond.
        """
        before, after = self._sides(order)
        inner = np.abs(after[1:] - before[:-1]).max(axis=1)
        ends = self._accelerations_along_ends(end_accelerations) if order == CONTINUOUS_ORDERS else (0.0, 0.0)
        jumps = np.concatenate([ends[:1], inner, ends[1:]])
        if not jumps.max() > JUMP * LEAST_JUMP_SCALE / self.duration**order:
            return np.empty(0)
        largest_first = np.argsort(-jumps, kind="stable")
        return self.breakpoints[largest_first[jumps[largest_first] > JUMP * self._jump_scale(order)]]

    def jump_time(self, order: int, end_accelerations: FloatArray | None = None) -> float | None:
        """The time at which a derivative jumps most, s; None where none jumps; as in :meth:`jump_times`."""
        times = self.jump_times(order, end_accelerations)
        return float(times[0]) if times.size else None

    def jumps_below(self, order: int, end_accelerations: FloatArray | None = None) -> tuple[int, FloatArray] | None:
        """The lowest derivative below an order that jumps, which makes that order infinite, and :meth:`jump_times`."""
        jumps = ((lower, self.jump_times(lower, end_accelerations)) for lower in range(order))
        return next(((lower, times) for lower, times in jumps if times.size), None)

    def jumps_inside(self, order: int) -> bool:
        """Whether a derivative jumps between the ends by more than rounding; relative as in :meth:`largest_jump`."""
        most = self.jump(order, None)
        return most > JUMP * LEAST_JUMP_SCALE and most > JUMP * self._jump_scale(order)

    def _accelerations_along_ends(self, outside: FloatArray | None = None) -> tuple[float, float]:
        """The largest jump of a joint's acceleration at the start and at the end, without what is across velocities."""
        velocities, accelerations = (
            np.stack([after[0], before[-1]]) for before, after in (self._sides(order) for order in (1, 2))
        )
        accelerations = accelerations if outside is None else accelerations - outside
        largest = JUMP * self._jump_scale(1)
        along = [
            a if np.abs(v).max() <= largest else v * float(v @ a) / float(v @ v)
            for v, a in zip(velocities, accelerations, strict=True)
        ]
        return float(np.abs(along[0]).max()), float(np.abs(along[1]).max())

    def jump(self, order: int, outside: FloatArray | None = None) -> float:
        """The largest jump of a derivative, rad / s^order; also to its values before and after the motion, (2, k)."""
        return float(self._jumps(order, outside).max(initial=0.0))

    def jump_sum(self, order: int, outside: FloatArray | None) -> float:
        """The sum of all jumps of a derivative of the joint that jumps most, rad / s^order."""
        return float(self._jumps(order, outside).sum(axis=0).max(initial=0.0))

    def _jumps(self, order: int, outside: FloatArray | None) -> FloatArray:
        before, after = self._sides(order)
        jumps = np.abs(after[1:] - before[:-1])
        if outside is None:
            return np.asarray(jumps)
        return np.concatenate([jumps, np.abs(np.stack([after[0], before[-1]]) - outside)])

    def _sides(self, order: int) -> tuple[FloatArray, FloatArray]:
        """A derivative at the end of each piece and at its start, both (p, k), rad / s^order."""
        curve = self._derivatives[order]
        powers = np.diff(self.breakpoints)[:, None] ** np.arange(curve.c.shape[0] - 1, -1, -1)
        return np.einsum("ipk,pi->pk", np.asarray(curve.c), powers), np.asarray(curve.c[-1])

    def _jump_scale(self, order: int) -> float:
        """The scale of jumps of a derivative, rad / s^order."""
        extreme = float(np.abs(self.at(self.extreme_times(order), order)).max())
        piece = self.duration / (self.breakpoints.size - 1)
        return max(min(extreme, LARGEST_JUMP_SCALE / piece**order), LEAST_JUMP_SCALE / self.duration**order)

    def stays_within(self, derivative: int, lower: FloatArray, upper: FloatArray) -> bool:
        """Whether bounds (k,) of angles (0), speeds (1) or accelerations (2) are proven for all t."""
        return self.unproven_cell(derivative, lower, upper) is None

    def unproven_cell(self, derivative: int, lower: FloatArray, upper: FloatArray) -> tuple[float, float] | None:
        """Start and end, s, of a cell of time in which such bounds are not proven; None where they are for all t."""
        lengths = np.diff(self.breakpoints)
        part = unproven_part(bernstein(np.asarray(self._derivatives[derivative].c), lengths), lower, upper)
        if part is None:
            return None
        start, length = float(self.breakpoints[part.piece]), float(lengths[part.piece])
        return start + part.start * length, start + part.end * length

    def time_scaled(self, factor: float) -> Trajectory:
        """The trajectory run ``factor`` times slower."""
        powers = np.arange(self.coefficients.shape[0] - 1, -1, -1)
        slower = self.coefficients / (factor**powers)[:, None, None]
        return Trajectory(self.breakpoints * factor, slower)


P = TypeVar("P")


@dataclass(frozen=True, kw_only=True)
class SampleGrid:
    """The samples of a motion as numbers: the rows of a compiled loop.

    Attributes:
        rows: what is different from sample to sample, (n, r).
        pieces: of each row, the number of the piece of the motion's blocks with which its part begins, (n,).
    """

    rows: FloatArray
    pieces: NDArray[np.intp]


class Motion(Parametric, ABC, Generic[P]):
    """A family of motions with parameters P. A subclass is a frozen dataclass.

    The same motion is sampled in two ways: all rows at once (:meth:`samples`), and row by row, as compiled code does:
    :meth:`blocks` prepares numbers once for a candidate, :meth:`at` makes one row of a part of them.
    """

    robot: Robot
    orders: ClassVar[tuple[int, ...]] = (0, 1, 2, 3)  # of the derivatives that it can be sampled for

    @abstractmethod
    def samples(self, parameters: P) -> Samples:
        """All samples, n rows."""

    @property
    @abstractmethod
    def grid(self) -> SampleGrid:
        """The rows of these samples, for :meth:`at`."""

    @abstractmethod
    def blocks(self, parameters: P, orders: tuple[int, ...]) -> Matrix:
        """The numbers from which all samples are computed, as one vector (b, 1), for the given derivative orders."""

    @abstractmethod
    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """Entries of one piece of the blocks, and of the window that a row sees: the pieces that shape a sample."""

    @abstractmethod
    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        """The sample of one row.

        Args:
            window: the part of the blocks that belongs to this row, (width, 1).
            row: of the grid, (r, 1).
            durations: of :meth:`durations`, (m, 1), s.
            orders: of the derivatives in the blocks; the others are left out.
        """

    @abstractmethod
    def durations(self, parameters: P) -> Matrix:
        """The durations of the motion's parts, (m, 1), s; they add up to its duration."""

    @property
    @abstractmethod
    def duration_count(self) -> int:
        """The number m of these times."""

    def duration(self, durations: Matrix) -> Matrix:
        """The duration of the whole motion, s, from its parts."""
        return sum(ca.vertsplit(durations), ca.DM(0))

    @abstractmethod
    def as_matrices(self, parameters: P) -> list[Matrix]:
        """The parameters as a list of matrices."""

    @abstractmethod
    def from_matrices(self, matrices: Sequence[Matrix]) -> P:
        """The inverse of :meth:`as_matrices`."""

    @abstractmethod
    def trajectory(self, parameters: P) -> Trajectory:
        """The exact motion of numeric parameters."""

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Times in s at which to tabulate a trajectory, those of the samples among them; breakpoints by default."""
        return trajectory.times(at_least)
