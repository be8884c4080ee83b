"""A motion sampled in time: what every objective and constraint is written in."""

from __future__ import annotations

from dataclasses import dataclass

from problems.base.matrix import Matrix


@dataclass(frozen=True)
class Samples:
    """Joint motion at n times; symbolic in a model, numeric when a trajectory is verified.

    Attributes:
        theta: joint angles, (n, k), rad.
        speed: dtheta/dt, (n, k), rad/s.
        acceleration: d2theta/dt2, (n, k), rad/s^2.
        duration: of the whole motion, scalar, s.
    """

    theta: Matrix
    speed: Matrix
    acceleration: Matrix
    duration: Matrix

    def time_scaled(self, factor: Matrix) -> Samples:
        """The same shape run ``factor`` times slower."""
        return Samples(self.theta, self.speed / factor, self.acceleration / factor**2, self.duration * factor)
