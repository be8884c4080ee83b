"""Any limit proven for all t, by interval arithmetic over cells of time.

A range is finite, and then the value is defined all over the box; or it is not a number, where the value may be
undefined or without bounds: an argument may be outside a domain or 0 in a denominator, or the operation is in no table.
Bounds are moved outwards by more than rounding takes.

In a cell of time every joint's angle and each derivative lies within its own bounds; interval arithmetic bounds the
expression there. Where it is continuous, so does its value in the middle of the cell with a bound of how fast it
changes, which closes in with the square of the cell's length. Cells in which neither settles the limit are halved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from math import perm, pi
from typing import TypeAlias

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray, as_array
from problems.certify.settings import DEFAULT_INTERVALS, IntervalSettings
from problems.certify.time_cells import TimeCells, shifted
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, WorstIs, infinite, peak_near, verdict
from problems.evaluation import interpret
from problems.limits import Constraint, Limit
from problems.motions import SAMPLED_ORDERS, Samples, Trajectory

Range: TypeAlias = tuple[FloatArray, FloatArray]  # lower and upper bounds in n boxes, both (n,)
OPERATION_ROUNDING = 8.0 * np.finfo(float).eps  # relative, of one operation
ROUNDING = 1e-14  # of the sizes of a polynomial's terms: more than its value loses
LARGEST_ANGLE = 1e6  # rad; beyond, remainders of turns are too rough to tell where a sine peaks

CONTINUOUS = {  # expressions of these alone obey the mean value theorem
    *("neg", "sq", "twice", "inv", "sqrt", "fabs", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log"),
    *("sinh", "cosh", "tanh", "asinh", "erf", "log1p", "expm1", "add", "sub", "mul", "div", "fmin", "fmax", "pow"),
    *("hypot", "atan2"),  # the last where it does not jump by a turn
}

EXACT = {  # operations without rounding
    *("neg", "twice", "fabs", "sign", "floor", "ceil", "not", "fmin", "fmax", "lt", "le", "eq", "ne", "and", "or"),
    "if_else_zero",
}
WITHIN_ONE = {"sin", "cos", "tanh", "erf"}  # never beyond 1 in size, whatever the rounding


class Ranges:
    """Interpreter of expressions in intervals.

    Args:
        count: of boxes.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self.operations: set[str] = set()
        self.jumps = np.zeros(count, dtype=bool)  # boxes in which an angle may jump by a turn

    def constant(self, value: float) -> Range:
        """The range of a number, equal in all boxes."""
        number = np.full(self._count, value)
        return number, number

    def unary(self, name: str, a: Range) -> Range:
        """The range of an operation on one range."""
        self.operations.add(name)
        with np.errstate(all="ignore"):
            return _certain(name, UNARY[name](*a) if name in UNARY else self._undefined)

    def binary(self, name: str, a: Range, b: Range) -> Range:
        """The range of an operation on two ranges."""
        self.operations.add(name)
        if name == "atan2":
            self.jumps |= _jumps(a, b)
        with np.errstate(all="ignore"):
            return _certain(name, BINARY[name](a, b) if name in BINARY else self._undefined)

    @property
    def _undefined(self) -> Range:
        return self.constant(np.nan)


def _certain(name: str, computed: Range) -> Range:
    """The range of an operation widened by rounding, and not a number where a bound is not finite."""
    low, high = computed
    known, rounding = np.isfinite(low) & np.isfinite(high), 0.0 if name in EXACT else OPERATION_ROUNDING
    low, high = low - rounding * np.abs(low), high + rounding * np.abs(high)
    if name in WITHIN_ONE:
        low, high = np.maximum(low, -1.0), np.minimum(high, 1.0)
    return np.where(known, low, np.nan), np.where(known, high, np.nan)


def _within(low: FloatArray, high: FloatArray, domain: tuple[float, float], values: Range) -> Range:
    """The range of values where an argument is within a domain, else not a number."""
    inside = (low >= domain[0]) & (high <= domain[1])
    return np.where(inside, values[0], np.nan), np.where(inside, values[1], np.nan)


