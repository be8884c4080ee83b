"""A limit of a user's own for all t: interval arithmetic and the mean value theorem over cells of time.

In a cell of time every joint's angle and each derivative lies within its own bounds; interval arithmetic bounds the
expression there. Where it is continuous, so does its value in the middle of the cell with a bound of how fast it
changes, which closes in with the square of the cell's length. Cells in which neither settles the limit are halved.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from math import perm

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray, as_array
from problems.certify.dynamics.taylor import ROUNDING
from problems.certify.dynamics.time_cells import TimeCells, shifted
from problems.certify.expressions.ranges import CONTINUOUS, Range, Ranges
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, verdict
from problems.evaluation.tape import interpret
from problems.limits.expression import ExpressionLimit
from problems.motions.samples import Samples
from problems.motions.trajectory import SAMPLED_ORDERS, Trajectory

FIRST_TIMES = 401  # at which a violation is looked for first
INITIAL_CELLS = 64
JERK = 3  # order of the derivative
MOST_NUMBERS = 60_000_000  # intervals that are computed, operations times cells
FEWEST_CELLS, MOST_CELLS = 4_000, 60_000  # that are looked at, however long or short an expression is
MOST_AT_ONCE = 4_096  # cells


def prove_expression(limit: ExpressionLimit, trajectory: Trajectory) -> Verdict:
    """Violated where a time is found at which the limit is broken, certified where all cells are settled."""
    times = trajectory.times(FIRST_TIMES)
    outcome = _of_values(limit, as_array(limit.function.at(trajectory.samples(times, limit.robot))), times)
    if not outcome.satisfied or not trajectory.is_finite:
        return outcome
    jump = trajectory.jump_time(JERK - 1) if limit.function.uses("jerk") else None
    if jump is not None:  # where the jerk is infinite for a moment
        where = f"accelerations jump, t = {jump:.4g} s"
        return replace(outcome, worst=np.inf, status=CertificateStatus.VIOLATED, where=where)
    motion = _Expression(limit, trajectory)
    most = int(np.clip(MOST_NUMBERS / motion.operations, FEWEST_CELLS, MOST_CELLS))
    queue, count = [TimeCells.over(trajectory, INITIAL_CELLS)], 0
    while queue and count <= most:
        cells = queue.pop()
        count += len(cells)
        settled, values = motion.settled(cells)
        middles = cells.moments(np.zeros(len(cells)))
        seen = _of_values(limit, values, middles.times)
        if not seen.satisfied:
            return seen
        queue += _parts(cells.halved(~settled))
    return replace(outcome, status=CertificateStatus.UNDECIDED) if queue else outcome


def _of_values(limit: ExpressionLimit, values: FloatArray, times: FloatArray) -> Verdict:
    """The verdict on values (n, m) at times (n,); one that is no finite number breaks the limit."""
    [constraint] = limit.bounding(ca.DM(values))
    undefined = np.argwhere(~np.isfinite(values))
    if not undefined.size:
        return verdict(constraint, times)
    (row, column), (lower, upper) = undefined[0], constraint.bounds
    return Verdict(
        name=limit.name,
        worst=np.inf,
        bound=float(upper[column] if np.isfinite(upper[column]) else lower[column]),
        unit=limit.unit,
        status=CertificateStatus.VIOLATED,
        where=f"{limit.columns[column]} is undefined, t = {times[row]:.4g} s",
    )


def _parts(cells: TimeCells) -> list[TimeCells]:
    """The same, not too many at once; those that come last are looked at first."""
    edges = range(0, len(cells), MOST_AT_ONCE)
    pieces, middles, halves = cells.pieces, cells.middles, cells.halves
    return [
        TimeCells(cells.trajectory, pieces[e : e + MOST_AT_ONCE], middles[e : e + MOST_AT_ONCE],
                  halves[e : e + MOST_AT_ONCE])
        for e in edges
    ]  # fmt: skip


class _Expression:
    """The expression of a limit along a motion, and how fast it changes.

    Args:
        limit: on m values.
        trajectory: the motion.
    """

    def __init__(self, limit: ExpressionLimit, trajectory: Trajectory) -> None:
        self.limit, self.trajectory = limit, trajectory
        dof, robot = limit.robot.dof, limit.robot
        derivatives = [ca.SX.sym(f"derivative_{order}", dof) for order in range(SAMPLED_ORDERS + 1)]
        time = ca.SX.sym("time")
        rows, duration = tuple(part.T for part in derivatives[:-1]), ca.SX(trajectory.duration)
        now = Samples(robot=robot, derivatives=rows, duration=duration, times=time)
        values = ca.densify(limit.function.at(now).T)
        state, rates = ca.vertcat(*derivatives[:-1], time), ca.vertcat(*derivatives[1:], 1.0)
        changes = ca.densify(ca.jtimes(values, state, rates))
        symbols = ca.vertcat(*derivatives, time)
        self.values = ca.Function("values", [symbols], [values], {"cse": True})
        self.both = ca.Function("both", [symbols], [values, changes], {"cse": True})

    @property
    def operations(self) -> int:
        """In a cell."""
        return int(self.both.n_instructions())

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds with what rounding may take, (m,)."""
        [constraint] = self.limit.bounding(ca.DM.zeros(1, self.limit.function.width))
        (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
        return lower - slack, upper + slack

    def settled(self, cells: TimeCells) -> tuple[NDArray[np.bool_], FloatArray]:
        """In which cells the limit is proven, (n,); and the values in their middles, (n, m)."""
        middles, ranges = self._along(cells)
        interpreter = Ranges(len(cells))
        inside, changes = interpret(self.both, [ranges], interpreter)
        certain = self._continuous
        at_middle = as_array(self.values(middles)).T
        found = np.ones(len(cells), dtype=bool)
        for column, (range_, change, least, most) in enumerate(zip(inside, changes, *self._bounds, strict=True)):
            around = _around(at_middle[:, column], change, cells.halves) if certain else range_
            found &= (np.maximum(range_[0], around[0]) >= least) & (np.minimum(range_[1], around[1]) <= most)
        return found, at_middle

    @cached_property
    def _continuous(self) -> bool:
        interpreter = Ranges(1)
        interpret(self.values, [[interpreter.constant(0.0)] * self.values.size1_in(0)], interpreter)
        return interpreter.operations <= CONTINUOUS

    def _along(self, cells: TimeCells) -> tuple[FloatArray, list[Range]]:
        """What the expression depends on: in the middles of the cells, and anywhere in them."""
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


def _around(middle: FloatArray, changes: Range, halves: FloatArray) -> Range:
    """What is within half a cell of its middle, by the mean value theorem."""
    away = np.maximum(np.abs(changes[0]), np.abs(changes[1])) * halves
    known = np.isfinite(middle) & np.isfinite(away)
    return np.where(known, middle - away, -np.inf), np.where(known, middle + away, np.inf)
