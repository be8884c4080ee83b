"""Benchmark functions by name: ``rastrigin-10``, shifted and rotated ``rastrigin-10@3``, of COCO ``bbob-f15-10@3``."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from solvers.box import Box, FloatArray
from solvers.functions.classical import CLASSICAL, Classical

MOST_VARIABLES = 1000
CENTRAL = 0.8  # share of the box, around its centre, in which a shifted minimum lies
BBOB_FUNCTIONS = range(1, 25)
BBOB_EDGE = 5.0  # its box is [-5, 5]^d
NAME = re.compile(r"(?P<family>[a-z][a-z0-9-]*)-(?P<dimension>[1-9][0-9]{0,8})(?:@(?P<instance>[1-9][0-9]{0,8}))?")
BENCHMARK_FUNCTIONS: tuple[str, ...] = (*CLASSICAL, *(f"bbob-f{number}" for number in BBOB_FUNCTIONS))


class InvalidFunction(ValueError):
    """A name that stands for no benchmark function; the message is one line."""


@dataclass(frozen=True, eq=False)
class BenchmarkFunction:
    """A function to be minimised, whose minimum is known; call it with one vector or with a population.

    Attributes:
        name: ``rastrigin-10@3``.
        f: of a population (m, d) -> (m,).
        box: where to search.
        minimum: where it is lowest, (d,).
    """

    name: str
    f: Callable[[FloatArray], FloatArray]
    box: Box
    minimum: FloatArray

    @property
    def dimension(self) -> int:
        """Number of variables, d."""
        return self.box.dimension

    @property
    def bounds(self) -> FloatArray:
        """One row (low, high) a variable, (d, 2)."""
        return np.stack([self.box.lower, self.box.upper], axis=1)

    @property
    def optimum(self) -> float:
        """The lowest value."""
        return float(self.f(self.minimum[None])[0])

    def __call__(self, x: FloatArray) -> FloatArray | float:
        """Values (m,) of a population (m, d), or the value of one vector (d,).

        Raises:
            ValueError: of another shape.
        """
        points = np.asarray(x, dtype=np.float64)
        if points.ndim not in (1, 2) or points.shape[-1] != self.dimension:
            raise ValueError(f"{self.name}: x of shape {points.shape} where (d,) or (m, d) with d = {self.dimension}")
        return float(self.f(points[None])[0]) if points.ndim == 1 else self.f(points)

    def __repr__(self) -> str:
        return f"BenchmarkFunction({self.name!r}, {self.dimension} variables, optimum={self.optimum:.6g})"


def benchmark_function(name: str) -> BenchmarkFunction:
    """A function by its name.

    Args:
        name: ``FUNCTION-D`` as published with d variables, or ``FUNCTION-D@N``, its minimum shifted and its axes
            rotated at random by the seed N; ``bbob-fK-D@N`` is COCO's function K, instance N (1 if none).

    Raises:
        InvalidFunction: there is none of that name, of so many variables, or COCO's package is not installed.
    """
    match = NAME.fullmatch(name)
    if match is None:
        raise InvalidFunction(f"{name!r:.60} is not FUNCTION-D or FUNCTION-D@N, such as rastrigin-10 or rastrigin-10@3")
    family, dimension, instance = match["family"], int(match["dimension"]), int(match["instance"] or 0)
    if family not in BENCHMARK_FUNCTIONS:
        raise InvalidFunction(f"no benchmark function {family!r:.40}; {_hint(family)}")
    if dimension > MOST_VARIABLES:
        raise InvalidFunction(f"{name}: at most {MOST_VARIABLES} variables")
    if family in CLASSICAL:
        return _classical(name, CLASSICAL[family], dimension, instance)
    return _bbob(name, int(family.removeprefix("bbob-f")), dimension, instance or 1)


def _hint(family: str) -> str:
    nearest = difflib.get_close_matches(family, BENCHMARK_FUNCTIONS, n=1, cutoff=0.5)
    return f"did you mean {nearest[0]}?" if nearest else f"there are {', '.join(CLASSICAL)} and bbob-f1 to bbob-f24"


def _classical(name: str, function: Classical, dimension: int, instance: int) -> BenchmarkFunction:
    if dimension < function.fewest:
        raise InvalidFunction(f"{name}: needs {function.fewest} variables or more")
    box = Box(np.full(dimension, function.low), np.full(dimension, function.high))
    published = function.minimum(dimension)
    if not instance:
        return BenchmarkFunction(name, function.f, box, published)
    rng = np.random.default_rng(instance)
    shifted = box.from_unit(0.5 + CENTRAL * (rng.random((1, dimension)) - 0.5))[0]
    rotation = _rotation(rng, dimension)
    return BenchmarkFunction(name, lambda x: function.f((x - shifted) @ rotation.T + published), box, shifted)


def _rotation(rng: np.random.Generator, dimension: int) -> FloatArray:
    """An orthogonal matrix (d, d), uniform over all (Mezzadri, 2007)."""
    q, r = np.linalg.qr(rng.standard_normal((dimension, dimension)))
    return np.asarray(q * np.sign(np.diag(r)))


def _bbob(name: str, number: int, dimension: int, instance: int) -> BenchmarkFunction:
    if find_spec("cocoex") is None:
        raise InvalidFunction(f"{name}: needs the package coco-experiment: pip install 'tpbso-casadi[coco]'")
    if dimension < 2:
        raise InvalidFunction(f"{name}: needs 2 variables or more")
    import cocoex  # noqa: PLC0415 (optional)

    problem = cocoex.BareProblem("bbob", number, dimension, instance)
    edge = np.full(dimension, BBOB_EDGE)
    minimum = np.asarray(problem.best_parameter(), dtype=np.float64)
    return BenchmarkFunction(name, lambda x: np.array([problem(row) for row in x]), Box(-edge, edge), minimum)
