"""Benchmark functions: thirteen classical ones and COCO's, shifted and rotated.

Jamil and Yang, "A Literature Survey of Benchmark Functions For Global Optimization Problems", 2013.
"""

from __future__ import annotations

import difflib
import re
import reprlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np

from solvers.solver import FloatArray, SearchBox

SCHWEFEL_MINIMUM = 420.9687462275036
SCHWEFEL_OFFSET = 418.9828872724338
SCHWEFEL_EDGE = 500.0
STYBLINSKI_MINIMUM = -2.903534027771178


@dataclass(frozen=True)
class Classical:
    """A benchmark function as published.

    Attributes:
        f: of a population (m, d) -> (m,); at no point of the whole space lower than at ``minimum``.
        low: of every coordinate of the box.
        high: of every coordinate of the box.
        minimum: where it is lowest, of d variables, (d,).
        fewest: variables that it needs.
    """

    f: Callable[[FloatArray], FloatArray]
    low: float
    high: float
    minimum: Callable[[int], FloatArray]
    fewest: int = 1


def sphere(x: FloatArray) -> FloatArray:
    """Sum of squares: convex, separable, all directions alike."""
    return _sum(x**2)


def ellipsoid(x: FloatArray) -> FloatArray:
    """Sum of squares with weights from 1 to 10^6."""
    return _sum(10.0 ** (6.0 * np.linspace(0.0, 1.0, x.shape[1])) * x**2)


def bent_cigar(x: FloatArray) -> FloatArray:
    """One flat direction, all others 10^6 times as steep."""
    return np.asarray(x[:, 0] ** 2 + 1e6 * _sum(x[:, 1:] ** 2))


def rosenbrock(x: FloatArray) -> FloatArray:
    """A curved, flat valley."""
    return _sum(100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2)


def rastrigin(x: FloatArray) -> FloatArray:
    """A bowl with about 11^d regular local minima."""
    return _sum(x**2 - 10.0 * np.cos(2.0 * np.pi * x) + 10.0)


def ackley(x: FloatArray) -> FloatArray:
    """Nearly flat with a deep funnel."""
    root = np.sqrt(np.mean(x**2, axis=1))
    waves = np.mean(np.cos(2.0 * np.pi * x), axis=1)
    return np.asarray(20.0 - 20.0 * np.exp(-0.2 * root) + (np.e - np.exp(waves)))


def griewank(x: FloatArray) -> FloatArray:
    """A wide bowl with many shallow minima."""
    waves = np.prod(np.cos(x / np.sqrt(np.arange(1, x.shape[1] + 1))), axis=1)
    return np.asarray(_sum(x**2) / 4000.0 - waves + 1.0)


def schwefel(x: FloatArray) -> FloatArray:
    """Deep minima far from each other, the lowest near a corner; rising outside its box, where it is not defined."""
    inside = np.clip(x, -SCHWEFEL_EDGE, SCHWEFEL_EDGE)
    wells = SCHWEFEL_OFFSET - inside * np.sin(np.sqrt(np.abs(inside)))
    return _sum(wells + 0.01 * (x - inside) ** 2)


def levy(x: FloatArray) -> FloatArray:
    """Waves on a bowl, steep across one direction."""
    w = 1.0 + (x - 1.0) / 4.0
    first, last = w[:, 0], w[:, -1]
    middle = (w[:, :-1] - 1.0) ** 2 * (1.0 + 10.0 * np.sin(np.pi * w[:, :-1] + 1.0) ** 2)
    end = (last - 1.0) ** 2 * (1.0 + np.sin(2.0 * np.pi * last) ** 2)
    return np.asarray(np.sin(np.pi * first) ** 2 + _sum(middle) + end)


def zakharov(x: FloatArray) -> FloatArray:
    """One minimum in a plate that bends away."""
    slope = 0.5 * x @ np.arange(1.0, x.shape[1] + 1.0)
    return np.asarray(_sum(x**2) + slope**2 + slope**4)


def dixon_price(x: FloatArray) -> FloatArray:
    """A narrow valley in which each variable depends on the one before."""
    steps = np.arange(2.0, x.shape[1] + 1.0) * (2.0 * x[:, 1:] ** 2 - x[:, :-1]) ** 2
    return np.asarray((x[:, 0] - 1.0) ** 2 + _sum(steps))


