"""Paths of the tool in space run faster by programs that leave them as far as they may."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.assembly import Criteria, DirectPlanner
from problems.families.traced.nearness import Nearness
from problems.motions import Trajectory
from problems.polish import PIECES, ExpressionLimits, IntegrandFunctions, faster_nearby, programs_know
from problems.tasks import SpaceTracing
from problems.worlds import world_of

MOST_POLISHES, WORTH_POLISHING = 3, 0.01  # of a path; of the duration: what one gains before the next
PIECES_EACH, MOST_PIECES = 12, 96  # of what a motion deviates by: in each stretch between two stops, in all


@dataclass(frozen=True, eq=False)
class TracingPlanner(DirectPlanner):
    """Programs that make a motion along a path deviate, in least time, where they know what else is asked for.

    Args:
        criteria: by which motions are judged.
        task: the statement.
        stretches: of the path, between two stops.
    """

    criteria: Criteria
    task: SpaceTracing
    stretches: int

    @cached_property
    def integrals(self) -> IntegrandFunctions | None:
        """The integrals of what is minimised; None where programs do not know all that is asked for."""
        others = [limit for limit in self.criteria.limits if not ExpressionLimits.supports(limit)]
        free = self.task.total_time is None and not self.task.is_timed
        objective = self.criteria.objective
        if not (free and objective.asks_for_least_time and programs_know(others)):
            return None
        return IntegrandFunctions.of(objective, self.task.robot)

    def polished(self, start: Trajectory, is_enough: Callable[[bool], bool]) -> Iterator[Trajectory]:
        """A faster motion that leaves the path as far as it may, by programs that deviate, again while it is worth it.

        Each is certified before the next.
        """
        known = start
        for _ in range(0 if self.integrals is None else MOST_POLISHES):
            faster = self._faster(known)
            gained, known = 1.0 - faster.duration / known.duration, faster
            if gained < WORTH_POLISHING or is_enough(True):
                break
        if known is not start:
            yield known

    def _faster(self, known: Trajectory) -> Trajectory:
        """The first certified motion that programs make of one, if it is faster; else that one."""
        assert self.integrals is not None
        near, stretches = self._nearness, self.stretches
        pieces = PIECES if stretches == 1 else min(PIECES_EACH * stretches, MOST_PIECES)
        limits = (*self.criteria.limits, *near.limits)
        world = world_of(self.task.robot, self.task.obstacles, self.criteria.limits)
        for made in faster_nearby(known, self.integrals, world, limits, places=near.corners, pieces=pieces):
            found = made.time_scaled(max(1.0, self.criteria.safe_time_scale(made)))
            if found.duration < known.duration and all(each.satisfied for each in self.criteria.verify(found)):
                return found
        return known

    @cached_property
    def _nearness(self) -> Nearness:
        lines = [self.task.path.array[:-1], self.task.path.array[1:]]
        orientations = self.task.path.orientations
        if orientations is not None:
            lines += [orientations.matrices[:-1].reshape(-1, 9), orientations.axes, orientations.angles[:, None]]
        return Nearness(self.task, np.column_stack(lines))
