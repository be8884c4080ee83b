"""A robot on its way: the torques of its motors at single times, and bounds of them over cells of time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.bernstein import bernstein
from problems.base.matrix import FloatArray, as_array
from problems.certify.dynamics.taylor import DEGREE, ENTRIES, ROUNDING, modelled
from problems.certify.dynamics.time_cells import Moments, TimeCells
from problems.certify.verdict import TOLERANCE
from problems.limits.torque import TorqueLimit
from problems.motions.trajectory import Trajectory
from problems.robots.rigid.slowing_down import time_scales_of_arrays
from problems.robots.robot import Robot

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
        chain, k = robot.massive, robot.dof
        smooth = replace(chain, joints=tuple(replace(joint, friction=0.0) for joint in chain.joints))
        state = ca.SX.sym("state", 3 * k)
        q, v, a = (part.T for part in ca.vertsplit(state, k))
        parts = [chain.inertial(q, v, a).T, chain.viscous(v).T, chain.gravitational(q).T]
        total = ca.Function("torques", [state], [ca.densify(smooth.torques(q, v, a).T)], {"cse": True})
        return cls(
            ca.Function("parts", [state], [ca.densify(part) for part in parts], {"cse": True}),
            modelled(total),
            np.array([float(joint.friction) for joint in chain.joints]),
        )


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