def styblinski_tang(x: FloatArray) -> FloatArray:
    """Two wells a variable, one deeper; its lowest value is about -39.166 d."""
    return _sum(x**4 - 16.0 * x**2 + 5.0 * x) / 2.0


def salomon(x: FloatArray) -> FloatArray:
    """Spherical ripples around the minimum."""
    radius = np.sqrt(_sum(x**2))
    return np.asarray(1.0 - np.cos(2.0 * np.pi * radius) + 0.1 * radius)


def _sum(terms: FloatArray) -> FloatArray:
    return np.asarray(terms.sum(axis=1))


def _dixon_price_minimum(dimension: int) -> FloatArray:
    powers = 2.0 ** np.arange(1, dimension + 1)
    return np.asarray(2.0 ** (-(powers - 2.0) / powers))


CLASSICAL: dict[str, Classical] = {
    "sphere": Classical(sphere, -5.12, 5.12, np.zeros),
    "ellipsoid": Classical(ellipsoid, -5.0, 5.0, np.zeros, fewest=2),
    "bent-cigar": Classical(bent_cigar, -5.0, 5.0, np.zeros, fewest=2),
    "rosenbrock": Classical(rosenbrock, -5.0, 10.0, np.ones, fewest=2),
    "rastrigin": Classical(rastrigin, -5.12, 5.12, np.zeros),
    "ackley": Classical(ackley, -32.768, 32.768, np.zeros),
    "griewank": Classical(griewank, -600.0, 600.0, np.zeros),
    "schwefel": Classical(schwefel, -500.0, 500.0, lambda d: np.full(d, SCHWEFEL_MINIMUM)),
    "levy": Classical(levy, -10.0, 10.0, np.ones),
    "zakharov": Classical(zakharov, -5.0, 10.0, np.zeros),
    "dixon-price": Classical(dixon_price, -10.0, 10.0, _dixon_price_minimum),
    "styblinski-tang": Classical(styblinski_tang, -5.0, 5.0, lambda d: np.full(d, STYBLINSKI_MINIMUM)),
    "salomon": Classical(salomon, -100.0, 100.0, np.zeros),
}


MOST_VARIABLES = 1000
CENTRAL = 0.8  # share of the box, around its centre, in which a shifted minimum lies
BBOB_FUNCTIONS = range(1, 25)
BBOB_EDGE = 5.0  # its box is [-5, 5]^d
NAME = re.compile(r"(?P<family>[a-z][a-z0-9-]*)-(?P<dimension>[1-9][0-9]{0,8})(?:@(?P<instance>[1-9][0-9]{0,8}))?")
BENCHMARK_FUNCTIONS: tuple[str, ...] = (*CLASSICAL, *(f"bbob-f{number}" for number in BBOB_FUNCTIONS))


class InvalidFunction(ValueError):
    """Raised for a name of no benchmark function; the message is one line."""


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
    box: SearchBox
    minimum: FloatArray

    @property
    def dimension(self) -> int:
        """The number of variables, d."""
        return self.box.dimension

    @property
    def bounds(self) -> FloatArray:
        """One row (low, high) a variable, (d, 2)."""
        return np.stack([self.box.lower, self.box.upper], axis=1)

    @property
    def optimum(self) -> float:
        """The lowest value, at the minimum."""
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
    """The benchmark function of a name.

    Args:
        name: ``FUNCTION-D`` as published with d variables, or ``FUNCTION-D@N``, its minimum shifted and its axes
            rotated at random by the seed N; ``bbob-fK-D@N`` is COCO's function K, instance N (1 if none).

    Raises:
        InvalidFunction: there is none of that name, of so many variables, or COCO's package is not installed.
    """
    match = NAME.fullmatch(name) if isinstance(name, str) else None
    if match is None:
        raise InvalidFunction(
            f"{reprlib.repr(name):.60} is not FUNCTION-D or FUNCTION-D@N, such as rastrigin-10 or rastrigin-10@3"
        )
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
    box = SearchBox(np.full(dimension, function.low), np.full(dimension, function.high))
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
    return BenchmarkFunction(name, lambda x: np.array([problem(row) for row in x]), SearchBox(-edge, edge), minimum)
