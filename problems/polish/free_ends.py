"""The fastest of motions whose ends may move: at a point or a pose that leaves an arm joints to choose."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, as_array
from problems.motions import Trajectory
from problems.polish.settings import DEFAULT_FREE_ENDS, FreeEndsSettings
from problems.robots import Robot
from problems.tasks import Place


@dataclass(frozen=True, eq=False)
class FreeEnd:
    """The postures at a place near one of them.

    Args:
        robot: that moves.
        place: where the posture is.
        settings: of the steps along them.
    """

    robot: Robot
    place: Place
    settings: FreeEndsSettings = DEFAULT_FREE_ENDS

    @cached_property
    def _jacobian(self) -> ca.Function:
        theta = ca.SX.sym("theta", 1, self.robot.dof)
        return ca.Function("jacobian", [theta], [ca.jacobian(self.place.miss(self.robot, theta), theta)])

    def around(self, theta: FloatArray, step: float) -> Iterator[FloatArray]:
        """The postures there that are one step in rad, both ways in each free direction, from one of them, (dof,)."""
        _, sizes, directions = np.linalg.svd(as_array(self._jacobian(theta)))
        rank = int((sizes > self.settings.rank_tolerance * sizes.max()).sum())
        for direction in directions[rank:]:
            for sign in (1.0, -1.0):
                found, is_there = self.place.near(self.robot, theta + sign * step * direction)
                if is_there and self._is_within_range(found):
                    yield found

    def _is_within_range(self, theta: FloatArray) -> bool:
        ranges = self.robot.limits.position
        return ranges is None or all(low <= angle <= high for angle, (low, high) in zip(theta, ranges, strict=True))


def with_better_ends(
    known: Trajectory,
    ends: tuple[FreeEnd, FreeEnd],
    made: Callable[[FloatArray, FloatArray, Trajectory], Trajectory | None],
    settings: FreeEndsSettings = DEFAULT_FREE_ENDS,
) -> Trajectory:
    """The fastest motion that a pattern search over the postures at both ends leads to.

    Args:
        known: a motion.
        ends: its start and its goal.
        made: the motion between two postures (dof,) near a known motion; None where there is none.
        settings: of the search.
    """
    best, step = known, settings.first_step
    while step >= settings.least_step:
        before = best
        postures = [best.at(best.breakpoints[[end]])[0] for end in (0, -1)]
        for number, end in enumerate(ends):
            for posture in end.around(postures[number], step):
                start, goal = (posture, postures[1]) if number == 0 else (postures[0], posture)
                found = made(start, goal, best)
                if found is not None and found.duration < best.duration:
                    best, postures[number] = found, posture
                    break
        step = step if best is not before else settings.shrinkage * step
    return best
