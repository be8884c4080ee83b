"""Torques of a robot as shares of their limits, at many samples at once, and how these change with its motion."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array
from problems.core import Dynamics
from problems.limits import Limit, TorqueLimit
from problems.motions import LEAST_TORQUE_SHARE, Samples, Trajectory
from problems.robots import time_scales_of_arrays

CACHED_LIMITS = 16
STATE_ORDERS = 3  # angles, velocities, accelerations


@dataclass(frozen=True)
class JointTorques:
    """Torques as shares of their limits, at many samples at once.

    Args:
        limit: of the torques.
    """

    limit: TorqueLimit

    @classmethod
    @lru_cache(maxsize=CACHED_LIMITS)
    def of(cls, limit: TorqueLimit) -> JointTorques:
        """The cached torques of a limit, whose functions are made once; by the core where that knows the robot."""
        dynamics = Dynamics.of(limit.robot) if type(limit) is TorqueLimit else None
        return cls(limit) if dynamics is None else CoreTorques(limit, dynamics)

    @classmethod
    def among(cls, limits: Iterable[Limit]) -> JointTorques | None:
        """The torques of the torque limit among some; None where there is none."""
        return next((cls.of(limit) for limit in limits if isinstance(limit, TorqueLimit)), None)

    @property
    def dof(self) -> int:
        """The number of joints."""
        return self.limit.robot.dof

    @cached_property
    def _samples(self) -> Samples:
        return Samples.symbolic(self.limit.robot, STATE_ORDERS)

    @property
    def _state(self) -> Matrix:
        return ca.horzcat(self._samples.theta, self._samples.speed, self._samples.acceleration)

    @property
    def _symbolic_shares(self) -> Matrix:
        return self._samples.torque / ca.horzcat(*self.limit.bounds)

    @cached_property
    def _shares(self) -> ca.Function:
        return ca.Function("shares", [self._state.T], [self._symbolic_shares.T], {"cse": True})

    @cached_property
    def _slopes(self) -> ca.Function:
        slopes = ca.densify(ca.jacobian(self._symbolic_shares, self._state))
        return ca.Function("slopes", [self._state.T], [ca.vec(slopes.T)], {"cse": True})

    @cached_property
    def _time_scales(self) -> ca.Function:
        magnitudes = self.limit.magnitudes(self._samples)
        return ca.Function("time_scales", [self._state.T], [magnitudes.T], {"cse": True})

    def shares(self, state: FloatArray) -> FloatArray:
        """Torques as shares of the limits, with their signs: (n, k); Coulomb friction has the sign of the velocity.

        Args:
            state: angles, velocities and accelerations, (n, 3 k).
        """
        return as_array(self._shares(state.T)).T

    def slopes(self, state: FloatArray) -> FloatArray:
        """How shares change with angles, velocities and accelerations: (n, k, 3, k)."""
        values = as_array(self._slopes(state.T)).T
        return values.reshape(len(state), self.dof, STATE_ORDERS, self.dof)

    def time_scale(self, state: FloatArray) -> float:
        """The time scale at which a motion keeps its limits at samples; below 1 where time can be saved.

        It is exact: inertia takes less by its square, viscous friction by the factor itself, gravity as much as before.
        """
        peaks = as_array(self._time_scales(state.T)).max(axis=1)
        return float(self.limit.time_scale(ca.DM(peaks).T))

    def time_scale_of(self, trajectory: Trajectory, times: FloatArray) -> float:
        """The time scale at which a motion keeps its limits at times (n,) in s."""
        return self.time_scale(np.concatenate([trajectory.at(times, order) for order in range(STATE_ORDERS)], axis=1))


@dataclass(frozen=True)
class CoreTorques(JointTorques):
    """Torques as shares of their limits by the compiled core.

    Args:
        limit: of the torques.
        dynamics: of its robot.
    """

    dynamics: Dynamics

    @property
    def _bounds(self) -> FloatArray:
        return np.array(self.limit.bounds)

    def shares(self, state: FloatArray) -> FloatArray:
        inertial, holding = self._torques(state)
        return np.asarray((inertial + holding + self._viscous(state)) / self._bounds)

    def slopes(self, state: FloatArray) -> FloatArray:
        return np.asarray(self.dynamics.slopes(state) / self._bounds[:, None, None])

    def time_scale(self, state: FloatArray) -> float:
        (inertial, holding), viscous, bounds = self._torques(state), self._viscous(state), self._bounds
        least = LEAST_TORQUE_SHARE * bounds
        above = time_scales_of_arrays(inertial, viscous, np.maximum(bounds - holding, least))
        below = time_scales_of_arrays(-inertial, -viscous, np.maximum(bounds + holding, least))
        return float(np.maximum(above, below).max())

    def _torques(self, state: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Torques of inertia, and those of gravity and Coulomb friction, (n, k) each."""
        inertial, gravity = self.dynamics.torques(state)
        return inertial, gravity + self.dynamics.friction * np.sign(self._speeds(state))

    def _viscous(self, state: FloatArray) -> FloatArray:
        return np.asarray(self.dynamics.damping * self._speeds(state))

    def _speeds(self, state: FloatArray) -> FloatArray:
        return state[:, self.dof : 2 * self.dof]
