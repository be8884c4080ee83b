"""Optimality of a solution: multipliers, conditions, shadow prices, slopes by parameters.

For rows g <= b with multipliers lambda, d f* / d b = -lambda: a limit's price is the sum over its rows, in the limit's
own unit. Prices in different units are compared by what one per cent more of each limit saves.

At a point z of a nonlinear program with objective f, rows g and active rows A, multipliers lambda >= 0 are estimated by
least squares, signs kept: the smallest |grad f + sum of lambda_i grad (row i)|. For the rows' bounds b they are the
sensitivities d f* / d b.

With f* the optimum of a program whose objective f and rows g depend on a number p, d f* / d p is the partial derivative
of f + lambda' g at the optimum: neither the variables nor the multipliers have to follow. The program is written
anew with a symbol for the number; the rest of it stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import Arguments, FloatArray, Parametric, as_array
from problems.limits import SAMPLING_MARGIN, Constraint
from problems.nlp.program import MotionProgram, NonlinearProgram
from problems.robots import Payload, Robot

TECHNICAL = ("slack", "h[", "miss")  # beginnings of the names of variables whose bounds say nothing about the motion
JOINT_RANGE = "joint range"
PER_CENT = 0.01


@dataclass(frozen=True)
class Sensitivity:
    """The shadow price of a limit, or of a number of the model.

    Attributes:
        constraint: its name; ``bound`` for that of a variable.
        column: the joint, link, obstacle or variable.
        active: how many of its rows have a multiplier other than 0.
        per_unit: change of the objective when the bound, or both bounds, are relaxed by one unit; at most 0.
        unit: of that, objective over constraint.
        size: of the limit; of a range its width; in its unit.
        limit_unit: the unit of the limit.
    """

    constraint: str
    column: str
    active: int
    per_unit: float
    unit: str
    size: float
    limit_unit: str

    @property
    def per_cent(self) -> float:
        """Change of the objective when the limit is relaxed by 1 % of its size, in the objective's unit."""
        return self.per_unit * self.size * PER_CENT


def ranking(sensitivities: Sequence[Sensitivity]) -> list[Sensitivity]:
    """What holds a motion back, that of which one per cent saves most first; what has no size comes last."""
    worth = (price for price in sensitivities if price.per_unit < 0.0)
    return sorted(worth, key=lambda price: (price.per_cent, price.per_unit))


def sensitivities(
    program: NonlinearProgram, z: FloatArray, multipliers: FloatArray, objective_unit: str, robot: Robot
) -> list[Sensitivity]:
    """Shadow prices of limits on the whole motion, by column, and of variables' bounds; the largest first.

    Args:
        program: whose optimum it is.
        z: the optimum, (n,).
        multipliers: of the rows and of the variables' bounds, (r + n,): positive at an upper bound. Those of variables
            that are given must be 0.
        objective_unit: of the program's objective.
        robot: whose joints are limited.
    """
    multipliers = multipliers * program.objective_size
    prices, first = list[_Part](), 0
    plain = {constraint.name: constraint for constraint in program.constraints(0.0)}
    for constraint in program.constraints(SAMPLING_MARGIN):
        count, width = constraint.expression.shape
        forces = multipliers[first : first + count * width].reshape(width, count)
        first += count * width
        for column in np.flatnonzero(forces.any(axis=1)) if constraint.for_all_t else ():
            prices.append(_of_column(constraint, plain[constraint.name], int(column), forces[column], robot))
    prices += _of_variables(program, z, multipliers[first:], robot)
    return sorted(_added(prices, objective_unit), key=lambda price: price.per_unit)


@dataclass(frozen=True)
class _Part:
    """What some rows, or the bound of a variable, add to the price of a limit."""

    constraint: str
    column: str
    active: int
    per_unit: float
    size: float
    unit: str


def _of_column(constraint: Constraint, plain: Constraint, column: int, forces: FloatArray, robot: Robot) -> _Part:
    """A column's rows (count,) of multipliers; ``plain`` is the constraint without what is kept between samples."""
    slope = _slope(constraint, column, upper=bool(forces.sum() > 0.0))
    name = constraint.columns[column]
    return _Part(
        constraint=constraint.name,
        column=name,
        active=int(np.count_nonzero(forces)),
        per_unit=-float(np.abs(forces).sum()) * slope,
        size=_size(plain, column),
        unit=_unit(constraint.unit, name, robot),
    )


