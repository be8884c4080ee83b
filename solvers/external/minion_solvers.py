"""The algorithms of Minion by their names: jSO, NL-SHADE-RSP, ARRDE and others, in C++.

Muzakka, Möller, Finsterhölzl and others, "Minion: a high-performance derivative-free optimization library", 2025,
doi:10.5281/zenodo.14794240.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from minionpy import Minimizer

from solvers.external.callbacks import Cost, callback_to_generator
from solvers.solver import DEFAULT_EVALUATIONS, Iterations, Search, SearchBox, Solver, require

ALGORITHMS = (  # those that search a whole box
    *("ABC", "AGSK", "ARRDE", "BIPOP_aCMAES", "CMAES", "DE", "DMSPSO", "IMODE", "JADE", "LSHADE", "LSHADE_cnEpSin"),
    *("LSRTDE", "NLSHADE_RSP", "PSO", "RCMAES", "RDEX", "SPSO2011", "j2020", "jSO"),
)

MOVING_MEANS = ("BIPOP_aCMAES", "CMAES", "RCMAES")  # which begin around what is known, without its costs


@dataclass(frozen=True)
class Minion(Solver):
    """An algorithm of Minion with its own defaults, given the number of evaluations."""

    minimum_population: ClassVar[int] = 6

    population: int | None = None  # m >= 6; None: the algorithm's own, which most of them fit to dimension and budget
    algorithm: str = "ARRDE"  # one of ALGORITHMS

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.algorithm in ALGORITHMS, f"algorithm = {self.algorithm!r} is none of {', '.join(ALGORITHMS)}")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        """Candidates of one generation after the other, restarted where the algorithm ends before the budget."""
        left = iterations.evaluations or DEFAULT_EVALUATIONS

        def run(cost: Cost) -> None:
            nonlocal left

            def costs(shares: Any) -> list[float]:
                nonlocal left
                left -= len(shares)
                found: list[float] = cost(box.from_unit(np.asarray(shares, dtype=np.float64))).tolist()
                return found

            options = {} if self.population is None else {"population_size": self.population}
            known = [] if box.known is None else box.to_unit(box.known)[: self.minimum_population].tolist()
            if known and self.algorithm in MOVING_MEANS:
                costs(known)
            while True:
                Minimizer(
                    costs,
                    [(0.0, 1.0)] * box.dimension,
                    x0=known,
                    algo=self.algorithm,
                    maxevals=max(left, DEFAULT_EVALUATIONS // 100),
                    seed=int(rng.integers(2**31)),
                    options=options,
                ).optimize()
                known = []

        return callback_to_generator(run, iterations)
