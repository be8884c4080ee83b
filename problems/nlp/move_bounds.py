"""Bounds of the variables of a move: what is given at its ends and at its waypoints, and how far a descent may go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.nlp.move_pieces import SHORTEST, PieceVariables
from problems.nlp.move_rows import goal_misses
from problems.nlp.program import MAX_ANGLE_CHANGE
from problems.tasks.elbow import narrow_elbow
from problems.tasks.move import Move
from problems.tasks.place import Place


@dataclass(frozen=True)
class MoveBounds:
    """Bounds around a start.

    Args:
        task: whose.
        variables: of the motion; behind them are the misses of several goals, then slacks.
        waypoints: which nodes are waypoints.
    """

    task: Move
    variables: PieceVariables
    waypoints: NDArray[np.intp]

    def near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of variables (n,), both (n,)."""
        lower, upper = np.full(x.size, -np.inf), np.full(x.size, np.inf)
        goal = self.task.reached_goal(self.variables.end_postures(x)[1])
        self._angles(x, goal, lower, upper)
        self._ends(lower, upper)
        lower[self.variables.slices[-1]] = SHORTEST
        motion = sum(self.variables.sizes)
        kept = self._kept(goal)
        lower[motion : motion + kept.size][kept] = upper[motion : motion + kept.size][kept] = 0.0
        lower[motion + kept.size :] = 0.0
        return lower, upper

    def _angles(self, x: FloatArray, goal: Place, lower: FloatArray, upper: FloatArray) -> None:
        """Ranges, and elbows at the waypoints; in place."""
        robot, nodes, theta = self.task.robot, self.variables.count + 1, self.variables.slices[0]
        lower[theta], upper[theta] = (
            (x[theta] - MAX_ANGLE_CHANGE, x[theta] + MAX_ANGLE_CHANGE)
            if robot.limits.position is None
            else np.repeat(np.array(robot.limits.position), nodes, axis=0).T
        )
        for node, place in zip(self.waypoints.tolist(), [self.task.start, *self.task.vias, goal], strict=True):
            if place.chosen_by_inverse_kinematics:  # theta_2 is the second column
                narrow_elbow(self.task.elbow, x, nodes + node, lower, upper, robot.stretched)

    def _ends(self, lower: FloatArray, upper: FloatArray) -> None:
        """Velocities, and accelerations where they are continuous; in place."""
        _, speed, acceleration, *_ = self.variables.slices
        velocities = self.task.end_velocities * self.variables.unit
        fixed = [(speed, velocities), *([(acceleration, 0.0 * velocities)] if self.variables.smooth else [])]
        for block, values in fixed:
            for bound in (lower, upper):
                bound[block].reshape(self.task.robot.dof, -1)[:, [0, -1]] = values.T

    def _kept(self, goal: Place) -> NDArray[np.bool_]:
        """Which misses of several goals are those of one of them."""
        sizes = [miss.size for miss in goal_misses(self.task, np.zeros(self.task.robot.dof))]
        return np.repeat([other is goal for other in self.task.goals], sizes or 0)
