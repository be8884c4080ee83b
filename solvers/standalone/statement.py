"""What a user states of a search, in the forms that users have it: bounds, a solver, a budget."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import fields, replace
from importlib.util import find_spec
from pkgutil import resolve_name
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from solvers.box import Box, FloatArray
from solvers.driver.budget import Budget
from solvers.registry import EXTERNAL, GRADIENT_SOLVERS, SOLVERS
from solvers.solver import Solver

Bounds: TypeAlias = Box | FloatArray | Sequence[Sequence[float]]
SolverChoice: TypeAlias = Solver | type[Solver] | str


def box_of(bounds: Bounds) -> Box:
    """The box of bounds: one ``(low, high)`` a variable, (d, 2); or an array of both corners, (2, d); or a box.

    A list of two pairs is two variables; an array of shape (2, 2) is read as one is, too: a row for each variable.

    Raises:
        ValueError: of another shape, not finite, or swapped.
    """
    if isinstance(bounds, Box):
        return bounds
    try:
        table = np.asarray(bounds, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"bounds: one (low, high) a variable is needed, not {bounds!r:.60}") from error
    if table.ndim == 2 and table.shape[1] == 2:
        lower, upper = table.T
    elif table.ndim == 2 and table.shape[0] == 2:
        lower, upper = table
    else:
        raise ValueError(f"bounds: of shape {table.shape}; say one (low, high) a variable, or an array (2, d)")
    with np.errstate(over="ignore"):
        _check(lower, upper)
    return Box(lower.copy(), upper.copy())


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
        TypeError: not a solver, or it has no such setting.
    """
    settings = settings or {}
    if isinstance(choice, Solver):
        _check_settings(type(choice), settings)
        return replace(choice, **settings) if settings else choice  # type: ignore[type-var]  # all are dataclasses
    kind = _named(choice) if isinstance(choice, str) else choice
    if not (isinstance(kind, type) and issubclass(kind, Solver)):
        raise TypeError(f"solver: {choice!r:.60} is not a name, a class derived from solvers.Solver, or one's object")
    _check_settings(kind, settings)
    return kind(**settings)


def _named(name: str) -> Any:
    if name in SOLVERS:
        return SOLVERS[name]
    if name in EXTERNAL:
        external = EXTERNAL[name]
        if external.extra and find_spec(external.extra) is None:
            raise ValueError(f"solver: {name} needs the package {external.extra}: {external.install}")
        return resolve_name(external.path)
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


def candidates_of(known: Any, box: Box) -> Box:
    """The box with known candidates (m, d), or one (d,), that are evaluated first; None for none.

    Raises:
        ValueError: of another shape, no real numbers, or not finite.
    """
    if known is None:
        return box
    try:
        table = np.atleast_2d(np.asarray(known, dtype=np.float64))
    except (TypeError, ValueError) as error:
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
