"""Problems of a suite as other libraries have theirs.

Every adapter asks for the values of candidates and nothing else; constraints are ``<= 0``. A library that takes one
number for a candidate is given the merit: feasibility first, then the objective.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from tpbso_casadi.suite.evaluation import FrozenProblem
from tpbso_casadi.suite.frozen import InvalidSuite
from tpbso_casadi.suite.kernels import FloatArray


def adapted(problem: FrozenProblem, library: str) -> Any:
    """The problem of another library.

    Raises:
        InvalidSuite: there is no such adapter, the library is missing, or it has no problems of this form.
    """
    if library not in ADAPTERS:
        raise InvalidSuite(f"no adapter for {library!r:.60}; there are {', '.join(ADAPTERS)}")
    module, make = ADAPTERS[library]
    try:
        loaded = import_module(module)
    except ImportError as error:
        raise InvalidSuite(f"{library} is not installed: pip install {library}") from error
    return make(problem, loaded)


def one_objective(problem: FrozenProblem, library: str) -> None:
    """Make sure that a number says all of a candidate.

    Raises:
        InvalidSuite: there are two objectives.
    """
    if len(problem.objectives) > 1:
        raise InvalidSuite(f"{problem.name}: has two objectives, and {library} takes one; pymoo and pygmo take both")


@dataclass(frozen=True, eq=False)
class ScipyFunction:
    """A function for SciPy, and for any other library that calls functions of one vector.

    Attributes:
        problem: whose merit it is.
        bounds: ``scipy.optimize.Bounds``.
    """

    problem: FrozenProblem
    bounds: Any

    def __call__(self, x: FloatArray) -> float:
        """The merit of one vector (d,)."""
        return float(self.problem.merit(np.asarray(x, dtype=np.float64)[None])[0])

    def vectorized(self, x: FloatArray) -> FloatArray:
        """The merits (m,) of vectors (d, m), as ``differential_evolution(vectorized=True)`` has them."""
        return self.problem.merit(np.asarray(x).T)


def scipy_function(problem: FrozenProblem, optimize: Any) -> ScipyFunction:
    """The function for ``scipy.optimize``: the merit."""
    one_objective(problem, "scipy")
    return ScipyFunction(problem, optimize.Bounds(*problem.bounds))


def ioh_problem(problem: FrozenProblem, ioh: Any) -> Any:
    """The problem for IOHexperimenter: the merit over the unit box, as ioh has one interval for all variables."""
    one_objective(problem, "ioh")
    lower, upper = problem.bounds

    def merit(shares: list[float]) -> float:
        cube = np.array(shares)
        points = np.clip(lower + cube * (upper - lower), lower, upper)  # which rounding may have left
        return float(problem.merit(np.where((cube >= 0.0) & (cube <= 1.0), points, np.nan)[None])[0])

    return ioh.wrap_problem(
        merit, name=problem.function.name, dimension=problem.dimension, instance=problem.instance, lb=0.0, ub=1.0
    )


def nevergrad_function(problem: FrozenProblem, functions: Any) -> Any:
    """The experiment function for nevergrad: the merit."""
    one_objective(problem, "nevergrad")
    lower, upper = problem.bounds
    array = import_module("nevergrad").p.Array(shape=(problem.dimension,), lower=lower, upper=upper)
    return functions.ExperimentFunction(ScipyFunction(problem, None), array.set_name(problem.name))


def pymoo_problem(problem: FrozenProblem, core: Any) -> Any:
    """The problem for pymoo: objectives and violations of populations; the merit alone where the form is penalised."""
    constraints = 0 if problem.form == "penalised" else len(problem.constraint_names)

    class Adapted(core.Problem):  # type: ignore[misc]
        """The problem of pymoo."""

        def __init__(self) -> None:
            lower, upper = problem.bounds
            super().__init__(
                n_var=problem.dimension, n_obj=len(problem.objectives), n_ieq_constr=constraints, xl=lower, xu=upper
            )

        def _evaluate(self, x: FloatArray, out: dict[str, Any], *_: Any, **__: Any) -> None:
            found = problem.values(x)
            if constraints:
                out["F"], out["G"] = found.objectives, found.violations
            else:
                out["F"] = found.merit[:, None]

    return Adapted()


def pygmo_problem(problem: FrozenProblem, pygmo: Any) -> Any:
    """The problem for pygmo: objectives and inequality constraints; the merit alone where the form is penalised."""
    return pygmo.problem(PygmoProblem(problem))


@dataclass(frozen=True, eq=False)
class PygmoProblem:
    """The methods that pygmo asks of a problem.

    Attributes:
        problem: of the suite.
    """

    problem: FrozenProblem

    def fitness(self, x: FloatArray) -> FloatArray:
        """Objectives, then violations, of one vector (d,)."""
        return self.batch_fitness(x)

    def batch_fitness(self, rows: FloatArray) -> FloatArray:
        """Objectives and violations of vectors (m * d,), those of one vector behind those of the other."""
        found = self.problem.values(np.asarray(rows).reshape(-1, self.problem.dimension))
        return (np.hstack([found.objectives, found.violations]) if self.get_nic() else found.merit).ravel()

    def get_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Corners of the box."""
        return self.problem.bounds

    def get_nobj(self) -> int:
        """The number of objectives."""
        return len(self.problem.objectives)

    def get_nic(self) -> int:
        """How many inequality constraints."""
        return 0 if self.problem.form == "penalised" else len(self.problem.constraint_names)

    def get_name(self) -> str:
        """The name of the problem."""
        return self.problem.name


ADAPTERS: dict[str, tuple[str, Callable[[FrozenProblem, Any], Any]]] = {
    "ioh": ("ioh", ioh_problem),
    "nevergrad": ("nevergrad.functions", nevergrad_function),
    "pygmo": ("pygmo", pygmo_problem),
    "pymoo": ("pymoo.core.problem", pymoo_problem),
    "scipy": ("scipy.optimize", scipy_function),
}
