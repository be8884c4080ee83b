"""The fastest stop or move between moving states, by Ruckig.

Ruckig [1] finds for each joint the profile of constant jerks that takes the least time. It keeps limits of speed,
acceleration and jerk; a state beyond a limit is brought back first. It knows neither ranges of joints nor torques.

[1] L. Berscheid, T. Kroeger, "Jerk-limited Real-time Trajectory Generation with Arbitrary Target States", RSS 2021
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from typing import Self

import numpy as np
from ruckig import ControlInterface, InputParameter, Profile, Ruckig, Synchronization
from ruckig import Trajectory as Profiles

from problems.base import FloatArray, InvalidProblem
from problems.motions import SMOOTH_ORDERS, Trajectory
from problems.robots import JointLimits
from problems.timing.free_space import AccelerationPieces, side_by_side

STILL_RATE = 1e-9  # rad/s, rad/s^2


@dataclass(frozen=True)
class MotionState:
    """Angles and how they change.

    Args:
        angles: (k,), rad.
        velocity: (k,), rad/s.
        acceleration: (k,), rad/s^2.

    Raises:
        InvalidProblem: they are not three times k finite numbers.
    """

    angles: FloatArray
    velocity: FloatArray
    acceleration: FloatArray

    def __post_init__(self) -> None:
        for name in ("angles", "velocity", "acceleration"):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            if values.shape != np.shape(self.angles) or values.ndim != 1 or not np.isfinite(values).all():
                raise InvalidProblem(name, f"as many finite numbers as joints are needed, not {values.tolist()}")
            object.__setattr__(self, name, values)

    @classmethod
    def at_end(cls, trajectory: Trajectory) -> Self:
        """The state with which a motion arrives."""
        return cls(*(trajectory.value_at_end(order) for order in range(SMOOTH_ORDERS)))

    @classmethod
    def at_rest(cls, angles: FloatArray) -> Self:
        """The state of joints that stand at angles (k,), rad."""
        return cls(angles, *np.zeros((2, np.size(angles))))

    @property
    def derivatives(self) -> FloatArray:
        """Angles, velocities and accelerations, (3, k)."""
        return np.stack([self.angles, self.velocity, self.acceleration])

    @property
    def moves(self) -> bool:
        """Whether a joint does, by more than rounding, or is about to."""
        return bool(max(np.abs(self.velocity).max(), np.abs(self.acceleration).max()) > STILL_RATE)


JERK_RATE = 20.0  # 1/s: jerk per acceleration where no jerk is stated
ALLOWANCE = 1e-6  # share of the limits that is left, so that rounding breaks none of them
STANDING_DURATION = 1e-3  # s: of a stop of joints that stand
GOAL_ROUNDING = 1e-9  # rad: a motion that ends farther from its goal is refused


def fastest_stop(state: MotionState, limits: JointLimits) -> Trajectory:
    """Every joint to rest in its own least time; those that stand before the others stay where they are.

    Args:
        state: of k joints.
        limits: of speed, acceleration and jerk; without a jerk it is 20 times the acceleration a second.

    Raises:
        InvalidProblem: state and limits are not of one number of joints, or Ruckig finds no profile.
    """
    wanted = _stated(state, limits)
    wanted.control_interface = ControlInterface.Velocity
    wanted.synchronization = Synchronization.No
    return _motion(state, wanted)


def fastest_move(state: MotionState, goal: MotionState, limits: JointLimits) -> Trajectory:
    """The fastest motion from one state to another; all joints arrive together.

    Args:
        state: of k joints.
        goal: of as many.
        limits: as in :func:`fastest_stop`.

    Raises:
        InvalidProblem: numbers of joints differ, or Ruckig finds no profile.
    """
    motion = _motion(state, _between(state, goal, limits), goal.derivatives)
    missed = float(np.abs(motion.value_at_end(0) - goal.angles).max())
    if missed > GOAL_ROUNDING:
        raise InvalidProblem("goal", f"the fastest motion misses it by {missed:.3g} rad")
    return motion


def fastest_duration(state: MotionState, goal: MotionState, limits: JointLimits) -> float:
    """How long the motion of :func:`fastest_move` takes, s; to make it takes 30 times as long as to tell this.

    Args:
        state: of k joints.
        goal: in which it ends.
        limits: as in :func:`fastest_stop`.

    Raises:
        InvalidProblem: as :func:`fastest_stop`.
    """
    return float(_profiles(_between(state, goal, limits)).duration) or STANDING_DURATION


def least_duration(state: MotionState, goal: MotionState, limits: JointLimits) -> float:
    """How long the fastest motion from one state to another takes, s; without a jerk limit accelerations may jump.

    Args:
        state: of k joints; a rate beyond its limit by rounding counts as the limit.
        goal: likewise.
        limits: of speed, acceleration and jerk.

    Raises:
        InvalidProblem: as :func:`fastest_move`.
    """
    unlimited = replace(limits, jerk=limits.jerk or (inf,) * limits.dof)
    wanted = _between(_within(state, limits), _within(goal, limits), unlimited, share=1.0)
    return float(_profiles(wanted).duration)


def _within(state: MotionState, limits: JointLimits) -> MotionState:
    """The state with rates no larger than their limits."""
    rates = zip((state.velocity, state.acceleration), limits.by_order, strict=False)
    return MotionState(state.angles, *(np.clip(rate, -bound, bound) for rate, bound in rates))


def _between(
    state: MotionState, goal: MotionState, limits: JointLimits, share: float = 1.0 - ALLOWANCE
) -> InputParameter:
    """The input of Ruckig for two states and a share of the limits."""
    if goal.angles.size != state.angles.size:
        raise InvalidProblem("goal", f"{state.angles.size} joint angles are needed, not {goal.angles.tolist()}")
    wanted = _stated(state, limits, share)
    wanted.target_position, wanted.target_velocity, wanted.target_acceleration = goal.derivatives.tolist()
    return wanted


def _stated(state: MotionState, limits: JointLimits, share: float = 1.0 - ALLOWANCE) -> InputParameter:
    """The state, a share of the limits, and rest as the target."""
    dof = limits.dof
    if state.angles.size != dof:
        raise InvalidProblem("state", f"{state.angles.size} joints where the limits have {dof}")
    if limits.jerk is None:
        limits = replace(limits, jerk=tuple(JERK_RATE * most for most in limits.acceleration))
    wanted = InputParameter(dof)
    wanted.current_position = state.angles.tolist()
    wanted.current_velocity = state.velocity.tolist()
    wanted.current_acceleration = state.acceleration.tolist()
    for name, bounds in zip(("velocity", "acceleration", "jerk"), limits.by_order, strict=True):
        setattr(wanted, f"max_{name}", (share * bounds).tolist())
    return wanted


def _profiles(wanted: InputParameter) -> Profiles:
    """The profiles that Ruckig computes."""
    profiles = Profiles(wanted.degrees_of_freedom)
    try:
        outcome = Ruckig(wanted.degrees_of_freedom).calculate(wanted, profiles)
    except RuntimeError as error:  # of limits that are no numbers, for example
        raise InvalidProblem("state", f"there is no fastest motion from it: {error}") from error
    if outcome < 0:
        raise InvalidProblem("state", f"there is no fastest motion from it: {outcome.name}")
    return profiles


def _motion(state: MotionState, wanted: InputParameter, goal: FloatArray | None = None) -> Trajectory:
    """The motion as cubic pieces that begin with the state and end at the goal, (3, k), where there is one."""
    joints = [_jerks(profile) for profile in _profiles(wanted).profiles[0]]
    if goal is not None:
        joints = [(h, _corrected(h, j, state, joint, goal[:, joint])) for joint, (h, j) in enumerate(joints)]
    duration = max((float(durations.sum()) for durations, _ in joints), default=0.0)
    if not duration > 0.0:
        return Trajectory.standing(state.angles, STANDING_DURATION)
    ends = np.zeros_like(state.acceleration) if goal is None else goal[2]
    moves = [
        _pieces(durations, jerks, start, end, duration)
        for (durations, jerks), start, end in zip(joints, state.acceleration, ends, strict=True)
    ]
    return side_by_side(moves, duration).trajectory(state.angles, state.velocity)


def _jerks(profile: Profile) -> tuple[FloatArray, FloatArray]:
    """Durations and jerks of one joint's pieces: what brings it back within its limits first."""
    parts = (profile.brake, profile, profile.accel)
    durations, jerks = np.concatenate([part.t for part in parts]), np.concatenate([part.j for part in parts])
    return durations[durations > 0.0], jerks[durations > 0.0]


