"""The path's parameter as a spline of time, and limits as rows of its coefficients."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import pairwise
from math import factorial

import numpy as np
from numpy.typing import NDArray

from problems.base import BSpline, FloatArray, basis_functions, composition
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits
from problems.timing.prepared import PathTorques, PreparedPath
from problems.timing.settings import LawSettings
from problems.timing.speed_profile import Intervals

DEGREE = 4
BISECTIONS = 60
LEAST_SPAN = 1e-290  # s^n, an interval to the n-th power: dividing by less gives no number
TIME_ROUNDING = 1e-9  # of the duration: a knot nearer to where the path changes its piece is left out


def averaged_knots(knots: FloatArray) -> FloatArray:
    """The tau about which each control point is, (controls,): Greville abscissae."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(knots[1:-1], DEGREE).mean(axis=1))


@dataclass(frozen=True)
class Basis:
    """The matrix from control points to s, s', ... at samples.

    Args:
        first: number of the first of the ``DEGREE + 1`` control points that count at a sample, (n,).
        weights: of these, (orders, n, DEGREE + 1).
    """

    first: NDArray[np.intp]
    weights: FloatArray

    @classmethod
    def of(cls, knots: FloatArray, tau: FloatArray, orders: int) -> Basis:
        """The basis of samples at tau (n,)."""
        last = np.clip(np.searchsorted(knots, tau, "right") - 1, DEGREE, knots.size - DEGREE - 2)
        return cls(
            last - DEGREE, np.stack([basis_functions(knots, tau, DEGREE, last, order).T for order in range(orders)])
        )

    def joined(self, other: Basis) -> Basis:
        """The basis of these samples and others."""
        return Basis(np.append(self.first, other.first), np.concatenate([self.weights, other.weights], axis=1))

    def at(self, controls: FloatArray) -> FloatArray:
        """s, s', ... at the samples, (orders, n)."""
        near = np.lib.stride_tricks.sliding_window_view(controls, DEGREE + 1)[self.first]
        return np.asarray((self.weights * near).sum(axis=-1))


@dataclass(frozen=True)
class Parametrisation:
    """A spline s(tau), not decreasing.

    Args:
        knots: of a clamped B-spline of degree ``DEGREE`` over [0, 1].
        controls: its control points, not decreasing, from the path's first parameter to its last.
    """

    knots: FloatArray
    controls: FloatArray

    @cached_property
    def _spline(self) -> BSpline:
        return BSpline(self.knots, self.controls, DEGREE)

    def at(self, tau: FloatArray, derivative: int = 0) -> FloatArray:
        """The parameter or a derivative of it with respect to tau, (n,)."""
        return np.asarray(self._spline(tau, derivative))

    def reaching(self, parameters: FloatArray) -> FloatArray:
        """The tau (n,) at which parameters are reached, by bisection of the polynomials between knots."""
        nodes = np.unique(self.knots)
        reached = np.maximum.accumulate(self.at(nodes))
        interval = np.clip(np.searchsorted(reached, parameters, "left") - 1, 0, nodes.size - 2)
        begin, width = nodes[interval], np.diff(nodes)[interval]
        powers = [self.at(begin, order) * width**order / factorial(order) for order in range(DEGREE, -1, -1)]
        low, high = np.zeros(parameters.size), np.ones(parameters.size)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            late = reduce(lambda value, power: value * middle + power, powers) >= parameters
            low, high = np.where(late, low, middle), np.where(late, middle, high)
        return np.asarray(begin + high * width)

    def trajectory(self, path: JointPath, duration: float) -> Trajectory | None:
        """The motion along a path in a duration in s: polynomials of ``DEGREE`` times the path's degree.

        None where the law turns back, as one may that has to begin or end faster than the path is long.
        """
        ends, crossed = path.breakpoints[[0, -1]], self.reaching(path.breakpoints[1:-1])
        inner = np.unique(self.knots)[1:-1]
        inner = inner[np.abs(inner[:, None] - crossed).min(axis=1, initial=1.0) > TIME_ROUNDING]
        parameters = np.clip(self.at(inner), *ends)
        nodes = np.concatenate([ends, parameters, path.breakpoints[1:-1]])
        nodes, first = np.unique(nodes, return_index=True)
        tau = np.concatenate([[0.0, 1.0], inner, crossed])[first]
        steps, lengths = np.diff(tau), np.diff(nodes)
        if not (steps > 0.0).all():
            return None
        local = [self.at(tau[:-1], n) * steps**n / factorial(n) / lengths for n in range(1, DEGREE + 1)]
        inside = np.stack([np.zeros_like(steps), *local])[..., None]
        scaled = composition(Intervals.of(path, nodes).local, inside)
        spans = (steps * duration) ** np.arange(len(scaled))[:, None]
        matters = spans > LEAST_SPAN  # terms beyond turn a joint by rounding at most: a law hardly bends in an interval
        coefficients = np.where(matters[..., None], scaled, 0.0) / np.where(matters, spans, 1.0)[..., None]
        return Trajectory(tau * duration, coefficients[::-1])


