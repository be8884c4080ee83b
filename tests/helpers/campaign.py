"""Solvers that misbehave, for campaigns to survive. Their workers import this module by name."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solvers import Iterations, Search, SearchBox, Solver


@dataclass(frozen=True)
class Random(Solver):
    """Candidates out of the blue."""

    population: int = 10

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        yield box.sample(rng, self.population)
        for _ in iterations:
            yield box.sample(rng, self.population)


@dataclass(frozen=True)
class Raises(Random):
    """Raises in some of its runs."""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        if rng.random() < 0.5:
            raise ArithmeticError("this one\nfails")
        yield from super().search(box, rng, iterations)


@dataclass(frozen=True)
class Kills(Random):
    """Takes its worker with it; only the first time when there is a mark to leave."""

    mark: str = ""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        if not self.mark or not Path(self.mark).exists():
            if self.mark:
                Path(self.mark).touch()
            os._exit(9)
        yield from super().search(box, rng, iterations)


@dataclass(frozen=True)
class Exits(Random):
    """Wants to end the process, as if all were well."""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        yield box.sample(rng, self.population)
        raise SystemExit(0)


@dataclass(frozen=True)
class Endless(Random):
    """Leaves a mark, and never comes back."""

    mark: str = ""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        Path(self.mark).write_text(str(os.getpid()))
        while True:
            time.sleep(1.0)
        yield box.sample(rng, self.population)