def _of_variables(program: NonlinearProgram, z: FloatArray, forces: FloatArray, robot: Robot) -> Iterator[_Part]:
    """Those of bounds of variables (n,); of an angle's it is the joint's range, where it has that bound."""
    ranges = np.array(robot.limits.position or ())
    bounds = program.bounds_near(z)
    for place in np.flatnonzero(forces):
        name, force = program.names[place], -abs(float(forces[place]))
        joint = program.joint_of_angle.get(int(place))
        side = int(forces[place] > 0.0)
        if joint is not None and ranges.size and bounds[side][place] == ranges[joint, side]:
            width, unit = float(np.ptp(ranges[joint])), robot.joint_units[joint]
            yield _Part(JOINT_RANGE, robot.joint_names[joint], 1, force, width, unit)
        elif not name.startswith(TECHNICAL):
            yield _Part("bound", name, 1, force, 0.0, "unit")


def _added(parts: Sequence[_Part], objective_unit: str) -> Iterator[Sensitivity]:
    """One price of each limit of each column."""
    groups: dict[tuple[str, str], list[_Part]] = {}
    for part in parts:
        groups.setdefault((part.constraint, part.column), []).append(part)
    for (constraint, column), group in groups.items():
        active, per_unit, limit_unit = sum(p.active for p in group), sum(p.per_unit for p in group), group[0].unit
        unit = f"{objective_unit} / ({limit_unit})" if constraint != "bound" else f"{objective_unit} / unit"
        yield Sensitivity(constraint, column, active, per_unit, unit, group[0].size, limit_unit)


def _size(constraint: Constraint, column: int) -> float:
    """The size of a bound, or the width of a range."""
    lower, upper = (float(bound[column]) for bound in constraint.bounds)
    if constraint.symmetric or not np.isfinite(lower):
        return abs(upper)
    return upper - lower if np.isfinite(upper) else abs(lower)


def _unit(unit: str, column: str, robot: Robot) -> str:
    """That of a joint's limit: of one that slides m for rad, and N for N m."""
    if column not in robot.joint_names:
        return unit
    joint = robot.joint_names.index(column)
    turns = robot.joint_units[joint] == "rad"
    return unit if turns else unit.replace("rad", "m").replace("N m", "N")


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


def settled(values: FloatArray, bounds: tuple[FloatArray, FloatArray], multipliers: FloatArray) -> FloatArray:
    """Multipliers (m,) of an interior point, 0 where they are smaller than the way to their bound.

    At an interior point lambda x distance is a small number everywhere: of an active bound the distance is the smaller.

    Args:
        values: of scaled rows or variables, (m,).
        bounds: lower and upper, both (m,).
        multipliers: positive at an upper bound.
    """
    lower, upper = bounds
    gap = np.where(multipliers > 0.0, upper - values, values - lower)
    kept: NDArray[np.bool_] = np.abs(multipliers) > gap
    return np.where(kept, multipliers, 0.0)


ACTIVE_ROW_DISTANCE = 1e-3  # a scaled row that is nearer than this to its bound is active
NNLS_ITERATIONS = 30  # at most, for each bound
RANK_TOLERANCE = 1e-8  # relative size of a singular value that counts


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


def optimality(program: NonlinearProgram, z: FloatArray, objective_unit: str, robot: Robot) -> Optimality:
    """First-order conditions at a point (n,) of a program of a robot."""
    values, jacobian, gradient = _evaluated(program, z)
    lower, upper = _bounds(program, z)
    gap_low, gap_high = values - lower, upper - values
    equal = lower == upper
    near = np.minimum(gap_low, gap_high)
    active = equal | (near <= ACTIVE_ROW_DISTANCE)
    at_upper = gap_high <= gap_low
    rows = jacobian[active]
    multipliers = np.zeros(values.size)
    size = max(float(np.linalg.norm(gradient)), np.finfo(float).tiny)
    if active.any():
        multipliers[active] = least_squares_multipliers(rows, gradient, equal[active], at_upper[active])
    inexact = active & ~equal
    given = equal & (np.arange(values.size) >= program.g.shape[0])  # variables that are none
    left = gradient + jacobian.T @ multipliers
    independent = _independent(rows, RANK_TOLERANCE * max(1.0, np.abs(rows).max(initial=0.0)))[1]
    return Optimality(
        float(np.linalg.norm(left)) / size,
        float(np.abs(multipliers[inexact] * near[inexact]).max(initial=0.0)),
        float(max(0.0, -near.min())),
        int(active.sum()),
        independent if active.any() else 0,
        tuple(sensitivities(program, z, np.where(given, 0.0, multipliers), objective_unit, robot)),
    )


