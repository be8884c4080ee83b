"""The joints of a robot: their names, their units and their limits."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray


@dataclass(frozen=True, kw_only=True)
class Joints:
    """Names and units of joints.

    Attributes:
        names: for messages and tables.
        identifiers: the controller's names.
        units: of positions: rad, or m where a joint slides.
        base: the controller's name of the body that stands still.
    """

    names: tuple[str, ...]
    identifiers: tuple[str, ...]
    units: tuple[str, ...]
    base: str = "base"

    @property
    def torque_units(self) -> tuple[str, ...]:
        """The units of torques: N m, or N where a joint slides."""
        return tuple("N m" if unit == "rad" else "N" for unit in self.units)


@dataclass(frozen=True, kw_only=True)
class JointLimits:
    """Limits of the joints, one value per joint; None where there is no limit.

    Attributes:
        speed: bounds of |dq/dt|, rad/s.
        acceleration: bounds of |d2q/dt2|, rad/s^2.
        position: (lowest, highest) of q, rad.
        jerk: bounds of |d3q/dt3|, rad/s^3.
        torque: bounds of what the motors give, N m (N where a joint slides).
    """

    speed: tuple[float, ...]
    acceleration: tuple[float, ...]
    position: tuple[tuple[float, float], ...] | None = None
    jerk: tuple[float, ...] | None = None
    torque: tuple[float, ...] | None = None

    @property
    def dof(self) -> int:
        """The number of joints."""
        return len(self.speed)

    @property
    def by_order(self) -> tuple[FloatArray, ...]:
        """Bounds (dof,) of the absolute values of dq/dt, d2q/dt2 and so on, as far as they are limited."""
        return tuple(np.array(bound) for bound in (self.speed, self.acceleration, self.jerk) if bound is not None)

    @staticmethod
    def time_scale(shares: Iterable[float]) -> float:
        """The least factor by which time has to be multiplied, given the peak of each order as a share of its bound."""
        return max(float(share ** (1.0 / order)) for order, share in enumerate(shares, start=1))
