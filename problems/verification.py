"""Judging a finished trajectory: polynomials at their exact extremes, clearance at thousands of times."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from problems.constraint import Constraint, Verdict, verdict
from problems.limits import acceleration_limit, joint_range, obstacle_clearance, speed_limit
from problems.matrix import Matrix
from problems.obstacles import Ellipse
from problems.planar_arm import PlanarArm
from problems.trajectory import Trajectory

DENSE_TIMES = 4001


def limit_verdicts(arm: PlanarArm, obstacles: Sequence[Ellipse], trajectory: Trajectory) -> list[Verdict]:
    """Speed, acceleration and joint range for all t, exactly; clearance at ``DENSE_TIMES`` times."""
    exact = [(speed_limit, 1), (acceleration_limit, 2)]
    if arm.joint_limits is not None:
        exact.append((joint_range, 0))
    verdicts = []
    for limit, derivative in exact:
        times = trajectory.extreme_times(derivative)
        verdicts.append(verdict(limit(arm, trajectory.samples(times)), times))
    if obstacles:
        times = trajectory.times(DENSE_TIMES)
        x, y = arm.joint_positions(trajectory.samples(times).theta)
        for constraint in obstacle_clearance(arm, obstacles, x, y, margin=0.0)[:1]:
            verdicts.append(verdict(constraint, times))
    return verdicts


def end_verdicts(
    arm: PlanarArm, trajectory: Trajectory, start: tuple[float, float], goal: tuple[float, float]
) -> list[Verdict]:
    """Whether the tip starts at ``start`` and ends at ``goal`` (m)."""
    ends = trajectory.breakpoints[[0, -1]]
    tip = arm.tip(trajectory.samples(ends).theta)
    return [
        verdict(endpoint(name, ca.norm_2(tip[i, :] - ca.DM(list(point)).T)), ends[i : i + 1])
        for i, (name, point) in enumerate((("start", start), ("goal", goal)))
    ]


def endpoint(name: str, miss: Matrix) -> Constraint:
    """The tip is where the task wants it: a distance in m, up to rounding."""
    bound = np.array([1e-9])
    return Constraint(name, "-", "m", miss, -bound, bound, ("tip",), bound, for_all_t=False)
