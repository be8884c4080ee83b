"""A path in joint space without any timing: a piecewise polynomial q(u), to be run at whatever speed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from scipy.interpolate import PPoly

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory


@dataclass(frozen=True)
class JointPath:
    """Joint angles over a path parameter u.

    Args:
        breakpoints: p + 1 increasing values of u.
        coefficients: (order, p, k), rad; highest power first, each piece in its own u from 0, as SciPy's PPoly.
    """

    breakpoints: FloatArray
    coefficients: FloatArray

    @classmethod
    def of(cls, trajectory: Trajectory) -> Self:
        """The path of a motion, with the time as its parameter."""
        return cls(trajectory.breakpoints, trajectory.coefficients)

    @cached_property
    def curve(self) -> PPoly:
        """The piecewise polynomial."""
        return PPoly(self.coefficients, self.breakpoints)

    def at(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """Angles or a derivative of them, (n, k), at parameters (n,)."""
        return np.asarray(self.curve(u, derivative))
