"""The ends of a time law: which of its control points the velocity and the acceleration there determine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray
from problems.timing.prepared import PreparedPath
from problems.timing.smooth.time_law import DEGREE

STRAIGHT = 1e-8  # of the largest q'' along the path: a smaller one at an end is none


@dataclass(frozen=True)
class LawEnds:
    """What is given at both ends.

    Args:
        start: ds/dt and d2s/dt2, or the first of them, or nothing.
        goal: likewise.
    """

    start: tuple[float, ...]
    goal: tuple[float, ...]

    @classmethod
    def of(cls, prepared: PreparedPath) -> LawEnds:
        """Joints at rest start with no acceleration; moving ones with the least that the path's curvature allows."""
        path = prepared.path
        ends = path.breakpoints[[0, -1]]
        slopes, bends = (path.at(ends, order) for order in (1, 2))
        middles = (path.breakpoints[:-1] + path.breakpoints[1:]) / 2.0
        least = STRAIGHT * np.abs(path.at(np.concatenate([path.breakpoints, middles]), 2)).max()
        given: list[tuple[float, ...]] = []
        for slope, bend, rate, resting in zip(slopes, bends, prepared.rates, prepared.resting, strict=True):
            if not resting:
                given.append((rate, -float(slope @ bend) / float(slope @ slope) * rate**2))
            else:
                given.append((0.0,) if np.abs(bend).max() > least else ())
        return cls(given[0], given[1])

    @property
    def moving(self) -> bool:
        """Whether an end has a velocity, so that no motion with these ends can be slowed."""
        return any(values[0] > 0.0 for values in (self.start, self.goal) if values)

    def free(self, controls: int) -> slice:
        """Which of so many control points are not determined."""
        return slice(1 + len(self.start), controls - 1 - len(self.goal))

    def placed(self, knots: FloatArray, controls: FloatArray, duration: float) -> FloatArray:
        """The control points in order, those that are determined in their places."""
        free = self.free(controls.size)
        placed = controls.copy()
        placed[: free.start] = controls[0] + _offsets(knots, self.start, duration)[0]
        placed[free.stop :] = controls[-1] - _offsets(*_mirrored(knots, self.goal), duration)[0][::-1]
        ordered = np.maximum.accumulate(placed)
        return np.asarray(np.minimum.accumulate(np.append(ordered[: free.stop], placed[free.stop :])[::-1])[::-1])

    def slopes(self, knots: FloatArray, duration: float) -> FloatArray:
        """How far each control point moves where the duration grows by a small share, (controls,)."""
        slopes = np.zeros(knots.size - DEGREE - 1)
        free = self.free(slopes.size)
        slopes[: free.start] = _offsets(knots, self.start, duration)[1]
        slopes[free.stop :] = -_offsets(*_mirrored(knots, self.goal), duration)[1][::-1]
        return slopes


def _mirrored(knots: FloatArray, given: tuple[float, ...]) -> tuple[FloatArray, tuple[float, ...]]:
    """The same end seen backwards in time: accelerations change their sign."""
    return 1.0 - knots[::-1], tuple(value * sign for value, sign in zip(given, (1.0, -1.0), strict=False))


def _offsets(knots: FloatArray, given: tuple[float, ...], duration: float) -> tuple[FloatArray, FloatArray]:
    """How far the determined control points are from the end, and how far they move as the duration grows.

    By the derivatives of a B-spline at its first knot.
    """
    first, second = knots[DEGREE + 1], knots[DEGREE + 2]
    rate, change = (*given, 0.0, 0.0)[:2]
    speed, bend = rate * duration, change * duration**2 * first / (DEGREE - 1)
    near = speed * first / DEGREE
    offsets = [0.0, near, near + (speed + bend) * second / DEGREE]
    slopes = [0.0, near, near + (speed + 2.0 * bend) * second / DEGREE]
    count = 1 + len(given)
    return np.array(offsets[:count]), np.array(slopes[:count])
