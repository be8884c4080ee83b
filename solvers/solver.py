"""Solvers: frozen hyper-parameters and one random generator."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass, is_dataclass, replace
from math import isfinite
from numbers import Integral
from types import MappingProxyType
from typing import ClassVar, Literal, TypeAlias, TypeGuard

import numpy as np
from numpy.typing import NDArray

from solvers.budget import Budget

FloatArray: TypeAlias = NDArray[np.float64]


@dataclass(frozen=True)
class SearchBox:
    """The domain of a search: all x with lower <= x <= upper.

    Args:
        lower: shape (d,).
        upper: shape (d,).
        known: candidates that take the first places of initial populations, (m, d), as :meth:`with_known` gives them;
            None for none.

    Raises:
        ValueError: the corners differ in shape, are not finite, or are swapped.
    """

    lower: FloatArray
    upper: FloatArray
    known: FloatArray | None = None

    def __post_init__(self) -> None:
        try:
            for name in ("lower", "upper"):
                object.__setattr__(self, name, np.asarray(getattr(self, name), dtype=np.float64))
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(f"corners: two arrays (d,) of numbers are needed: {error}") from error
        if self.lower.shape != self.upper.shape or self.lower.ndim != 1 or self.lower.size == 0:
            raise ValueError(f"corners of shapes {self.lower.shape} and {self.upper.shape} where two (d,) are needed")
        if not (np.isfinite(self.lower).all() and np.isfinite(self.upper).all()):
            raise ValueError("a box has finite corners")
        if (self.lower > self.upper).any():
            raise ValueError("a lower corner is above the upper one: did you swap them?")

    @property
    def dimension(self) -> int:
        """The number of variables d."""
        return self.lower.size

    @property
    def span(self) -> FloatArray:
        """The lengths of the edges, (d,)."""
        return self.upper - self.lower

    def sample(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Uniform random points, (count, d)."""
        return rng.uniform(self.lower, self.upper, (count, self.dimension))

    def initial(self, rng: np.random.Generator, count: int) -> FloatArray:
        """The initial population (count, d): the known candidates, and uniform random points in the other places."""
        points = self.sample(rng, count)
        if self.known is not None:
            points[: len(self.known)] = self.known[:count]
        return points

    def initial_shares(self, shares: FloatArray) -> FloatArray:
        """The initial population in the unit cube: points (m, d) with the known candidates in the first places."""
        if self.known is None:
            return shares
        return np.concatenate([self.to_unit(self.known), shares[len(self.known) :]])[: len(shares)]

    def with_known(self, known: FloatArray | None) -> SearchBox:
        """The box with known candidates (m, d), clipped to it.

        Raises:
            ValueError: they are not (m, d), or not finite.
        """
        if known is None:
            return self
        if known.ndim != 2 or known.shape[1] != self.dimension or not np.isfinite(known).all():
            raise ValueError(f"known candidates of shape {known.shape} where finite (m, {self.dimension}) are needed")
        return replace(self, known=self.clip(known))

    def clip(self, points: FloatArray) -> FloatArray:
        """The nearest points of the box, same shape."""
        return np.clip(points, self.lower, self.upper)

    def from_unit(self, shares: FloatArray) -> FloatArray:
        """Map points (m, d) of the unit cube to the box; those outside the cube by rounding are clipped."""
        return self.clip(self.lower + shares * self.span)

    def to_unit(self, points: FloatArray) -> FloatArray:
        """Points (m, d) of the box as shares of its edges, 0 where an edge has no length."""
        return (points - self.lower) / np.where(self.span > 0.0, self.span, 1.0)


Preset: TypeAlias = Mapping[str, int | float | str]  # settings by name
NO_PRESETS: Mapping[str, Preset] = MappingProxyType({})


@dataclass(frozen=True, kw_only=True)
class Steps:
    """The kind of steps that the entries of a history count.

    Attributes:
        name: of one step, for the axis of a figure.
        first: number of the first entry.
    """

    name: str
    first: int


ITERATIONS = Steps(name="iteration", first=0)  # the initial population is iteration 0
STARTS = Steps(name="start", first=1)


class SolverTraits:
    """Base of all solvers, metaheuristic or gradient-based.

    Attributes:
        default_budget: used where the user states no limit.
        has_population: whether ``population`` is one of its settings.
        solves_program: whether it descends on a smooth program (:func:`solvers.descend`) rather than searching a box
            (:func:`solvers.driver`).
        steps: what the entries of its history count.
        presets: settings that belong together, by a name that stands for them: ``bso(printed)``.
    """

    default_budget: ClassVar[Budget]
    has_population: ClassVar[bool]
    solves_program: ClassVar[bool]
    steps: ClassVar[Steps]
    presets: ClassVar[Mapping[str, Preset]] = NO_PRESETS