BEND_ROUNDING = 1e-8  # of the largest q'' along the path: a smaller one at an end is none


@dataclass(frozen=True)
class ParametrisationEnds:
    """Given rates of the parameter at both ends.

    Args:
        start: ds/dt and d2s/dt2, or the first of them, or nothing.
        goal: the same at the goal.
    """

    start: tuple[float, ...]
    goal: tuple[float, ...]

    @classmethod
    def of(cls, prepared: PreparedPath) -> ParametrisationEnds:
        """Joints at rest start with no acceleration; moving ones with the least that the path's curvature allows."""
        path = prepared.path
        ends = path.breakpoints[[0, -1]]
        slopes, bends = (path.at(ends, order) for order in (1, 2))
        middles = (path.breakpoints[:-1] + path.breakpoints[1:]) / 2.0
        least = BEND_ROUNDING * np.abs(path.at(np.concatenate([path.breakpoints, middles]), 2)).max()
        given: list[tuple[float, ...]] = []
        for slope, bend, rate, resting in zip(slopes, bends, prepared.rates, prepared.resting, strict=True):
            if not resting:
                given.append((rate, -float(slope @ bend) / float(slope @ slope) * rate**2))
            else:
                given.append((0.0,) if np.abs(bend).max() > least else ())
        return cls(given[0], given[1])

    @property
    def moving(self) -> bool:
        """Whether an end has a velocity, so that no motion with these ends can be slowed."""
        return any(values[0] > 0.0 for values in (self.start, self.goal) if values)

    def free(self, controls: int) -> slice:
        """The slice of so many control points that are not determined."""
        return slice(1 + len(self.start), controls - 1 - len(self.goal))

    def placed(self, knots: FloatArray, controls: FloatArray, duration: float) -> FloatArray:
        """The control points in order, those that are determined in their places."""
        free = self.free(controls.size)
        placed = controls.copy()
        placed[: free.start] = controls[0] + _offsets(knots, self.start, duration)[0]
        placed[free.stop :] = controls[-1] - _offsets(*_mirrored(knots, self.goal), duration)[0][::-1]
        ordered = np.maximum.accumulate(placed)
        return np.asarray(np.minimum.accumulate(np.append(ordered[: free.stop], placed[free.stop :])[::-1])[::-1])

    def slopes(self, knots: FloatArray, duration: float) -> FloatArray:
        """How far each control point moves where the duration grows by a small share, (controls,)."""
        slopes = np.zeros(knots.size - DEGREE - 1)
        free = self.free(slopes.size)
        slopes[: free.start] = _offsets(knots, self.start, duration)[1]
        slopes[free.stop :] = -_offsets(*_mirrored(knots, self.goal), duration)[1][::-1]
        return slopes


def _mirrored(knots: FloatArray, given: tuple[float, ...]) -> tuple[FloatArray, tuple[float, ...]]:
    """An end seen backwards in time: knots from its side, accelerations with the other sign."""
    return 1.0 - knots[::-1], tuple(value * sign for value, sign in zip(given, (1.0, -1.0), strict=False))


