"""BAS: beetle antennae search, the one beetle that the paper's swarm is made of.

Jiang and Li, "BAS: Beetle Antennae Search Algorithm for Optimization Problems", International Journal of Robotics and
Control 1, 2018.

Deviation: the step of [BAS] falls by 5 % a time whatever the budget, until the beetle stands still; here a new beetle
starts at a random place once the step is below ``last_step``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.solver import Iterations, Search, SearchBox, Solver, require


@dataclass(frozen=True)
class BAS(Solver):
    """Beetle antennae search with restarts. Lengths are shares of the box.

    Each iteration takes three evaluations: two antennae in a random direction, and the new position.

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 1

    population: int = 1  # m >= 1, beetles that know nothing of each other
    first_step: float = 1.0  # > 0, delta^0
    eta: float = 0.95  # in (0, 1), decay of step and antennae
    shortest_antenna: float = 0.01  # >= 0, d_0 of d^t = eta d^(t-1) + d_0, of which d^0 is the first step
    last_step: float = 1e-4  # > 0, at which a new beetle starts

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.first_step > 0.0, f"first_step = {self.first_step} is not positive")
        require(0.0 < self.eta < 1.0, f"eta = {self.eta} is not in (0, 1)")
        require(self.shortest_antenna >= 0.0, f"shortest_antenna = {self.shortest_antenna} is negative")
        require(self.last_step > 0.0, f"last_step = {self.last_step} is not positive")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        x = box.initial(rng, self.population)
        yield x
        step = antenna = self.first_step
        for _ in iterations:
            direction = rng.standard_normal(x.shape)
            direction *= box.span / np.linalg.norm(direction, axis=1, keepdims=True)
            right, left = box.clip(x + antenna * direction), box.clip(x - antenna * direction)
            cost_right, cost_left = np.split((yield np.concatenate([right, left])), 2)
            better_side = (cost_left > cost_right).astype(np.float64) - (cost_left < cost_right)
            x = box.clip(x + step * direction * better_side[:, None])
            yield x
            step, antenna = self.eta * step, self.eta * antenna + self.shortest_antenna
            if step < self.last_step:
                x, step, antenna = box.sample(rng, self.population), self.first_step, self.first_step