def _corrected(
    durations: FloatArray, jerks: FloatArray, state: MotionState, joint: int, goal: FloatArray
) -> FloatArray:
    """The jerks of one joint, changed as little as can be, so that it ends at (3,): Ruckig misses by up to 1e-8."""
    if not durations.size:
        return jerks
    total = float(durations.sum())
    left = total - np.cumsum(durations)
    gains = np.stack(
        [
            durations**3 / 6.0 + durations**2 / 2.0 * left + durations * left**2 / 2.0,
            (durations**2 / 2.0 + durations * left) * total,
            durations * total**2,
        ]
    )
    angle, speed, rate = (float(values[joint]) for values in (state.angles, state.velocity, state.acceleration))
    coasting = np.array(
        [angle + speed * total + rate * total**2 / 2.0, speed * total + rate * total**2, rate * total**2]
    )
    missing = goal * total ** np.arange(3) - coasting - gains @ jerks
    return np.asarray(jerks + np.linalg.lstsq(gains, missing, rcond=None)[0])


def _pieces(durations: FloatArray, jerks: FloatArray, start: float, end: float, duration: float) -> AccelerationPieces:
    """One joint's accelerations (p, 1), those at its ends given in rad/s^2; the last lasts until all have arrived."""
    accelerations = start + np.concatenate([[0.0], np.cumsum(durations * jerks)])
    accelerations[-1] = end
    rest = max(duration - float(durations.sum()), 0.0)
    positive = np.append(durations, rest) > 0.0
    parts = (np.append(durations, rest), accelerations, np.append(jerks, 0.0))
    times, values, rates = (part[positive] for part in parts)
    return AccelerationPieces(times, values[:, None], rates[:, None])
