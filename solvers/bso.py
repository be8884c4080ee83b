"""BSO: beetle swarm optimisation, Algorithm 1 and (26)-(32) of the TPBSO paper.

Wang and Yang, "Beetle Swarm Optimization Algorithm: Theory and Application", 2018 [49 of the paper]: particles
that are beetles. Each one evaluates the cost at its two antennae and adds a step towards the better side to the
velocity of a particle.

Deviations from the paper, each with a parameter that undoes it, both undone by the preset ``printed``:
    * an inertia weight w before V in (27), from 0.9 down to 0.4 as in [49]; (27) prints none (``inertia_first =
      inertia_last = 1``);
    * the sign of (28): as printed it steps towards the worse antenna (``antenna_sign="printed"``).
Interpretation: the paper's indices in (26) and (28)-(30) are inconsistent; here, as in its Algorithm 1, the new V of
(27) is used everywhere, and the antennae are x ± V d / 2. r1 and r2 of (27) are drawn for every component.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, Literal

import numpy as np

from solvers.solver import FloatArray, Iterations, Preset, Search, SearchBox, Solver, require
from solvers.swarm import Swarm, linear_schedule

PRINTED: Preset = MappingProxyType({"inertia_first": 1.0, "inertia_last": 1.0, "antenna_sign": "printed"})


@dataclass(frozen=True)
class BSO(Solver):
    """Beetle swarm optimisation as the paper has it.

    Each iteration takes three evaluations a beetle: two antennae and the new position.

    The defaults are the best found on the paper's eight point-to-point cases, with the same effort for each solver: see
    ``benchmarks/results/tune.md`` and ``benchmarks/tune.py``.

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 2
    presets: ClassVar[Mapping[str, Preset]] = MappingProxyType({"printed": PRINTED})  # (27) and (28) to the letter

    population: int = 30  # m >= 2, beetles
    lambda_: float = 0.95  # lambda in [0, 1] of (26): share of the particle's velocity against the beetle's step
    c1: float = 1.7  # >= 0, learning factor of (27) towards the beetle's own best
    c2: float = 1.7  # >= 0, learning factor of (27) towards the swarm's best
    inertia_first: float = 0.9  # >= 0, inertia weight w at the start, [49]; 1 is (27) as printed
    inertia_last: float = 0.4  # >= 0, w at the end, linear in between
    velocity_range: float = 0.1  # > 0, v_max of Algorithm 1 as a share of the box; v_min = -v_max
    delta_0: float = 2.0  # >= 0, first step size of (32)
    eta: float = 0.95  # in (0, 1], decay of the step size in (32)
    c: float = 8.0  # > 0, step size over antenna length, (31)
    antenna_sign: Literal["descend", "printed"] = "descend"  # of (28)

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0.0 <= self.lambda_ <= 1.0, f"lambda_ = {self.lambda_} is not in [0, 1]")
        require(self.c1 >= 0.0 and self.c2 >= 0.0, "c1 and c2 are not negative")
        require(self.inertia_first >= 0.0 and self.inertia_last >= 0.0, "the inertia is not negative")
        require(self.velocity_range > 0.0, f"velocity_range = {self.velocity_range} is not positive")
        require(self.delta_0 >= 0.0, f"delta_0 = {self.delta_0} is negative")
        require(0.0 < self.eta <= 1.0, f"eta = {self.eta} is not in (0, 1]")
        require(self.c > 0.0, f"c = {self.c} is not positive")
        require(self.antenna_sign in ("descend", "printed"), f"antenna_sign = {self.antenna_sign!r} is unknown")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        """Candidates of Algorithm 1 of the paper."""
        v_max = self.velocity_range * box.span
        swarm = Swarm.start(box, rng, self.population, v_max)  # line 1
        swarm.update_best((yield swarm.x))  # lines 2-3
        delta = self.delta_0
        for progress in iterations:  # line 4
            inertia = linear_schedule(self.inertia_first, self.inertia_last, progress)
            swarm.accelerate(rng, inertia, self.c1, self.c2, v_max)  # line 6, (27)
            right, left = self.antennae(box, swarm, delta)
            cost = yield np.concatenate([right, left])  # line 7
            step = self.beetle_step(swarm.v, delta, *np.split(cost, 2))  # line 8
            swarm.x = box.clip(swarm.x + self.lambda_ * swarm.v + (1.0 - self.lambda_) * step)  # line 9, (26)
            swarm.update_best((yield swarm.x))  # lines 11-20
            delta *= self.eta  # line 21, (32)

    def antennae(self, box: SearchBox, swarm: Swarm, delta: float) -> tuple[FloatArray, FloatArray]:
        """The antennae (29)-(31): x_right, x_left = x ± V d / 2 with d = delta / c; kept in the box. Both (m, d)."""
        antenna = swarm.v * (delta / self.c / 2.0)
        return box.clip(swarm.x + antenna), box.clip(swarm.x - antenna)

    def beetle_step(self, v: FloatArray, delta: float, cost_right: FloatArray, cost_left: FloatArray) -> FloatArray:
        """The step (28): xi = ± delta V sign(F(x_right) - F(x_left)), (m, d); 0 where both antennae cost the same."""
        sign = (cost_right > cost_left).astype(np.float64) - (cost_right < cost_left)
        if self.antenna_sign == "descend":
            sign = -sign
        return delta * v * sign[:, None]