def _rising(
    function: Callable[[FloatArray], FloatArray], lowest: float = -np.inf, highest: float = np.inf
) -> Callable[[FloatArray, FloatArray], Range]:
    """A function that rises over its domain."""
    return lambda low, high: _within(low, high, (lowest, highest), (function(low), function(high)))


def _error_function(x: FloatArray) -> FloatArray:
    return np.asarray(scipy.special.erf(x))


def _falling(
    function: Callable[[FloatArray], FloatArray], lowest: float, highest: float
) -> Callable[[FloatArray, FloatArray], Range]:
    return lambda low, high: _within(low, high, (lowest, highest), (function(high), function(low)))


def _even(function: Callable[[FloatArray], FloatArray]) -> Callable[[FloatArray, FloatArray], Range]:
    """A function that rises on both sides of 0."""

    def of(low: FloatArray, high: FloatArray) -> Range:
        least = np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(np.abs(low), np.abs(high)))
        return function(least), function(np.maximum(np.abs(low), np.abs(high)))

    return of


def _wave(function: Callable[[FloatArray], FloatArray], top: float) -> Callable[[FloatArray, FloatArray], Range]:
    """A sine whose highest value is at an angle, in turns."""

    def of(low: FloatArray, high: FloatArray) -> Range:
        ends = function(low), function(high)
        rough = np.maximum(np.abs(low), np.abs(high)) > LARGEST_ANGLE
        has_top, has_bottom = (
            rough | (np.floor(high / (2.0 * pi) - at) >= np.ceil(low / (2.0 * pi) - at)) for at in (top, top + 0.5)
        )
        return np.where(has_bottom, -1.0, np.minimum(*ends)), np.where(has_top, 1.0, np.maximum(*ends))

    return of


def _tangent(low: FloatArray, high: FloatArray) -> Range:
    ends = np.tan(low), np.tan(high)
    same_branch = (np.floor(low / pi + 0.5) == np.floor(high / pi + 0.5)) & (ends[0] <= ends[1])
    known = same_branch & (np.maximum(np.abs(low), np.abs(high)) <= LARGEST_ANGLE)
    return np.where(known, ends[0], np.nan), np.where(known, ends[1], np.nan)


def _inverse(low: FloatArray, high: FloatArray) -> Range:
    crosses = (low <= 0.0) & (high >= 0.0)
    return np.where(crosses, np.nan, 1.0 / high), np.where(crosses, np.nan, 1.0 / low)


def _product(a: Range, b: Range) -> Range:
    corners = [x * y for x in a for y in b]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _minus(a: Range, b: Range) -> Range:
    return a[0] - b[1], a[1] - b[0]


def _power(a: Range, b: Range) -> Range:
    """The range of a power with a positive base, or with a whole, positive exponent."""
    exponent = b[0][0] if b[0].size and (b[0] == b[1]).all() and (b[0] == b[0][0]).all() else np.nan
    if exponent > 0.0 and exponent == np.floor(exponent):
        return _even(lambda x: x**exponent)(*a) if exponent % 2 == 0.0 else (a[0] ** exponent, a[1] ** exponent)
    logarithm = _within(*a, (0.0, np.inf), (np.log(a[0]), np.log(a[1])))
    low, high = _product(logarithm, b)
    return np.exp(low), np.exp(high)


def _jumps(y: Range, x: Range) -> NDArray[np.bool_]:
    """Whether a box may hold points at which atan2 jumps: those to the left of 0 and 0 itself."""
    return np.asarray(~((x[0] > 0.0) | (y[0] > 0.0) | (y[1] < 0.0)))


def _angle(y: Range, x: Range) -> Range:
    """atan2: sharp to the right of 0, above it and below it, anything within a turn elsewhere."""
    turn = np.where(np.isnan(y[0]) | np.isnan(x[0]), np.nan, pi)
    (low, high), (left, right) = _product(y, _inverse(*x)), _product(x, _inverse(*y))
    beside, rounding = np.where(y[0] > 0.0, pi / 2.0, -pi / 2.0), OPERATION_ROUNDING * pi
    jumps, is_right = _jumps(y, x), x[0] > 0.0
    return (
        np.where(jumps, -turn, np.where(is_right, np.arctan(low), beside - np.arctan(right) - rounding)),
        np.where(jumps, turn, np.where(is_right, np.arctan(high), beside - np.arctan(left) + rounding)),
    )


