"""Torques proven for all t, and the time scale at which they hold.

In a cell every joint's angle, speed and acceleration is a polynomial, and the core's recursion of Newton and Euler
makes of them a polynomial of degree 3 for the torque and a bound of how far from that it can be, rounding included.
Cells in which this does not settle the limit are halved; the bound closes in with the fourth power of their length.
Coulomb friction takes any value between its two where a joint may stand still: the limit has to hold for all of them.
Without a core, intervals bound the same formula, with more cells.

[1] J. Luh, M. Walker, R. Paul: On-line computational scheme for mechanical manipulators. Journal of Dynamic Systems,
    Measurement, and Control 102 (1980).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, bernstein
from problems.certify.settings import DEFAULT_TORQUE_PROOF, TorqueProofSettings
from problems.certify.time_cells import PieceTimes
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.core import Dynamics, TorqueAim
from problems.limits import Constraint, TorqueLimit
from problems.motions import Samples, Trajectory
from problems.robots import time_scales_of_arrays

STILL_SPEED = 1e-9  # of a joint's largest speed: slower, it may stand still
STATUS = {True: CertificateStatus.CERTIFIED, False: CertificateStatus.VIOLATED, None: CertificateStatus.UNDECIDED}


@dataclass(frozen=True)
class TorqueOfAnyFriction(TorqueLimit):
    """The torque limit for both values of Coulomb friction where a joint may stand still, as intervals prove it."""

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        (limit,), chain, speed = super().constraints_at(samples, margin), self.robot.dynamics, samples.speed
        smooth = replace(chain, joints=tuple(replace(joint, friction=0.0) for joint in chain.joints))
        still = ca.repmat(STILL_SPEED * ca.DM(self.robot.limits.speed).T, samples.count, 1)
        torques = smooth.torques(samples.theta, speed, samples.acceleration)
        both = ca.horzcat(torques + chain.coulomb(speed + still), torques + chain.coulomb(speed - still))
        bound = ca.repmat(ca.horzcat(*self.bounds), 1, 2)
        return [replace(limit, expression=both, lower=-bound, upper=bound, scale=bound, columns=2 * limit.columns)]


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
    def dynamics(self) -> Dynamics:
        """The robot's equations of motion in the core."""
        return Dynamics.needed(self.limit.robot)

    @cached_property
    def bounds(self) -> FloatArray:
        """The limits of its torques, (k,), N m or N."""
        return np.array(self.limit.bounds, dtype=np.float64)

    @cached_property
    def still(self) -> FloatArray:
        """Speeds up to which a joint may stand still, (k,), rad/s."""
        curves = bernstein(np.asarray(self.trajectory.derivative(1).c), np.diff(self.trajectory.breakpoints))
        return np.asarray(STILL_SPEED * np.abs(curves).max(axis=(0, 1)))

    def first_moments(self, at_least: int) -> PieceTimes:
        """So many times at least, both sides of breakpoints, and turning points of joints with Coulomb friction."""
        times = [self.trajectory.times(at_least)]
        if self.dynamics.friction.any():
            times.append(self.trajectory.extreme_times(0))
        return PieceTimes.at(self.trajectory, np.concatenate(times))

    def parts(self, moments: PieceTimes) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Torques of inertia, viscous friction, gravity and, least and most, of Coulomb friction.

        Returns:
            (n, k) thrice, and (2, n, k).
        """
        states, k = moments.states(), len(self.bounds)
        inertial, gravity = self.dynamics.torques(states)
        speeds, friction = states[:, k : 2 * k], self.dynamics.friction
        least = np.where(speeds > self.still, friction, -friction)
        most = np.where(speeds < -self.still, -friction, friction)
        return inertial, self.dynamics.damping * speeds, gravity, np.stack([least, most])

    def at(self, moments: PieceTimes) -> FloatArray:
        """The torques of largest size, (n, k), N m or N."""
        inertial, viscous, gravity, friction = self.parts(moments)
        low, high = inertial + viscous + gravity + friction
        return np.asarray(np.where(high >= -low, high, low))

    def holds(self, moments: PieceTimes, least_left: float = -TOLERANCE) -> NDArray[np.bool_]:
        """Whether motors hold each joint where it is, however friction acts, (n, k).

        Args:
            moments: when.
            least_left: share of a limit that has to be left.
        """
        _, _, gravity, friction = self.parts(moments)
        return np.asarray((np.abs(gravity + friction) <= self.bounds * (1.0 - least_left)).all(axis=0))

    def time_scales(self, moments: PieceTimes) -> FloatArray:
        """The least factors by which time has to be multiplied, (n, k); 0 where any will do.

        Run s times slower, torques are inertial / s^2 + viscous / s + gravity and Coulomb friction.
        """
        inertial, viscous, gravity, friction = self.parts(moments)
        low, high = gravity + friction
        above = time_scales_of_arrays(inertial, viscous, self.bounds - high)
        return np.asarray(np.maximum(above, time_scales_of_arrays(-inertial, -viscous, self.bounds + low)))


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

    Raises:
        NoCore: there is no core.
    """
    arm = MovingArm(limit, trajectory)
    moments = arm.first_moments(settings.initial_cells)
    if not trajectory.is_finite:
        first, none = moments.chosen(np.array([0])), moments.chosen(np.empty(0, dtype=np.intp))
        return _proof(arm, CertificateStatus.UNDECIDED, first, none, (0.0, trajectory.duration))
    aim = TorqueAim(
        allowed=1.0 + tolerance,
        gap=settings.proof_gap,
        least=settings.least_share,
        first_cells=settings.initial_cells,
        most_cells=settings.most_cells,
        step=trajectory.duration / settings.initial_cells / 2.0,
    )
    answer = arm.dynamics.settle(moments.numbers, arm.bounds, arm.still, aim)
    worst = PieceTimes(trajectory, np.array([answer.piece]), np.array([answer.offset]))
    broken = PieceTimes(trajectory, answer.broken_pieces, answer.broken_offsets)
    return _proof(arm, STATUS[answer.kept], worst, broken, answer.cell)


def _proof(
    arm: MovingArm, status: CertificateStatus, worst: PieceTimes, broken: PieceTimes, cell: tuple[float, float] | None
) -> TorqueProof:
    """The proof with the torque of the largest share at the only moment of the worst."""
    (torques,), (held,) = arm.at(worst), arm.holds(worst)
    joint = int(np.argmax(np.abs(torques) / arm.bounds))
    return TorqueProof(
        arm, status, float(torques[joint]), joint, float(worst.times[0]), bool(held[joint]), broken, cell
    )


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