class Iterations(Iterator[float]):
    """An iterator over the share of the budget already used, from 0 to 1, once for each iteration.

    Ends when a limit is reached.

    Args:
        progress: the shares.
        evaluations: the budget in evaluations, for solvers that fit their population to it; None where evaluations
            are not limited.
    """

    def __init__(self, progress: Iterable[float], evaluations: int | None = None) -> None:
        if not isinstance(progress, Iterable):
            raise TypeError(f"progress: shares of the budget are needed, not {progress!r}")
        self._progress = iter(progress)
        self.evaluations = evaluations

    def __next__(self) -> float:
        return next(self._progress)


Search: TypeAlias = Generator[FloatArray, FloatArray, None]

DEFAULT_EVALUATIONS = 30_000  # the paper's swarm: 50 beetles, 200 iterations, 3 evaluations each


class Solver(SolverTraits, ABC):
    """A population-based search, written as the paper writes Algorithm 1: one loop over iterations.

    A subclass is a frozen dataclass whose fields are its hyper-parameters. It holds only the algorithm; budget,
    best-so-far, history, seed and interruption belong to :func:`solvers.minimize`.

    Attributes:
        minimum_population: the fewest members the algorithm works with.
        population: m, the number of members; None for a number that fits the budget.
    """

    default_budget: ClassVar[Budget] = Budget(evaluations=DEFAULT_EVALUATIONS)
    has_population: ClassVar[bool] = True
    solves_program: ClassVar[Literal[False]] = False
    steps: ClassVar[Steps] = ITERATIONS

    minimum_population: ClassVar[int] = 2
    population: int | None

    def __post_init__(self) -> None:
        population = getattr(self, "population", None)  # a solver of a user's own need not have any
        if population is None:
            return
        name = type(self).__name__
        if isinstance(population, bool) or not isinstance(population, Integral):
            raise TypeError(f"{name} needs a whole number for its population, not {population!r:.60}")
        if population < self.minimum_population:
            raise ValueError(f"{name} needs a population of at least {self.minimum_population}, not {population}")

    @abstractmethod
    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        """Yield candidates and receive their costs: ``costs = yield candidates``.

        Args:
            box: where to search; every candidate of an array (m, d), m > 0, lies inside.
            rng: the only source of randomness.
            iterations: loop over it; each turn starts an iteration and gives the share of the budget already used,
                from 0 to 1, for schedules; its ``evaluations`` is the budget. The driver closes the search when the
                budget is spent.

        Receives:
            costs: shape (m,), finite, or inf for points without a cost; lower is better.
        """

    @property
    def takes_several_costs(self) -> bool:
        """Whether a search may be sent costs (m, k), and then looks for their front."""
        return False


def is_solver_class(candidate: object) -> TypeGuard[type[Solver]]:
    """Whether something is a class of solvers: derived from :class:`Solver`, and a dataclass."""
    return isinstance(candidate, type) and issubclass(candidate, Solver) and is_dataclass(candidate)


def checked_candidates(yielded: object, box: SearchBox, solver: Solver) -> FloatArray:
    """The candidates (m, d) that a solver has yielded.

    Raises:
        TypeError: it yielded no array of numbers.
        ValueError: the array has another shape or no row, or a number in it is not finite or outside the box.
    """
    name, needed = type(solver).__name__, f"an array of numbers (m, {box.dimension}) is needed"
    if not isinstance(yielded, np.ndarray):
        raise TypeError(f"{name} yielded an object of type {type(yielded).__name__}; {needed}")
    if yielded.dtype.kind not in "iuf":
        raise TypeError(f"{name} yielded an array of type {yielded.dtype}; {needed}")
    if yielded.ndim != 2 or yielded.shape[1] != box.dimension:
        raise ValueError(f"{name} yielded an array of shape {yielded.shape}; {needed}")
    if not len(yielded):
        raise ValueError(f"{name} yielded no candidate; {needed}, m > 0")
    candidates = np.asarray(yielded, dtype=np.float64)
    inside = (candidates >= box.lower) & (candidates <= box.upper)  # which no NaN is
    if not inside.all():
        row, column = np.argwhere(~inside)[0]
        value, where = float(candidates[row, column]), f"variable {column} of candidate {row}"
        if not isfinite(value):
            raise ValueError(f"{name} yielded {value} for {where}; finite numbers are needed")
        edges = f"from {float(box.lower[column])} to {float(box.upper[column])}"
        raise ValueError(f"{name} left its box: {where} is {value}, not {edges}")
    return candidates


def require(holds: bool, requirement: str) -> None:
    """Raise ValueError with ``requirement`` unless it holds; for hyper-parameters."""
    if not holds:
        raise ValueError(requirement)
