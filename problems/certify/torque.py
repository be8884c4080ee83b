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

from problems.base import FloatArray, as_array, bernstein, cached_function
from problems.certify.settings import DEFAULT_TORQUE_PROOF, TorqueProofSettings
from problems.certify.taylor import DEGREE, ENTRIES, ROUNDING, PieceTimes, TimeCells, modelled
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.limits import TorqueLimit
from problems.motions import Trajectory
from problems.robots import RigidChain, Robot, time_scales_of_arrays

STILL_SPEED = 1e-9  # of a joint's largest speed: slower, it may stand still
CACHED_ROBOTS = 32


@dataclass(frozen=True, eq=False)
class Torques:
    """Compiled torques of a robot's motors; angles, speeds and accelerations one after the other, (3 k,).

    Attributes:
        parts: torques of inertia, of viscous friction and of gravity, (k,) each.
        models: the sum of the three, of Taylor models.
        friction: of Coulomb, (k,), N m or N.
    """

    parts: ca.Function
    models: ca.Function
    friction: FloatArray

    @classmethod
    @lru_cache(maxsize=CACHED_ROBOTS)
    def of(cls, robot: Robot) -> Torques:
        """The cached torques of a robot whose masses are known."""
        chain = robot.dynamics
        parts = cached_function(lambda: _parts(chain), "torques by part", chain)
        models = cached_function(lambda: _models(chain), "models of torques", chain)
        return cls(parts, models, np.array([float(joint.friction) for joint in chain.joints]))


def _state(chain: RigidChain) -> tuple[ca.SX, tuple[ca.SX, ca.SX, ca.SX]]:
    """Angles, speeds and accelerations one after the other, and each as a row."""
    state = ca.SX.sym("state", 3 * len(chain.joints))
    q, v, a = (part.T for part in ca.vertsplit(state, len(chain.joints)))
    return state, (q, v, a)


def _parts(chain: RigidChain) -> ca.Function:
    """The function of torques of inertia, viscous friction and gravity, (k,) each."""
    state, (q, v, a) = _state(chain)
    parts = [chain.inertial(q, v, a).T, chain.viscous(v).T, chain.gravitational(q).T]
    return ca.Function("parts", [state], [ca.densify(part) for part in parts], {"cse": True})


def _models(chain: RigidChain) -> ca.Function:
    """The function of the sum of these torques, of Taylor models."""
    smooth = replace(chain, joints=tuple(replace(joint, friction=0.0) for joint in chain.joints))
    state, (q, v, a) = _state(chain)
    return modelled(ca.Function("torques", [state], [ca.densify(smooth.torques(q, v, a).T)], {"cse": True}))


@dataclass(frozen=True, eq=False)
class MovingArm:
    """A robot with limited torques along a motion.

    Args:
        limit: of its torques.
        trajectory: its motion.
    """

    limit: TorqueLimit
    trajectory: Trajectory

    @cached_property
    def torques(self) -> Torques:
        """The torques of its motors."""
        return Torques.of(self.limit.robot)

    @cached_property
    def bounds(self) -> FloatArray:
        """The limits of its torques, (k, 1), N m or N."""
        return np.array(self.limit.bounds)[:, None]

    @cached_property
    def still(self) -> FloatArray:
        """Speeds up to which a joint may stand still, (k, 1), rad/s."""
        curves = bernstein(np.asarray(self.trajectory.derivative(1).c), np.diff(self.trajectory.breakpoints))
        return np.asarray(STILL_SPEED * np.abs(curves).max(axis=(0, 1))[:, None])

    def first_moments(self, at_least: int) -> PieceTimes:
        """So many times at least, both sides of breakpoints, and turning points of joints with Coulomb friction."""
        times = [self.trajectory.times(at_least)]
        if self.torques.friction.any():
            times.append(self.trajectory.extreme_times(0))
        return PieceTimes.at(self.trajectory, np.concatenate(times))

    def parts(self, moments: PieceTimes) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
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

    def at(self, moments: PieceTimes) -> FloatArray:
        """The torques of largest size, (k, n), N m or N."""
        inertial, viscous, gravity, friction = self.parts(moments)
        low, high = inertial + viscous + gravity + friction
        return np.asarray(np.where(high >= -low, high, low))

    def holds(self, moments: PieceTimes, least_left: float = -TOLERANCE) -> NDArray[np.bool_]:
        """Whether motors hold each joint where it is, however friction acts, (k, n).

        Args:
            moments: when.
            least_left: share of a limit that has to be left.
        """
        _, _, gravity, friction = self.parts(moments)
        return np.asarray((np.abs(gravity + friction) <= self.bounds * (1.0 - least_left)).all(axis=0))

    def time_scales(self, moments: PieceTimes) -> FloatArray:
        """The least factors by which time has to be multiplied, (k, n); 0 where any will do.

        Run s times slower, torques are inertial / s^2 + viscous / s + gravity and Coulomb friction.
        """
        inertial, viscous, gravity, friction = self.parts(moments)
        low, high = gravity + friction
        above = time_scales_of_arrays(inertial, viscous, self.bounds - high)
        return np.asarray(np.maximum(above, time_scales_of_arrays(-inertial, -viscous, self.bounds + low)))

    def over(self, cells: TimeCells) -> tuple[FloatArray, PieceTimes]:
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


