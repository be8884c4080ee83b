"""How joints move at one time."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.motions.trajectory import SMOOTH_ORDERS, Trajectory

STILL = 1e-9  # rad/s, rad/s^2


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
        """With which a motion arrives."""
        return cls(*(trajectory.value_at_end(order) for order in range(SMOOTH_ORDERS)))

    @property
    def moves(self) -> bool:
        """Whether a joint does, by more than rounding, or is about to."""
        return bool(max(np.abs(self.velocity).max(), np.abs(self.acceleration).max()) > STILL)
