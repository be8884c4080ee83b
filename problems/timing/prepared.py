"""A path prepared for timing: polynomials between breaks, the time scale of a given timing, torques along the path.

The joints have to stop where the path's derivative changes its direction. Where it only changes its length, the
parametrisation jumps, not the path: the pieces after it get another length in the parameter.

With b the square of du/dt, and u the path's parameter, the inverse dynamics are linear in b and in its slope:

    tau = m(u) d2u/dt2 + c(u) b + g(u) + viscous q'(u) du/dt + coulomb sign(q'(u))
    m = M(q) q',  c = M(q) q'' + C(q, q') q'
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, PiecewisePolynomial, as_array, bernstein, peak
from problems.core import Dynamics
from problems.motions import JointPath, Trajectory
from problems.robots import JointLimits, RigidChain, time_scales_of_arrays
from problems.timing.settings import DEFAULT_TORQUE_CURVE, TorqueCurveSettings

STILL_TRAVEL = 1e-12  # of the path's extent: how far a piece turns that is left out
LARGEST_GAP = 1e-9  # of the path's extent: between pieces that join
SIMILAR_DIRECTIONS = 1e-6  # difference of unit vectors that may be equal; DERIVATIVE_ROUNDING decides
DERIVATIVE_ROUNDING = 1e-10  # of what a piece turns: a smaller difference of derivatives is none


@dataclass(frozen=True, kw_only=True)
class PreparedPath:
    """A path in which every piece turns a joint and q' is continuous but for corners.

    Attributes:
        path: with parameters of its own, from 0.
        corners: whether q' jumps at a breakpoint, (p + 1,); not at the ends.
        kinks: whether q' or q'' jumps at a breakpoint, (p + 1,); not at the ends.
        resting: whether q' is zero at the start, and at the end.
        rates: du/dt at the start, and at the end.
    """

    path: JointPath
    corners: FloatArray
    kinks: FloatArray
    resting: tuple[bool, bool]
    rates: tuple[float, float]

    def sections(self) -> list[PreparedPath]:
        """The parts between kinks; where they meet the joints are at rest."""
        bounds = [0, *np.flatnonzero(self.kinks).tolist(), self.path.breakpoints.size - 1]
        return [self._section(first, last) for first, last in pairwise(bounds)]

    def _section(self, first: int, last: int) -> PreparedPath:
        breakpoints = self.path.breakpoints[first : last + 1]
        path = JointPath(breakpoints - breakpoints[0], self.path.coefficients[:, first:last])
        none = np.zeros(breakpoints.size, dtype=bool)
        start = self.rates[0] if first == 0 else 0.0
        end = self.rates[1] if last == self.path.breakpoints.size - 1 else 0.0
        return PreparedPath(path=path, corners=none, kinks=none, resting=_resting(path), rates=(start, end))

    @property
    def moves_at_an_end(self) -> bool:
        """Whether joints have a velocity at an end, so that nothing can be slowed afterwards."""
        return any(rate > 0.0 and not resting for rate, resting in zip(self.rates, self.resting, strict=True))


def prepared(path: JointPath, rates: tuple[float, float] = (0.0, 0.0)) -> PreparedPath:
    """The path prepared for timing, without pieces that stand still.

    Args:
        path: to time.
        rates: du/dt at its start and at its end.

    Raises:
        InvalidProblem: it stands still, or jumps, or has a number that is none.
    """
    lengths, coefficients = np.diff(path.breakpoints), np.asarray(path.coefficients, dtype=np.float64)
    if not (np.isfinite(coefficients).all() and np.isfinite(lengths).all() and (lengths > 0.0).all()):
        raise InvalidProblem("path", "a coefficient is not a number, or the parameter does not increase")
    if not (np.isfinite(rates).all() and min(rates) >= 0.0):
        raise InvalidProblem("rates", "du/dt at an end is negative or not a number")
    unit = coefficients * (lengths ** np.arange(len(coefficients))[::-1, None])[..., None]  # each piece over [0, 1]
    turned = np.abs(unit[:-1]).sum(axis=0).max(axis=-1, initial=0.0)
    extent = float(np.ptp(unit[-1], axis=0).max() + turned.max())
    turning = turned > STILL_TRAVEL * extent
    if not turning.any():
        raise InvalidProblem("path", "it stands still: there is nothing to time")
    _check_joined(unit, path.breakpoints, extent)
    return _joined(unit[:, turning], lengths[turning], turned[turning], rates)


def _check_joined(unit: FloatArray, breakpoints: FloatArray, extent: float) -> None:
    gaps = np.abs(unit[-1, 1:] - unit[:, :-1].sum(axis=0))
    if gaps.max(initial=0.0) > LARGEST_GAP * extent:
        piece, joint = np.unravel_index(np.argmax(gaps), gaps.shape)
        at = breakpoints[piece + 1]
        raise InvalidProblem("path", f"joint {joint + 1} jumps by {gaps.max():.3g} rad where the parameter is {at:g}")


def _joined(unit: FloatArray, lengths: FloatArray, turned: FloatArray, rates: tuple[float, float]) -> PreparedPath:
    """Choose the lengths of pieces (order, p, k) over [0, 1] so that q' is continuous where its direction is."""
    starts, ends = _end_derivatives(unit)
    corners, kinks = np.zeros((2, lengths.size + 1), dtype=bool)
    chosen = lengths.copy()
    for i in range(1, lengths.size):
        chosen[i] = chosen[i - 1] * lengths[i] / lengths[i - 1]
        (before, before2), (after, after2) = ends[:, i - 1], starts[:, i]
        least = DERIVATIVE_ROUNDING * max(turned[i - 1] / chosen[i - 1], turned[i] / chosen[i])
        fast, slow = np.linalg.norm(before) / chosen[i - 1], np.linalg.norm(after) / chosen[i]
        if fast > least and slow > least and np.abs(before / chosen[i - 1] - after / chosen[i]).max() > least:
            same_direction = (
                np.abs(before / (chosen[i - 1] * fast) - after / (chosen[i] * slow)).max() <= SIMILAR_DIRECTIONS
            )
            chosen[i] = chosen[i] * slow / fast if same_direction else lengths[i]  # beyond a corner nothing has to fit
        corners[i] = np.abs(before / chosen[i - 1] - after / chosen[i]).max() > least
        least2 = DERIVATIVE_ROUNDING * max(turned[i - 1] / chosen[i - 1] ** 2, turned[i] / chosen[i] ** 2)
        kinks[i] = corners[i] or np.abs(before2 / chosen[i - 1] ** 2 - after2 / chosen[i] ** 2).max() > least2
    powers = np.arange(len(unit))[::-1, None]
    path = JointPath(np.concatenate([[0.0], np.cumsum(chosen)]), unit / (chosen**powers)[..., None])
    return PreparedPath(
        path=path,
        corners=corners,
        kinks=kinks,
        resting=_resting(path),
        rates=(rates[0], rates[1] * float(chosen[-1] / lengths[-1])),
    )


