"""Common parts of swarms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.solver import FloatArray, SearchBox


@dataclass
class Swarm:
    """A swarm of m moving points.

    Attributes:
        x: positions x^t, (m, d).
        v: velocities V^t, (m, d).
        best: personal best positions P_is, (m, d).
        best_cost: their costs, (m,).
    """

    x: FloatArray
    v: FloatArray
    best: FloatArray
    best_cost: FloatArray

    @classmethod
    def start(cls, box: SearchBox, rng: np.random.Generator, size: int, v_max: FloatArray) -> Swarm:
        """Random positions in the box, known ones first, and velocities within ±v_max (d,); no costs yet."""
        x = box.initial(rng, size)
        v = rng.uniform(-v_max, v_max, x.shape)
        return cls(x, v, x.copy(), np.full(size, np.inf))

    @property
    def leader(self) -> FloatArray:
        """The best position P_gs that any member has visited, (d,)."""
        leader: FloatArray = self.best[np.argmin(self.best_cost)]
        return leader

    def update_best(self, cost: FloatArray) -> None:
        """Update personal bests with the costs (m,) of the present positions."""
        better = cost < self.best_cost
        self.best[better] = self.x[better]
        self.best_cost[better] = cost[better]

    def accelerate(self, rng: np.random.Generator, inertia: float, c1: float, c2: float, v_max: FloatArray) -> None:
        """The update (27): V <- w V + c1 r1 (P_is - x) + c2 r2 (P_gs - x), kept within ±v_max (d,)."""
        r1, r2 = rng.random((2, *self.x.shape))
        pull = c1 * r1 * (self.best - self.x) + c2 * r2 * (self.leader - self.x)
        self.v = np.clip(inertia * self.v + pull, -v_max, v_max)


def linear_schedule(first: float, last: float, progress: float) -> float:
    """A parameter that goes linearly from first to last as progress goes from 0 to 1."""
    return first + (last - first) * progress
