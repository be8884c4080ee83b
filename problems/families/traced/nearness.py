"""Nearness to a path of straight lines as limits of one instant, for programs that make a motion along it faster.

A posture is near the path where the tool is near the nearest of its lines, and turned as that line says there. That
says nothing of points at which the path turns sharply: between two lines the tool may cut a corner by more than it may
be away from either. Such corners are places to be passed; of others the tool keeps a little nearer than it must.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.limits import ExpressionLimit, StatedExpression, rotation_away, shares_along, turned_along
from problems.motions import MotionView, traced
from problems.tasks import Position, SpaceTracing

SHARP = 0.4  # rad: a corner that turns by more is a place to be passed
KEPT = 0.998  # of accuracies: what splines through postures of a motion leave of them


@dataclass(frozen=True, eq=False)
class Nearness:
    """The nearness to the path of a task, as limits and places.

    Args:
        task: path and accuracies.
        lines: of the path: start and end, m; with orientations also how each turns, (n, w).
    """

    task: SpaceTracing
    lines: FloatArray

    @cached_property
    def _turns(self) -> FloatArray:
        """The angle by which the path turns at each inner point, rad."""
        steps = np.diff(self.task.path.array, axis=0)
        units = steps / np.linalg.norm(steps, axis=1)[:, None]
        return np.asarray(np.arccos(np.clip((units[1:] * units[:-1]).sum(axis=1), -1.0, 1.0)))

    @property
    def _sharp(self) -> NDArray[np.bool_]:
        return self._turns > SHARP

    @property
    def corners(self) -> tuple[Position, ...]:
        """Corners that turn sharply, as places that may be missed by the accuracy."""
        points = self.task.path.array[1:-1][self._sharp]
        return tuple(Position(tuple(point), within=KEPT * self.task.accuracy) for point in points.tolist())

    @cached_property
    def limits(self) -> tuple[ExpressionLimit, ...]:
        """Limits on the distance, m, and on the sine of an angle where the path gives orientations."""
        robot, most = self.task.robot, self.task.angular_accuracy
        cut = float(np.cos(self._turns[~self._sharp].max(initial=0.0) / 2.0))

        def near(m: MotionView) -> ca.SX:
            return ca.norm_2(self._nearest(m.tool)[0])

        def facing(m: MotionView) -> ca.SX:
            _, share, line = self._nearest(m.tool)
            wanted = ca.reshape(turned_along(share, line), 3, 3).T
            sine, cosine = rotation_away(wanted, m.rotation)
            return ca.vertcat(ca.norm_2(sine), -cosine)

        name = "path accuracy"
        stated = [
            StatedExpression(
                name, "m", traced(near, robot, name, differentiates=False), None, (KEPT * cut * self.task.accuracy,)
            )
        ]
        if most is not None:
            name, sine = "angular accuracy", float(np.sin(KEPT * most))
            stated.append(
                StatedExpression(name, "rad", traced(facing, robot, name, differentiates=False), None, (sine, 0.0))
            )
        return tuple(each.for_robot(robot, ()) for each in stated)

    def _nearest(self, tool: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
        """The miss of the nearest line by a point (3, 1): a vector, (3, 1), its share, and the line's turn, (1, w)."""
        seen = [self._seen(tool, row) for row in self.lines]
        _, missed, share, turned = reduce(_nearer, seen)
        return missed, share, turned

    @staticmethod
    def _seen(tool: ca.SX, line: FloatArray) -> list[ca.SX]:
        """The squared distance from one line, and the same."""
        start, end = ca.DM(line[:3]).T, ca.DM(line[3:6]).T
        share = shares_along(tool.T, start, end)
        missed = tool - (start + share * (end - start)).T
        return [ca.sumsqr(missed), missed, ca.SX(share), ca.SX(ca.DM(line[6:]).T)]


def _nearer(one: list[ca.SX], other: list[ca.SX]) -> list[ca.SX]:
    """The values seen of the nearer one of two lines."""
    first = one[0] <= other[0]
    return [ca.if_else(first, *each) for each in zip(one, other, strict=True)]