def _resting(path: JointPath) -> tuple[bool, bool]:
    """Whether q' is zero at the start, and at the end."""
    start, end = np.abs(path.at(path.breakpoints[[0, -1]], 1)).max(axis=1)
    lengths, order = np.diff(path.breakpoints), len(path.coefficients)
    turned = np.abs(path.coefficients[:-1] * (lengths ** np.arange(order - 1, 0, -1)[:, None])[..., None]).sum(axis=0)
    mean = turned.max(axis=1) / lengths
    return bool(start <= DERIVATIVE_ROUNDING * mean[0]), bool(end <= DERIVATIVE_ROUNDING * mean[-1])


def _end_derivatives(unit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First and second derivatives of pieces (order, p, k) over [0, 1], at their starts and ends, (2, p, k) each."""
    n = np.arange(len(unit))[::-1, None, None]
    padded = np.concatenate([np.zeros((3, *unit.shape[1:])), unit])
    starts = np.stack([padded[-2], 2.0 * padded[-3]])
    return starts, np.stack([(n * unit).sum(axis=0), (n * (n - 1) * unit).sum(axis=0)])


def peak_ratios(trajectory: Trajectory, limits: JointLimits) -> list[float]:
    """Bounds of the peak of each limited derivative over all t, as shares of its limits."""
    durations = np.diff(trajectory.breakpoints)
    ratios = []
    for order, bound in enumerate(limits.by_order, start=1):
        curves = bernstein(np.asarray(trajectory.derivative(order).c), durations)
        ratios.append(peak((curves / bound).reshape(len(curves), -1)))
    return ratios


@dataclass(frozen=True)
class PathTorques:
    """The dynamics along a path.

    Args:
        path: of k joints.
        curve: m, c and g, (3, k), N m for a rate of the parameter in 1/s.
        bound: torques that the motors may give, the margin taken off, (k,), N m.
        viscous: friction, (k,), N m s.
        coulomb: friction, (k,), N m.
        settings: of the polynomials and the margin.
    """

    path: JointPath
    curve: PiecewisePolynomial
    bound: FloatArray
    viscous: FloatArray
    coulomb: FloatArray
    settings: TorqueCurveSettings = DEFAULT_TORQUE_CURVE

    @classmethod
    def of(
        cls,
        path: JointPath,
        limits: JointLimits,
        chain: RigidChain | None,
        settings: TorqueCurveSettings = DEFAULT_TORQUE_CURVE,
    ) -> PathTorques | None:
        """The dynamics of a chain with torque limits along a path; None where there is neither.

        Raises:
            InvalidProblem: the motors cannot hold the chain, or overcome its friction, somewhere on the path.
        """
        if chain is None or limits.torque is None:
            return None
        path = path.first_joints(len(limits.torque))
        count = settings.nodes
        nodes = (1.0 - np.cos(np.pi * (np.arange(count) + 0.5) / count)) / 2.0
        starts = _polynomial_starts(path, settings)
        lengths = np.diff(starts)
        u = starts[:-1] + nodes[:, None] * lengths
        values = _dynamics(path, chain, u.ravel()).reshape(3, *u.shape, -1)
        ascending = np.linalg.solve(np.vander(nodes, increasing=True), values.swapaxes(0, 1).reshape(count, -1))
        scaled = ascending.reshape(count, 3, lengths.size, -1).swapaxes(1, 2)
        powers = lengths ** np.arange(count)[:, None]
        one = ca.DM.ones(1, len(limits.torque))
        viscous, coulomb = (as_array(part(one))[0] for part in (chain.viscous, chain.coulomb))
        bound = np.array(limits.torque) * (1.0 - settings.margin)
        curve = PiecewisePolynomial((scaled / powers[..., None, None])[::-1], starts)
        made = cls(path, curve, bound, viscous, coulomb, settings)
        made._check_holding(np.union1d(u, starts))
        return made

    def at(self, u: FloatArray, derivative: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """m, c and g, or derivatives of them, (..., k) at parameters (...)."""
        inertia, bend, gravity = np.moveaxis(np.asarray(self.curve(u, derivative)), -2, 0)
        return inertia, bend, gravity

    def time_scale(self, u: FloatArray, rate: FloatArray, change: FloatArray) -> float:
        """How many times slower a motion has to be run, at samples in order; below 1 where time can be saved.

        Args:
            u: parameters (n,).
            rate: du/dt, (n,).
            change: d2u/dt2, (n,).
        """
        inertia, bend, gravity = self.at(u)
        velocity = self.path.at(u, 1) * rate[:, None]
        inertial = inertia * change[:, None] + bend * rate[:, None] ** 2
        viscous = self.viscous * velocity
        sign, either = self.friction(velocity)
        holding, bound = gravity + sign, self.bound - either
        least = self.settings.least_left * self.bound
        over, under = (np.maximum(left, least) for left in (bound - holding, bound + holding))
        above = time_scales_of_arrays(inertial, viscous, over)
        return float(np.maximum(above, time_scales_of_arrays(-inertial, -viscous, under)).max())

    def friction(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coulomb friction at samples in order, (n, k): what it is, and half of what it may be where it jumps."""
        sign = np.sign(velocity)
        padded = np.pad(sign, ((1, 1), (0, 0)), mode="edge")
        sure = (sign == padded[:-2]) & (sign == padded[2:]) & (sign != 0.0)
        return np.where(sure, sign, 0.0) * self.coulomb, np.where(sure, 0.0, 1.0) * self.coulomb

    def _check_holding(self, u: FloatArray) -> None:
        """Whether the motors can run the chain along the path slowly."""
        torque = np.abs(self.at(u)[2] + self.coulomb * np.sign(self.path.at(u, 1)))
        where, joint = np.unravel_index(np.argmax(torque / self.bound), torque.shape)
        if torque[where, joint] > self.bound[joint]:
            margin = self.settings.margin
            share, stated = u[where] / self.path.breakpoints[-1], self.bound[joint] / (1.0 - margin)
            raise InvalidProblem(
                "path",
                f"joint {joint + 1} has to give {torque[where, joint]:.4g} N m to hold the arm {share:.0%} along the "
                f"path, and may give {stated:g} N m, of which {margin:.2%} is kept free",
            )


def _polynomial_starts(path: JointPath, settings: TorqueCurveSettings) -> FloatArray:
    """Parameters at which polynomials begin, and the last ends: breakpoints of the path among them."""
    shares = np.linspace(0.0, 1.0, settings.travel_samples)[:, None]
    lengths = np.diff(path.breakpoints)
    inner = path.at(np.minimum(path.breakpoints[:-1] + shares * lengths, np.nextafter(path.breakpoints[1:], 0.0)))
    turned = np.abs(np.diff(inner, axis=0)).sum(axis=0).max(axis=1)
    counts = np.maximum(np.ceil(turned / settings.travel).astype(int), settings.fewest_polynomials)
    pieces = zip(path.breakpoints[:-1], lengths, counts, strict=True)
    return np.concatenate([*(a + h * np.arange(n) / n for a, h, n in pieces), path.breakpoints[-1:]])


def _dynamics(path: JointPath, chain: RigidChain, u: FloatArray) -> FloatArray:
    """m, c and g at parameters (n,): (3, n, k)."""
    theta, first, second = (path.at(u, order) for order in range(3))
    still, core = np.zeros(theta.shape), Dynamics.of_chain(chain)
    if core is None:
        at, one, two, none = map(ca.DM, (theta, first, second, still))
        parts = chain.inertial(at, none, one), chain.inertial(at, one, two), chain.gravitational(at)
        return np.stack([as_array(part) for part in parts])
    slow, gravity = core.torques(np.hstack([theta, still, first]))
    return np.stack([slow, core.torques(np.hstack([theta, first, second]))[0], gravity])
