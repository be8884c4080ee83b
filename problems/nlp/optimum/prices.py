"""What each limit is worth at an optimum of a program: shadow prices, and what one per cent of each would buy.

For rows g <= b with multipliers lambda, d f* / d b = -lambda: a limit's price is the sum over its rows, in the limit's
own unit. Prices in different units are compared by what one per cent more of each limit saves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray, as_array
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN
from problems.nlp.program import NonlinearProgram
from problems.robots.robot import Robot

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
