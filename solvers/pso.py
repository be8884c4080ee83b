"""PSO: particle swarm optimisation with a global best and a falling inertia weight.

[1] Kennedy and Eberhart, "Particle Swarm Optimization", 1995; [2] Shi and Eberhart, "A Modified Particle Swarm
Optimizer", 1998 (inertia, from 0.9 to 0.4); [3] Clerc and Kennedy, 2002 (c1 = c2 = 1.49 with clamped velocities).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.solver import Iterations, Search, SearchBox, Solver, require
from solvers.swarm import Swarm, linear_schedule


@dataclass(frozen=True)
class PSO(Solver):
    """Particle swarm optimisation with a falling inertia.

    The defaults are the best found on the paper's eight point-to-point cases, with the same effort for each solver: see
    ``benchmarks/results/tune.md`` and ``benchmarks/tune.py``.

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 2

    population: int = 100  # m >= 2, particles
    c1: float = 1.22  # >= 0, pull towards the particle's own best [3]
    c2: float = 2.06  # >= 0, pull towards the swarm's best [3]
    inertia_first: float = 0.86  # >= 0, w at the start [2]
    inertia_last: float = 0.43  # >= 0, w at the end [2]
    velocity_range: float = 0.089  # > 0, v_max as a share of the box

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.c1 >= 0.0 and self.c2 >= 0.0, "c1 and c2 are not negative")
        require(self.inertia_first >= 0.0 and self.inertia_last >= 0.0, "the inertia is not negative")
        require(self.velocity_range > 0.0, f"velocity_range = {self.velocity_range} is not positive")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        v_max = self.velocity_range * box.span
        swarm = Swarm.start(box, rng, self.population, v_max)
        swarm.update_best((yield swarm.x))
        for progress in iterations:
            inertia = linear_schedule(self.inertia_first, self.inertia_last, progress)
            swarm.accelerate(rng, inertia, self.c1, self.c2, v_max)
            swarm.x = box.clip(swarm.x + swarm.v)
            swarm.update_best((yield swarm.x))
