"""Starts of a point-to-point motion.

By turns: a few motions between the end postures of least displacement, along the profiles that get there soonest; and
motions between random postures through a random one. Without obstacles the first are all but the solution. Around
obstacles a random one is the clearest of many.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.two_segments import Quantities
from problems.nlp.starts.displacement import Displacement, displacement_of
from problems.nlp.starts.end_postures import EndPostures, Ends
from problems.nlp.starts.profiles import PROFILES, SKEWED, SYMMETRIC, Profile
from problems.objectives import Objective
from problems.tasks.point_to_point import PointToPoint

END_POSTURE_DRAWS = 8  # random end postures from which the program of least displacement descends
BEST_END_POSTURES = 2  # of its solutions that become starts
TIMED_PROFILES = 2  # profiles tried between the same ends, where time counts
GOAL_DRAWS = 8  # a random start takes the goal posture nearest to its start posture among so many
MIDDLE_SPREAD = 0.3  # rad, of theta_m around the middle of a random start's ends
MOTIONS_PER_CLEAR_START = 24  # around obstacles: random motions, of which the clearest is a start
CLEAR_STARTS = 4  # consecutive starts of this kind
CLEAR_MIDDLE_SPREAD = 0.8  # rad, the same for these motions


@dataclass(frozen=True)
class PointToPointStarts:
    """Motions that meet start and goal.

    Args:
        task: the statement: robot, start, goal, obstacles.
        objective: what is minimised.
    """

    task: PointToPoint
    objective: Objective

    @property
    def displacement(self) -> Displacement:
        """How the joints' displacements count."""
        return displacement_of(self.objective)

    @cached_property
    def ends(self) -> EndPostures:
        """The program of the end postures."""
        task = self.task
        return EndPostures(task.robot, task.start, task.goal, task.elbow, self.displacement, SKEWED)

    def sequence(self, rng: np.random.Generator, violation: Callable[[Quantities], float]) -> Iterator[Quantities]:
        """An endless sequence of starts; the most promising come first.

        Args:
            rng: source of the random starts.
            violation: by how much a motion breaks the limits.
        """
        while True:
            if not self.task.crowded:
                yield from self.direct(rng)
                yield self.random(rng, MIDDLE_SPREAD)
                continue
            for _ in range(CLEAR_STARTS):
                many = [self.random(rng, CLEAR_MIDDLE_SPREAD) for _ in range(MOTIONS_PER_CLEAR_START)]
                yield min(many, key=violation)
            yield from self.direct(rng)

    def direct(self, rng: np.random.Generator) -> Iterator[Quantities]:
        """Starts between end postures of least displacement."""
        for ends in self.ends.best(rng, END_POSTURE_DRAWS, BEST_END_POSTURES):
            yield from (self.along(ends, profile) for profile in self.profiles(ends))

    def profiles(self, ends: Ends) -> list[Profile]:
        """The profiles that join the ends soonest; a symmetric one where time does not count."""
        if not self.displacement.longest:
            return [SYMMETRIC]
        return sorted(PROFILES, key=lambda profile: self._rank(ends, profile))[:TIMED_PROFILES]

    def _rank(self, ends: Ends, profile: Profile) -> tuple[float, float]:
        """By how much the longer segment takes too long, and the duration, s."""
        duration, bounds = self._duration(ends, profile), self.task.duration_bounds
        longest = np.inf if bounds is None else bounds.longest
        return max(0.0, max(profile.share, 1.0 - profile.share) * duration - longest), duration

    def _duration(self, ends: Ends, profile: Profile) -> float:
        limits, shortest = self.task.robot.limits, self.task.time_box[0]
        return profile.duration(
            ends.theta_f - ends.theta_s, np.array(limits.speed), np.array(limits.acceleration), shortest
        )

    def along(self, ends: Ends, profile: Profile) -> Quantities:
        """All joints along the same profile, as fast as they can."""
        way, duration = ends.theta_f - ends.theta_s, self._duration(ends, profile)
        middle, speed = ends.theta_s + profile.middle * way, profile.speed * way / duration
        t1 = profile.share * duration
        return quantities(ends.theta_s, middle, speed, ends.theta_f, t1, duration - t1)

    def random(self, rng: np.random.Generator, spread: float) -> Quantities:
        """Postures by inverse kinematics at both ends, theta_m within ``spread`` rad of their middle.

        t1 = t2 = 1 s, or as near to that as the task allows.
        """
        draws = [self.ends.draw(rng) for _ in range(GOAL_DRAWS)]
        ends = min(draws, key=lambda each: float(np.linalg.norm(each.theta_f - each.theta_s)))
        middle = (ends.theta_s + ends.theta_f) / 2.0 + rng.normal(0.0, spread, ends.theta_s.size)
        time = float(np.clip(1.0, *self.task.time_box))
        speed = 0.75 * (ends.theta_f - ends.theta_s) / time
        return quantities(ends.theta_s, middle, speed, ends.theta_f, time, time)


def quantities(
    theta_s: FloatArray, theta_m: FloatArray, dtheta_m: FloatArray, theta_f: FloatArray, t1: float, t2: float
) -> Quantities:
    """The quantities of numbers: angles and speeds (k,), rad and rad/s; times, s."""
    first, middle, speed, last = (ca.DM(angles).T for angles in (theta_s, theta_m, dtheta_m, theta_f))
    return Quantities(first, middle, speed, last, ca.DM(t1), ca.DM(t2))
