"""When a motion passes parameters of its path, and how that changes with its speeds: what obstacles that move ask."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.sequential.path_speed import GAUSS, MotionSpace, PathSpeed


@dataclass(frozen=True)
class Clock:
    """Times t(u), the integral of du / w(u) from 0 on, by Gauss's rule between one parameter and the next.

    Args:
        space: of motions.
        u: parameters, (n,), the first 0, none smaller than the one before.
        waits: how many of them are passed before the motion begins, in equal steps.
    """

    space: MotionSpace
    u: FloatArray
    waits: int = 0

    @cached_property
    def _nodes(self) -> tuple[FloatArray, FloatArray]:
        """Basis functions of the speed at the nodes, ((n - 1) GAUSS, M), and weights, (n - 1, GAUSS)."""
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
        lengths = np.diff(self.u)[:, None]
        at = self.u[:-1, None] + lengths * (nodes + 1.0) / 2.0
        return self.space.speed.matrix(at.ravel()), weights * lengths / 2.0

    def steps(self, speeds: FloatArray) -> FloatArray:
        """How long a motion with such speeds, (M,), takes from each parameter to the next, (n - 1,), s."""
        basis, weights = self._nodes
        return np.asarray((weights / (basis @ speeds).reshape(weights.shape)).sum(axis=1))

    @property
    def _delays(self) -> FloatArray:
        """Shares of the delay that have passed, (n,)."""
        return np.minimum(np.arange(self.u.size) / max(self.waits, 1), 1.0)

    def times(self, motion: PathSpeed) -> FloatArray:
        """When a motion passes each, (n,), s."""
        return np.asarray(np.append(0.0, np.cumsum(self.steps(motion.speeds))) + self._delays * motion.delay)

    def slopes(self, motion: PathSpeed) -> FloatArray:
        """Of these times with respect to the speeds, s^2, and to the delay: (n, M + 1)."""
        basis, weights = self._nodes
        falls = -weights.ravel()[:, None] / (basis @ motion.speeds)[:, None] ** 2 * basis
        steps = falls.reshape(*weights.shape, -1).sum(axis=1)
        by_speeds = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
        return np.concatenate([by_speeds, self._delays[:, None]], axis=1)
