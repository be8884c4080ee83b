"""The classical functions as published, each of a population (m, d) -> (m,), with its box and its minimum.

Jamil and Yang, "A Literature Survey of Benchmark Functions For Global Optimization Problems", 2013.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solvers.box import FloatArray

SCHWEFEL_MINIMUM = 420.9687462275036
SCHWEFEL_OFFSET = 418.9828872724338
SCHWEFEL_EDGE = 500.0
STYBLINSKI_MINIMUM = -2.903534027771178


@dataclass(frozen=True)
class Classical:
    """A function as published.

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
