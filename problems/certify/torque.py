"""Torques proven for all t, and the time scale at which they hold.

In a cell every joint's angle, speed and acceleration is a polynomial, and the recursion of Newton and Euler makes of
them a polynomial of degree 3 for the torque and a bound of how far from that it can be, rounding included. Cells in
which this does not settle the limit are halved; the bound closes in with the fourth power of their length. Coulomb
friction takes any value between its two where a joint may stand still: the limit has to hold for all of them.

[1] J. Luh, M. Walker, R. Paul: On-line computational scheme for mechanical manipulators. Journal of Dynamic Systems,
    Measurement, and Control 102 (1980).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, as_array, bernstein, kept_function
from problems.certify.taylor import DEGREE, ENTRIES, ROUNDING, Moments, TimeCells, modelled
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.limits import TorqueLimit
from problems.motions import Trajectory
from problems.robots import RigidChain, Robot, time_scales_of_arrays

STILL = 1e-9  # of a joint's largest speed: slower, it may stand still
ROBOTS = 32  # of which compiled functions are kept


@dataclass(frozen=True, eq=False)
class Torques:
    """What a robot's motors give, compiled; angles, speeds and accelerations one after the other, (3 k,).

    Attributes:
        parts: torques of inertia, of viscous friction and of gravity, (k,) each.
        models: the sum of the three, of Taylor models.
        friction: of Coulomb, (k,), N m or N.
    """

    parts: ca.Function
    models: ca.Function
    friction: FloatArray

    @classmethod
    @lru_cache(maxsize=ROBOTS)
    def of(cls, robot: Robot) -> Torques:
        """Of a robot whose masses are known."""
        chain = robot.massive
        parts = kept_function(lambda: _parts(chain), "torques by part", chain)
        models = kept_function(lambda: _models(chain), "models of torques", chain)
        return cls(parts, models, np.array([float(joint.friction) for joint in chain.joints]))


def _state(chain: RigidChain) -> tuple[ca.SX, tuple[ca.SX, ca.SX, ca.SX]]:
    """Angles, speeds and accelerations one after the other, and each as a row."""
    state = ca.SX.sym("state", 3 * len(chain.joints))
    q, v, a = (part.T for part in ca.vertsplit(state, len(chain.joints)))
    return state, (q, v, a)


def _parts(chain: RigidChain) -> ca.Function:
    """Torques of inertia, viscous friction and gravity."""
    state, (q, v, a) = _state(chain)
    parts = [chain.inertial(q, v, a).T, chain.viscous(v).T, chain.gravitational(q).T]
    return ca.Function("parts", [state], [ca.densify(part) for part in parts], {"cse": True})


def _models(chain: RigidChain) -> ca.Function:
    """Their sum, of models."""
    smooth = replace(chain, joints=tuple(replace(joint, friction=0.0) for joint in chain.joints))
    state, (q, v, a) = _state(chain)
    return modelled(ca.Function("torques", [state], [ca.densify(smooth.torques(q, v, a).T)], {"cse": True}))


@dataclass(frozen=True, eq=False)
class MovingArm:
    """A robot with limited torques on its way.

    Args:
        limit: of its torques.
        trajectory: its motion.
    """

    limit: TorqueLimit
    trajectory: Trajectory

    @cached_property
    def torques(self) -> Torques:
        """What its motors give."""
        return Torques.of(self.limit.robot)

    @cached_property
    def bounds(self) -> FloatArray:
        """Its largest torques, (k, 1), N m or N."""
        return np.array(self.limit.bounds)[:, None]

    @cached_property
    def still(self) -> FloatArray:
        """Speeds up to which a joint may stand still, (k, 1), rad/s."""
        curves = bernstein(np.asarray(self.trajectory.derivative(1).c), np.diff(self.trajectory.breakpoints))
        return np.asarray(STILL * np.abs(curves).max(axis=(0, 1))[:, None])

    def first_moments(self, at_least: int) -> Moments:
        """So many times, both sides of breakpoints, and where a joint with Coulomb friction turns back."""
        times = [self.trajectory.times(at_least)]
        if self.torques.friction.any():
            times.append(self.trajectory.extreme_times(0))
        return Moments.at(self.trajectory, np.concatenate(times))

    def parts(self, moments: Moments) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Torques of inertia, viscous friction, gravity and, least and most, of Coulomb friction.

        Returns:
            (k, n) thrice, and (2, k, n).
        """
        state = moments.derivatives()
        inertial, viscous, gravity = (as_array(part) for part in self.torques.parts(state))
        k = len(self.bounds)
        speeds, friction = state[k : 2 * k], self.torques.friction[:, None]
        least = np.where(speeds > self.still, friction, -friction)
        most = np.where(speeds < -self.still, -friction, friction)
        return inertial, viscous, gravity, np.stack([least, most])

    def at(self, moments: Moments) -> FloatArray:
        """The torques of largest size, (k, n), N m or N."""
        inertial, viscous, gravity, friction = self.parts(moments)
        low, high = inertial + viscous + gravity + friction
        return np.asarray(np.where(high >= -low, high, low))

    def holds(self, moments: Moments, least_room: float = -TOLERANCE) -> NDArray[np.bool_]:
        """Whether motors hold each joint where it is, however friction acts, (k, n).

        Args:
            moments: when.
            least_room: what has to be left of a limit, relative to it.
        """
        _, _, gravity, friction = self.parts(moments)
        return np.asarray((np.abs(gravity + friction) <= self.bounds * (1.0 - least_room)).all(axis=0))

    def time_scales(self, moments: Moments) -> FloatArray:
        """The least factors by which time has to be multiplied, (k, n); 0 where any will do.

        Run s times slower, torques are inertial / s^2 + viscous / s + held.
        """
        inertial, viscous, gravity, friction = self.parts(moments)
        low, high = gravity + friction
        above = time_scales_of_arrays(inertial, viscous, self.bounds - high)
        return np.asarray(np.maximum(above, time_scales_of_arrays(-inertial, -viscous, self.bounds + low)))

    def over(self, cells: TimeCells) -> tuple[FloatArray, Moments]:
        """Bounds of the torques' sizes in cells, (k, n), N m or N; and when they are likely to be largest, (n,)."""
        k, inputs = len(self.bounds), cells.models()
        outputs = as_array(self.torques.models(inputs)).reshape(k, ENTRIES, -1)
        speeds = inputs.reshape(3, k, ENTRIES, -1)[1]
        slowest, fastest = (values for values, _ in extremes(speeds))
        (low, when_low), (high, when_high) = extremes(outputs)
        friction = self.torques.friction[:, None]
        low = low + np.where(slowest > 0.0, friction, -friction)
        high = high + np.where(fastest < 0.0, -friction, friction)
        size = np.maximum(high, -low)
        joint, each = np.argmax(size / self.bounds, axis=0), np.arange(len(cells))
        shares = np.where(high >= -low, when_high, when_low)[joint, each]
        return size, cells.moments(shares)


