"""A lower bound of the duration of any motion through given postures.

Joints share nothing but the durations of the segments. With weights w_ij >= 0 of joint j in segment i, whose sum over
the joints is 1, no motion takes less than the sum over the joints of each one's own least sum_i w_ij T_ij, since T_i is
the same for all of them. Of one joint that is a shortest path: it passes each posture with a velocity in one of many
intervals, and between two intervals it takes no less than ``joint_segments`` says. Its accelerations may be any there,
and may jump: that, the width of the intervals and the weights are what the bound gives away.

It is computed in floating point, with an allowance for rounding that is far larger than that: no certificate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.robots import JointLimits
from problems.timing.free_space import least_durations
from problems.timing.joint_segments import JointSegments, Ramps, from_rest
from problems.timing.settings import DEFAULT_THROUGH_BOUND, ThroughBoundSettings
from problems.timing.through import apart

ROUNDING = 1e-9  # share of a bound


def least_through(
    postures: FloatArray,
    limits: JointLimits,
    velocities: FloatArray | None = None,
    settings: ThroughBoundSettings = DEFAULT_THROUGH_BOUND,
) -> float:
    """A lower bound of the duration of any motion through postures (n, k) in rad, s.

    Args:
        postures: in their order.
        limits: of the joints; their ranges only make a motion longer.
        velocities: at both ends, (2, k), rad/s; at rest where None.
        settings: of the search for good weights, and the intervals of velocities.
    """
    distances = np.diff(postures[apart(postures)], axis=0)
    ends = np.zeros((2, limits.dof)) if velocities is None else velocities
    if len(distances) < 2:
        least = _between_velocities(distances, limits, ends) if ends.any() else least_durations(distances, limits)
        return float(least.max(initial=0.0)) * (1.0 - ROUNDING)
    weights, best = np.full(distances.shape, 1.0 / limits.dof), 0.0
    for intervals, steps in settings.levels(distances.size):
        graph = VelocityGraph.of(distances, limits, ends, intervals)
        bound, weights = best_weights(graph, weights, steps, settings)
        best = max(best, bound)
    return best * (1.0 - ROUNDING)


def _between_velocities(distances: FloatArray, limits: JointLimits, velocities: FloatArray) -> FloatArray:
    """Least durations of joints over distances (1, k) in rad between velocities (2, k) in rad/s, (1, k), s."""
    start, end = np.where(distances < 0.0, -1.0, 1.0) * velocities[:, None]
    return JointSegments(Ramps.of(limits).shaped(1, -1), np.abs(distances), (start, start), (end, end)).durations()


def best_weights(
    graph: VelocityGraph, weights: FloatArray, steps: int, settings: ThroughBoundSettings
) -> tuple[float, FloatArray]:
    """The largest bound that some steps of the weights lead to, s, and its weights.

    A segment that takes a joint longer than others counts more for it, and less for the others.
    """
    best, kept = 0.0, weights
    for number in range(steps):
        bound, durations = graph.shortest(weights)
        if bound > best:
            best, kept = bound, weights
        step = settings.first_step / (1.0 + number / settings.settling)
        longest = durations.max(axis=1, keepdims=True)
        weights = weights * np.exp(step * (durations - longest) * len(durations) / longest.sum())
        weights = weights / weights.sum(axis=1, keepdims=True)
    return best, kept


@dataclass(frozen=True, eq=False)
class VelocityGraph:
    """Least durations of all joints between intervals of their velocities.

    Attributes:
        first: from rest to each interval, (k, n), s.
        inner: from each interval at one posture to each at the next, (segments - 2, k, n, n), s.
        last: from each interval to rest, (k, n), s.
    """

    first: FloatArray
    inner: FloatArray
    last: FloatArray

    @classmethod
    def of(cls, distances: FloatArray, limits: JointLimits, velocities: FloatArray, intervals: int) -> VelocityGraph:
        """The graph of distances (segments, k) in rad with so many intervals of velocity.

        They are the shorter the slower: what they give away is where joints turn back.

        Args:
            distances: from posture to posture.
            limits: of the joints.
            velocities: at both ends, (2, k), rad/s.
            intervals: how many.
        """
        ramps, even = Ramps.of(limits), np.linspace(-1.0, 1.0, intervals + 1)
        edges = even * np.abs(even)
        backward, far = distances[:, :, None] < 0.0, np.abs(distances)[:, :, None]
        sides = [ramps.speed[:, None] * side for side in (edges[:-1], edges[1:])]
        low = np.where(backward, -sides[1], sides[0])  # in the direction in which a joint goes
        high = np.where(backward, -sides[0], sides[1])
        inner = JointSegments(
            ramps.shaped(1, -1, 1, 1),
            far[1:-1, :, :, None],
            (low[1:-1, :, :, None], high[1:-1, :, :, None]),
            (low[1:-1, :, None], high[1:-1, :, None]),
        )

        def at_end(i: int) -> FloatArray:
            """Durations of the first segment, or of the last one, backward in time."""
            still, own = velocities[i][:, None] == 0.0, np.where(backward[i], -1.0, 1.0) * velocities[i][:, None]
            limited = ramps.shaped(-1, 1)
            moving = JointSegments(limited, far[i], (own, own), (low[i], high[i])).durations()
            return np.where(still, from_rest(limited, far[i], low[i], high[i]), moving)

        return cls(at_end(0), inner.durations(), at_end(-1))

    def shortest(self, weights: FloatArray) -> tuple[float, FloatArray]:
        """The sum of the joints' least weighted durations, s, and the durations of their segments, (segments, k), s."""
        cost, origins = weights[0][:, None] * self.first, []
        for own, weight in zip(self.inner, weights[1:-1], strict=True):
            sums = cost[:, :, None] + weight[:, None, None] * own
            origins.append(sums.argmin(axis=1))
            cost = np.take_along_axis(sums, origins[-1][:, None], axis=1)[:, 0]
        sums, joints = cost + weights[-1][:, None] * self.last, np.arange(len(cost))
        chosen = sums.argmin(axis=1)
        total, durations = float(sums[joints, chosen].sum()), [self.last[joints, chosen]]
        for own, origin in zip(self.inner[::-1], reversed(origins), strict=True):
            chosen, after = origin[joints, chosen], chosen
            durations.insert(0, own[joints, chosen, after])
        durations.insert(0, self.first[joints, chosen])
        return total, np.array(durations)
