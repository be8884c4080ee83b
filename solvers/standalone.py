"""A solver alone, on any function of a box of numbers."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from importlib.util import find_spec
from pkgutil import resolve_name
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from solvers.budget import Budget
from solvers.driver import Result, Status, keep_best
from solvers.driver import minimize as drive
from solvers.registry import EXTERNAL, GRADIENT_SOLVERS, NO_SEARCH, SOLVERS
from solvers.solver import FloatArray, SearchBox, Solver, is_solver_class


@dataclass(frozen=True)
class PopulationCost:
    """A function of a whole population, (m, d) -> (m,).

    Raises:
        ValueError: when called: the function returned another shape.
    """

    f: Callable[[FloatArray], Any]

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d)."""
        if not len(candidates):
            return np.empty(0)
        costs = _numbers(self.f(candidates.copy()))
        if costs.shape != (len(candidates),):
            raise ValueError(
                f"f returned shape {costs.shape} for {len(candidates)} candidates {candidates.shape}; with "
                "vectorized=True it takes a population (m, d) and returns (m,)"
            )
        return costs


@dataclass(frozen=True)
class SingleCost:
    """A function of one vector, (d,) -> a number; called once a candidate.

    Raises:
        ValueError: when called: the function returned something else than a number.
    """

    f: Callable[[FloatArray], Any]

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d)."""
        costs: list[float] = []
        try:
            for x in candidates:
                costs.append(self._one(x))
        except BaseException as error:
            if costs:
                keep_best(error, np.array(costs))
            raise
        return np.array(costs, dtype=np.float64)

    def _one(self, x: FloatArray) -> float:
        cost = _numbers(self.f(x.copy()))
        if cost.size != 1:
            raise ValueError(
                f"f returned shape {cost.shape} for one vector {x.shape}; a function of a whole population (m, d) "
                "needs vectorized=True"
            )
        return float(cost.reshape(()))


def _numbers(values: Any) -> FloatArray:
    try:
        numbers = np.asarray(values)
    except ValueError as error:
        raise ValueError(f"f returned {values!r:.60}: rows of different lengths") from error
    if numbers.dtype.kind not in "biuf":
        raise ValueError(f"f returned {values!r:.60} where real numbers are needed")
    return numbers.astype(np.float64)


Bounds: TypeAlias = SearchBox | FloatArray | Sequence[Sequence[float]]
SolverChoice: TypeAlias = Solver | type[Solver] | str


def box_of(bounds: Bounds) -> SearchBox:
    """The box of bounds: one ``(low, high)`` a variable, (d, 2); or an array of both corners, (2, d); or a box.

    A list of two pairs is two variables; an array of shape (2, 2) is read as one is, too: a row for each variable.

    Raises:
        ValueError: of another shape, not finite, or swapped.
    """
    if isinstance(bounds, SearchBox):
        return bounds
    try:
        table = np.asarray(bounds, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"bounds: one (low, high) a variable is needed, not {bounds!r:.60}") from error
    if table.ndim == 2 and table.shape[1] == 2:
        lower, upper = table.T
    elif table.ndim == 2 and table.shape[0] == 2:
        lower, upper = table
    else:
        raise ValueError(f"bounds: of shape {table.shape}; say one (low, high) a variable, or an array (2, d)")
    with np.errstate(over="ignore"):
        _check(lower, upper)
    return SearchBox(lower.copy(), upper.copy())


def _check(lower: FloatArray, upper: FloatArray) -> None:
    wrong = ~(np.isfinite(lower) & np.isfinite(upper))
    if lower.size == 0 or wrong.any():
        raise ValueError(f"bounds: {_shown(lower, upper, wrong)}; finite numbers are needed")
    if (lower > upper).any():
        raise ValueError(f"bounds: {_shown(lower, upper, lower > upper)} is swapped; say (low, high)")
    wide = ~np.isfinite(upper - lower)
    if wide.any():
        raise ValueError(f"bounds: {_shown(lower, upper, wide)} is wider than a floating-point number can say")


def _shown(lower: FloatArray, upper: FloatArray, chosen: NDArray[np.bool_]) -> str:
    if not lower.size:
        return "there is no variable"
    first = int(np.argmax(chosen))
    return f"variable {first} from {lower[first]:g} to {upper[first]:g}"


def solver_of(choice: SolverChoice, settings: dict[str, Any] | None = None) -> Solver:
    """The solver of a name of :data:`SOLVERS` or :data:`EXTERNAL`, a path "module:Class", a class or an object.

    Raises:
        ValueError: no such solver, its package is not installed, or a setting is outside its range.
        TypeError: not a solver, no dataclass, or it has no such setting.
    """
    settings, given = settings or {}, choice if isinstance(choice, Solver) else None
    kind = type(choice) if given is not None else _named(choice) if isinstance(choice, str) else choice
    if not (isinstance(kind, type) and issubclass(kind, Solver)):
        raise TypeError(f"solver: {choice!r:.60} is not a name, a class derived from solvers.Solver, or one's object")
    if not is_solver_class(kind):
        raise TypeError(f"solver: {kind.__name__} is no dataclass; put @dataclass(frozen=True) above the class")
    _check_settings(kind, settings)
    if given is None:
        return kind(**settings)
    return replace(given, **settings) if settings else given  # type: ignore[type-var]  # all are dataclasses


def _named(name: str) -> Any:
    if name in SOLVERS:
        return SOLVERS[name]
    if name in EXTERNAL:
        external = EXTERNAL[name]
        if external.package and find_spec(external.package) is None:
            raise ValueError(f"solver: {name} needs the package {external.package}: {external.install}")
        return resolve_name(external.path)
    if name in {"direct", "ladder"}:
        raise ValueError(f"solver: {NO_SEARCH}")
    if name in GRADIENT_SOLVERS:
        raise ValueError(f"solver: {name} needs the derivatives of a program, and a function of numbers has none")
    if ":" in name:
        try:
            return resolve_name(name)
        except (ImportError, AttributeError, ValueError) as error:
            raise ValueError(f"solver: {name!r} cannot be loaded: {error}") from error
    raise ValueError(f"solver: no solver {name!r}; {_hint(name, [*SOLVERS, *EXTERNAL])}")


def _check_settings(kind: type[Solver], settings: dict[str, Any]) -> None:
    known = [field.name for field in fields(kind)]  # type: ignore[arg-type]  # all are dataclasses
    for name in settings:
        if name not in known:
            raise TypeError(f"{kind.__name__} has no setting {name!r}; {_hint(name, known)}")


def _hint(name: str, known: list[str]) -> str:
    nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
    return f"did you mean {nearest[0]!r}?" if nearest else f"there are {', '.join(known)}"


def budget_of(budget: Budget | int) -> Budget:
    """A budget; a number is one of evaluations.

    Raises:
        ValueError: it is not positive.
        TypeError: it is no whole number and no budget.
    """
    if isinstance(budget, Budget):
        return budget
    if isinstance(budget, bool) or not isinstance(budget, int | np.integer):
        raise TypeError(f"budget: a number of evaluations or a Budget is needed, not {budget!r:.60}")
    return Budget(int(budget))


def candidates_of(known: Any, box: SearchBox) -> SearchBox:
    """The box with known candidates (m, d), or one (d,), that are evaluated first; None for none.

    Raises:
        ValueError: of another shape, no real numbers, or not finite.
    """
    if known is None:
        return box
    try:
        table = np.atleast_2d(np.asarray(known, dtype=np.float64))
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"known: candidates (m, {box.dimension}) are needed, not {known!r:.60}") from error
    return box.with_known(table)


def generator_of(seed: Any) -> np.random.Generator:
    """The random generator of a seed, or the generator that it is.

    Raises:
        ValueError: it is negative.
        TypeError: it is neither a whole number nor a generator, or None, with which no result could be repeated.
    """
    if seed is None:
        raise TypeError("seed: None gives another result every time; say a whole number, or a generator of your own")
    try:
        return np.random.default_rng(seed)
    except (TypeError, ValueError) as error:
        kind = type(error)
        raise kind(f"seed: a whole number >= 0 or a numpy Generator is needed, not {seed!r:.60}") from error


def minimize(
    f: Callable[[FloatArray], Any],
    bounds: Bounds,
    solver: SolverChoice = "abso",
    budget: Budget | int = 10_000,
    seed: int | np.random.Generator = 1,
    *,
    vectorized: bool = False,
    known: Any = None,
    callback: Callable[[Status], object] | None = None,
    **settings: Any,
) -> Result:
    """Search a box for the lowest value of any function.

    Args:
        f: of one vector (d,) -> a number; with ``vectorized`` of a whole population (m, d) -> (m,), which is much
            faster for NumPy code. NaN and infinite values count as worst.
        bounds: one ``(low, high)`` a variable, or an array (2, d) of the lower and the upper corner.
        solver: a name of :data:`tpbso_casadi.SOLVERS` or of an external solver, a class, or an object with its
            settings: ``tp.BSO(c1=2.0)``.
        budget: evaluations of ``f``, never exceeded; or a :class:`Budget`.
        seed: same seed, same result.
        vectorized: whether ``f`` takes a whole population.
        known: good candidates (m, d) or (d,), evaluated first.
        callback: gets the status after the initial population and after every iteration.
        settings: hyper-parameters of the solver by name.

    Returns:
        The best vector ``x``, its ``cost``, why the search ended and its history. After Ctrl-C too.

    Raises:
        ValueError: bounds that are swapped or not finite, an unknown solver, a budget that is not positive, values
            of ``f`` of another shape, or a solver whose candidates are not (m, d), not finite or outside the box.
        TypeError: a setting that the solver does not have, or an argument of a wrong type.
        BaseException: whatever ``f``, the callback or the solver raises. Once there is a candidate, the exception's
            attribute ``best_so_far`` is the result until then (with ``vectorized``, of whole populations), with
            ``StopReason.ERROR``.
    """
    if not callable(f):
        raise TypeError(f"f: a function is needed, not {f!r:.60}")
    if callback is not None and not callable(callback):
        raise TypeError(f"callback: a function is needed, not {callback!r:.60}")
    generator_of(seed)
    cost = PopulationCost(f) if vectorized else SingleCost(f)
    box = candidates_of(known, box_of(bounds))
    return drive(cost, box, solver_of(solver, settings), budget_of(budget), seed, callback)