def _offsets(knots: FloatArray, given: tuple[float, ...], duration: float) -> tuple[FloatArray, FloatArray]:
    """How far the determined control points are from the end, and how far they move as the duration grows.

    By the derivatives of a B-spline at its first knot.
    """
    first, second = knots[DEGREE + 1], knots[DEGREE + 2]
    rate, change = (*given, 0.0, 0.0)[:2]
    speed, bend = rate * duration, change * duration**2 * first / (DEGREE - 1)
    near = speed * first / DEGREE
    offsets = [0.0, near, near + (speed + bend) * second / DEGREE]
    slopes = [0.0, near, near + (speed + 2.0 * bend) * second / DEGREE]
    count = 1 + len(given)
    return np.array(offsets[:count]), np.array(slopes[:count])


def graded_knots(passed: FloatArray, count: int, coarser: int, settings: LawSettings) -> FloatArray:
    """Knots of a clamped B-spline over [0, 1].

    Args:
        passed: when the breakpoints of the path are passed, (p + 1,), shares of the duration.
        count: of intervals, were all equally long.
        coarser: times fewer intervals than usual.
        settings: of the law.
    """
    per_piece, most = settings.intervals_in_piece / coarser, settings.most_intervals // coarser
    tau = np.union1d(np.linspace(0.0, 1.0, settings.knot_grid), passed)
    done = _intervals_before(tau, passed, count, per_piece, settings)
    while done[-1] > max(most, count + 1):
        per_piece /= 2.0
        done = _intervals_before(tau, passed, count, per_piece, settings)
    inner = np.interp(np.linspace(0.0, done[-1], int(np.ceil(done[-1])) + 1), done, tau)
    return np.concatenate([np.zeros(DEGREE), [0.0], inner[1:-1], [1.0], np.ones(DEGREE)])


def _intervals_before(
    tau: FloatArray, passed: FloatArray, count: int, per_piece: float, settings: LawSettings
) -> FloatArray:
    """How many intervals there should be before each tau, (n,), increasing from 0."""
    shortest, grading = settings.shortest_interval, settings.knot_grading
    size = np.full(tau.size, 1.0 / count)
    for start, end in pairwise(passed):
        away = np.maximum(np.maximum(start - tau, tau - end), 0.0)
        size = np.minimum(size, np.maximum((end - start) / per_piece, shortest) + grading * away)
    density = 1.0 / size
    return np.concatenate([[0.0], np.cumsum(np.diff(tau) * (density[:-1] + density[1:]) / 2.0)])


ORDERS = 3  # speed, acceleration, jerk


@dataclass(frozen=True, kw_only=True)
class LawLimits:
    """Limited values as shares of their limits, linear in the time law: r rows, of each order or torque and joint.

    Attributes:
        values: at n samples, (r, n), those of the order m for a duration of which they are the m-th power less.
        slopes: with respect to s and its three derivatives at the sample, (r, 4, n).
        slowing: of torques, of the order 0: how they change with a small share of the duration, (r, n); else zero.
        orders: m, (r,).
    """

    values: FloatArray
    slopes: FloatArray
    slowing: FloatArray
    orders: FloatArray

    def joined(self, other: LawLimits) -> LawLimits:
        """The limits of this and another object at common samples."""
        return LawLimits(
            values=np.concatenate([self.values, other.values]),
            slopes=np.concatenate([self.slopes, other.slopes]),
            slowing=np.concatenate([self.slowing, other.slowing]),
            orders=np.append(self.orders, other.orders),
        )

    def after(self, law: FloatArray, slower: float) -> FloatArray:
        """The values (r, n) where s and its derivatives change by (4, n), and the duration by a share."""
        return np.asarray(self.values + np.einsum("rpn,pn->rn", self.slopes, law) + self.slowing * slower)


def joint_shares(path: JointPath, limits: JointLimits, law: FloatArray, duration: float) -> FloatArray:
    """Speed, acceleration and jerk as shares of limits, (3, k, n); arguments as of :func:`joint_limits`."""
    return _derivatives(_along(path, law[0], ORDERS), law) / _scales(limits, duration)