def least_squares_multipliers(
    rows: FloatArray, gradient: FloatArray, equal: NDArray[np.bool_], at_upper: NDArray[np.bool_]
) -> FloatArray:
    """Multipliers (m,) that leave the least of the gradient: any for equalities, of the right sign for bounds.

    What equalities can make up for is projected out, so that only the bounds are left to non-negative least squares.

    Args:
        rows: gradients of the active rows, (m, n).
        gradient: of the objective, (n,).
        equal: which rows are equalities, (m,).
        at_upper: which of the others are at their upper bound, whose multipliers are positive, (m,).
    """
    signs = np.where(at_upper[~equal], 1.0, -1.0)
    bounds = signs[:, None] * rows[~equal]
    (basis, triangle, chosen), rank = _independent(rows[equal], RANK_TOLERANCE * max(1.0, np.abs(rows).max()))
    basis = basis[:, :rank]
    left = [matrix - basis @ (basis.T @ matrix) for matrix in (bounds.T, -gradient)]
    most = NNLS_ITERATIONS * (1 + len(bounds))
    sizes = scipy.optimize.nnls(left[0], left[1], maxiter=most)[0] if len(bounds) else np.empty(0)
    multipliers = np.zeros(len(rows))
    multipliers[~equal] = signs * sizes
    known = basis.T @ (-gradient - bounds.T @ sizes)
    multipliers[np.flatnonzero(equal)[chosen[:rank]]] = scipy.linalg.solve_triangular(triangle[:rank, :rank], known)
    return multipliers


def _independent(rows: FloatArray, tolerance: float) -> tuple[tuple[FloatArray, FloatArray, NDArray[np.intp]], int]:
    """Q, R and the order of a QR decomposition of rows (m, n), the most independent first; and how many there are."""
    if not len(rows):
        return (np.zeros((rows.shape[1], 0)), np.zeros((0, 0)), np.zeros(0, dtype=np.intp)), 0
    *factors, order = scipy.linalg.qr(rows.T, mode="economic", pivoting=True)
    basis, triangle = (np.asarray(factor, dtype=np.float64) for factor in factors)
    return (basis, triangle, order.astype(np.intp)), int((np.abs(np.diag(triangle)) > tolerance).sum())


def _evaluated(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows and variables (r + n,), their Jacobian (r + n, n), the objective's gradient (n,).

    Column by column: to write down the whole Jacobian takes longer than to evaluate one direction of it n times.
    """
    x, g, n = program.x, program.g, program.x.shape[0]
    direction = type(x).sym("direction", n)
    at = ca.Function("at", [x], [g, ca.gradient(program.f, x)])
    along = ca.Function("along", [x, direction], [ca.jtimes(g, x, direction)])
    rows, gradient = (as_array(part).ravel() for part in at(z))
    columns = as_array(along(np.tile(z[:, None], n), np.eye(n)))
    return np.concatenate([rows, z]), np.vstack([columns, np.eye(n)]), gradient


def _bounds(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    pairs = zip(program.row_bounds(), program.bounds_near(z), strict=True)
    lower, upper = (np.concatenate(pair) for pair in pairs)
    return lower, upper


PAYLOAD = "payload"


def payload_price(
    program: MotionProgram, z: FloatArray, multipliers: FloatArray, objective_unit: str
) -> Sensitivity | None:
    """What a payload that is lighter by one unit of mass is worth; None where nothing with a mass is carried.

    Args:
        program: whose optimum it is.
        z: the optimum, (n,).
        multipliers: of the rows, (r,): positive at an upper bound.
        objective_unit: of the program's objective.
    """
    payload = payload_of(program.task.robot)
    if payload is None or payload.mass == 0.0:
        return None
    slope = float(parameter_slopes(program, z, multipliers, payload, "mass")[0])
    unit = f"{objective_unit} / (kg)"
    return Sensitivity(PAYLOAD, "mass", 0, -slope, unit, payload.mass, "kg") if slope else None


def payload_of(robot: Robot) -> Payload | None:
    """What its tool carries, if it can carry anything."""
    payload = getattr(robot, PAYLOAD, None)
    return payload if isinstance(payload, Payload) else None


def parameter_slopes(
    program: MotionProgram, z: FloatArray, multipliers: FloatArray, statement: Parametric, field: str
) -> FloatArray:
    """Derivatives of the optimum with respect to the numbers of a field of a statement, (m,), in their units.

    Args:
        program: whose optimum it is, (n,); the statement is in its task or its limits.
        z: the optimum, (n,).
        multipliers: of the rows, (r,): positive at an upper bound.
        statement: the robot, what it carries, an obstacle.
        field: one of its ``numbers``, on which no bound of a row or of a variable depends.
    """
    arguments = Arguments(lambda owner, name: owner is statement and name == field)
    own = {part.name: arguments.symbolic_copy(getattr(program, part.name)) for part in fields(program)}  # type: ignore[arg-type]
    symbolic_copy = replace(program, **own)  # type: ignore[type-var]
    size = program.objective_size
    lagrangian = size * (
        symbolic_copy.f * symbolic_copy.objective_size / size + ca.dot(ca.DM(multipliers), symbolic_copy.g)
    )
    slope = ca.gradient(lagrangian, arguments.symbols)
    at = ca.Function("slope", [symbolic_copy.x, arguments.symbols], [slope])
    return np.asarray(as_array(at(z, arguments.values)).ravel())
