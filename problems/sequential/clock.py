"""When a motion passes parameters of its path, and how that changes with its speeds: what obstacles that move ask."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.sequential.path_speed import GAUSS, MotionSpace


@dataclass(frozen=True)
class Clock:
    """Times t(u), the integral of du / w(u) from 0 on, by Gauss's rule between one parameter and the next.

    Args:
        space: of motions.
        u: increasing parameters, (n,), the first 0.
    """

    space: MotionSpace
    u: FloatArray

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

    def times(self, speeds: FloatArray) -> FloatArray:
        """When it passes each, (n,), s."""
        return np.concatenate([[0.0], np.cumsum(self.steps(speeds))])

    def slopes(self, speeds: FloatArray) -> FloatArray:
        """Of these times with respect to the speeds, (n, M), s^2."""
        basis, weights = self._nodes
        falls = -weights.ravel()[:, None] / (basis @ speeds)[:, None] ** 2 * basis
        steps = falls.reshape(*weights.shape, -1).sum(axis=1)
        return np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