def _hypotenuse(a: Range, b: Range) -> Range:
    one, other = _even(np.abs)(*a), _even(np.abs)(*b)
    return np.hypot(one[0], other[0]), np.hypot(one[1], other[1])


def _truth(certain: NDArray[np.bool_], impossible: NDArray[np.bool_]) -> Range:
    """The range of a truth value, uncertain where an argument is not a number."""
    return np.where(certain, 1.0, 0.0), np.where(impossible, 0.0, 1.0)


def _identical(a: Range, b: Range) -> NDArray[np.bool_]:
    return np.asarray((a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0]))


def _apart(a: Range, b: Range) -> NDArray[np.bool_]:
    return np.asarray((a[1] < b[0]) | (b[1] < a[0]))


def _both(a: Range, b: Range) -> Range:
    """The conjunction of truth values, of which all but 0 are true."""
    return _truth(_surely(a) & _surely(b), _never(a) | _never(b))


def _either(a: Range, b: Range) -> Range:
    return _truth(_surely(a) | _surely(b), _never(a) & _never(b))


def _surely(a: Range) -> NDArray[np.bool_]:
    return np.asarray((a[0] > 0.0) | (a[1] < 0.0))


def _never(a: Range) -> NDArray[np.bool_]:
    return np.asarray((a[0] == 0.0) & (a[1] == 0.0))


def _if(a: Range, b: Range) -> Range:
    """B where a is true, else 0."""
    low, high = np.minimum(b[0], 0.0), np.maximum(b[1], 0.0)
    return (
        np.where(_surely(a), b[0], np.where(_never(a), 0.0, low)),
        np.where(_surely(a), b[1], np.where(_never(a), 0.0, high)),
    )


UNARY: dict[str, Callable[[FloatArray, FloatArray], Range]] = {
    "neg": lambda low, high: (-high, -low),
    "sq": _even(np.square),
    "twice": lambda low, high: (2.0 * low, 2.0 * high),
    "inv": _inverse,
    "sqrt": _rising(np.sqrt, lowest=0.0),
    "fabs": _even(np.abs),
    "sign": _rising(np.sign),
    "floor": _rising(np.floor),
    "ceil": _rising(np.ceil),
    "not": lambda low, high: _truth(_never((low, high)), _surely((low, high))),
    "sin": _wave(np.sin, 0.25),
    "cos": _wave(np.cos, 0.0),
    "tan": _tangent,
    "asin": _rising(np.arcsin, -1.0, 1.0),
    "acos": _falling(np.arccos, -1.0, 1.0),
    "atan": _rising(np.arctan),
    "exp": _rising(np.exp),
    "log": _rising(np.log, lowest=0.0),
    "sinh": _rising(np.sinh),
    "cosh": _even(np.cosh),
    "tanh": _rising(np.tanh),
    "asinh": _rising(np.arcsinh),
    "acosh": _rising(np.arccosh, lowest=1.0),
    "atanh": _rising(np.arctanh, -1.0, 1.0),
    "erf": _rising(_error_function),
    "log1p": _rising(np.log1p, lowest=-1.0),
    "expm1": _rising(np.expm1),
}
BINARY: dict[str, Callable[[Range, Range], Range]] = {
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": _minus,
    "mul": _product,
    "div": lambda a, b: _product(a, _inverse(*b)),
    "fmin": lambda a, b: (np.minimum(a[0], b[0]), np.minimum(a[1], b[1])),
    "fmax": lambda a, b: (np.maximum(a[0], b[0]), np.maximum(a[1], b[1])),
    "pow": _power,
    "atan2": _angle,
    "hypot": _hypotenuse,
    "lt": lambda a, b: _truth(a[1] < b[0], a[0] >= b[1]),
    "le": lambda a, b: _truth(a[1] <= b[0], a[0] > b[1]),
    "eq": lambda a, b: _truth(_identical(a, b), _apart(a, b)),
    "ne": lambda a, b: _truth(_apart(a, b), _identical(a, b)),
    "and": _both,
    "or": _either,
    "if_else_zero": _if,
}  # fmt: skip