def joint_limits(path: JointPath, limits: JointLimits, law: FloatArray, duration: float) -> LawLimits:
    """Linearise the derivatives of q(s(t)) around a time law.

    Args:
        path: of k joints.
        limits: a jerk among them.
        law: s and its three derivatives at n samples, (4, n).
        duration: in s.
    """
    _, v, a, j = law
    q1, q2, q3, q4 = along = _along(path, law[0], ORDERS + 1)
    scales = _scales(limits, duration)
    joints = path.coefficients.shape[2]
    slopes = np.zeros((ORDERS, joints, ORDERS + 1, v.size))
    parts = [
        [q2 * v, q1],
        [q2 * a + q3 * v**2, 2.0 * q2 * v, q1],
        [q2 * j + 3.0 * q3 * v * a + q4 * v**3, 3.0 * (q2 * a + q3 * v**2), 3.0 * q2 * v, q1],
    ]
    for order, every in enumerate(parts):
        for part, slope in enumerate(every):
            np.divide(slope, scales[order], out=slopes[order, :, part])
    rows = ORDERS * joints
    return LawLimits(
        values=(_derivatives(along, law) / scales).reshape(rows, -1),
        slopes=slopes.reshape(rows, ORDERS + 1, -1),
        slowing=np.zeros((rows, v.size)),
        orders=np.repeat(np.arange(1.0, ORDERS + 1.0), joints),
    )


def _along(path: JointPath, s: FloatArray, orders: int) -> list[FloatArray]:
    """Derivatives of a path by its parameter from the first on, (k, n) each."""
    inside = np.clip(s, *path.breakpoints[[0, -1]])
    return [np.ascontiguousarray(path.at(inside, order).T) for order in range(1, orders + 1)]


def _derivatives(along: list[FloatArray], law: FloatArray) -> FloatArray:
    """Derivatives of q(s(tau)) by tau, (3, k, n)."""
    (q1, q2, q3), (_, v, a, j) = along[:ORDERS], law
    return np.stack([q1 * v, q1 * a + q2 * v**2, q1 * j + 3.0 * q2 * (v * a) + q3 * v**3])


def _scales(limits: JointLimits, duration: float) -> FloatArray:
    """Limits of derivatives with respect to tau, (3, k, 1)."""
    return np.stack([bound * duration**order for order, bound in enumerate(limits.by_order, start=1)])[..., None]


def torque_limits(motors: PathTorques, law: FloatArray, duration: float) -> LawLimits:
    """Linearise the torques around a time law, as shares of their limits; arguments as of :func:`joint_limits`."""
    s, rate, change = in_time(motors.path, law, duration)
    v, a = rate[:, None], change[:, None]
    (m, c, g), (m1, c1, g1) = (motors.at(s, order) for order in (0, 1))
    q1, q2 = (motors.path.at(s, order) for order in (1, 2))
    inertial, viscous = m * a + c * v**2, motors.viscous * q1 * v
    order = np.argsort(s, kind="stable")
    sign, either = (part[np.argsort(order, kind="stable")] for part in motors.friction((q1 * v)[order]))
    bound = motors.bound - either
    parts = [
        (m1 * a + c1 * v**2 + motors.viscous * q2 * v + g1) / bound,
        (2.0 * c * v + motors.viscous * q1) / (bound * duration),
        m / (bound * duration**2),
        np.zeros_like(m),
    ]
    return LawLimits(
        values=((inertial + viscous + g + sign) / bound).T,
        slopes=np.stack(parts).transpose(2, 0, 1),
        slowing=(-(2.0 * inertial + viscous) / bound).T,
        orders=np.zeros(bound.shape[1]),
    )


def in_time(path: JointPath, law: FloatArray, duration: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The parameter at samples, ds/dt and d2s/dt2, (n,) each; law as of :func:`joint_limits`."""
    s, rate, change = law[:3]
    return np.clip(s, *path.breakpoints[[0, -1]]), rate / duration, change / duration**2
