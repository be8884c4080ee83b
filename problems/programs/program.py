"""Smooth nonlinear programs: variables, constraints, objective, derivatives by composition.

Every row with an obstacle depends on one or two samples, that is on few angles; each of these depends on few
variables. Written out over the variables, the Hessian of the Lagrangian repeats the map from the variables to the
angles in every row. With y = y(x), L = L(x, y) and no term that mixes both,

    H = L_xx + J' L_yy J + sum_i (L_y)_i (y_i)_xx,   J = dy/dx,

which around an obstacle takes less than half of the operations.

Its variables are the arm's own quantities instead of a search vector: kinematics and splines become equalities, so
that nothing has a kink or an edge. Its rows come from the same :class:`Constraint` objects as the penalty and the
verification.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, depends_on_speed
from problems.motions import Samples, Trajectory
from problems.objectives import Objective
from problems.tasks import Task


def composed_hessian(x: Matrix, y: Matrix, inner: Matrix, f: Matrix, g: Matrix) -> ca.Function:
    """The Hessian of lam_f f + lam_g' g with respect to x, as CasADi's ``nlpsol`` takes it.

    Args:
        x: symbols of the variables, (n, 1).
        y: symbols that stand for ``inner``, (m, 1).
        inner: y(x), (m, 1).
        f: the objective, of x and y.
        g: the rows, of x and y, (r, 1).

    Returns:
        Of x, p (empty), lam_f and lam_g: the upper triangle, (n, n).

    Raises:
        ValueError: a term mixes x and y.
    """
    used = np.flatnonzero(ca.which_depends(ca.vertcat(f, g), y, 1, False)).tolist()
    y, inner = y[used], inner[used]
    of_f, of_g, of_y = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", g.shape[0]), ca.SX.sym("lam_y", y.shape[0])
    lagrangian = of_f * f + ca.dot(of_g, g)
    own, slope = ca.gradient(lagrangian, x), ca.gradient(lagrangian, y)
    if ca.jacobian(own, y).nnz():
        raise ValueError("a row mixes the variables with what depends on them")
    outer = ca.Function(
        "outer", [x, y, of_f, of_g], [ca.jacobian(own, x), ca.jacobian(slope, y, {"symmetric": True}), slope]
    )
    bend = ca.Function("bend", [x, of_y], [ca.hessian(ca.dot(of_y, inner), x)[0]])
    first = ca.Function("inner", [x], [inner, ca.jacobian(inner, x)])
    point, no_parameters = ca.MX.sym("x", x.shape[0]), ca.MX.sym("p", 0, 0)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.shape[0])
    value, jacobian = first(point)
    of_x, of_values, forces = outer(point, value, lam_f, lam_g)
    hessian = of_x + ca.mtimes([jacobian.T, of_values, jacobian]) + bend(point, forces)
    names = ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
    return ca.Function("nlp_hess_l", [point, no_parameters, lam_f, lam_g], [ca.triu(hessian)], *names)


def replace_with_symbols(samples: Samples) -> tuple[ca.SX, Matrix, Samples]:
    """Symbols in the place of a motion's samples, all of whose parts are known, and of those that belong to it.

    Returns:
        The symbols (m, 1), the expressions that they stand for (m, 1), and the samples made of them.
    """
    given = (*samples.derivatives, samples.duration, samples.times, samples.weights)
    parts = [part for part in given if part is not None]  # all of them are
    symbols = [ca.SX.sym("y", *part.shape) for part in parts]
    *derivatives, duration, times, weights = symbols
    of_symbols = replace(samples, derivatives=tuple(derivatives), duration=duration, times=times, weights=weights)
    y, inner = ca.veccat(*symbols), ca.densify(ca.veccat(*parts))
    if samples.quadrature is not None:
        own, own_inner, points = replace_with_symbols(samples.quadrature)
        y, inner = ca.vertcat(y, own), ca.vertcat(inner, own_inner)
        of_symbols = replace(of_symbols, quadrature=points)
    if samples.before_jumps is not None:
        own, own_inner, points = replace_with_symbols(samples.before_jumps)
        y, inner = ca.vertcat(y, own), ca.vertcat(inner, own_inner)
        of_symbols = replace(of_symbols, before_jumps=points)
    return y, inner, of_symbols


MAX_ANGLE_CHANGE = 3.5  # rad, from a start; without this bound some angles drift by thousands of turns


class NonlinearProgram(ABC):
    """Minimise f(x) subject to bounds of the rows g(x) and of the variables x.

    Attributes:
        takes_any_motion: whether a motion of another form than the task's own, of any timing, can be a start.
    """

    takes_any_motion: ClassVar[bool] = False

    @property
    @abstractmethod
    def x(self) -> ca.SX:
        """The variables, (n, 1)."""

    @property
    @abstractmethod
    def names(self) -> tuple[str, ...]:
        """Names of the variables, n."""

    @property
    @abstractmethod
    def f(self) -> Matrix:
        """The objective, in units of :attr:`objective_size`."""

    @property
    def objective_size(self) -> float:
        """The size by which the objective is divided, in its unit."""
        return 1.0

    @abstractmethod
    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        """All rows; equalities are those whose bounds are the same. The margin changes bounds alone."""

    @abstractmethod
    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the variables, (n,): around the angles of a start (n,), in their turn."""

    @property
    def has_free_durations(self) -> bool:
        """Whether durations are variables; if not they follow from the shape."""
        return True

    def finer(self) -> NonlinearProgram:
        """A program with more samples, where limits are missed by much between few of them; by default this program."""
        return self

    def near(self, trajectory: Trajectory) -> NonlinearProgram:
        """The program near a motion, without limits from which that is far; by default this program."""
        return self

    @abstractmethod
    def from_search(self, x: FloatArray) -> FloatArray:
        """The variables (n,) of a search vector (d,)."""

    @abstractmethod
    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """The variables (n,) of a motion of the task's own form."""

    @abstractmethod
    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        """Endless starts (n,) that meet the task's points: structured ones and random ones."""

    @abstractmethod
    def trajectory(self, x: FloatArray) -> Trajectory:
        """The exact trajectory of a solution, as fast as the limits allow for all t where time is free."""

    @abstractmethod
    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The arm's own quantities (the paper's symbols) of a solution."""

    @cached_property
    def rows(self) -> tuple[Constraint, ...]:
        """The constraints at the usual margin."""
        return self.constraints(SAMPLING_MARGIN)

    @cached_property
    def g(self) -> Matrix:
        """All rows of all constraints, (r, 1), each divided by its scale."""
        return ca.densify(ca.vertcat(*(constraint.row_values() for constraint in self.rows)))

    @property
    def hessian(self) -> ca.Function | None:
        """The Hessian of the Lagrangian where there is a faster one than CasADi's own."""
        return None

    def row_bounds(self, margin: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the rows, both (r,).

        Args:
            margin: to keep at the samples for what lies between them, as a share of the reach and of the joints'
                ranges; ``SAMPLING_MARGIN`` if None.
        """
        used_margin = SAMPLING_MARGIN if margin is None else margin
        if used_margin not in self._row_bounds:
            rows = self.rows if used_margin == SAMPLING_MARGIN else self.constraints(used_margin)
            lower, upper = zip(*(constraint.row_bounds() for constraint in rows), strict=True)
            self._row_bounds[used_margin] = np.concatenate(lower), np.concatenate(upper)
        return self._row_bounds[used_margin]

    @cached_property
    def _row_bounds(self) -> dict[float, tuple[FloatArray, FloatArray]]:
        """Bounds of the rows by margin: constructing the rows takes long, and every descent needs their bounds."""
        return {}


def equality(
    name: str, expression: Matrix, unit: str, column_names: Sequence[str], formula: str, scale: float = 1.0
) -> Constraint:
    """``expression == 0``, one column a name; of the size of ``scale``."""
    zero = ca.DM.zeros(1, len(column_names))
    return Constraint(
        name=name,
        unit=unit,
        expression=expression,
        lower=zero,
        upper=zero,
        columns=tuple(column_names),
        scale=zero + scale,
        for_all_t=False,
        formula=formula,
    )


def slack_constraints(objective: Objective, samples: Samples, slack: Matrix) -> list[Constraint]:
    """The constraints on the slacks of an objective's smooth form: none below zero."""
    joints = samples.moving.joints.names
    return [
        Constraint(
            name=name,
            equation=objective.equation,
            unit=objective.unit,
            expression=expression,
            lower=ca.DM.zeros(1, expression.shape[1]),
            upper=None,
            columns=joints,
            for_all_t=False,
            formula=formula,
        )
        for name, formula, expression in objective.slack_rows(samples, slack)
    ]


class MotionProgram(NonlinearProgram):
    """A program of an objective and limits, which decide whether durations are variables or follow from the shape."""

    task: Task
    objective: Objective
    limits: tuple[Limit, ...]

    @property
    def objective_size(self) -> float:
        return self.objective.size(self.task.robot)

    @property
    def has_free_durations(self) -> bool:
        return self.objective.is_time_dependent or self.depends_on_speed or self.task.duration_bounds is not None

    def duration_rows(self, durations: Matrix, margin: float) -> list[Constraint]:
        """The task's upper bounds of durations (1, n) in s; the lower ones are bounds of the variables."""
        bounds = self.task.duration_bounds
        return [] if bounds is None else [replace(bounds.at(durations, margin), lower=None)]

    @property
    def sampled_limits(self) -> list[Limit]:
        """The limits that may become rows; where durations follow from the shape, what that leaves of them."""
        if self.has_free_durations:
            return list(self.limits)
        return [each for limit in self.limits for each in (limit.static_limits if limit.scales_with_time else (limit,))]

    @cached_property
    def depends_on_speed(self) -> bool:
        """Whether a limit keeps a motion from being run faster than it was found."""
        return depends_on_speed(self.limits)
