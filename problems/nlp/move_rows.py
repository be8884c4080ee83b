"""Rows of a move: places at the waypoints, and limits of angles and their derivatives that hold for all t."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray, Matrix, as_array
from problems.limits.constraint import Constraint
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.nlp.move_pieces import Pieces, PieceVariables
from problems.nlp.program import equality
from problems.robots.robot import Robot
from problems.tasks.move import Move
from problems.tasks.place import ANGLE_TOLERANCE, Place

ALLOWANCE = 1e-3  # of the margin, left of what holds for all t and only rounding may break


def place_rows(task: Move, theta: Matrix, misses: Matrix) -> list[Constraint]:
    """Start, vias and goal.

    Args:
        task: whose.
        theta: angles at the waypoints, (waypoints, k), rad.
        misses: by how much each of several goals is missed, (m, 1), of about 1; which of them must be zero is for the
            bounds of these variables to say. Empty where there is one goal.
    """
    robot = task.robot
    named = [("start", task.start), *((f"via {number}", via) for number, via in enumerate(task.vias, start=1))]
    rows = [_place_row(robot, name, place, theta[row, :]) for row, (name, place) in enumerate(named)]
    goals = [_place_row(robot, "goal", goal, theta[-1, :]) for goal in task.goals]
    if len(goals) > 1:
        parts = ca.vertsplit(misses, np.cumsum([0, *(len(goal.columns) for goal in goals)]).tolist())
        each = zip(task.goals, goals, parts, strict=True)
        goals = [replace(row, expression=row.expression - _size(robot, goal) * part.T) for goal, row, part in each]
    return [*rows, *goals]


def goal_misses(task: Move, theta: FloatArray) -> list[FloatArray]:
    """By how much a posture (k,) misses each of several goals, as the variables say it, each (m,); empty for one."""
    robot, posture = task.robot, ca.DM(theta).T
    if len(task.goals) == 1:
        return []
    return [as_array(goal.miss(robot, posture)).ravel() / _size(robot, goal) for goal in task.goals]


def _size(robot: Robot, place: Place) -> float:
    """What makes a miss dimensionless."""
    return place.tolerance(robot) / ANGLE_TOLERANCE


def _place_row(robot: Robot, name: str, place: Place, theta: Matrix) -> Constraint:
    miss = place.miss(robot, theta)
    columns = [str(number) for number in range(1, miss.shape[1] + 1)]
    return equality(name, miss, place.unit, columns, f"the motion is at {name}", _size(robot, place))


@dataclass(frozen=True)
class ExactRows:
    """Limits of angles and derivatives on Bezier coefficients, between which these stay for all t.

    Args:
        variables: of the motion.
        pieces: the same, in symbols.
        waypoints: which nodes are waypoints.
        moving: whether ends move, so that a solution cannot be scaled in time.
        margin: of limits that are sampled; these ones need but a small part of it.
    """

    variables: PieceVariables
    pieces: Pieces
    waypoints: NDArray[np.intp]
    moving: bool
    margin: float

    def of(self, limits: Iterable[Limit]) -> list[Constraint]:
        """The rows of those limits that bound angles or, where time counts, a derivative of them."""
        rows = []
        for limit in limits:
            if limit.order == 0:
                rows += self._range(limit)
            elif limit.order is not None and self.variables.timed:
                values = self._values(limit.order) / self.variables.unit**limit.order
                chosen = limit.at(self._samples(limit.order, values))
                rows += [self._narrowed(row) for row in chosen] if self.moving else chosen
        return rows

    def _samples(self, order: int, values: Matrix) -> Samples:
        """Samples of one derivative."""
        derivatives = *((None,) * order), values
        return Samples(robot=self.variables.robot, derivatives=derivatives, duration=ca.DM.nan())

    def _values(self, order: int) -> Matrix:
        """Bezier coefficients of a derivative, scaled; without those at the ends, which are given."""
        pieces, smooth = self.pieces, self.variables.smooth
        if order == 1:
            return ca.vertcat(pieces.speed[1:-1, :], pieces.middle[1:-1, :] if smooth else pieces.middle)
        if order == 2:
            return pieces.before[1:, :] if smooth else ca.vertcat(pieces.before, pieces.after)
        assert pieces.jerk is not None  # where it is limited
        return pieces.jerk

    def _range(self, limit: Limit) -> list[Constraint]:
        """The angles between waypoints; next to one, which may be at the end of a range, without allowance."""
        after, before = self.pieces.inner_angles
        beside = ca.vertcat(after[self.waypoints[:-1].tolist(), :], before[(self.waypoints[1:] - 1).tolist(), :])
        inner = np.setdiff1d(np.arange(self.variables.count), self.waypoints)
        apart = ca.vertcat(
            self.pieces.theta[inner.tolist(), :], after[inner.tolist(), :], before[(inner - 1).tolist(), :]
        )
        return [*limit.at(self._samples(0, apart), ALLOWANCE * self.margin), *limit.at(self._samples(0, beside))]

    def _narrowed(self, row: Constraint) -> Constraint:
        """With the allowance of a motion that cannot be scaled."""
        share = 1.0 - ALLOWANCE * self.margin
        assert row.lower is not None
        assert row.upper is not None
        return replace(row, lower=row.lower * share, upper=row.upper * share)