def prove_by_cells(
    limit: Limit, trajectory: Trajectory, settings: IntervalSettings = DEFAULT_INTERVALS
) -> list[Verdict]:
    """Verdicts on a limit: violated where a time is found that breaks it, certified where all cells are settled.

    Verdicts are about every time, so that constraints on steps from one sample to the next are left out. An expression
    that depends on a derivative is infinite for a moment where a lower one jumps.

    Args:
        limit: of any kind.
        trajectory: the motion.
        settings: of the proof.
    """
    times = trajectory.times(settings.first_times)
    constraints = limit.constraints_at(trajectory.samples(times, limit.robot_or_none))
    return [_proven(limit, index, constraint, trajectory, settings) for index, constraint in enumerate(constraints)]


def _proven(
    limit: Limit, index: int, constraint: Constraint, trajectory: Trajectory, settings: IntervalSettings
) -> Verdict:
    """The verdict on one of the constraints of a limit."""
    times = trajectory.times(settings.first_times)
    if constraint.rows != times.size:  # it is not about one time after the other
        outcome = verdict(constraint, times)
        return outcome.undecided_in(None) if outcome.satisfied else outcome
    outcome = of_values(constraint, as_array(constraint.expression), times)
    if not trajectory.is_finite or not np.isfinite(outcome.worst):
        return outcome
    if not outcome.satisfied:
        return _at_its_peak(limit, index, trajectory, outcome, settings.first_times)
    motion = _Expression(limit, index, constraint, trajectory)
    jumps = trajectory.jumps_below(motion.order)
    if jumps is not None:
        return infinite(outcome, jumps)
    most = int(np.clip(settings.most_intervals / motion.operations, settings.fewest_cells, settings.most_cells))
    queue, count = [TimeCells.over(trajectory, settings.initial_cells)], 0
    while queue and count <= most:
        cells = queue.pop()
        count += len(cells)
        settled, values = motion.settled(cells)
        seen = of_values(constraint, values, cells.moments(np.zeros(len(cells))).times)
        if not seen.satisfied:
            return seen
        queue += cells.halved(~settled).divided(settings.cells_at_once)
    outcome = _at_its_peak(limit, index, trajectory, outcome, settings.first_times)
    return outcome.undecided_in(queue[-1].first) if queue and outcome.satisfied else outcome


def _at_its_peak(limit: Limit, index: int, trajectory: Trajectory, first: Verdict, count: int) -> Verdict:
    """The verdict with the worst value near the worst of so many times."""

    def at(times: FloatArray) -> tuple[Constraint, FloatArray]:
        constraint = limit.constraints_at(trajectory.samples(times, limit.robot_or_none))[index]
        return constraint, as_array(constraint.expression)

    def nearness(times: FloatArray) -> FloatArray:
        constraint, values = at(times)
        lower, upper = constraint.bounds
        return -np.asarray((np.minimum(values - lower, upper - values) / constraint.scales).min(axis=1))

    times, step = trajectory.times(count), trajectory.duration / (count - 1)
    _, time = peak_near(nearness, float(times[np.argmax(nearness(times))]), step, trajectory.duration)
    worst = of_values(*at(np.array([time])), np.array([time]))
    return worst if worst.satisfied and first.satisfied else replace(worst, status=CertificateStatus.VIOLATED)


def of_values(constraint: Constraint, values: FloatArray, times: FloatArray) -> Verdict:
    """The verdict on values (n, m) at times (n,); one that is no finite number breaks the limit."""
    undefined = np.argwhere(~np.isfinite(values))
    if not undefined.size:
        outcome = replace(verdict(replace(constraint, expression=ca.DM(values)), times), worst_is=WorstIs.FOUND)
        if outcome.time is not None:
            return outcome
        time = float(times[0])  # of the only row
        return replace(outcome, where=f"{outcome.where}, t = {time:.4g} s", time=time)
    (row, column), (lower, upper) = undefined[0], constraint.bounds
    return Verdict(
        name=constraint.name,
        worst=np.inf,
        bound=float(upper[column] if np.isfinite(upper[column]) else lower[column]),
        unit=constraint.unit,
        status=CertificateStatus.VIOLATED,
        where=f"{constraint.columns[column]} is undefined, t = {times[row]:.4g} s",
        worst_is=WorstIs.FOUND,
        time=float(times[row]),
    )


