"""Global optimisers of SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

import numpy as np
from scipy.optimize import Bounds, differential_evolution, direct, dual_annealing

from solvers.external.callbacks import Cost, callback_to_generator
from solvers.solver import DEFAULT_EVALUATIONS, Iterations, Search, SearchBox, Solver, require

Strategy = Literal["best1bin", "rand1bin", "currenttobest1bin"]
UNLIMITED = 10**9  # iterations; the budget ends the search
CALLS_PER_ITERATION = 100  # of dual annealing's cost, one candidate each, counted as one iteration


@dataclass(frozen=True)
class SciPyDE(Solver):
    """``scipy.optimize.differential_evolution`` without its final polish; all but the population as SciPy has it."""

    minimum_population: ClassVar[int] = 5

    population: int = 50  # m >= 5; SciPy's own default is 15 d
    strategy: Strategy = "best1bin"
    recombination: float = 0.7  # in [0, 1]

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.strategy in get_args(Strategy), f"strategy = {self.strategy!r} is unknown")
        require(0.0 <= self.recombination <= 1.0, f"recombination = {self.recombination} is not in [0, 1]")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:

        def run(cost: Cost) -> None:
            def vectorised(shares: Any) -> Any:  # SciPy's types know scalar costs only
                return cost(box.from_unit(shares.T))

            while True:
                differential_evolution(
                    vectorised,
                    Bounds(np.zeros(box.dimension), np.ones(box.dimension)),
                    strategy=self.strategy,
                    init=box.initial_shares(rng.random((self.population, box.dimension))),
                    recombination=self.recombination,
                    maxiter=UNLIMITED,
                    rng=rng,
                    polish=False,
                    updating="deferred",
                    vectorized=True,
                )

        return callback_to_generator(run, iterations)


@dataclass(frozen=True)
class DualAnnealing(Solver):
    """``scipy.optimize.dual_annealing``, without its local search, which would need thousands of finite differences."""

    minimum_population: ClassVar[int] = 1

    population: int = 1  # one candidate at a time
    visit: float = 2.62  # in (1, 3], of the visiting distribution
    restart_temp_ratio: float = 2e-5  # in (0, 1)

    def __post_init__(self) -> None:
        super().__post_init__()
        require(1.0 < self.visit <= 3.0, f"visit = {self.visit} is not in (1, 3]")
        require(0.0 < self.restart_temp_ratio < 1.0, f"restart_temp_ratio = {self.restart_temp_ratio} is not in (0, 1)")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:

        def run(cost: Cost) -> None:
            def one(shares: Any) -> float:
                return float(cost(box.from_unit(shares[None]))[0])

            dual_annealing(
                one,
                Bounds(np.zeros(box.dimension), np.ones(box.dimension)),
                maxiter=UNLIMITED,
                maxfun=UNLIMITED,
                visit=self.visit,
                restart_temp_ratio=self.restart_temp_ratio,
                no_local_search=True,
                rng=rng,
                x0=None if box.known is None else box.to_unit(box.known)[0],
            )

        return callback_to_generator(run, iterations, CALLS_PER_ITERATION)


@dataclass(frozen=True)
class DirectRectangles(Solver):
    """``scipy.optimize.direct``: divides the box, without any random number. It begins at the centre.

    Jones, Perttunen and Stuckman, "Lipschitzian Optimization Without the Lipschitz Constant", 1993; locally biased:
    Gablonsky and Kelley, 2001.
    """

    minimum_population: ClassVar[int] = 1

    population: int = 1  # one candidate at a time
    locally_biased: int = 1  # 0 or 1
    eps: float = 1e-4  # >= 0, least improvement that a rectangle has to promise

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.locally_biased in (0, 1), f"locally_biased = {self.locally_biased} is neither 0 nor 1")
        require(self.eps >= 0.0, f"eps = {self.eps} is negative")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        evaluations = iterations.evaluations or DEFAULT_EVALUATIONS

        def run(cost: Cost) -> None:
            if box.known is not None:
                cost(box.known[:1])

            def one(shares: Any) -> float:
                return float(cost(box.from_unit(shares[None]))[0])

            direct(
                one,
                Bounds(np.zeros(box.dimension), np.ones(box.dimension)),
                eps=self.eps,
                maxfun=evaluations,
                maxiter=evaluations,  # no more than that: it takes memory for each
                locally_biased=bool(self.locally_biased),
                vol_tol=0.0,
                len_tol=0.0,
            )

        return callback_to_generator(run, iterations, CALLS_PER_ITERATION)
