"""What the motors give along a motion, and how that changes with angles, velocities and accelerations."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from problems.base.matrix import FloatArray, Matrix, as_array
from problems.limits.torque import TorqueLimit
from problems.motions.samples import Samples

STATE = 3  # angles, velocities, accelerations


@dataclass(frozen=True)
class JointTorques:
    """Torques as shares of their limits, at many samples at once.

    Args:
        limit: of them.
    """

    limit: TorqueLimit

    @property
    def dof(self) -> int:
        """The number of joints."""
        return self.limit.robot.dof

    @cached_property
    def _samples(self) -> Samples:
        return Samples.symbolic(self.limit.robot, STATE)

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
        """Of the limits, with their signs: (n, k); the sign of Coulomb friction is that of the velocity.

        Args:
            state: angles, velocities and accelerations, (n, 3 k).
        """
        return as_array(self._shares(state.T)).T

    def slopes(self, state: FloatArray) -> FloatArray:
        """How shares change with angles, velocities and accelerations: (n, k, 3, k)."""
        values = as_array(self._slopes(state.T)).T
        return values.reshape(len(state), self.dof, STATE, self.dof)

    def time_scale(self, state: FloatArray) -> float:
        """The factor by which a motion has to be slowed to keep its limits at samples; below 1 where time can be saved.

        That is exact: inertia takes less by the square of it, viscous friction by the factor itself, gravity nothing.
        """
        peaks = as_array(self._time_scales(state.T)).max(axis=1)
        return float(self.limit.time_scale(ca.DM(peaks).T))