class _Expression:
    """The m values that a constraint bounds along a motion, and how fast they change."""

    def __init__(self, limit: Limit, index: int, constraint: Constraint, trajectory: Trajectory) -> None:
        self.trajectory = trajectory
        (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
        self._bounds = lower - slack, upper + slack
        derivatives = [
            ca.SX.sym(f"derivative_{order}", trajectory.coefficients.shape[2]) for order in range(SAMPLED_ORDERS + 1)
        ]
        time = ca.SX.sym("time")
        rows, duration = tuple(part.T for part in derivatives[:-1]), ca.SX(trajectory.duration)
        now = Samples(robot=limit.robot_or_none, derivatives=rows, duration=duration, times=time)
        values = ca.densify(limit.exact_constraints_at(now)[index].expression.T)
        state, rates = ca.vertcat(*derivatives[:-1], time), ca.vertcat(*derivatives[1:], 1.0)
        changes = ca.densify(ca.jtimes(values, state, rates))
        symbols = ca.vertcat(*derivatives, time)
        used = [order for order, part in enumerate(derivatives[:-1]) if ca.depends_on(values, part)]
        self.order = max(used, default=0)  # of the highest derivative that it depends on
        self.values = ca.Function("values", [symbols], [values], {"cse": True})
        self.both = ca.Function("both", [symbols], [values, changes], {"cse": True})

    @property
    def operations(self) -> int:
        """The number of operations in one cell."""
        return int(self.both.n_instructions())

    def settled(self, cells: TimeCells) -> tuple[NDArray[np.bool_], FloatArray]:
        """Mask of the cells in which the limit is proven, (n,); and the values in their middles, (n, m)."""
        middles, ranges = self._along(cells)
        interpreter = Ranges(len(cells))
        inside, changes = interpret(self.both, [ranges], interpreter)
        certain = self._continuous
        at_middle = as_array(self.values(middles)).T
        proven = np.ones(len(cells), dtype=bool)
        for column, (range_, change, least, most) in enumerate(zip(inside, changes, *self._bounds, strict=True)):
            around = _around(at_middle[:, column], change, cells.halves, certain & ~interpreter.jumps)
            proven &= (np.maximum(range_[0], around[0]) >= least) & (np.minimum(range_[1], around[1]) <= most)
        return proven, at_middle

    @cached_property
    def _continuous(self) -> bool:
        interpreter = Ranges(1)
        interpret(self.values, [[interpreter.constant(0.0)] * self.values.size1_in(0)], interpreter)
        return interpreter.operations <= CONTINUOUS

    def _along(self, cells: TimeCells) -> tuple[FloatArray, list[Range]]:
        """Arguments of the expression: in the middles of the cells, and their ranges in them."""
        local, ends = self.trajectory.coefficients[::-1][:, cells.pieces], cells.middles + cells.halves
        around, sizes = shifted(local, cells.middles), shifted(np.abs(local), ends)
        degree, count, joints = around.shape
        values, ranges = [], []
        for order in range(SAMPLED_ORDERS + 1):
            terms = [
                perm(power + order, order) * around[power + order] * cells.halves[:, None] ** power
                for power in range(degree - order)
            ] or [np.zeros((count, joints))]
            rest = np.sum(np.abs(terms[1:]), axis=0) if len(terms) > 1 else np.zeros((count, joints))
            rest += ROUNDING * perm(order, order) * sizes[order] if order < degree else 0.0
            values.append(terms[0].T)
            ranges += list(zip((terms[0] - rest).T, (terms[0] + rest).T, strict=True))
        times = cells.moments(np.zeros(count)).times
        reach = cells.halves + ROUNDING * self.trajectory.breakpoints[-1]
        ranges.append((times - reach, times + reach))
        return np.vstack([*values, times]), ranges


def _around(middle: FloatArray, changes: Range, halves: FloatArray, certain: NDArray[np.bool_]) -> Range:
    """The range within half a cell of its middle, by the mean value theorem; unbounded where it may not hold."""
    away = np.maximum(np.abs(changes[0]), np.abs(changes[1])) * halves
    known = certain & np.isfinite(middle) & np.isfinite(away)
    return np.where(known, middle - away, -np.inf), np.where(known, middle + away, np.inf)
