"""The nonlinear program.

The knots are passed at free times, anywhere within the accuracy: corners are rounded off as far as it allows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base import FloatArray
from problems.families.splines import MoveNlp, PassedMotion, node_times
from problems.limits import Accuracy, Constraint
from problems.motions import Samples, Trajectory
from problems.tasks import Move, PathKnots, PathTracing, Position, times_at

STEPS = 4
MARGINS_OF_ACCURACY = 25.0  # a tool leaves lines between samples by more of the accuracy than obstacles of the reach


@dataclass(frozen=True, kw_only=True)
class TracingNlp(MoveNlp):
    """Lead the tool along a path.

    Args:
        knots: of the path; between any two of them is one piece.
        path: the given points, (n, dim), m.
        accuracy: the largest distance from the path, m.
        box: of the search vectors, lower and upper corner, both (d,).
    """

    knots: PathKnots
    path: FloatArray
    accuracy: float
    box: tuple[FloatArray, FloatArray]

    @property
    def steps(self) -> int:
        """Time steps of a piece: so many that the tool hardly leaves the accuracy between them."""
        return STEPS

    def _constraints(self, samples: Samples, margin: float) -> tuple[Constraint, ...]:
        """Those of a move; near the given points when they are passed, near the lines that join them in between."""
        near, lines = (
            Accuracy(self.accuracy),
            np.append(self.knots.segments.repeat(self.steps), self.knots.segments[-1]),
        )
        starts, ends = ca.DM(self.path[lines]), ca.DM(self.path[lines + 1])
        at_points = (self.steps * self.knots.vertices[1:-1]).tolist()
        margin_of_accuracy = MARGINS_OF_ACCURACY * margin
        rows = [near.along(samples.tool, starts, ends, margin_of_accuracy)]
        if at_points:
            rows.append(near.at(samples.tool[at_points, :], ca.DM(self.path[1:-1]), margin_of_accuracy))
        return (*super()._constraints(samples, margin), *rows)

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """Nodes where the knots are passed; a motion of this program has them at its breakpoints."""
        own = trajectory.breakpoints.size == self.knots.u.size
        times = trajectory.breakpoints if own else times_at(self.robot, trajectory, self.knots.points)
        return self._variables(PassedMotion(trajectory, times))

    def node_times(self, motion: PassedMotion) -> FloatArray:
        """When the knots are passed, a little apart."""
        return node_times(motion.trajectory, motion.times, 1, self.robot.limits)

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        """Random search vectors."""
        while True:
            yield self.from_search(rng.uniform(*self.box))


def end_to_end(task: PathTracing) -> Move:
    """The move from the first point of a path to its last one."""
    first, last = (Position(task.path.points[i]) for i in (0, -1))
    return Move(task.robot, first, (last,), (), task.elbow, task.obstacles, total_time=task.total_time)
