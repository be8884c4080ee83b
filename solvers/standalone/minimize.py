"""One call for a function of numbers: the front of the driver that users see."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from solvers.box import FloatArray
from solvers.driver.budget import Budget
from solvers.driver.minimize import minimize as drive
from solvers.driver.result import Result, Status
from solvers.standalone.cost import PopulationCost, SingleCost
from solvers.standalone.statement import Bounds, SolverChoice, box_of, budget_of, candidates_of, generator_of, solver_of


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
        ValueError: bounds that are swapped or not finite, an unknown solver, a budget that is not positive, or values
            of ``f`` of another shape.
        TypeError: a setting that the solver does not have, or an argument of a wrong type.
    """
    if not callable(f):
        raise TypeError(f"f: a function is needed, not {f!r:.60}")
    if callback is not None and not callable(callback):
        raise TypeError(f"callback: a function is needed, not {callback!r:.60}")
    generator_of(seed)
    cost = PopulationCost(f) if vectorized else SingleCost(f)
    box = candidates_of(known, box_of(bounds))
    return drive(cost, box, solver_of(solver, settings), budget_of(budget), seed, callback)