@dataclass(frozen=True, eq=False)
class TorqueProof:
    """A proof about the torques of a whole motion.

    Attributes:
        arm: that moves.
        status: whether torques keep their limits.
        worst: the torque seen that is the largest share of its limit, with its sign, N m or N; proven to be nowhere
            larger by more than the proof gap, unless undecided.
        joint: of the worst torque, from 0 on.
        time: of the worst torque, s.
        can_be_held: whether the motor could hold the joint where it is then.
        broken: times at which a limit was seen to be broken.
        cell: start and end of one, s, that is left undecided; None where none is.
    """

    arm: MovingArm
    status: CertificateStatus
    worst: float
    joint: int
    time: float
    can_be_held: bool
    broken: PieceTimes
    cell: tuple[float, float] | None = None

    @property
    def verdict(self) -> Verdict:
        """The verdict on the limit; one that standing still breaks too is broken however slowly."""
        limit = self.arm.limit
        bound, robot = limit.bounds[self.joint], limit.robot
        where = f"{robot.joints.names[self.joint]}, t = {self.time:.4g} s"
        outcome = Verdict(
            name=limit.name,
            worst=self.worst,
            bound=bound if self.worst >= 0.0 else -bound,
            unit=robot.joints.torque_units[self.joint],
            status=self.status,
            where=where if self.can_be_held else f"{where}, however slowly",
            time=self.time,
        )
        return outcome.undecided_in(self.cell) if self.status is CertificateStatus.UNDECIDED else outcome


def prove_torques(
    limit: TorqueLimit,
    trajectory: Trajectory,
    tolerance: float = TOLERANCE,
    settings: TorqueProofSettings = DEFAULT_TORQUE_PROOF,
) -> TorqueProof:
    """Bound the torques of a motion for all t.

    Args:
        limit: of the torques.
        trajectory: the motion.
        tolerance: relative to the limits, for rounding.
        settings: of the proof.
    """
    arm = MovingArm(limit, trajectory)
    allowed, seen = 1.0 + tolerance, _Seen.at(arm, arm.first_moments(settings.initial_cells))
    cells = TimeCells.over(trajectory, settings.initial_cells)
    count, most = 0, settings.most_cells + len(cells)
    while len(cells) and count + len(cells) <= most and trajectory.is_finite:
        count += len(cells)
        sizes, likely = arm.over(cells)
        shares = (sizes / arm.bounds).max(axis=0)
        seen = seen.and_at(likely)
        aim = max(seen.share, settings.least_share) * (1.0 + settings.proof_gap)
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
    moments: PieceTimes
    torques: FloatArray

    @classmethod
    def at(cls, arm: MovingArm, moments: PieceTimes) -> _Seen:
        return cls(arm, moments, arm.at(moments))

    def and_at(self, moments: PieceTimes) -> _Seen:
        """The torques at these and more moments."""
        torques = np.concatenate([self.torques, self.arm.at(moments)], axis=1)
        return _Seen(self.arm, self.moments.together(moments), torques)

    @cached_property
    def _shares(self) -> FloatArray:
        """Shares of the limits, (k, n)."""
        return np.asarray(np.abs(self.torques) / self.arm.bounds)

    @property
    def share(self) -> float:
        """The largest share of a limit."""
        return float(self._shares.max())

    @property
    def worst(self) -> tuple[float, int, float, bool]:
        """The torque of that share, its joint, its time in s, and whether the joint can be held there."""
        joint, moment = np.unravel_index(np.argmax(self._shares), self._shares.shape)
        when = self.moments.chosen(np.array([moment]))
        can_be_held = bool(self.arm.holds(when)[joint, 0])
        return float(self.torques[joint, moment]), int(joint), float(when.times[0]), can_be_held

    def broken(self, allowed: float) -> PieceTimes:
        """The moments at which a torque is a larger share of its limit."""
        return self.moments.chosen(np.flatnonzero((self._shares > allowed).any(axis=0)))


def torque_time_scale(
    limit: TorqueLimit, trajectory: Trajectory, settings: TorqueProofSettings = DEFAULT_TORQUE_PROOF
) -> float:
    """The least factor by which time has to be multiplied so that the limit is proven for all t, to 1e-7 or so.

    The factor of each of many times is known in closed form. The proof of the motion that is slowed by the largest of
    them finds times at which it is still broken; their factors join in, until no limit is broken.

    Returns:
        The factor; 0 where any will do, and where none does: the motors cannot hold the arm at some time.
    """
    arm = MovingArm(limit, trajectory)
    scale, step = 0.0, settings.first_step
    if trajectory.is_finite:
        scale = _scale_at(arm, arm.first_moments(settings.first_times), settings.least_left)
    if scale in (0.0, np.inf):
        return 0.0
    for _ in range(settings.rounds):
        proof = prove_torques(limit, trajectory.time_scaled(scale), TOLERANCE / 2.0, settings)
        if proof.status is CertificateStatus.CERTIFIED:
            break
        needed = _scale_at(
            arm, PieceTimes(trajectory, proof.broken.pieces, proof.broken.offsets / scale), settings.least_left
        )
        if np.isinf(needed):
            return 0.0
        if needed <= scale * (1.0 + step):
            needed, step = max(needed, scale) * (1.0 + step), 10.0 * step
        scale = needed
    return scale


def _scale_at(arm: MovingArm, moments: PieceTimes, least_left: float) -> float:
    """The largest factor that a time needs; infinite where the motors can hardly hold the arm."""
    can_hold = arm.holds(moments, least_left).all()
    return float(arm.time_scales(moments).max(initial=0.0)) if can_hold else np.inf
