"""The values of a problem's candidates: compiled, or interpreted by the model where there is no compiler.

Nothing here loads CasADi, unless a kernel has to be compiled or interpreted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tpbso_casadi.suite.frozen import (
    Description,
    FunctionContent,
    InvalidSuite,
    check_points,
    content_of,
    digest_of,
    with_frozen_spheres,
)
from tpbso_casadi.suite.kernels import FloatArray, NoCompiler

if TYPE_CHECKING:
    from tpbso_casadi.scenario import Scenario


class Values(NamedTuple):
    """All that is computed of m candidates, at once.

    Attributes:
        merit: one number to minimise, (m,): the objective where all constraints hold, more than the bound where not;
            of two objectives (m, 2).
        objectives: (m, 1) or (m, 2), whether constraints hold or not.
        violations: (m, c), 0 where a constraint holds, else how much of it is broken in all, without a unit.
    """

    merit: FloatArray
    objectives: FloatArray
    violations: FloatArray


@dataclass(frozen=True, eq=False)
class FrozenProblem:
    """One instance of one function: a box of numbers with values.

    Attributes:
        suite: the name of the one that it comes from; later ones that share it keep the name.
        function: what is told of it.
        instance: from 1 on.
        threads: that share candidates, each at least 512.
    """

    suite: str
    function: Description
    instance: int
    threads: int = 1

    def __repr__(self) -> str:
        return f"<{self.name}: {self.function.title}, {self.dimension} variables>"

    @property
    def name(self) -> str:
        """The name of the problem, as ``arm-motions-1/spline-3@1``."""
        return f"{self.suite}/{self._key}"

    @property
    def group(self) -> str:
        """The group of functions that are judged together."""
        return self.function.group

    @property
    def form(self) -> str:
        """``penalised``, ``constrained`` or ``two objectives``."""
        return self.function.form

    @property
    def dimension(self) -> int:
        """Number of variables, d."""
        return self.function.dimension

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return self.function.variables

    @property
    def objectives(self) -> tuple[tuple[str, str], ...]:
        """Names and units of the objectives."""
        return self.function.objectives

    @property
    def constraint_names(self) -> tuple[str, ...]:
        """Names of the columns of :meth:`constraints`."""
        return self.function.constraints

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the search box, both (d,)."""
        return self._content.lower[self.instance - 1], self._content.upper[self.instance - 1]

    def contains(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (..., d) are in the box, (...); no point with a NaN is."""
        lower, upper = self.bounds
        return np.asarray(((points >= lower) & (points <= upper)).all(axis=-1))

    @property
    def feasible_merit(self) -> float:
        """The merit up to which all constraints hold; of two objectives that of the first."""
        return float(self._content.bounds[0, self.instance - 1])

    def evaluate(self, candidates: FloatArray) -> FloatArray:
        """Values to be minimised, (m,) of candidates (m, d); of two objectives (m, 2).

        The merit where the form is ``penalised``; else the objective alone, beside :meth:`constraints`.

        Raises:
            ValueError: of another shape.
        """
        found = self.values(candidates)
        if self.form == "penalised":
            return found.merit
        return found.objectives[:, 0] if len(self.objectives) == 1 else found.objectives

    def constraints(self, candidates: FloatArray) -> FloatArray:
        """Violations (m, c) of candidates (m, d): 0 where a constraint holds at all samples, else more.

        Raises:
            ValueError: of another shape.
        """
        return self.values(candidates).violations

    def merit(self, candidates: FloatArray) -> FloatArray:
        """One number (m,) for each of candidates (m, d), whatever the form: feasibility first, then the objective.

        Raises:
            ValueError: of another shape.
        """
        return self.values(candidates).merit

    def values(self, candidates: FloatArray) -> Values:
        """Everything of candidates (m, d), in one evaluation; infinite where one is not in the box.

        Raises:
            ValueError: of another shape.
        """
        points = np.ascontiguousarray(candidates, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != self.dimension:
            raise ValueError(f"{self.name}: candidates of shape {points.shape} where (m, {self.dimension}) is needed")
        columns = [self._columns(kernel, points) for kernel in range(len(self.objectives))]
        is_outside = ~self.contains(points)
        if is_outside.any():
            for each in columns:
                each[is_outside] = inf
        merit, objectives = (np.stack([each[:, k] for each in columns], axis=1) for k in range(2))
        return Values(merit[:, 0] if len(columns) == 1 else merit, objectives, columns[0][:, 2:])

    def _columns(self, kernel: int, points: FloatArray) -> FloatArray:
        """Merit, objective and violations (m, k): by compiled code, or interpreted where there is none."""
        try:
            return self._content.values(kernel, self.instance - 1, points, self.threads)
        except NoCompiler:
            return self._interpreted[kernel](points)

    @cached_property
    def _interpreted(self) -> list[Callable[[FloatArray], FloatArray]]:
        """The functions of the model itself, if they still give the bits of the suite."""
        from tpbso_casadi.suite.motions import interpreted  # noqa: PLC0415 (CasADi)

        functions = interpreted(self.scenario, self.form, self.suite)
        points = check_points(*self.bounds)
        if digest_of(np.hstack([function(points) for function in functions])) != self._check:
            raise InvalidSuite(f"{self.name}: without a C++ compiler this version does not give the suite's values")
        return functions

    def is_intact(self) -> bool:
        """Whether this machine gives the bits with which the suite was frozen."""
        return digest_of(np.hstack(self.check_values)) == self._check

    @property
    def check_values(self) -> list[FloatArray]:
        """Merit, objective and violations at points of the box that are the same on every machine, by objective."""
        points = check_points(*self.bounds)
        return [self._columns(kernel, points) for kernel in range(len(self.objectives))]

    @property
    def _check(self) -> str:
        return self.function.checks[self.instance - 1]

    @property
    def _key(self) -> str:
        return f"{self.function.name}@{self.instance}"

    @cached_property
    def scenario(self) -> Scenario:
        """The scenario that it was made of."""
        from tpbso_casadi.scenario import parse_scenario  # noqa: PLC0415 (CasADi)

        return parse_scenario(with_frozen_spheres(self.suite, self._content.scenarios[self.instance - 1]))

    @property
    def _content(self) -> FunctionContent:
        return content_of(self.suite, self.function.name, self.function.digest)
