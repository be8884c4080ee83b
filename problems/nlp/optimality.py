"""Whether a motion is a KKT point, which limits are active, and their shadow prices.

At a point z of a nonlinear program with objective f, rows g and active rows A, multipliers lambda >= 0 are estimated by
least squares, signs kept: the smallest |grad f + sum of lambda_i grad (row i)|. For the rows' bounds b they are the
sensitivities d f* / d b.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import lsq_linear

from problems.base.matrix import FloatArray, as_array
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN
from problems.nlp.program import NonlinearProgram

ACTIVE_ROW_DISTANCE = 1e-3  # a scaled row that is nearer than this to its bound is active
TECHNICAL = ("slack", "h[")  # beginnings of the names of variables whose bounds say nothing about the motion
RANK_TOLERANCE = 1e-8  # relative size of a singular value that counts
MOST_DENSE = 500  # active rows; an active set method on a dense matrix takes minutes for some more
QUIET: dict[str, Any] = {"ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-10, "print_time": False}


@dataclass(frozen=True)
class Sensitivity:
    """The shadow price of one bound.

    Attributes:
        constraint: its name; ``bound`` for that of a variable.
        column: the joint, link, obstacle or variable.
        active: how many of its rows have a multiplier other than 0.
        per_unit: change of the objective when the bound, or both bounds, are relaxed by one unit; at most 0.
        unit: of that, objective over constraint.
    """

    constraint: str
    column: str
    active: int
    per_unit: float
    unit: str


@dataclass(frozen=True)
class Optimality:
    """First-order conditions at a point.

    Attributes:
        stationarity: |grad f + J' lambda| over |grad f|, with the best multipliers; 0 at a KKT point.
        complementarity: largest |multiplier x distance from the bound| of the scaled rows.
        violation: largest violation of the scaled rows and bounds.
        active: how many rows and bounds are active, equalities included.
        rank: of their Jacobian.
        sensitivities: of the active limits, the largest first.
    """

    stationarity: float
    complementarity: float
    violation: float
    active: int
    rank: int
    sensitivities: tuple[Sensitivity, ...]

    @property
    def licq(self) -> bool:
        """Whether the gradients of the active rows are independent."""
        return self.rank == self.active


def optimality(program: NonlinearProgram, z: FloatArray, objective_unit: str) -> Optimality:
    """First-order conditions at a point (n,) of a program."""
    values, jacobian, gradient = _evaluated(program, z)
    lower, upper = _bounds(program, z)
    gap_low, gap_high = values - lower, upper - values
    equal = lower == upper
    near = np.minimum(gap_low, gap_high)
    active = equal | (near <= ACTIVE_ROW_DISTANCE)
    at_upper = gap_high <= gap_low
    least = np.where(equal | ~at_upper, -np.inf, 0.0)[active]
    most = np.where(equal | at_upper, np.inf, 0.0)[active]
    rows = jacobian[active]
    multipliers = np.zeros(values.size)
    size = max(float(np.linalg.norm(gradient)), np.finfo(float).tiny)
    if active.any():
        multipliers[active] = bounded_multipliers(rows, gradient, least, most)
    inexact = active & ~equal
    given = equal & (np.arange(values.size) >= program.g.shape[0])  # variables that are none
    left = gradient + jacobian.T @ multipliers
    independent = int(np.linalg.matrix_rank(rows, tol=RANK_TOLERANCE * max(1.0, np.abs(rows).max(initial=0.0))))
    return Optimality(
        float(np.linalg.norm(left)) / size,
        float(np.abs(multipliers[inexact] * near[inexact]).max(initial=0.0)),
        float(max(0.0, -near.min())),
        int(active.sum()),
        independent if active.any() else 0,
        tuple(sensitivities(program, np.where(given, 0.0, multipliers), objective_unit)),
    )


def bounded_multipliers(rows: FloatArray, gradient: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
    """The multipliers (m,) between bounds for which |gradient (n,) + rows (m, n)' multipliers| is smallest."""
    if len(rows) <= MOST_DENSE:
        return np.asarray(lsq_linear(rows.T, -gradient, (least, most), method="bvls").x)
    return sparse_multipliers(rows, gradient, least, most)


def sparse_multipliers(rows: FloatArray, gradient: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
    """The same, as a quadratic program of multipliers and what is left of the gradient; for many rows, mostly zeros."""
    count, size = rows.shape
    unknown = ca.MX.sym("unknown", count + size)
    left = unknown[count:]
    equations = ca.mtimes(ca.sparsify(ca.DM(rows.T)), unknown[:count]) - left
    program: Any = {"x": unknown, "f": ca.sumsqr(left) / 2.0, "g": equations}
    solver = ca.nlpsol("multipliers", "ipopt", program, QUIET)
    free = np.full(size, np.inf)
    bounds = np.concatenate([least, -free]), np.concatenate([most, free])
    solution = as_array(solver(lbx=bounds[0], ubx=bounds[1], lbg=-gradient, ubg=-gradient)["x"]).ravel()[:count]
    return np.asarray(np.clip(solution, least, most))


def _evaluated(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows and variables (r + n,), their Jacobian (r + n, n), the objective's gradient (n,)."""
    everything = ca.vertcat(program.g, program.x)
    evaluate = ca.Function(
        "at", [program.x], [everything, ca.jacobian(everything, program.x), ca.gradient(program.f, program.x)]
    )
    values, jacobian, gradient = (as_array(part) for part in evaluate(z))
    return values.ravel(), jacobian, gradient.ravel()


def _bounds(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    pairs = zip(program.row_bounds(), program.bounds_near(z), strict=True)
    lower, upper = (np.concatenate(pair) for pair in pairs)
    return lower, upper


def sensitivities(program: NonlinearProgram, multipliers: FloatArray, objective_unit: str) -> list[Sensitivity]:
    """Shadow prices from multipliers (r + n,): of limits on the whole motion, by column, and of variables' bounds."""
    entries, first = [], 0
    multipliers = multipliers * program.objective_size
    for constraint in program.constraints(SAMPLING_MARGIN):
        count, width = constraint.expression.shape
        forces = multipliers[first : first + count * width].reshape(width, count)
        first += count * width
        for column in np.flatnonzero(forces.any(axis=1)) if constraint.for_all_t else ():
            slope = _slope(constraint, int(column), upper=bool(forces[column].sum() > 0.0))
            per_unit = -float(np.abs(forces[column]).sum()) * slope
            unit = f"{objective_unit} / ({constraint.unit})"
            rows = int(np.count_nonzero(forces[column]))
            entries.append(Sensitivity(constraint.name, constraint.columns[column], rows, per_unit, unit))
    own = zip(program.names, multipliers[first:], strict=True)
    bounds = [(name, force) for name, force in own if force != 0.0 and not name.startswith(TECHNICAL)]
    entries += [Sensitivity("bound", name, 1, -abs(float(force)), f"{objective_unit} / unit") for name, force in bounds]
    return sorted(entries, key=lambda s: s.per_unit)


def _slope(constraint: Constraint, column: int, upper: bool) -> float:
    """d(bound of the scaled row) / d(bound in the constraint's unit)."""
    if constraint.transform is None:
        return 1.0 / float(constraint.scales[column])
    bound = constraint.bounds[1 if upper else 0]
    bound = np.where(np.isfinite(bound), bound, 0.0)
    step = 1e-6 * max(float(constraint.scales[column]), abs(float(bound[column])))
    shifted = bound + step * (np.arange(bound.size) == column)
    before, after = (as_array(constraint.transform(ca.DM(b).T)).ravel()[column] for b in (bound, shifted))
    return float(after - before) / step