def extremes(models: FloatArray) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Least and largest values of Taylor models of degree 3, and at which s their polynomials have them.

    Args:
        models: (..., ENTRIES, n).
    """
    p0, p1, p2, p3, rest = np.moveaxis(models, -2, 0)
    with np.errstate(all="ignore"):
        root = np.sqrt(p2 * p2 - 3.0 * p1 * p3)
        pivot = -(p2 + np.copysign(root, p2))
        inner = np.nan_to_num(np.stack([pivot / (3.0 * p3), p1 / pivot]), posinf=1.0, neginf=-1.0)
    s = np.concatenate([np.clip(inner, -1.0, 1.0), np.stack([np.full_like(p0, -1.0), np.ones_like(p0)])])
    values = p0 + s * (p1 + s * (p2 + s * p3))
    wide = rest + ROUNDING * np.abs(models[..., : DEGREE + 1, :]).sum(axis=-2)
    lowest, highest = values.argmin(axis=0)[None], values.argmax(axis=0)[None]
    low, high = (np.take_along_axis(values, at, 0)[0] for at in (lowest, highest))
    when_low, when_high = (np.take_along_axis(s, at, 0)[0] for at in (lowest, highest))
    return (low - wide, when_low), (high + wide, when_high)


INITIAL_CELLS = 24
MAX_CELLS = 5_000  # beyond those that the pieces need
PROOF_GAP = 1e-3  # of the largest torque seen: what is proven is at most this much higher
LEAST_SHARE = 1e-3  # of a limit: smaller torques need not be known any better


@dataclass(frozen=True, eq=False)
class TorqueProof:
    """What is known of the torques of a whole motion.

    Attributes:
        arm: whose.
        status: whether they keep their limits.
        worst: the torque seen that is the largest share of its limit, with its sign, N m or N; proven to be nowhere
            more than ``PROOF_GAP`` larger, unless undecided.
        joint: of that, from 0 on.
        time: of that, s.
        held: whether the motor could hold the joint where it is then.
        broken: times at which a limit was seen to be broken.
        cell: start and end of one, s, that is left undecided; None where none is.
    """

    arm: MovingArm
    status: CertificateStatus
    worst: float
    joint: int
    time: float
    held: bool
    broken: Moments
    cell: tuple[float, float] | None = None

    @property
    def verdict(self) -> Verdict:
        """In words; a limit that is broken where standing still breaks it too is broken however slowly."""
        limit = self.arm.limit
        bound, robot = limit.bounds[self.joint], limit.robot
        where = f"{robot.joint_names[self.joint]}, t = {self.time:.4g} s"
        outcome = Verdict(
            name=limit.name,
            worst=self.worst,
            bound=bound if self.worst >= 0.0 else -bound,
            unit=robot.torque_units[self.joint],
            status=self.status,
            where=where if self.held else f"{where}, however slowly",
            time=self.time,
        )
        return outcome.undecided_in(self.cell) if self.status is CertificateStatus.UNDECIDED else outcome


def prove_torques(limit: TorqueLimit, trajectory: Trajectory, tolerance: float = TOLERANCE) -> TorqueProof:
    """Bound the torques of a motion for all t.

    Args:
        limit: of the torques.
        trajectory: the motion.
        tolerance: relative to the limits, for rounding.
    """
    arm = MovingArm(limit, trajectory)
    allowed, seen = 1.0 + tolerance, _Seen.at(arm, arm.first_moments(INITIAL_CELLS))
    cells = TimeCells.over(trajectory, INITIAL_CELLS)
    count, most = 0, MAX_CELLS + len(cells)
    while len(cells) and count + len(cells) <= most and trajectory.is_finite:
        count += len(cells)
        sizes, likely = arm.over(cells)
        shares = (sizes / arm.bounds).max(axis=0)
        seen = seen.and_at(likely)
        aim = max(seen.share, LEAST_SHARE) * (1.0 + PROOF_GAP)
        aim = allowed if seen.share <= allowed < aim else aim
        cells = cells.halved(~(shares <= aim))
    if seen.share > allowed:
        status = CertificateStatus.VIOLATED
    else:
        status = CertificateStatus.UNDECIDED if len(cells) else CertificateStatus.CERTIFIED
    cell = cells.first if status is CertificateStatus.UNDECIDED else None
    return TorqueProof(arm, status, *seen.worst, seen.broken(allowed), cell)


@dataclass(frozen=True, eq=False)
class _Seen:
    """Torques at single times: (k, n), N m or N, at n moments."""

    arm: MovingArm
    moments: Moments
    torques: FloatArray

    @classmethod
    def at(cls, arm: MovingArm, moments: Moments) -> _Seen:
        return cls(arm, moments, arm.at(moments))

    def and_at(self, moments: Moments) -> _Seen:
        """Those at more times too."""
        torques = np.concatenate([self.torques, self.arm.at(moments)], axis=1)
        return _Seen(self.arm, self.moments.together(moments), torques)

    @cached_property
    def _shares(self) -> FloatArray:
        """Of the limits, (k, n)."""
        return np.asarray(np.abs(self.torques) / self.arm.bounds)

    @property
    def share(self) -> float:
        """The largest."""
        return float(self._shares.max())

    @property
    def worst(self) -> tuple[float, int, float, bool]:
        """That torque, its joint, its time in s, and whether the joint can be held there."""
        joint, moment = np.unravel_index(np.argmax(self._shares), self._shares.shape)
        when = self.moments.chosen(np.array([moment]))
        held = bool(self.arm.holds(when)[joint, 0])
        return float(self.torques[joint, moment]), int(joint), float(when.times[0]), held

    def broken(self, allowed: float) -> Moments:
        """When a torque is a larger share of its limit."""
        return self.moments.chosen(np.flatnonzero((self._shares > allowed).any(axis=0)))


LEAST_ROOM = 1e-6  # of a limit: what gravity and friction have to leave of it at least
FIRST_TIMES = 201
MAX_ROUNDS = 12
FIRST_STEP = 1e-7  # relative: what is added where no time is seen to be broken and nothing is proven


def torque_time_scale(limit: TorqueLimit, trajectory: Trajectory) -> float:
    """The least factor by which time has to be multiplied so that the limit is proven for all t, to 1e-7 or so.

    What each of many times needs is known in closed form. The proof of the motion that is slowed by the largest factor
    finds times at which it is still broken; what these need joins in, until nothing is broken.

    Returns:
        The factor; 0 where any will do, and where none does: the motors cannot hold the arm at some time.
    """
    arm = MovingArm(limit, trajectory)
    scale, step = _scale_at(arm, arm.first_moments(FIRST_TIMES)) if trajectory.is_finite else 0.0, FIRST_STEP
    if scale in (0.0, np.inf):
        return 0.0
    for _ in range(MAX_ROUNDS):
        proof = prove_torques(limit, trajectory.time_scaled(scale), TOLERANCE / 2.0)
        if proof.status is CertificateStatus.CERTIFIED:
            break
        needed = _scale_at(arm, Moments(trajectory, proof.broken.pieces, proof.broken.offsets / scale))
        if np.isinf(needed):
            return 0.0
        if needed <= scale * (1.0 + step):
            needed, step = max(needed, scale) * (1.0 + step), 10.0 * step
        scale = needed
    return scale


def _scale_at(arm: MovingArm, moments: Moments) -> float:
    """The largest factor that a time needs; infinite where the motors can hardly hold the arm."""
    held = arm.holds(moments, LEAST_ROOM).all()
    return float(arm.time_scales(moments).max(initial=0.0)) if held else np.inf
